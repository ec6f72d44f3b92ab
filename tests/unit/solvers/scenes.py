"""Random scenes for tests of the event-driven kernel."""

from __future__ import annotations

import math

import numpy as np

from carom import Disc, Scene, Wall
from carom.disc_arrays import DiscArrays


def box(width: float, height: float) -> tuple[tuple[float, float, float, float], ...]:
    """Return the four walls of a box with a corner at the origin."""
    return ((0.0, 0.0, 1.0, 0.0), (width, 0.0, -1.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.0, height, 0.0, -1.0))


def random_start(
    rng: np.random.Generator,
    discs: int,
    *,
    walls: bool = True,
    spread: float = 3.0,
    restitution: float = 1.0,
    wall_restitution: float = 1.0,
    immovable: int = 0,
    tilt: float = 0.0,
) -> DiscArrays:
    """Return discs of unequal radius and mass on the places of a lattice, jittered, with random velocities.

    The radii span a factor `spread`; the box is turned by `tilt` radians.
    """
    columns = math.ceil(math.sqrt(discs))
    radius = rng.uniform(0.45 / spread, 0.45, discs)
    place = np.stack([np.arange(discs) % columns, np.arange(discs) // columns], axis=1) + 0.5
    position = place + rng.uniform(-1, 1, (discs, 2)) * (0.49 - radius)[:, None]
    velocity = rng.normal(size=(discs, 2))
    mass = np.exp(rng.uniform(-2, 2, discs))
    mass[:immovable] = math.inf
    velocity[:immovable] = 0.0
    turn = np.array([[math.cos(tilt), math.sin(tilt)], [-math.sin(tilt), math.cos(tilt)]])
    sides = np.array(box(columns, columns))
    sides = np.hstack([sides[:, :2] @ turn, sides[:, 2:] @ turn])
    return DiscArrays(
        position @ turn,
        velocity @ turn,
        radius,
        mass,
        tuple((float(a), float(b), float(c), float(d)) for a, b, c, d in sides) if walls else (),
        restitution,
        wall_restitution,
    )


def scene_of(start: DiscArrays, duration_s: float) -> Scene:
    """Return the scene of a start."""
    return Scene(
        name="random",
        discs=[
            Disc(position_m=tuple(p), velocity_m_s=tuple(v), radius_m=r, mass_kg=m)
            for p, v, r, m in zip(
                start.position_m.tolist(),
                start.velocity_m_s.tolist(),
                start.radius_m.tolist(),
                start.mass_kg.tolist(),
                strict=True,
            )
        ],
        walls=[Wall(point_m=w[:2], normal=w[2:]) for w in start.half_planes()],
        restitution=start.restitution,
        wall_restitution=start.wall_restitution,
        duration_s=duration_s,
    )
