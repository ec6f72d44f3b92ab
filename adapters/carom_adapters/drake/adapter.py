"""Adapter of Drake, a three-dimensional engine with compliant contact, error control and 64-bit floats."""

from __future__ import annotations

from carom.engines.api import Accuracy, Knob, Profile
from carom_adapters.drake.limits import CAPABILITIES
from carom_adapters.drake.settings_code import write_code
from carom_adapters.drake.world import DrakeWorld
from carom_adapters.shared import engine_adapter as shared

_TUNED: shared.Settings = {"point_stiffness": 1e10, "target_accuracy": 1e-7, "integration_scheme": "runge_kutta3"}


adapter = shared.EngineAdapter(
    name="drake",
    # Drake releases before 1.31 end the process if NumPy 2 is installed.
    engine=shared.build_engine("Drake", "drake", "pydrake", "drake", oldest="1.31", newest_tried="1.51"),
    capabilities=CAPABILITIES,
    knobs={
        "point_stiffness": Knob(1e5, 1e11, log=True),
        "target_accuracy": Knob(1e-9, 1e-2, log=True),
        "integration_scheme": Knob(
            choices=("runge_kutta2", "runge_kutta3", "runge_kutta5", "implicit_euler", "radau3")
        ),
    },
    profiles={
        "default": Profile(
            "A continuous plant (Drake's model without time steps) with Drake's default stiffness, accuracy and "
            "integrator, but without dissipation or friction.",
            shared.add_step({}),
            # A contact lasts for pi * sqrt(mass / stiffness), some milliseconds. During the contact, the discs move
            # along each other, so the direction of the contact's force changes.
            Accuracy(late_steps=1.0, velocity=0.05, energy=0.01),
            changed={
                "time_step": "0 (a continuous plant), because nothing bounces in Drake's default, a discrete plant",
                "hunt_crossley_dissipation": "no dissipation, because the adapter supports only a restitution of 1",
                "dynamic_friction": shared.OF_THE_SCENE,
                "static_friction": shared.OF_THE_SCENE,
                "joint": "a planar joint without damping, which keeps a disc in the plane",
            },
        ),
        "tuned": Profile(
            "The most exact settings known, from Carom's own measurements: contacts ten thousand times as stiff as "
            "by default, and steps of the integrator that are short enough for slow contacts.",
            shared.add_step(_TUNED),
            # The errors of this profile were measured with an accuracy of 1e-7 for each step of the integrator.
            Accuracy(velocity=1e-3, energy=1e-3),
        ),
    },
    world=DrakeWorld,
    code=write_code,
)
