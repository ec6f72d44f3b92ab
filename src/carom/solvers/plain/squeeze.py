"""Discs that bounce to and fro between two walls that close on them: impacts without end before the walls meet them.

Between a wall and a parallel one that comes at a speed U, the relative speed of the disc after each impact on the
latter times the way that is left to it stays the same: so the speed grows as one over the way, and infinitely many
impacts come before it is used up. Time never stands still, so that no count of impacts at one instant ends this.
`docs/walls.md` derives it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from carom.physics.features import Face
from carom.solvers.plain.finite_walls import gap_of
from carom.trace import wall_body

if TYPE_CHECKING:
    from carom.solvers.plain.bodies import Bodies


class Crush(NamedTuple):
    """A disc that has no room left from an instant on.

    Attributes:
        disc: The disc.
        walls: The two that close on it.
        time_s: When the way that is left to it is used up, seconds since the epoch.
    """

    disc: int
    walls: tuple[int, int]
    time_s: float


class Squeezes:
    """How often in a row each disc has gone from one wall to one opposite, exactly parallel, and back.

    Args:
        bodies: The bodies of the run.
        most: After how many in a row a disc is looked at.
    """

    def __init__(self, bodies: Bodies, most: int) -> None:
        self._bodies = bodies
        self._most = most
        self._last: list[tuple[int, tuple[float, float]] | None] = [None] * len(bodies)
        self._row = [0] * len(bodies)

    def struck(self, disc: int, wall: int | None) -> Crush | None:
        """Note that a disc has struck a wall, or another disc (None); return when it is crushed, None for not that."""
        last, self._last[disc] = self._last[disc], None
        if wall is None:
            self._row[disc] = 0
            return None
        nx, ny = self._bodies.normal(disc, wall)
        self._last[disc] = (wall, (nx, ny))
        opposite = last is not None and last[0] != wall and last[1] == (-nx, -ny)
        self._row[disc] = self._row[disc] + 1 if opposite else 0
        if last is None or self._row[disc] <= self._most:
            return None
        return self._crush(disc, wall, last[0])

    def _crush(self, i: int, k: int, other: int) -> Crush | None:
        """Return when disc `i`, on wall `k`, is crushed between it and another.

        Along the walls its velocity does not change where nothing rubs: so it stays between two faces that it is
        between all the while. Nothing else may come near till then, nor may a wall go on to another leg of its path.
        """
        bodies = self._bodies
        (nx, ny), now_s = bodies.normal(i, k), bodies.time[i]
        legs = [bodies.legs_ahead(wall_body(wall), now_s)[0] for wall in (k, other)]
        (ax, ay), (bx, by) = (leg.velocity for leg in legs)
        closing = (ax - bx) * nx + (ay - by) * ny
        if not closing > 0.0:
            return None
        gap = self._gap(i, other)
        if gap is None:
            return None
        left_s = gap / closing
        if any(leg.end_s <= now_s + left_s for leg in legs) or self._is_disturbed(i, (k, other), gap, left_s):
            return None
        bounded = [wall for wall in (k, other) if not isinstance(bodies.walls[wall], tuple)]
        rubs = any(bodies.contact_of_wall(wall).friction > 0.0 for wall in (k, other))
        if (bounded and rubs) or not all(self._stays(i, wall, left_s) for wall in bounded):
            return None
        return Crush(i, (min(k, other), max(k, other)), now_s + left_s)

    def _is_disturbed(self, i: int, between: tuple[int, int], gap: float, seconds: float) -> bool:
        """Whether something else may come to disc `i` so soon, as all move now."""
        bodies = self._bodies
        now_s = bodies.time[i]
        nx, ny = bodies.normal(i, between[0])
        fall = 0.5 * math.hypot(*bodies.gravity) * seconds * seconds
        sides = [bodies.legs_ahead(wall_body(wall), now_s)[0].velocity for wall in between]
        way = gap + fall + seconds * (abs(bodies.vx[i] * ny - bodies.vy[i] * nx) + max(map(_speed, sides)))
        for k in range(len(bodies.walls)):
            fastest = max(_speed(leg.velocity) for leg in bodies.legs_ahead(wall_body(k), now_s))
            if k not in between and self._room(i, k) <= way + fastest * seconds:
                return True
        for j in range(len(bodies)):
            x, y, u, v = bodies.state_at(j, (now_s, 0.0))
            room = math.hypot(x - bodies.x[i], y - bodies.y[i]) - bodies.radius[i] - bodies.radius[j]
            fastest = max(_speed((u, v)), *(_speed(leg.velocity) for leg in bodies.legs_ahead(j, now_s)))
            if j != i and room <= way + fall + fastest * seconds:
                return True
        return False

    def _room(self, i: int, k: int) -> float:
        """Return how far disc `i` is from wall `k`."""
        bodies, (x, y, _, _) = self._bodies, self._bodies.seen_from(i, k)
        wall, radius = bodies.walls[k], bodies.radius[i]
        if isinstance(wall, tuple):
            return (x - wall[0]) * wall[2] + (y - wall[1]) * wall[3] - radius
        return wall.gap(x, y, radius)

    def _gap(self, i: int, k: int) -> float | None:
        """Return the way from disc `i` to wall `k`; None where what it meets there is no flat face."""
        if isinstance(self._bodies.walls[k], tuple):
            return self._room(i, k)
        face = self._face(i, k)
        return None if face is None else gap_of(self._bodies.mover(i, k), face)

    def _face(self, i: int, k: int) -> Face | None:
        part = self._bodies.expected(i, k)
        return part.feature if part is not None and isinstance(part.feature, Face) else None

    def _stays(self, i: int, k: int, seconds: float) -> bool:
        """Whether disc `i` is before finite wall `k` from now on for this many seconds, along the wall."""
        bodies, face = self._bodies, self._face(i, k)
        if face is None:
            return False
        x, y, vx, vy = bodies.seen_from(i, k)
        (ax, ay), (bx, by), (gx, gy) = face.a, face.b, bodies.gravity
        ex, ey = bx - ax, by - ay
        now, rate, pull = (x - ax) * ex + (y - ay) * ey, vx * ex + vy * ey, gx * ex + gy * ey
        turns_s = -rate / pull if pull else 0.0
        times_s = [0.0, seconds, *([turns_s] if 0.0 < turns_s < seconds else [])]
        return all(0.0 <= now + t * (rate + 0.5 * pull * t) <= ex * ex + ey * ey for t in times_s)


def _speed(velocity: tuple[float, float]) -> float:
    return math.hypot(*velocity)
