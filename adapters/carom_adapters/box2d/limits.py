"""Limits of Box2D: its settings by name, the range of scenes, and input checks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from carom.engines.api import AdapterError, Scene, Setting, require_sound, require_supported
from carom_adapters.shared.engine_adapter import GENERAL

#: Attributes of `b2World`, by pybox2d's names.
WORLD_SETTINGS = ("warmStarting",)

#: Other settings: the arguments of `b2World.Step`, and ``sleepingAllowed`` of every body (`b2World.allowSleeping` has
#: no effect in pybox2d 2.3.10). ``sweep`` is one of `SWEEPS`. For ``velocity_scale`` see the profile `tuned`.
#: ``polygon_radius_m`` is the skin of a wall's shape. With ``chains`` the edges of a wall are one chain, in which each
#: edge has its neighbours as ghosts.
OTHER_SETTINGS = (
    "velocityIterations",
    "positionIterations",
    "sleepingAllowed",
    "sweep",
    "velocity_scale",
    "polygon_radius_m",
    "chains",
)

#: Box2D's continuous detection: none, every disc against immovable bodies ("shipped"), or also against all other discs
#: ("fast", Box2D's bullets). "fast" is for scenes in which a disc or a driven body moves by more than a radius in a
#: step.
SWEEPS = ("none", "shipped", "fast")

#: Beyond these limits Box2D asserts or fails. A scaled step stays within 32-bit floats.
LEAST = {"velocityIterations": 1, "positionIterations": 0, "velocity_scale": 1, "polygon_radius_m": 0, "dt_s": 1e-12}
MOST = {"dt_s": 1e12}

#: b2_maxTranslation is 2 m: Box2D slows down a body that would move farther in one step. The limit here is a millionth
#: lower, so that a body at this limit differs from a body that was slowed down.
LONGEST_MOVE_M = 2.0 * (1 - 2.0**-20)

#: b2_maxRotation is pi/2: Box2D slows down a body that would turn farther in one step. The limit here is a millionth
#: lower.
LARGEST_TURN_RAD = 0.5 * math.pi * (1 - 2.0**-20)

#: The product of two friction coefficients must stay within 32-bit floats, or velocities become NaN. The same limit
#: applies to the rate of damping times the velocity scale.
LARGEST_FRICTION = 1e19

#: The limit is a third of the largest 32-bit float.
LARGEST_FORCE_N = 1e38

#: b2_velocityThreshold, compiled in: contacts that close at this speed or less are made inelastic.
THRESHOLD_M_S = 1.0

#: See the profile `tuned`.
VELOCITY_SCALE = 2.0**20

#: b2_linearSlop: the neighbouring points of a chain must be farther apart, or Box2D asserts.
SHORTEST_PIECE_M = 0.005

CAPABILITIES = replace(
    GENERAL,
    wall_materials=False,
    belts=True,
    edge_belts=True,
    damping=True,
    table_friction=True,
    spin=True,
    # Because of rounding, a contact point is not exactly on the line of centres. So an impulse at this point turns the
    # disc. A smaller inertia lets the disc turn more. With this inertia factor, the relative change of the spin is 5e-4
    # for discs at 200 radii from the origin.
    min_inertia_factor=1e-2,
    friction=(0.0, LARGEST_FRICTION),
    max_turn_rad=LARGEST_TURN_RAD,
    continuous_detection=True,
    # The square of this speed times the velocity scale (2**20) is 1e36.
    max_speed_m_s=1e12,
    # Box2D compares squared distances in contacts. So this limit is far below 1.8e19, the square root of the largest
    # 32-bit float.
    max_coordinate_m=1e9,
    max_move_m=LONGEST_MOVE_M,
    # `b2WorldManifold` invents a normal for points that are closer than b2_epsilon, 1.2e-7.
    min_radius_m=1e-6,
    # If masses are between these powers of ten, masses, their quotients, and impulses at scaled velocities stay within
    # 32-bit floats (1e-38 to 1e38). Box2D replaces a mass that is not above 0 by 1 kg.
    min_mass_kg=1e-20,
    max_mass_kg=1e20,
    float_bits=32,
    restitution_threshold_m_s=THRESHOLD_M_S / VELOCITY_SCALE,
)


def require_usable(scene: Scene, settings: Mapping[str, Setting]) -> None:
    """Refuse scenes that are not supported, and input on which Box2D would assert or fail silently.

    Raises:
        AdapterError: A capability excludes the scene, a setting has an unknown name or value, or a step, damping or
            force is beyond 32-bit floats.
    """
    require_sound("Box2D", scene, settings, (*WORLD_SETTINGS, *OTHER_SETTINGS), LEAST, MOST, {"sweep": SWEEPS})
    if scene.damping_per_s > LARGEST_FRICTION:
        raise AdapterError(f"Box2D: damping_per_s must be at most {LARGEST_FRICTION:g}, got {scene.damping_per_s:g}")
    scale = float(settings.get("velocity_scale", 1.0))
    heaviest = max((disc.mass_kg for disc in scene.discs if not disc.immovable), default=0.0)
    if scene.table_deceleration_m_s2 * heaviest * scale * scale > LARGEST_FORCE_N:
        raise AdapterError(
            f"Box2D: the table's force on {heaviest:g} kg exceeds 32 bits ({scene.table_deceleration_m_s2:g} m/s^2 "
            f"times the square of velocity_scale {scale:g}); lower table_deceleration_m_s2"
        )
    if math.frexp(scale)[0] != 0.5:
        raise AdapterError(f"Box2D: velocity_scale must be a power of two, got {settings['velocity_scale']}")
    require_supported("Box2D", scene, CAPABILITIES, float(settings["dt_s"]))
