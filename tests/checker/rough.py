"""What friction gives at impacts, from their velocities, normals and spins alone, and how far rounding can have it off.

Both surfaces slip past each other at s. Friction takes what would turn it round as asked, (1 + b) s over how easily it
yields, or f times the push, whichever is less. The slip adds up two velocities along a tangent and two rims: 24
roundings of their sizes, as in the push (`rules`). The lesser of two numbers is off by no more than the worse of them;
where it is plain which one is less, by that one.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tests.checker.flights import UNIT

from carom import DiscArrays

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Rub:
    """Friction's impulse on the second body along the normal turned by +90 degrees; the first receives the opposite.

    Attributes:
        impulse: Shape ``(m,)``, newton seconds.
        bound: How far rounding can have it off.
    """

    impulse: Floats
    bound: Floats


def compute_friction(start: DiscArrays, rows: NDArray[np.void], rims: tuple[Floats, Floats], fell: Floats) -> Rub:
    """Return what friction gives at each impact.

    Args:
        start: Discs and walls.
        rows: Impacts, shape ``(m,)``.
        rims: Speeds of both bodies' rims before them, in metres per second.
        fell: How far the recorded speed towards a wall may be from the one that presses, in metres per second.
    """
    hit = rows["second"] >= 0
    one, two = rows["first"], np.where(hit, rows["second"], 0)
    light = (1.0 / start.mass_kg[one], np.where(hit, 1.0 / start.mass_kg[two], 0.0))
    k1, k2 = start.inertia[one], start.inertia[two]
    coefficient = np.where(hit, start.friction, start.wall_friction)
    back = 1.0 + np.where(hit, start.tangential_restitution, start.wall_tangential_restitution)
    bounce = 1.0 + np.where(hit, start.restitution, start.wall_restitution)
    (nx, ny), (ux, uy) = rows["normal"].T, (rows["velocity_second_before"] - rows["velocity_first_before"]).T
    speed = np.hypot(ux, uy)
    slip = uy * -nx + ux * ny + rims[0] + rims[1]
    fast = speed + np.abs(rims[0]) + np.abs(rims[1])
    together = light[0] + light[1]
    yields = together + light[0] / k1 + light[1] / k2
    held, held_off = back * slip / yields, back * 24 * UNIT * fast / yields
    most = coefficient * bounce * np.maximum(-(ux * nx + uy * ny), 0.0) / together
    most_off = coefficient * bounce * (24 * UNIT * speed + fell) / together
    size = np.minimum(np.abs(held), most)
    plainly_held = np.abs(held) + held_off < most - most_off
    plainly_slid = np.abs(held) - held_off > most + most_off
    off = np.where(plainly_held, held_off, np.where(plainly_slid, most_off, np.maximum(held_off, most_off)))
    # Of two directions that rounding can't tell apart friction may take either.
    turned_round = np.where(np.abs(slip) <= 24 * UNIT * fast, 2 * np.minimum(held_off, most + most_off), 0.0)
    return Rub(np.where(slip > 0.0, size, -size), off + turned_round)
