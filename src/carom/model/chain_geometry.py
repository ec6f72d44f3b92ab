"""Geometry of finite walls in floats: straight edges, arcs and circles, and the nearest point of a wall.

An edge connects one point to the next. The bulge of an edge describes its curvature: the tangent of a quarter of the
arc's angle, as in DXF files. An edge with bulge 0 is straight, an edge with bulge 1 is half of a circle, and a positive
bulge means a counterclockwise arc. The wall consists of all points whose distance from the line of edges is at most the
half width.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

Point = tuple[float, float]


class ExactCircle(NamedTuple):
    """The exact circle of an arc. Centre and squared radius are rational numbers."""

    x: Fraction
    y: Fraction
    radius2: Fraction


class Edge(NamedTuple):
    """One edge of a chain: its ends a and b, in metres, and its bulge."""

    a: Point
    b: Point
    bulge: float


class Foot(NamedTuple):
    """The point of a wall's line that is nearest to a given point.

    Attributes:
        x: x coordinate of the point, in metres.
        y: y coordinate of the point, in metres.
        edge: Number of the edge that contains the point. At a joint of two edges, the lower edge number.
        inner: Whether the point is between the ends of the edge.
    """

    x: float
    y: float
    edge: int
    inner: bool


def compute_circle(edge: Edge) -> ExactCircle:
    """Return the circle of an edge whose bulge is not 0."""
    (ax, ay), (bx, by), k = map(Fraction, edge.a), map(Fraction, edge.b), Fraction(edge.bulge)
    across = (1 - k * k) / (4 * k)
    x, y = (ax + bx) / 2 - across * (by - ay), (ay + by) / 2 + across * (bx - ax)
    return ExactCircle(x, y, (ax - x) ** 2 + (ay - y) ** 2)


class Stretch(NamedTuple):
    """An edge or a whole circle, with its coordinates as floats.

    Attributes:
        edge: The edge. Both ends of a whole circle are the same point.
        centre: Centre of an arc's circle; None for a straight edge.
        radius: Radius of an arc's circle; 0 for a straight edge.
    """

    edge: Edge
    centre: Point | None = None
    radius: float = 0.0

    @property
    def whole(self) -> bool:
        """Whether this is a whole circle, whose radius may be 0."""
        return self.edge.a == self.edge.b

    def find_nearest(self, x: float, y: float) -> tuple[Point, bool]:
        """Return the edge's nearest point to a given point, and whether this point is between the ends."""
        (ax, ay), (bx, by), bulge = self.edge
        if self.centre is None:
            ex, ey = bx - ax, by - ay
            part = ((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey)
            if 0.0 < part < 1.0:
                return (ax + part * ex, ay + part * ey), True
            return ((ax, ay) if part <= 0.0 else (bx, by)), False
        (cx, cy), (dx, dy) = self.centre, (x - self.centre[0], y - self.centre[1])
        distance = math.sqrt(dx * dx + dy * dy)
        if self.whole:  # all points of a circle are equally far from its centre
            rim = (cx + self.radius * dx / distance, cy + self.radius * dy / distance) if distance else (ax, ay)
            return rim, self.radius > 0.0
        # The test whether the point is in the arc's sector uses the point's positions relative to the arc's ends,
        # because the centre of a flat arc is far away.
        is_past_begin = ((ax - cx) * (y - ay) - (ay - cy) * (x - ax)) * bulge > 0.0
        is_before_end = ((bx - cx) * (y - by) - (by - cy) * (x - bx)) * bulge < 0.0
        if (is_past_begin or is_before_end) if abs(bulge) > 1.0 else (is_past_begin and is_before_end):
            gap = self.compute_power(x, y) / (distance + self.radius) if distance else 0.0
            return (x - gap * dx / distance, y - gap * dy / distance) if distance else (ax, ay), True
        to_a, to_b = _compute_square(x - ax, y - ay), _compute_square(x - bx, y - by)
        return ((ax, ay) if to_a <= to_b else (bx, by)), False

    def compute_power(self, x: float, y: float) -> float:
        """Return the power of the point (x, y): its squared distance from an arc's centre minus the squared radius.

        The power is computed from the arc's ends a and b, so that a huge radius does not reduce accuracy. With p = (x,
        y) and k = bulge, the power is ``(p - a).(p - b) - cross(b - a, p - a) (1 / k - k) / 2``.
        """
        (ax, ay), (bx, by), bulge = self.edge
        across = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
        return ((x - ax) * (x - bx) + (y - ay) * (y - by)) - across * (0.5 * (1.0 / bulge - bulge))

    def is_under_arc(self, x: float, y: float) -> bool:
        """Whether a point is between an arc and the straight line that connects the arc's ends."""
        if self.centre is None:
            return False
        (ax, ay), (bx, by), bulge = self.edge
        return self.compute_power(x, y) < 0.0 and ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) * bulge < 0.0


