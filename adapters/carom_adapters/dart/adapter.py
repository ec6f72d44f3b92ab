"""Adapter of DART (the wheel `dartpy`), a 3D engine that solves a boxed LCP for velocities with 64-bit floats."""

from __future__ import annotations

from carom.engines.api import Accuracy, Knob, Profile
from carom_adapters.dart.limits import CAPABILITIES, DETECTORS, MIXING
from carom_adapters.dart.settings_code import write_code
from carom_adapters.dart.world import DartWorld
from carom_adapters.shared import engine_adapter as shared

#: DART's constraint-force mixing reduces velocities and energy a little at each elastic impact. The declared accuracy
#: allows the losses of sixteen impacts in succession.
CHAIN = Accuracy(velocity=16 * 2 * MIXING, energy=16 * 4 * MIXING)

_TUNED: shared.Settings = {
    # DART's own detector tests spheres by a formula, not as meshes.
    "collision_detector": "DART",
    # With split impulses, DART pushes overlapping bodies apart without changing their velocities.
    "split_impulse": True,
}


adapter = shared.EngineAdapter(
    name="dart",
    # DART has split impulses since release 6.20. Earlier releases run the profiles without split impulses, and report
    # the setting as False.
    engine=shared.build_engine("DART", "dart", "dartpy", oldest="6.16", newest_tried="6.20"),
    capabilities=CAPABILITIES,
    knobs={"collision_detector": Knob(choices=DETECTORS), "split_impulse": Knob(choices=(False, True))},
    profiles={
        "default": Profile(
            "DART's defaults, but with the scene's restitution, without friction, and with joints that keep discs in "
            "the plane.",
            shared.add_step({}),
            CHAIN,
            changed={
                "restitution": shared.OF_THE_SCENE,
                "friction": shared.OF_THE_SCENE,
                "joint": "two slide joints: discs stay in the plane and cannot turn",
            },
        ),
        "tuned": shared.build_tuned_profile(
            "DART's own collision detector finds contacts, and overlapping bodies are pushed apart without a change of "
            "their velocities",
            _TUNED,
            CHAIN,
        ),
        "located": shared.build_located_profile("DART's own collision detector", _TUNED, CHAIN),
    },
    world=DartWorld,
    code=write_code,
)
