"""Adapter of ODE, the Open Dynamics Engine, as contained in Panda3D's wheel: three-dimensional, with 32-bit floats."""

from __future__ import annotations

from carom.engines.api import Knob, Profile
from carom_adapters.ode.limits import CAPABILITIES, STEPPERS
from carom_adapters.ode.settings_code import write_code
from carom_adapters.ode.world import OdeWorld
from carom_adapters.shared import engine_adapter as shared

_DEFAULT: shared.Settings = {"stepper": "step"}

_TUNED: shared.Settings = {"stepper": "step", "cfm": 0.0, "erp": 0.0}


adapter = shared.EngineAdapter(
    name="ode",
    engine=shared.build_engine("ODE of Panda3D", "ode", "panda3d.ode", "panda3d", newest_tried="1.10.16"),
    capabilities=CAPABILITIES,
    knobs={
        "cfm": Knob(0.0, 1e-3),
        "erp": Knob(0.0, 1.0),
        "quick_step_iterations": Knob(1, 200, log=True),
        "stepper": Knob(choices=STEPPERS),
    },
    profiles={
        "default": Profile(
            "ODE's defaults with the scene's restitution, without friction, and with the stepper that solves each step "
            "exactly.",
            shared.add_step(_DEFAULT),
            changed={
                "bounce": shared.OF_THE_SCENE,
                "mu": shared.OF_THE_SCENE,
                "mode": "contacts bounce; without this flag ODE has no restitution",
            },
        ),
        "tuned": shared.build_tuned_profile("contacts are rigid, and overlapping bodies are not pushed apart", _TUNED),
        "located": shared.build_located_profile("ODE's own collision detection", _TUNED),
    },
    world=OdeWorld,
    code=write_code,
)
