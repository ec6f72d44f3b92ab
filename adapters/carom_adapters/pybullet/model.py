"""Shapes, moments of inertia and coefficients of a scene in Bullet."""

from __future__ import annotations

import math
from collections.abc import Mapping

from carom.engines.api import Disc, Scene, Setting, is_fast
from carom_adapters.pybullet.limits import BODY_SETTINGS

Point = tuple[float, float]

#: Moment of inertia of a cylinder about a diameter, divided by mass times radius squared: 1/4 + 1/3, if the height
#: equals the diameter.
CYLINDER_TIPS = 7 / 12


def compute_capsule(a: Point, b: Point) -> tuple[float, Point, list[float]]:
    """Return the length, the middle and the rotation of a capsule from a to b. Bullet builds capsules along z."""
    length = math.dist(a, b)
    x, y = (b[0] - a[0]) / length, (b[1] - a[1]) / length
    half = math.sqrt(0.5)
    return length, (a[0] / 2 + b[0] / 2, a[1] / 2 + b[1] / 2), [-y * half, x * half, 0.0, half]


def compute_moments(scene: Scene, settings: Mapping[str, Setting], disc: Disc) -> list[float] | None:
    """Return the moments of inertia of a movable disc; None to keep the moments that Bullet computes from the shape."""
    cylinder, free, turns = settings.get("shape") == "cylinder", bool(settings.get("turn", True)), scene.arrays.turns
    if free and not turns:
        return None
    # Bullet treats a moment of 0 as infinite.
    factor = disc.inertia_factor if turns and math.isfinite(disc.inertia_factor) else 0.0
    # With infinite moments, no impact turns a cylinder out of the plane.
    tips = CYLINDER_TIPS if cylinder else factor
    scale = disc.mass_kg * disc.radius_m**2
    return [moment * scale for moment in ((tips if free else 0.0), (tips if free else 0.0), factor)]


def build_dynamics(scene: Scene, settings: Mapping[str, Setting]) -> dict[str, Setting]:
    """Return the settings that every body gets. A scene's damping replaces the damping in the settings.

    With maximal coordinates, Bullet's damping is the fraction of a speed that is lost in a second. For a multibody,
    Bullet's damping is the rate c in ``v' = -c v (1 + |v|)``, which is not linear damping.
    """
    dynamics = {name: settings[name] for name in BODY_SETTINGS if name in settings}
    if scene.damping_per_s:
        maximal = bool(settings.get("useMaximalCoordinates", False))
        rate = -math.expm1(-scene.damping_per_s) if maximal else scene.damping_per_s
        dynamics |= {"linearDamping": rate, "angularDamping": rate}
    return dynamics


def compute_resistance(scene: Scene, disc_friction: float) -> float:
    """Return a wall's rolling friction, in metres.

    The torque on a disc is at most `wall_rolling_resistance` times radius times normal force.

    Bullet multiplies the rolling friction of each body by the friction of the other body, and adds the two products.
    Discs have no rolling friction.
    """
    if not scene.wall_rolling_resistance:
        return 0.0
    return (
        scene.wall_rolling_resistance * max(disc.radius_m for disc in scene.discs if not disc.immovable) / disc_friction
    )


def build_structure_key(scene: Scene, settings: Mapping[str, Setting]) -> object:
    """Return a key that contains everything in a scene except the initial states of movable discs.

    Two scenes with equal keys can use the same client. Return None if a client can't be reused for this scene, since
    Bullet stores state that can't be reset. With three bodies or more, Bullet stores the order in which pairs came
    near, and solves contacts in this order, which affects the last bits of results. Bullet also stores contact points
    of cylinders and planes. If a disc has rolled, a stored contact point can be slightly wrong, and turns the disc in
    the next run.
    """
    plain = settings.get("shape", "sphere") == "sphere" and not scene.arrays.driven
    if len(scene.discs) > 2 or scene.walls or not plain:
        return None
    dt_s = float(settings["dt_s"])
    discs = tuple(
        (
            disc.radius_m,
            disc.mass_kg,
            disc.inertia_factor,
            is_fast(disc, dt_s),
            disc.position_m if disc.immovable else None,
        )
        for disc in scene.discs
    )
    frictions = (scene.arrays.turns, scene.friction, scene.wall_friction)
    laws = (scene.restitution, scene.wall_restitution, frictions, scene.gravity_m_s2, scene.damping_per_s)
    return (discs, scene.walls, laws, tuple(sorted(settings.items())))
