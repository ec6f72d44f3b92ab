"""Discs that bounce to and fro between two walls that close on them: impacts without end before the walls meet them.

Between a wall and a parallel one that comes at a speed U, the relative speed of the disc after each impact on the
latter times the way that is left to it stays the same: so the speed grows as one over the way, and infinitely many
impacts come before it is used up. Time never stands still, so that no count of impacts at one instant ends this.
`docs/walls.md` derives it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from carom.physics.features import Face
from carom.solvers.plain.finite_walls import gap_of

if TYPE_CHECKING:
    from carom.solvers.plain.bodies import Bodies

__all__ = ["Crush", "Squeezes"]


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
        between now and at the end.
        """
        bodies = self._bodies
        nx, ny = bodies.normal(i, k)
        (ax, ay), (bx, by) = (bodies.drive[wall] or (0.0, 0.0) for wall in (k, other))
        closing = (ax - bx) * nx + (ay - by) * ny
        if not closing > 0.0:
            return None
        gap = self._gap(i, other)
        if gap is None:
            return None
        left_s = gap / closing
        for wall in (k, other):
            if not self._stays(i, wall, left_s):
                return None
        return Crush(i, (min(k, other), max(k, other)), bodies.time[i] + left_s)

    def _gap(self, i: int, k: int) -> float | None:
        """Return the way from disc `i` to wall `k`; None where what it meets there is no flat face."""
        bodies = self._bodies
        wall = bodies.walls[k]
        if isinstance(wall, tuple):
            x, y, _, _ = bodies.seen_from(i, k)
            return (x - wall[0]) * wall[2] + (y - wall[1]) * wall[3] - bodies.radius[i]
        face = self._face(i, k)
        return None if face is None else gap_of(bodies.mover(i, k), face)

    def _face(self, i: int, k: int) -> Face | None:
        part = self._bodies.expected(i, k)
        return part.feature if part is not None and isinstance(part.feature, Face) else None

    def _stays(self, i: int, k: int, seconds: float) -> bool:
        """Whether disc `i` is before wall `k` now and so many seconds from now, along the wall."""
        bodies = self._bodies
        if isinstance(bodies.walls[k], tuple):
            return True
        face = self._face(i, k)
        if face is None or bodies.contact_of_wall(k).friction > 0.0:
            return False
        x, y, vx, vy = bodies.seen_from(i, k)
        (ax, ay), (bx, by) = face.a, face.b
        ex, ey = bx - ax, by - ay
        now, rate = (x - ax) * ex + (y - ay) * ey, vx * ex + vy * ey
        return all(0.0 <= along <= ex * ex + ey * ey for along in (now, now + rate * seconds))
