"""Checks of a chain of edges: no edge has length 0, and the chain does not fold back, cross or touch itself.

All decisions are exact. If two edges share a point, its coordinates have the form ``x + x' s``, where x and x' are
rational numbers and s is the square root of a rational number. The sign of ``p + q s`` is computed without rounding.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import NamedTuple

from carom.model.chain_geometry import Edge, ExactCircle, compute_circle

Number = Fraction | int


class Surd(NamedTuple):
    """The number ``whole + part * sqrt(square)``, with rational numbers in all three fields."""

    whole: Number
    part: Number
    square: Number

    @property
    def sign(self) -> int:
        """Return the sign of the number: 1, 0 or -1."""
        p, q = self.whole, self.part if self.square else 0
        if p >= 0 and q >= 0:
            return int(p > 0 or q > 0)
        if p <= 0 and q <= 0:
            return -1
        larger = p * p - q * q * self.square  # above 0 if the rational part is larger than the root
        return (larger > 0) - (larger < 0) if p > 0 else (larger < 0) - (larger > 0)


class Place(NamedTuple):
    """A point at which two edges may meet. Both coordinates contain the same square root."""

    x: Surd
    y: Surd

    def compute_order(self, a: tuple[Number, Number], along: tuple[Number, Number]) -> int:
        """Return 1 if the point is further than `a` in the direction `along`, 0 if equally far, -1 if less far."""
        dx, dy = self.x.whole - a[0], self.y.whole - a[1]
        return Surd(along[0] * dx + along[1] * dy, along[0] * self.x.part + along[1] * self.y.part, self.x.square).sign

    def to_floats(self) -> tuple[float, float]:
        """Return the point as floats, for messages."""
        root = math.sqrt(float(self.x.square))
        return float(self.x.whole) + float(self.x.part) * root, float(self.y.whole) + float(self.y.part) * root


class _Line:
    """An edge with rational coordinates."""

    def __init__(self, edge: Edge) -> None:
        self.a, self.b = ((Fraction(x), Fraction(y)) for x, y in (edge.a, edge.b))
        self.along = (self.b[0] - self.a[0], self.b[1] - self.a[1])
        self.circle: ExactCircle | None = compute_circle(edge) if edge.bulge else None
        self.turn = 1 if edge.bulge > 0 else -1

    def has_point(self, place: Place) -> bool:
        """Whether a point of the edge's line or circle is on the edge. The ends belong to the edge."""
        if self.circle is not None:  # a counterclockwise arc is to the right of the line from its start to its end
            left = (-self.along[1], self.along[0])
            return place.compute_order(self.a, left) * self.turn <= 0
        return place.compute_order(self.a, self.along) >= 0 and place.compute_order(self.b, self.along) <= 0


class Crossing(NamedTuple):
    """Two edges that share a point other than the joint between them.

    Attributes:
        first: Number of the first edge.
        second: Number of the second edge, which is higher.
        x: x coordinate of the point, in metres, rounded for messages.
        y: y coordinate of the point, in metres, rounded for messages.
    """

    first: int
    second: int
    x: float
    y: float


def find_crossings(edges: Sequence[Edge], *, closed: bool) -> Iterator[Crossing]:
    """Yield the pairs of edges that share a point other than the joint between them. No edge may have length 0."""
    lines = [_Line(edge) for edge in edges]
    spans = [_compute_box(edge, line.circle) for edge, line in zip(edges, lines, strict=True)]
    last = len(edges) - 1
    for j, line in enumerate(lines):
        left, low, right, high = spans[j]
        for i, (x, y, to_x, to_y) in enumerate(spans[:j]):
            if x > right or left > to_x or y > high or low > to_y:
                continue
            joints = [line.a] if i == j - 1 else []
            joints += [line.b] if closed and i == 0 and j == last else []
            for place in _find_shared_points(lines[i], line):
                if not any(_is_at(place, joint) for joint in joints):
                    yield Crossing(i, j, *place.to_floats())
                    break


def _is_at(place: Place, point: tuple[Number, Number]) -> bool:
    return not any(Surd(c.whole - p, c.part, c.square).sign for c, p in zip(place, point, strict=True))


