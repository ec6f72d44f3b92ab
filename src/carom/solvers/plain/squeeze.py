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

    from carom.driving import Course
    from carom.physics.features import Arc, Feature
    from carom.solvers.plain.bodies import Bodies

State = tuple[float, float, float, float]
#: Velocities and accelerations along a wall, to the right of its normal, that bound what a disc may have.
Drifts = tuple[Vector, ...]


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


class LastMet(NamedTuple):
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

    last: LastMet | None = None
    normal: Vector = (0.0, 0.0)
    across: LastMet | None = None
    row: int = 0

    def after(self, struck: LastMet, normal: Vector) -> ToAndFro:
        """Return the same after another impact of the disc."""
        if self.last is not None:
            if self.last.body != struck.body and self.normal == (-normal[0], -normal[1]):
                return ToAndFro(struck, normal, self.last, self.row + 1)
            # A disc of a row may strike the one beside it twice before it is back at the other.
            if struck.body >= 0 and (self.last.body, self.normal) == (struck.body, normal):
                return self._replace(row=self.row + 1)
        return ToAndFro(struck, normal)

    def beside(self, side: Vector) -> LastMet | None:
        """Return what the disc struck last on a side, given by a unit vector from there; None for nothing."""
        if side == self.normal:
            return self.last
        return self.across if side == (-self.normal[0], -self.normal[1]) else None


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
        struck = LastMet(other, None if hit is None else hit.feature)
        self.to_and_fro[disc] = self.to_and_fro[disc].after(struck, normal)
        return self.crush(disc) if self.to_and_fro[disc].row > self._most else None

    def crush(self, disc: int) -> Crush | None:
        """Return when a disc is crushed that has just struck a body, as it goes to and fro."""
        last, normal, across, _ = self.to_and_fro[disc]
        if last is None or across is None:  # it struck one disc again and again
            return None
        crush = None
        if last.body < 0 and across.body < 0:
            crush = self._crush(disc, wall_index(last.body), wall_index(across.body))
        return crush or self._crush_in_a_row(disc, normal)

    def _crush(self, i: int, k: int, other: int) -> Crush | None:
        """Return when disc `i`, on wall `k`, is crushed between its flat face and that of another.

        Nothing else may come near till then, nor may a wall go on to another leg of its path, nor may the disc get out
        sideways.
        """
        bodies = self._bodies
        (nx, ny), now_s = self.to_and_fro[i].normal, bodies.time[i]
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
        drifts = self._drifts(i, k, other, legs)
        if not drifts or any(leg.end_s <= now_s + left_s for leg in legs):
            return None
        slip = max(abs(velocity) for velocity, _ in drifts) + max(_speed(leg.velocity) for leg in legs)
        if self._is_disturbed(i, sides, gap + left_s * slip, left_s):
            return None
        if not all(self._stays(i, wall, (ny, -nx), drifts, left_s) for wall in (k, other)):
            return None
        return Crush(i, (sides[0], sides[1]), now_s + left_s)

    def _drifts(self, i: int, k: int, other: int, legs: list[Course]) -> Drifts:
        """Return how disc `i` may go along wall `k` while it bounces between it and another; nothing for anyhow.

        Where nothing rubs impacts leave the velocity that it has. One velocity u and spin w slip on neither wall. To
        each of the two an impact with friction is a step in the direction that lowers the slip, to where there is none
        at most, or beyond by as much again: so the distance from (u, w), squared by kinetic energy, never grows.
        """
        bodies, (nx, ny) = self._bodies, self.to_and_fro[i].normal
        now, pull = bodies.vx[i] * ny - bodies.vy[i] * nx, bodies.gravity[0] * ny - bodies.gravity[1] * nx
        if not any(bodies.rubs_on(wall) for wall in (k, other)):
            return ((now, pull),)
        one, two = (leg.velocity[0] * ny - leg.velocity[1] * nx for leg in legs)
        if bodies.belts is not None:
            one, two = one - bodies.belts[k], two + bodies.belts[other]
        steady, off = (one + two) / 2.0, bodies.radius[i] * bodies.spin[i] - (one - two) / 2.0
        inverse_inertia_ratio = bodies.inverse_inertia_ratio[i]
        if off and not inverse_inertia_ratio:
            return ()
        turning = off * off / inverse_inertia_ratio if off else 0.0
        most = math.sqrt((now - steady) * (now - steady) + turning)
        return (steady - most, -abs(pull)), (steady + most, abs(pull))

    def _crush_in_a_row(self, i: int, normal: Vector) -> Crush | None:
        """Return when disc `i` and those that it strikes have no room left between two bodies that no impact moves.

        That is so on one line to the bit, which is one along an axis, with no speed, no fall and no slip across it:
        nothing then takes them off it. And several may lose nothing, or they might come to rest on each other before.
        """
        bodies, now_s = self._bodies, self._bodies.time[i]
        line = self._in_a_row(i, normal)
        if line is None or 0.0 not in normal or _across(bodies.gravity, normal):
            return None
        row = [one.body for one in line]
        walls = [wall_index(body) for body in row if body < 0]
        if len(row) > 3 and min(bodies.restitution, *map(bodies.restitution_of_wall, walls)) < 1.0:
            return None
        states = [bodies.state_at(body, (now_s, 0.0)) for body in row if body >= 0]
        places = {_across(state[:2], normal) for state in states}
        if len(places) > 1 or any(_across(state[2:], normal) for state in states):
            return None
        if self._slips(row, walls):
            return None
        back = (-normal[0], -normal[1])
        ends = self._end(line[0], row[1], normal, now_s), self._end(line[-1], row[-2], back, now_s)
        if ends[0] is None or ends[1] is None:
            return None
        (x, y, vx, vy), (to_x, to_y, to_vx, to_vy) = ends[0], ends[1]
        closing = (vx - to_vx) * normal[0] + (vy - to_vy) * normal[1]
        room = (to_x - x) * normal[0] + (to_y - y) * normal[1]
        room = max(0.0, room - sum(2.0 * bodies.radius[body] for body in row[1:-1]))
        if not closing > 0.0:
            return None
        left_s = room / closing
        way = room + left_s * max(_speed(end[2:]) for end in (ends[0], ends[1]))
        if any(bodies.legs_ahead(body, now_s)[0].end_s <= now_s + left_s for body in (row[0], row[-1])):
            return None
        if any(self._is_disturbed(j, row, way, left_s) for j in row[1:-1]):
            return None
        return Crush(i, (row[0], row[-1]), now_s + left_s)

    def _slips(self, row: list[int], walls: list[int]) -> bool:
        """Whether the impacts of a row without a speed across it rub: friction turns what slips, and takes it off."""
        bodies, pairs = self._bodies, len(row) - 1 - len(walls)
        if not (pairs and bodies.contact.friction > 0.0) and not any(map(bodies.rubs_on, walls)):
            return False
        runs = bodies.belts is not None and any(bodies.belts[k] for k in walls)
        return runs or any(bodies.spin[body] for body in row if body >= 0)

    def _end(self, met: LastMet, disc: int, normal: Vector, time_s: float) -> State | None:
        """Return where the surface of a row's last body is on the line, and its velocity, at a time.

        None for a wall that moves across the line, or of which what `disc` meets does not lie across it; the normal is
        from the body to the disc.
        """
        bodies, (body, feature) = self._bodies, met
        nx, ny = normal
        if body >= 0:
            x, y, vx, vy = bodies.state_at(body, (time_s, 0.0))
            return x + bodies.radius[body] * nx, y + bodies.radius[body] * ny, vx, vy
        k, leg = wall_index(body), bodies.legs_ahead(body, time_s)[0]
        if _across(leg.velocity, normal):
            return None
        wall, (moved_x, moved_y) = bodies.walls[k], leg.moved_at(time_s)
        if isinstance(wall, tuple):
            x, y, depth, fits = wall[0], wall[1], 0.0, not _across(wall[2:], normal)
        elif feature is None:
            return None
        elif isinstance(feature, Face):
            (x, y), depth = feature.a, feature.half_width
            from_b = (feature.b[0] - x, feature.b[1] - y)
            fits = feature.normal == normal and not _across((from_b[1], -from_b[0]), normal)
        else:
            (x, y), depth = _centre(feature)
            seen = bodies.state_at(disc, (time_s, 0.0))
            fits = not _across((seen[0] - moved_x - x, seen[1] - moved_y - y), normal)
        return (x + moved_x + depth * nx, y + moved_y + depth * ny, *leg.velocity) if fits else None

    def _in_a_row(self, i: int, normal: Vector) -> list[LastMet] | None:
        """Return disc `i` and who strikes whom beside it, up to a body at each end that no impact moves.

        They are in the order of the normal, which is from one that disc `i` has struck to it.
        """
        bodies, ways = self._bodies, []
        for side in (normal, (-normal[0], -normal[1])):
            way, struck = list[LastMet](), self.to_and_fro[i].beside(side)
            while struck is not None and len(way) <= len(bodies):
                way.append(struck)
                if struck.body < 0 or not bodies.inverse_mass[struck.body]:
                    break
                struck = self.to_and_fro[struck.body].beside(side)
            else:
                return None
            ways.append(way)
        return [*reversed(ways[0]), LastMet(i, None), *ways[1]]

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

    def _stays(self, i: int, k: int, tangent: Vector, drifts: Drifts, seconds: float) -> bool:
        """Whether disc `i` is before wall `k` from now on for this many seconds, along the wall."""
        bodies, face = self._bodies, self._face(i, k)
        if isinstance(bodies.walls[k], tuple):
            return True
        if face is None:
            return False
        x, y, vx, vy = bodies.seen_from(i, k)
        (ax, ay), (bx, by), (tx, ty) = face.a, face.b, tangent
        ex, ey = bx - ax, by - ay
        now, way = (x - ax) * ex + (y - ay) * ey, tx * ex + ty * ey
        own = (bodies.vx[i] - vx) * tx + (bodies.vy[i] - vy) * ty  # the wall's velocity
        for velocity, pull in drifts:
            rate, bend = (velocity - own) * way, pull * way
            turns_s = -rate / bend if bend else 0.0
            times_s = [0.0, seconds, *([turns_s] if 0.0 < turns_s < seconds else [])]
            if not all(0.0 <= now + t * (rate + 0.5 * bend * t) <= ex * ex + ey * ey for t in times_s):
                return False
        return True


def _speed(velocity: tuple[float, float]) -> float:
    return math.hypot(*velocity)


def _across(vector: tuple[float, float], normal: Vector) -> float:
    """Return the component of a vector across a normal along an axis."""
    return vector[1] if normal[0] else vector[0]


def _centre(feature: Arc) -> tuple[Vector, float]:
    """Return the centre of a vertex or an arc, and how far in front of it, out or in, its surface is."""
    (x, _), (y, _) = feature.centre
    if feature.inside:
        return (x, y), feature.half_width - feature.radius[0]
    return (x, y), feature.half_width + feature.radius[0]
