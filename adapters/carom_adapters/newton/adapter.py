"""Adapter of Newton, a three-dimensional engine that uses Warp.

Newton's XPBD solver runs on the processor with 32-bit floats.
"""

from __future__ import annotations

from carom.engines.api import Accuracy, Knob, Profile
from carom_adapters.newton.limits import CAPABILITIES, SPECULATIVE
from carom_adapters.newton.settings_code import write_code
from carom_adapters.newton.world import NewtonWorld
from carom_adapters.shared import engine_adapter as shared

#: Newton moves bodies for a whole step before it solves their contacts, so impacts are up to one step late.
LATE = Accuracy(late_steps=1.0)

_DEFAULT: shared.Settings = {"enable_restitution": True}

_TUNED: shared.Settings = {"enable_restitution": True, "gap": 0.0, SPECULATIVE: 1.0}

_OVERLAPPING: shared.Settings = {"enable_restitution": True, "gap": 0.0}


adapter = shared.EngineAdapter(
    name="newton",
    engine=shared.build_engine("Newton", "newton", "newton", newest_tried="1.8.0"),
    capabilities=CAPABILITIES,
    knobs={
        "iterations": Knob(1, 64, log=True),
        "rigid_contact_relaxation": Knob(0.1, 1.0),
        "rigid_contact_restitution_iterations": Knob(1, 64, log=True),
        "rigid_contact_con_weighting": Knob(choices=(False, True)),
        "gap": Knob(0.0, 0.1),
        SPECULATIVE: Knob(0.0, 1.0),
    },
    profiles={
        "default": Profile(
            "The defaults of Newton's XPBD solver, except that restitution is switched on and is the scene's, and that "
            "there is no friction.",
            shared.add_step(_DEFAULT),
            changed={
                "restitution": shared.OF_THE_SCENE,
                "mu": shared.OF_THE_SCENE,
                "enable_restitution": "on, because otherwise the solver ignores every restitution",
            },
        ),
        "tuned": shared.build_tuned_profile(
            "Newton searches for contacts only as far ahead as discs move in the step, and at most 1 m", _TUNED
        ),
        "located": shared.build_located_profile(
            "Newton's own collision detection", _OVERLAPPING, LATE, " without a search ahead"
        ),
    },
    world=NewtonWorld,
    code=write_code,
)