def _compute_box(edge: Edge, circle: ExactCircle | None) -> tuple[float, float, float, float]:
    """Return the least x, least y, greatest x and greatest y of a box around an edge, in metres, rounded outwards."""
    xs, ys = zip(edge.a, edge.b, strict=True)
    box = [min(xs), min(ys), max(xs), max(ys)]
    if circle is not None:
        reach = (math.isqrt(math.ceil(circle.radius2 * 4**64)) + 1) / 2**64  # a little more than the radius
        x, y = float(circle.x), float(circle.y)
        room = (abs(x) + abs(y) + reach) * 2.0**-50
        box = [x - reach - room, y - reach - room, x + reach + room, y + reach + room]
    return box[0], box[1], box[2], box[3]


def _build_place(point: tuple[Number, Number]) -> Place:
    return Place(Surd(point[0], 0, 0), Surd(point[1], 0, 0))


def _find_shared_points(one: _Line, other: _Line) -> Iterator[Place]:
    """Yield points that two edges share. If the edges share a part of a line or circle, yield at least its ends."""
    if one.circle is None and other.circle is not None:
        one, other = other, one
    if one.circle is None:
        candidates = _intersect_straights(one, other)
    elif other.circle is None:
        candidates = _intersect_line(other.a, other.along, one.circle)
    elif one.circle == other.circle:
        middles = (_find_middle(line, one.circle) for line in (one, other))
        candidates = iter([*map(_build_place, (one.a, one.b, other.a, other.b)), *middles])
    else:
        candidates = _intersect_circles(one.circle, other.circle)
    return (place for place in candidates if one.has_point(place) and other.has_point(place))


def _find_middle(line: _Line, circle: ExactCircle) -> Place:
    """Return the middle of an arc.

    The ends of two arcs don't show whether the arcs overlap: two equal arcs share both ends, which may both be joints.
    """
    x, y, radius2 = circle
    ex, ey = line.along
    # The middle is one radius from the centre, perpendicular to the line between the arc's ends. The middle of a
    # counterclockwise arc is to the right of this line.
    square = radius2 / (ex * ex + ey * ey)
    return Place(Surd(x, line.turn * ey, square), Surd(y, -line.turn * ex, square))


def _intersect_straights(one: _Line, other: _Line) -> Iterator[Place]:
    (ex, ey), (fx, fy) = one.along, other.along
    dx, dy = other.a[0] - one.a[0], other.a[1] - one.a[1]
    cross = ex * fy - ey * fx
    if cross != 0:
        part = (dx * fy - dy * fx) / cross
        yield _build_place((one.a[0] + part * ex, one.a[1] + part * ey))
    elif dx * ey - dy * ex == 0:
        yield from map(_build_place, (one.a, one.b, other.a, other.b))


def _intersect_line(a: tuple[Number, Number], along: tuple[Number, Number], circle: ExactCircle) -> Iterator[Place]:
    """Yield the points at which a line meets a circle."""
    (ex, ey), dx, dy = along, a[0] - circle.x, a[1] - circle.y
    e2, b = ex * ex + ey * ey, ex * dx + ey * dy
    square = b * b - e2 * (dx * dx + dy * dy - circle.radius2)
    if square < 0:
        return
    for sign in (1, -1) if square else (1,):
        whole, part = Fraction(-b) / e2, Fraction(sign) / e2
        yield Place(Surd(a[0] + whole * ex, part * ex, square), Surd(a[1] + whole * ey, part * ey, square))


def _intersect_circles(one: ExactCircle, other: ExactCircle) -> Iterator[Place]:
    """Yield the points at which two circles meet.

    Both points are on a line perpendicular to the line through the centres.
    """
    dx, dy = other.x - one.x, other.y - one.y
    distance2 = dx * dx + dy * dy
    if distance2 == 0:
        return
    part = (distance2 + one.radius2 - other.radius2) / (2 * distance2)
    yield from _intersect_line((one.x + part * dx, one.y + part * dy), (-dy, dx), one)
