"""Separation: the bodies that a disc does not approach on its present path, whatever rounding makes of it.

- After their impact two bodies separate until another impact changes one of the paths. On straight paths they can't
  approach again, unless a chain bends or the path leads to its other side: then it is another feature of the chain, or
  the inside of an arc. A fall comes back, and on a table two discs are slowed in other directions.
- An impact with restitution 0 leaves no speed along the normal, of which floats leave a rounding. That is kept as a
  fact until another impact changes the velocity along that normal: one at a right angle, without friction, does not.

`carom/core/pit_separation.h` is the compiled form.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from carom.solvers.pit.nearest_edge import find_hit
from carom.trace import wall_body

if TYPE_CHECKING:
    from carom.solvers.plain.bodies import Bodies, Vector

#: The kinds of motion of discs that impacts move.
STRAIGHT, FALLING, SLOWING = range(3)

#: As many as are kept of a disc: two normals that are not parallel fix a velocity, a wall may be given twice.
_MOST_TOUCHED = 3

#: What of a wall a disc meets: the wall, of a chain its edge, the part of it, and whether that is an arc's inside.
Feature = tuple[int, int, str, bool]


class TouchedBody(NamedTuple):
    """A body that a disc touches without speed along the normal.

    Attributes:
        body: A disc, or the feature of a wall.
        normal: Unit vector along the normal.
        until_s: When the body changes to another leg of its path.
    """

    body: int | Feature
    normal: Vector
    until_s: float


class Separations:
    """What each disc does not approach.

    Args:
        bodies: The discs and walls.
        motion: The kind of motion.
    """

    def __init__(self, bodies: Bodies, motion: int) -> None:
        self._bodies, self._motion = bodies, motion
        self._touched: list[list[TouchedBody]] = [[] for _ in range(len(bodies))]
        self._hit: list[tuple[Feature, Vector] | None] = [None] * len(bodies)

    # Two discs --------------------------------------------------------------------------------------------------------

    def are_separating(self, i: int, j: int, now_s: float) -> bool:
        """Return whether two discs do not approach on their present paths."""
        mass = self._bodies.inverse_mass
        if self._motion == FALLING and 0.0 in (mass[i], mass[j]):
            return False
        return self._is_separating_from(i, j, now_s) and self._is_separating_from(j, i, now_s)

    def note_pair(self, i: int, j: int, normal: Vector, now_s: float) -> None:
        """Note an impact of two discs that was just carried out."""
        bodies = self._bodies
        bodies.last_partner[i], bodies.last_partner[j] = j, i
        stops = bodies.restitution == 0.0
        if self._motion == FALLING:
            stops = stops and bodies.inverse_mass[i] > 0.0 and bodies.inverse_mass[j] > 0.0
        for disc, other in ((i, j), (j, i)):
            if bodies.inverse_mass[disc] > 0.0:
                until_s = bodies.legs_ahead(other, now_s)[0].end_s
                self._note(
                    disc, TouchedBody(other, normal, until_s), now_s, slides=bodies.contact.friction > 0.0, stops=stops
                )

    # A disc and a wall ------------------------------------------------------------------------------------------------

    def is_leaving_wall(self, i: int, k: int, now_s: float) -> bool:
        """Return whether a disc, which overlaps a wall, does not approach it on its present path."""
        bodies, met, (feature, normal) = self._bodies, self._hit[i], self._feature_at(i, k)
        has_just_met = self._motion != FALLING and bodies.last_partner[i] == wall_body(k)
        if has_just_met and met is not None and met[0] == feature and (not feature[3] or met[1] == normal):
            return True
        return self._find(i, feature, now_s) is not None

    def note_wall(self, i: int, k: int, now_s: float) -> None:
        """Note an impact of a disc on a wall that was just carried out."""
        bodies = self._bodies
        feature, (nx, ny) = self._hit[i] = self._feature_at(i, k)
        bodies.last_partner[i] = wall_body(k)
        gx, gy = bodies.gravity
        stops = bodies.restitution_of_wall(k) == 0.0 and gx * nx + gy * ny == 0.0 and not feature[3]
        until_s = bodies.legs_ahead(wall_body(k), now_s)[0].end_s
        self._note(
            i,
            TouchedBody(feature, (nx, ny), until_s),
            now_s,
            slides=bodies.contact_of_wall(k).friction > 0.0,
            stops=stops,
        )

    def _feature_at(self, i: int, k: int) -> tuple[Feature, Vector]:
        """Return what of a wall a disc is nearest to, and the unit normal there."""
        x, y, _, _ = self._bodies.seen_from(i, k)
        wall = self._bodies.walls[k]
        if isinstance(wall, tuple):
            return (k, 0, "plane", False), (wall[2], wall[3])
        hit, foot = find_hit(wall, x, y), wall.nearest(x, y)
        if hit is None:
            raise TypeError(f"the centre of disc {i} is on wall {k}")
        stretch = wall.stretches[foot.edge]
        (ax, ay), (bx, by), _ = stretch.edge
        if not foot.inner:
            return (k, foot.edge, "begin" if (foot.x, foot.y) == (ax, ay) else "end", False), hit.normal
        if stretch.centre is None:
            side = "left" if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0.0 else "right"
            return (k, foot.edge, side, False), hit.normal
        dx, dy = x - stretch.centre[0], y - stretch.centre[1]
        inside = dx * dx + dy * dy < stretch.radius * stretch.radius
        return (k, foot.edge, "inside" if inside else "outside", inside), hit.normal

    # Facts ------------------------------------------------------------------------------------------------------------

    def _is_separating_from(self, i: int, j: int, now_s: float) -> bool:
        bodies = self._bodies
        has_just_met = bodies.last_partner[i] == j and self._motion != SLOWING
        return bodies.inverse_mass[i] == 0.0 or has_just_met or self._is_touching_disc(i, j, now_s)

    def _is_touching_disc(self, i: int, j: int, now_s: float) -> bool:
        """Return whether a disc touches another, and does not move back past it.

        PIT finds impacts late, with overlap. So a disc that has moved on past another approaches it on its way back.
        """
        if (touched := self._find(i, j, now_s)) is None:
            return False
        bodies, (nx, ny) = self._bodies, touched.normal
        moved = nx * (bodies.y[j] - bodies.y[i]) - ny * (bodies.x[j] - bodies.x[i])
        return not moved * self._slip_past(i, j, touched.normal) < 0.0

    def _find(self, i: int, body: int | Feature, now_s: float) -> TouchedBody | None:
        """Return the contact of a disc and a body without speed along the normal."""
        return next((one for one in self._touched[i] if one.body == body and now_s < one.until_s), None)

    def _slip_past(self, i: int, j: int, normal: Vector) -> float:
        """Return the speed at which disc `j` moves past disc `i`, to the left of a normal."""
        bodies, (nx, ny) = self._bodies, normal
        return nx * (bodies.vy[j] - bodies.vy[i]) - ny * (bodies.vx[j] - bodies.vx[i])

    def _note(self, i: int, new: TouchedBody, now_s: float, *, slides: bool, stops: bool) -> None:
        """Keep the facts of a disc that an impact has not changed, and add that of the impact."""
        kept = [
            one
            for one in self._touched[i]
            if not slides and one.body != new.body and _are_orthogonal(one.normal, new.normal) and now_s < one.until_s
        ]
        kept = [*kept, new][-_MOST_TOUCHED:] if stops else kept
        if self._motion == SLOWING:  # discs with other velocities are slowed in other directions
            kept = [
                one for one in kept if not isinstance(one.body, int) or self._slip_past(i, one.body, one.normal) == 0.0
            ]
        self._touched[i] = kept


def _are_orthogonal(one: Vector, other: Vector) -> bool:
    return one[0] * other[0] + one[1] * other[1] == 0.0
