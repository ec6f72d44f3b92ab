"""Adapter of DART (the wheel `dartpy`): a boxed LCP over velocities, three-dimensional, 64-bit floats."""

from __future__ import annotations

from carom.engines.api import Accuracy, Engine, Knob, Profile, Setting
from carom_adapters.dart.limits import CAPABILITIES, DETECTORS, MIXING
from carom_adapters.dart.settings_code import write_code
from carom_adapters.dart.world import DartWorld
from carom_adapters.shared.engine_adapter import OF_THE_SCENE, EngineAdapter, build_located_profile, build_tuned_profile

#: Constraint-force mixing reduces velocities and energy at each elastic impact. The declared accuracy allows the
#: velocity and energy that sixteen impacts lose.
CHAIN = Accuracy(velocity=16 * 2 * MIXING, energy=16 * 4 * MIXING)


def _build_default_settings(dt_s: float) -> dict[str, Setting]:
    return {"dt_s": dt_s}


def _build_tuned_settings(dt_s: float) -> dict[str, Setting]:
    return {
        **_build_default_settings(dt_s),
        # Spheres collide with spheres in closed form.
        "collision_detector": "DART",
        # Overlapping bodies are not pushed apart through their velocities.
        "split_impulse": True,
    }


adapter = EngineAdapter(
    name="dart",
    # DART has split impulses since release 6.20. Earlier releases run these profiles without split impulses, and the
    # settings that are read back show it.
    engine=Engine(
        "DART",
        module="dartpy",
        distribution="dartpy",
        install="pip install 'carom[dart]'",
        oldest="6.16",
        newest_tried="6.20",
    ),
    capabilities=CAPABILITIES,
    knobs={"collision_detector": Knob(choices=DETECTORS), "split_impulse": Knob(choices=(False, True))},
    profiles={
        "default": Profile(
            "DART's defaults, but with the scene's restitution, without friction, and with joints that keep discs in "
            "the plane.",
            _build_default_settings,
            CHAIN,
            changed={
                "restitution": OF_THE_SCENE,
                "friction": OF_THE_SCENE,
                "joint": "two slide joints: discs stay in the plane and cannot turn",
            },
        ),
        "tuned": build_tuned_profile(
            "DART's own collision detector is used, and overlaps are pushed apart without an effect on velocities",
            _build_tuned_settings,
            CHAIN,
        ),
        "located": build_located_profile("DART's own collision detector", _build_tuned_settings, CHAIN),
    },
    world=DartWorld,
    code=write_code,
)