@dataclass(frozen=True)
class Outline:
    """The shape of a finite wall, in metres or in the units of a run.

    Attributes:
        points: Points of a chain. The only point of a circle is its centre.
        bulges: Bulge of each edge of a chain.
        half_width: The wall consists of all points within this distance of the line or circle.
        closed: Whether an edge runs from the last point to the first.
        solid: Whether the inside of a closed chain is also part of the wall.
        radius: Radius of a circle; None for a chain.
    """

    points: tuple[Point, ...]
    bulges: tuple[float, ...]
    half_width: float
    closed: bool = False
    solid: bool = False
    radius: float | None = None

    @property
    def description(self) -> str:
        """Short text with the kind and the dimensions of the shape."""
        x, y = self.points[0]
        if self.radius is not None:
            return f"a circle of radius {self.radius:g} m about ({x:g}, {y:g})"
        _, end, bulge = self.edges[0]
        kind = "an arc" if bulge else "a segment"
        return f"a chain whose edge 0 is {kind} from ({x:g}, {y:g}) to ({end[0]:g}, {end[1]:g})"

    @cached_property
    def edges(self) -> tuple[Edge, ...]:
        """The edges of a chain, in order; empty for a circle."""
        ends = (*self.points[1:], *self.points[:1]) if self.closed else self.points[1:]
        return tuple(map(Edge, self.points, ends, self.bulges))

    @cached_property
    def stretches(self) -> tuple[Stretch, ...]:
        """The edges of a chain, or the circle, with their coordinates as floats."""
        if self.radius is not None:
            ((x, y),) = self.points
            start = (x + self.radius, y)
            return (Stretch(Edge(start, start, 1.0), (x, y), self.radius),)
        return tuple(_build_stretch(edge) for edge in self.edges)

    @cached_property
    def lengths(self) -> tuple[float, ...]:
        """Coordinates, radii and widths of the shape, for the choice of a unit of length. Some numbers are negative."""
        arcs = [(*stretch.centre, stretch.radius) for stretch in self.stretches if stretch.centre is not None]
        return (*(c for point in self.points for c in point), self.half_width, *(c for arc in arcs for c in arc))

    @cached_property
    def box(self) -> tuple[Point, Point]:
        """The lower left and the upper right corner of a box that contains the line and everything inside it."""
        points = [*self.points]
        for (cx, cy), radius in ((arc.centre, arc.radius) for arc in self.stretches if arc.centre is not None):
            points += [(cx - radius, cy - radius), (cx + radius, cy + radius)]
        xs, ys = zip(*points, strict=True)
        return (min(xs), min(ys)), (max(xs), max(ys))

    def find_nearest(self, x: float, y: float) -> Foot:
        """Return the point of the line that is nearest to a given point.

        If several points are equally near, a point between the ends of its edge is preferred to a joint. Near a joint,
        rounding can hide that the point on the edge is nearer than the joint.
        """
        feet = [
            (_compute_square(px - x, py - y), not inner, k, px, py)
            for k, ((px, py), inner) in enumerate(stretch.find_nearest(x, y) for stretch in self.stretches)
        ]
        _, is_end, k, px, py = min(feet)
        return Foot(px, py, k, not is_end)

    def find_feet(self, x: float, y: float, distance: float) -> Iterator[Foot]:
        """Yield the nearest point of each edge, for all edges within `distance` of a given point.

        A point that two edges share is yielded once, for the edge with the lower number.
        """
        yielded = set()
        for k, stretch in enumerate(self.stretches):
            place, inner = stretch.find_nearest(x, y)
            if place not in yielded and math.hypot(place[0] - x, place[1] - y) <= distance:
                yielded.add(place)
                yield Foot(*place, k, inner)

    def find_edge(self, x: float, y: float, among: tuple[int, ...]) -> int:
        """Return which edge in `among` is nearest to a point; if several are equally near, the lowest number."""
        places = [(self.stretches[k].find_nearest(x, y)[0], k) for k in among]
        return min((_compute_square(px - x, py - y), k) for (px, py), k in places)[1]

    def compute_gap(self, x: float, y: float, radius: float) -> float:
        """Return the distance between a disc's rim and the wall, which is negative if they overlap."""
        foot = self.find_nearest(x, y)
        return math.sqrt((x - foot.x) ** 2 + (y - foot.y) ** 2) - self.half_width - radius

    def does_enclose(self, x: float, y: float) -> bool:
        """Whether the line is closed and encloses a point, which must not be on the line."""
        if not self.closed:
            return False
        crossings = 0
        for stretch in self.stretches:
            (ax, ay), (bx, by), _ = stretch.edge
            crossings += stretch.is_under_arc(x, y)
            if (ay > y) != (by > y):
                crossings += (bx - ax) * (y - ay) / (by - ay) > x - ax
        return crossings % 2 == 1

    def build_polyline(self, arc_parts: int) -> Iterator[Point]:
        """Yield the points of a line that approximates the wall for drawing. A full circle has `arc_parts` parts."""
        for k, stretch in enumerate(self.stretches):
            (ax, ay), b, bulge = stretch.edge
            if k == 0:
                yield ax, ay
            if stretch.centre is not None:
                cx, cy = stretch.centre
                turn = math.tau if stretch.whole else 4.0 * math.atan(bulge)
                parts, begin = max(1, math.ceil(abs(turn) / math.tau * arc_parts)), math.atan2(ay - cy, ax - cx)
                for part in range(1, parts):
                    angle = begin + turn * part / parts
                    yield cx + stretch.radius * math.cos(angle), cy + stretch.radius * math.sin(angle)
            yield b

    def scale_lengths(self, exponent: int) -> Outline:
        """Return the shape with all lengths divided by ``2**exponent``, which causes no rounding."""
        points = tuple((math.ldexp(x, -exponent), math.ldexp(y, -exponent)) for x, y in self.points)
        radius = None if self.radius is None else math.ldexp(self.radius, -exponent)
        return replace(self, points=points, half_width=math.ldexp(self.half_width, -exponent), radius=radius)


def _compute_square(x: float, y: float) -> float:
    """Return the squared length of a vector.

    Multiplication gives the same bits on every machine, but the power function does not.
    """
    return x * x + y * y


def _build_stretch(edge: Edge) -> Stretch:
    if edge.bulge == 0.0:
        return Stretch(edge)
    circle = compute_circle(edge)
    return Stretch(edge, (float(circle.x), float(circle.y)), _compute_root(circle.radius2))


def _compute_root(square: Fraction) -> float:
    """Return the square root of a rational number as a float. Numerator and denominator may be too large for floats."""
    shift = (square.numerator.bit_length() - square.denominator.bit_length()) // 2
    return math.ldexp(math.sqrt(float(square / Fraction(4) ** shift)), shift)
