"""Discs that bounce to and fro between what closes on them: impacts without end before no room is left to them.

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
from carom.trace import Vector, wall_body, wall_index

if TYPE_CHECKING:
    from collections.abc import Collection

    from carom.physics.features import Feature
    from carom.solvers.plain.bodies import Bodies


class Crush(NamedTuple):
    """A disc that has no room left from an instant on.

    Attributes:
        disc: The disc.
        between: The two bodies that close on it, or on the discs with which it is in a row.
        time_s: When the way that is left to it is used up, seconds since the epoch.
    """

    disc: int
    between: tuple[int, int]
    time_s: float


class Struck(NamedTuple):
    """What a disc has met last.

    Attributes:
        body: The body.
        feature: What of it, if it is a finite wall.
    """

    body: int
    feature: Feature | None


class ToAndFro(NamedTuple):
    """How often in a row a disc has gone from one body to one exactly opposite, and back.

    Attributes:
        last: What it struck last; None for nothing so far.
        normal: Unit vector from there to the disc.
        across: What it struck last on the other side, in this row; None for nothing.
        row: How often.
    """

    last: Struck | None = None
    normal: Vector = (0.0, 0.0)
    across: Struck | None = None
    row: int = 0

    def after(self, struck: Struck, normal: Vector) -> ToAndFro:
        """Return the same after another impact of the disc."""
        if self.last is not None:
            if self.last.body != struck.body and self.normal == (-normal[0], -normal[1]):
                return ToAndFro(struck, normal, self.last, self.row + 1)
            # A disc of a row may strike the one beside it twice before it is back at the other.
            if struck.body >= 0 and (self.last.body, self.normal) == (struck.body, normal):
                return self._replace(row=self.row + 1)
        return ToAndFro(struck, normal)

    def beside(self, side: Vector) -> int | None:
        """Return whom the disc struck last on a side, given by a unit vector from there; None for nobody."""
        struck = self.last if side == self.normal else self.across
        return None if struck is None or side not in (self.normal, (-self.normal[0], -self.normal[1])) else struck.body


class Squeezes:
    """How each disc of a run goes to and fro, and which are crushed.

    Args:
        bodies: The bodies of the run.
        most: After how many impacts in a row a disc is looked at.
    """

    def __init__(self, bodies: Bodies, most: int) -> None:
        self._bodies = bodies
        self._most = most
        self.to_and_fro = [ToAndFro()] * len(bodies)

    def struck(self, disc: int, other: int, normal: Vector) -> Crush | None:
        """Note that a disc has struck a body; return when it is crushed, None for not that.

        Args:
            disc: The disc.
            other: The body.
            normal: Unit vector from the body to the disc.
        """
        hit = self._bodies.last_hit[disc] if other < 0 else None
        struck = Struck(other, None if hit is None else hit.feature)
        self.to_and_fro[disc] = self.to_and_fro[disc].after(struck, normal)
        return self.crush(disc) if self.to_and_fro[disc].row > self._most else None

    def crush(self, disc: int) -> Crush | None:
        """Return when a disc is crushed that has just struck a body, as it goes to and fro."""
        last, normal, across, _ = self.to_and_fro[disc]
        if last is None or across is None:  # it struck one disc again and again
            return None
        if last.body < 0 and across.body < 0:
            return self._crush(disc, wall_index(last.body), wall_index(across.body))
        return self._crush_in_a_row(disc, normal)

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
        sides = tuple(map(wall_body, sorted((k, other))))
        slip = abs(bodies.vx[i] * ny - bodies.vy[i] * nx) + max(_speed(leg.velocity) for leg in legs)
        if any(leg.end_s <= now_s + left_s for leg in legs) or self._is_disturbed(
            i, sides, gap + left_s * slip, left_s
        ):
            return None
        bounded = [wall for wall in (k, other) if not isinstance(bodies.walls[wall], tuple)]
        rubs = any(bodies.contact_of_wall(wall).friction > 0.0 for wall in (k, other))
        if (bounded and rubs) or not all(self._stays(i, wall, left_s) for wall in bounded):
            return None
        return Crush(i, (sides[0], sides[1]), now_s + left_s)

    def _crush_in_a_row(self, i: int, normal: Vector) -> Crush | None:
        """Return when disc `i` and those that it strikes have no room left between two half-planes or held discs.

        That is so on one line to the bit, which is one along an axis, with no speed across it, no friction and no fall:
        nothing then takes them off it. And nothing may be lost, or they might come to rest on each other before.
        """
        bodies, now_s = self._bodies, self._bodies.time[i]
        line = self._in_a_row(i, normal)
        rubs_or_loses = bodies.contact.friction > 0.0 or bodies.restitution < 1.0
        if line is None or rubs_or_loses or any(bodies.gravity) or 0.0 not in normal:
            return None
        along = 0 if normal[0] else 1
        states = [state for body in line if (state := self._in_line(body, now_s, normal)) is not None]
        if len(states) < len(line) or any(state[3 - along] for state in states):
            return None
        if len({state[1 - along] for j, state in zip(line, states, strict=True) if j >= 0}) > 1:
            return None
        ends = states[0], states[-1]
        closing = (ends[0][2 + along] - ends[1][2 + along]) * normal[along]
        room = (ends[1][along] - ends[0][along]) * normal[along]
        for body in line:
            if body >= 0:  # of a held disc one half lies between the ends
                room -= bodies.radius[body] * (2.0 if bodies.inverse_mass[body] else 1.0)
        room = max(0.0, room)
        if not closing > 0.0:
            return None
        left_s = room / closing
        way = room + left_s * max(abs(end[2 + along]) for end in ends)
        if any(bodies.legs_ahead(body, now_s)[0].end_s <= now_s + left_s for body in (line[0], line[-1])):
            return None
        if any(self._is_disturbed(j, line, way, left_s) for j in line[1:-1]):
            return None
        return Crush(i, (line[0], line[-1]), now_s + left_s)

    def _in_line(self, body: int, time_s: float, normal: Vector) -> tuple[float, float, float, float] | None:
        """Return place and velocity of a body at a time; None for a wall that is not across a line, or takes speed."""
        bodies = self._bodies
        if body >= 0:
            return bodies.state_at(body, (time_s, 0.0))
        k, leg = wall_index(body), bodies.legs_ahead(body, time_s)[0]
        wall = bodies.walls[k]
        if not isinstance(wall, tuple) or bodies.rubs_on(k) or bodies.restitution_of_wall(k) < 1.0:
            return None
        if wall[2] * normal[1] != wall[3] * normal[0]:
            return None
        moved_x, moved_y = leg.moved_at(time_s)
        return wall[0] + moved_x, wall[1] + moved_y, *leg.velocity

    def _in_a_row(self, i: int, normal: Vector) -> list[int] | None:
        """Return disc `i` and who strikes whom beside it, up to a body at each end that no impact moves.

        They are in the order of the normal, which is from one that disc `i` has struck to it.
        """
        bodies, ways = self._bodies, []
        for side in (normal, (-normal[0], -normal[1])):
            way, body = list[int](), self.to_and_fro[i].beside(side)
            while body is not None and len(way) <= len(bodies):
                way.append(body)
                if body < 0 or not bodies.inverse_mass[body]:
                    break
                body = self.to_and_fro[body].beside(side)
            else:
                return None
            ways.append(way)
        return [*reversed(ways[0]), i, *ways[1]]

    def _is_disturbed(self, i: int, among: Collection[int], way: float, seconds: float) -> bool:
        """Whether another body may come so soon to disc `i`, which gets this far beside its fall, as all move now."""
        bodies = self._bodies
        now_s = bodies.time[i]
        fall = 0.5 * math.hypot(*bodies.gravity) * seconds * seconds
        way += fall
        for k in range(len(bodies.walls)):
            fastest = max(_speed(leg.velocity) for leg in bodies.legs_ahead(wall_body(k), now_s))
            if wall_body(k) not in among and self._room(i, k) <= way + fastest * seconds:
                return True
        for j in range(len(bodies)):
            x, y, u, v = bodies.state_at(j, (now_s, 0.0))
            room = math.hypot(x - bodies.x[i], y - bodies.y[i]) - bodies.radius[i] - bodies.radius[j]
            fastest = max(_speed((u, v)), *(_speed(leg.velocity) for leg in bodies.legs_ahead(j, now_s)))
            if j not in among and j != i and room <= way + fall + fastest * seconds:
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
        """Return the flat face of finite wall `k` that disc `i` struck last; None where it struck no flat one."""
        for struck in (self.to_and_fro[i].last, self.to_and_fro[i].across):
            if struck is not None and struck.body == wall_body(k) and isinstance(struck.feature, Face):
                return struck.feature
        return None

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
