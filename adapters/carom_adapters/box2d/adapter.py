"""Adapter of Box2D 2.3 (pybox2d), an impulse-based two-dimensional engine with 32-bit floats."""

from __future__ import annotations

import math
from dataclasses import replace

from carom.engines.api import Knob, Profile
from carom_adapters.box2d.limits import CAPABILITIES, THRESHOLD_M_S, VELOCITY_SCALE
from carom_adapters.box2d.settings_code import write_code
from carom_adapters.box2d.world import Box2dWorld
from carom_adapters.shared import engine_adapter as shared

_DEFAULT: shared.Settings = {
    # Numbers of solver iterations that Box2D's manual suggests (section 2.4, "Simulating the world").
    "velocityIterations": 8,
    "positionIterations": 3,
    # By default Box2D stops a body that has been slower than 1 cm/s for half a second ("sleep"), which changes results.
    "sleepingAllowed": False,
}

_TUNED: shared.Settings = {
    # Box2D makes contacts inelastic if the closing speed is below 1 m/s (b2_velocityThreshold, compiled in). The
    # adapter's world multiplies all velocities by `velocity_scale`, and divides all times by it. So contacts are
    # inelastic only below 1e-6 m/s in the scene's units. The scale is a power of two, so scaling is exact.
    "velocity_scale": VELOCITY_SCALE,
    "velocityIterations": 50,
    # Overlapping bodies are not pushed apart.
    "positionIterations": 0,
    # Box2D checks the whole path of a swept disc, but stops the disc only 1.5 cm (3 b2_linearSlop) deep inside the
    # other disc. So only discs that could pass through other discs are swept.
    "sweep": "fast",
    # By default Box2D makes polygons 1 cm thicker on each side ("skin").
    "polygon_radius_m": 0.0,
    # A disc that slides over the joint of two edges gets caught on the joint, unless both edges belong to one chain.
    "chains": True,
}

_NO_CCD: shared.Settings = {**_TUNED, "sweep": "none"}


def _build_resting_settings(dt_s: float) -> shared.Settings:
    # Box2D applies restitution to the speed at the end of a step, which includes the fall during the step. So a ball
    # with the restitution e hops for ever at a speed of about ``g dt / (1 - e)``, unless contacts at this speed are
    # inelastic. With the profile `resting`, contacts are inelastic below a limit: the speed that a fall at 10 m/s^2
    # reaches in 2.5 steps, rounded up to a power of two. So a ball with a restitution of up to 0.6 comes to rest. A
    # ball with a greater restitution comes to rest only if rounding up raises the limit enough.
    steps_fall_m_s = 2.5 * 10.0 * dt_s
    scale = 2.0 ** math.floor(math.log2(THRESHOLD_M_S / steps_fall_m_s))
    return {"dt_s": dt_s, **_TUNED, "velocity_scale": min(max(scale, 1.0), VELOCITY_SCALE)}


#: While bodies touch, Box2D starts each step with the impulse of the last step, multiplied by the ratio of the present
#: to the last step size ("warm start"). With shortened steps, the ratio of the step sizes can be arbitrarily large.
_LOCATED: shared.Settings = {**_NO_CCD, "warmStarting": False}


adapter = shared.EngineAdapter(
    name="box2d",
    engine=shared.build_engine("Box2D", "box2d", "Box2D", newest_tried="2.3.10"),
    capabilities=CAPABILITIES,
    knobs={
        "velocityIterations": Knob(1, 100, log=True),
        "positionIterations": Knob(0, 10),
        "sweep": Knob(choices=("none", "shipped", "fast")),
        # The velocity scales are powers of two, so scaling is exact.
        "velocity_scale": Knob(choices=(1.0, 2.0**5, 2.0**10, 2.0**15, VELOCITY_SCALE)),
        "polygon_radius_m": Knob(0.0, 0.01),
        "warmStarting": Knob(choices=(False, True)),
    },
    profiles={
        "default": Profile(
            "Box2D's defaults (bodies that meet below 1 m/s do not bounce), except that bodies never sleep and have "
            "the scene's restitution and friction.",
            shared.add_step(_DEFAULT),
            capabilities=replace(
                CAPABILITIES,
                continuous_detection=False,  # by default, discs are swept only against immovable bodies
                restitution_threshold_m_s=THRESHOLD_M_S,
            ),
            changed={
                "restitution": shared.OF_THE_SCENE,
                "friction": shared.OF_THE_SCENE,
                "sleepingAllowed": "bodies never sleep, because sleep stops slow bodies",
                "fixedRotation": shared.NOT_TURNED,
                "velocityIterations": "8, as Box2D's manual suggests, because the argument has no default",
                "positionIterations": "3, as Box2D's manual suggests, because the argument has no default",
            },
        ),
        "tuned": shared.build_tuned_profile(
            "slow bodies bounce, overlapping bodies are never pushed apart, and fast discs have continuous detection",
            _TUNED,
        ),
        "located": shared.build_located_profile(
            "Box2D's own contact test", _LOCATED, but=" without continuous detection"
        ),
        "no-ccd": Profile("The tuned settings without continuous detection.", shared.add_step(_NO_CCD)),
        "resting": Profile(
            "The tuned settings, changed so that balls come to rest instead of hopping forever. Bodies do not bounce "
            "if they meet below a limit, the speed that a fall at 10 m/s2 reaches in 2.5 steps, rounded up to a power "
            "of two.",
            _build_resting_settings,
            capabilities=replace(CAPABILITIES, restitution_threshold_m_s=THRESHOLD_M_S),
        ),
    },
    world=Box2dWorld,
    code=write_code,
)
