"""Limits of Box2D: names of its settings, supported scenes, and input checks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from carom.engines.api import AdapterError, Scene, Setting, require_sound, require_supported
from carom_adapters.shared.engine_adapter import GENERAL

#: Attributes of `b2World`, with pybox2d's names.
WORLD_SETTINGS = ("warmStarting",)

#: Other settings: the arguments of `b2World.Step`, and ``sleepingAllowed`` of every body (`b2World.allowSleeping` has
#: no effect in pybox2d 2.3.10). ``sweep`` is one of `SWEEPS`. The profile `tuned` has a comment that explains
#: ``velocity_scale``. ``polygon_radius_m`` is the distance by which Box2D makes a wall's shape thicker (its skin). With
#: ``chains``, the edges of a wall form one chain, so that Box2D takes each edge's neighbours into account.
OTHER_SETTINGS = (
    "velocityIterations",
    "positionIterations",
    "sleepingAllowed",
    "sweep",
    "velocity_scale",
    "polygon_radius_m",
    "chains",
)

#: Values of ``sweep``, which determines for which discs Box2D checks the whole path of a step. With "none", no disc is
#: swept. With "shipped", every disc is swept against immovable bodies. With "fast", discs are swept only in scenes in
#: which a disc or a driven body moves by more than a radius in a step. In scenes with a fast body, every disc is swept
#: against immovable bodies, and fast discs are also swept against all other discs (as Box2D's "bullets").
SWEEPS = ("none", "shipped", "fast")

#: Smallest and largest values of settings. With other values, Box2D aborts or fails, or the scaled step size is outside
#: the range of 32-bit floats.
LEAST = {"velocityIterations": 1, "positionIterations": 0, "velocity_scale": 1, "polygon_radius_m": 0, "dt_s": 1e-12}
MOST = {"dt_s": 1e12}

#: b2_maxTranslation is 2 m: Box2D slows down a body that would move farther in one step. Carom's limit is a millionth
#: lower, so that a body at this limit can be distinguished from a body that was slowed down.
LONGEST_MOVE_M = 2.0 * (1 - 2.0**-20)

#: b2_maxRotation is pi/2: Box2D slows down a body that would turn farther in one step. Carom's limit is a millionth
#: lower, so that a body at this limit can be distinguished from a body that was slowed down.
LARGEST_TURN_RAD = 0.5 * math.pi * (1 - 2.0**-20)

#: Largest coefficient of friction. If the product of two coefficients overflowed 32-bit floats, velocities would become
#: NaN. `LARGEST_FRICTION` also limits the rate of damping.
LARGEST_FRICTION = 1e19

#: Largest force of a table on a disc: a third of the largest 32-bit float.
LARGEST_FORCE_N = 1e38

#: Box2D makes contacts with a closing speed of at most `THRESHOLD_M_S` inelastic (b2_velocityThreshold, compiled in).
THRESHOLD_M_S = 1.0

#: Factor on all velocities, explained by a comment in the profile `tuned`.
VELOCITY_SCALE = 2.0**20

#: Box2D aborts if neighbouring points of a chain are not farther apart than `SHORTEST_PIECE_M` (b2_linearSlop).
SHORTEST_PIECE_M = 0.005

CAPABILITIES = replace(
    GENERAL,
    wall_materials=False,
    belts=True,
    edge_belts=True,
    damping=True,
    table_friction=True,
    spin=True,
    # Because of rounding, a contact point is not exactly on the line of centres. So the normal impulse also changes the
    # spin. The error of the spin grows as the inertia decreases. With the inertia factor 1e-2, the relative error of
    # the spin is 5e-4 for discs at a distance of 200 radii from the origin.
    min_inertia_factor=1e-2,
    friction=(0.0, LARGEST_FRICTION),
    max_turn_rad=LARGEST_TURN_RAD,
    continuous_detection=True,
    # With the velocity scale 2^20, the square of the scaled speed is 1e36, within the range of 32-bit floats.
    max_speed_m_s=1e12,
    # To find contacts, Box2D compares squared distances. So the largest coordinate is far below 1.8e19, the square root
    # of the largest 32-bit float.
    max_coordinate_m=1e9,
    max_move_m=LONGEST_MOVE_M,
    # `b2WorldManifold` uses an arbitrary normal if two points are closer than b2_epsilon, 1.2e-7.
    min_radius_m=1e-6,
    # The limits of mass keep quotients of masses, and impulses at scaled velocities, in the range of 32-bit floats
    # (1e-38 to 1e38). Box2D replaces a mass that underflows to 0 by 1 kg.
    min_mass_kg=1e-20,
    max_mass_kg=1e20,
    float_bits=32,
    restitution_threshold_m_s=THRESHOLD_M_S / VELOCITY_SCALE,
)


def require_usable(scene: Scene, settings: Mapping[str, Setting]) -> None:
    """Refuse scenes that are not supported, and input for which Box2D would abort or fail silently.

    Raises:
        AdapterError: The scene or a setting is not supported, or a number is outside the range of 32-bit floats.
    """
    require_sound("Box2D", scene, settings, (*WORLD_SETTINGS, *OTHER_SETTINGS), LEAST, MOST, {"sweep": SWEEPS})
    if scene.damping_per_s > LARGEST_FRICTION:
        raise AdapterError(f"Box2D: damping_per_s must be at most {LARGEST_FRICTION:g}, got {scene.damping_per_s:g}")
    scale = float(settings.get("velocity_scale", 1.0))
    heaviest = max((disc.mass_kg for disc in scene.discs if not disc.immovable), default=0.0)
    if scene.table_deceleration_m_s2 * heaviest * scale * scale > LARGEST_FORCE_N:
        raise AdapterError(
            f"Box2D: the force with which the table slows a disc of {heaviest:g} kg is too large for 32-bit floats "
            f"({scene.table_deceleration_m_s2:g} m/s^2, multiplied by the square of velocity_scale, {scale:g}); lower "
            "table_deceleration_m_s2"
        )
    if math.frexp(scale)[0] != 0.5:
        raise AdapterError(f"Box2D: velocity_scale must be a power of two, got {settings['velocity_scale']}")
    require_supported("Box2D", scene, CAPABILITIES, float(settings["dt_s"]))
