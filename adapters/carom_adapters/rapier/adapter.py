"""Adapter of Rapier (the wheel `rapier3d`), an impulse-based three-dimensional engine with 32-bit floats."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from carom.engines.api import Accuracy, Knob, Profile, Scene, Setting
from carom_adapters.rapier.limits import CAPABILITIES, SHIPPED_SPEED_M_S
from carom_adapters.rapier.settings_code import write_code
from carom_adapters.rapier.world import RapierCuttableWorld, RapierWorld
from carom_adapters.shared import engine_adapter as shared

#: Default of `normalized_prediction_distance`, times a `length_unit` of 1 m.
SHIPPED_MARGIN_M = 0.02

#: In the step of an impact, Rapier moves bodies with the velocities of an inelastic impact, and sets the velocities of
#: the bounce afterwards. So an elastic pair seems to bounce in the middle of the step.
TURNS_LATE = 0.5

#: By default Rapier stops a body that is slow (8 cm/s) for half a second ("sleep"), which changes results.
_DEFAULT: shared.Settings = {"can_sleep": False}

_TUNED: shared.Settings = {
    **_DEFAULT,
    # By default Rapier solves contacts already at distances of up to 2 cm, with the normal at that distance.
    "normalized_prediction_distance": 0.0,
    # Overlapping bodies are not pushed apart.
    "contact_natural_frequency": 0.0,
    "static_contact_natural_frequency": 0.0,
    # By default Rapier slows faster bodies down to 400 m/s.
    "normalized_max_linear_velocity": CAPABILITIES.max_speed_m_s,
}

#: Largest distance at which Rapier searches for contacts ahead, in metres. Rapier itself limits the search to the
#: distance by which two bodies approach in a step, so a huge number does no harm.
_SWEPT: shared.Settings = {**_TUNED, "soft_ccd_prediction": 1e3}

_LOCATED: shared.Settings = {
    **_TUNED,
    # Without contact recycling and warm start, a step depends only on positions and velocities, so the step can be
    # undone.
    "contact_recycling": False,
    "warmstart_coefficient": 0.0,
    # The first part of a step is a fraction of the step, as small as the relative rounding error of 32-bit floats. The
    # fraction is a power of two, so that its product with the step size is exact.
    "first_part": 2.0**-24,
}


def _build_world(scene: Scene, settings: Mapping[str, Setting]) -> RapierWorld:
    return (RapierCuttableWorld if "first_part" in settings else RapierWorld)(scene, settings)


adapter = shared.EngineAdapter(
    name="rapier",
    engine=shared.build_engine("Rapier", "rapier", "rapier3d", newest_tried="0.36"),
    capabilities=CAPABILITIES,
    knobs={
        "num_solver_iterations": Knob(1, 64, log=True),
        "normalized_prediction_distance": Knob(choices=(0.0, 1e-4, 1e-3, 0.02)),
        "contact_natural_frequency": Knob(choices=(0.0, 1.0, 10.0, 30.0, 60.0)),
        "static_contact_natural_frequency": Knob(choices=(0.0, 1.0, 10.0, 30.0, 60.0)),
        "soft_ccd_prediction": Knob(choices=(0.0, 0.5, 1e3)),
        "contact_recycling": Knob(choices=(False, True)),
        "warmstart_coefficient": Knob(0.0, 1.0),
    },
    profiles={
        "default": Profile(
            "Rapier's defaults (contacts act when bodies are still 2 cm apart, and speeds are limited to 400 m/s), "
            "except that bodies never sleep and have the scene's restitution.",
            shared.add_step(_DEFAULT),
            # Rapier finds a contact within the margin only if a step ends within the margin. In other cases Rapier
            # finds the overlap later, as with the profile `tuned`.
            Accuracy(late_steps=TURNS_LATE, margin_m=SHIPPED_MARGIN_M),
            capabilities=replace(CAPABILITIES, max_speed_m_s=SHIPPED_SPEED_M_S),
            changed={
                "restitution": shared.OF_THE_SCENE,
                "friction": shared.OF_THE_SCENE,
                "can_sleep": "bodies never sleep, because sleep stops slow bodies",
                "enabled_rotations": shared.NOT_TURNED,
                "enabled_translations": "discs stay in the plane",
            },
        ),
        "tuned": shared.build_tuned_profile(
            "contacts act only when bodies overlap, and overlapping bodies are never pushed apart",
            _TUNED,
            Accuracy(late_steps=TURNS_LATE),
        ),
        "swept": Profile(
            "The tuned settings with Rapier's soft continuous detection: if bodies would meet in a step, the contact "
            "acts at the start of the step.",
            shared.add_step(_SWEPT),
            capabilities=replace(CAPABILITIES, continuous_detection=True),
        ),
        "located": shared.build_located_profile(
            "Rapier's own narrow phase",
            _LOCATED,
            then=". Each step has two parts: in the first part, touching bodies bounce; in the second part, they move",
        ),
    },
    world=_build_world,
    code=write_code,
)
