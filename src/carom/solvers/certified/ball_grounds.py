"""What discs are in contact with in certified runs: half-planes, and the straight faces of walls that end."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flint import arb

from carom.solvers.certified.gliding import BallGround
from carom.solvers.certified.obstacles import Plane, Round
from carom.trace import wall_body

if TYPE_CHECKING:
    from carom.solvers.certified.ball_bodies import BallBodies
    from carom.solvers.certified.obstacles import Exact, Obstacle

_ZERO = arb(0)


def ground_of(bodies: BallBodies, i: int, k: int) -> BallGround | None:
    """Return what disc `i` would lie on of an obstacle: what is straight, stands, and gravity presses discs to."""
    obstacle = bodies.obstacles[k]
    shape, belts = obstacle.shape, bodies.scene.arrays.belts_m_s
    if not isinstance(shape, Plane) or bodies.pulls[k] >= 0 or bodies.is_driven(k):
        return None
    if belts and belts[obstacle.wall]:
        return None
    law, (gx, gy) = bodies.wall_law(k, bodies.scene.discs[i].radius_m), bodies.gravity
    nx, ny, level = law.nx, law.ny, law.level / law.length
    presses, along = (_ZERO - gx * nx - gy * ny) / law.length, (gx * ny - gy * nx) / law.length
    span, never = None, {wall_body(k)}
    if shape.stretch is not None:
        ends = [bodies.exactly(*point) for point in shape.stretch]
        one, other = ((x * ny - y * nx) / law.length for x, y in ends)
        span = (one, other) if one < other else (other, one)
        never |= {wall_body(m) for m, other in enumerate(bodies.obstacles) if _is_part_of(other, obstacle)}
    return BallGround(wall_body(k), nx, ny, law.length, level, presses, along, span, frozenset(never))


def stretch_of(shape: Plane | Round) -> tuple[Exact, Exact]:
    """Return the ends of a face."""
    if not isinstance(shape, Plane) or shape.stretch is None:
        raise TypeError("a half-plane has no ends")
    return shape.stretch


def _is_part_of(other: Obstacle, face: Obstacle) -> bool:
    """Whether an obstacle is the back of a face, or a vertex at one of its ends."""
    if other.wall != face.wall:
        return False
    begin, end = stretch_of(face.shape)
    if isinstance(other.shape, Plane):
        return other.shape.stretch is not None and set(other.shape.stretch) == {begin, end}
    return other.shape.radius2 == 0 and other.shape.centre in (begin, end)
