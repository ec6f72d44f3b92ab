"""Features of finite walls, which are the parts that a disc can touch: straight faces, vertices, and sides of arcs.

A wall consists of all points whose distance from a line of straight edges and arcs is at most a half width. A disc
touches the wall when the distance of its centre from that line is the half width plus the disc's radius. The centres of
discs that touch a face form a straight line. The centres of discs that touch a vertex, or one side of an arc, form a
circle. So a vertex is represented as a circle of radius 0. A disc meets a feature when the disc's rim touches it.

Features are immutable. A feature contains all numbers from which times of impact are computed. A number with more
digits than a float is stored as a pair ``(high, low)`` of floats, whose sum is nearest to the number: see
`core/arithmetic/double_double.h`.

Neighbouring edges on the same line, or on the same circle, are one feature. A joint has no vertex if the tangents of
its two edges have the same direction. So if a wall is cut into pieces at points exactly on it, its features stay the
same, and impacts are bit-identical. All decisions use rational numbers, so nothing is rounded.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

from carom.core import primitives
from carom.model.chain_geometry import Edge, ExactCircle, Outline, compute_circle
from carom.model.trace import EdgeKind

Point = tuple[float, float]
Pair = tuple[float, float]
Exact = tuple[Fraction, Fraction]

#: Number of bits to which square roots are computed. The roots are then rounded to pairs of floats, which have 106
#: bits.
_ROOT_BITS = 160

#: A disc fits inside a circle if the circle's radius exceeds the disc's radius by at least this fraction of the
#: circle's coordinates. The disc's centre then has at least four to eight different float coordinates in each
#: direction. With fewer coordinates, normals would consist of rounding errors.
_PLACES = 2.0**-50

#: Sine of a small angle. An arc that is shorter than half a circle by at most this angle is assumed to be half a circle
#: with rounded coordinates. A disc as wide as the half circle passes between the ends of the half circle.
_NEARLY_HALF = Fraction(1, 2**20)


class Mover(NamedTuple):
    """A disc relative to a wall, which may be driven.

    Attributes:
        x: First coordinate of the disc's centre, in metres.
        y: Second coordinate of the centre, in metres.
        ux: First component of the disc's velocity relative to the wall, in m/s.
        uy: Second component of this velocity, in m/s.
        radius: Radius of the disc, in metres.
    """

    x: Pair
    y: Pair
    ux: Pair
    uy: Pair
    radius: float

    @classmethod
    def at(cls, position: Point, velocity: Point, radius: float, wall_velocity: Point = (0.0, 0.0)) -> Mover:
        """Return a disc relative to a wall that has `wall_velocity` and is now at its place in the scene file."""
        ux, uy = primitives.two_diff(velocity[0], wall_velocity[0]), primitives.two_diff(velocity[1], wall_velocity[1])
        return cls((position[0], 0.0), (position[1], 0.0), ux, uy, radius)


@dataclass(frozen=True, slots=True)
class Face:
    """The left side of a straight edge, as seen from its start a towards its end b.

    Attributes:
        a: Start of the edge, in metres.
        b: End of the edge, in metres.
        half_width: Half width of the wall, in metres. All points within this distance of the edge belong to the wall.
        along: The two components of ``b - a``, exactly.
        length: Length of the edge, in metres.
        normal: Unit vector to the free side, rounded to the nearest floats.
    """

    a: Point
    b: Point
    half_width: float
    along: tuple[Pair, Pair]
    length: Pair
    normal: Point

    @classmethod
    def between(cls, a: Point, b: Point, half_width: float = 0.0) -> Face:
        """Return the left side of an edge from a to b. The two points must differ."""
        along = primitives.two_diff(b[0], a[0]), primitives.two_diff(b[1], a[1])
        ex, ey = (Fraction(high) + Fraction(low) for high, low in along)
        length2 = ex * ex + ey * ey
        normal = _compute_nearest_root(-ey, length2), _compute_nearest_root(ex, length2)
        return cls(a, b, half_width, along, compute_root(length2), normal)


@dataclass(frozen=True, slots=True)
class Sector:
    """The directions from an arc's centre to its points: counterclockwise from `first` to `last`.

    Attributes:
        first: Vector from the centre to the start of the arc, in metres; two components.
        last: Vector from the centre to the end of the arc, in metres; two components.
        reflex: Whether the arc is more than half of its circle.
    """

    first: tuple[Pair, Pair]
    last: tuple[Pair, Pair]
    reflex: bool


@dataclass(frozen=True, slots=True)
class Arc:
    """A vertex, or one side of an arc or of a whole circle.

    Attributes:
        centre: The two coordinates of the circle's centre, in metres.
        radius: Radius of the circle, in metres; 0 for a vertex.
        half_width: Half width of the wall, in metres. All points within this distance of the arc belong to the wall.
        inside: Whether the circle's centre is on this side.
        sector: Directions of the arc's points from the centre; None for a whole circle.
        fits_below: Smallest radius of discs that do not fit inside, in metres. Discs of this radius or more meet the
            stops of the arc (see `find_stops`) instead of its inner side.
    """

    centre: tuple[Pair, Pair]
    radius: Pair
    half_width: float
    inside: bool
    sector: Sector | None
    fits_below: float = 0.0

    @classmethod
    def vertex(cls, at: Point, half_width: float = 0.0) -> Arc:
        """Return a vertex: an end of a line, or a joint with a corner. Discs can meet a vertex from all sides."""
        return cls(((at[0], 0.0), (at[1], 0.0)), (0.0, 0.0), half_width, inside=False, sector=None)

    @property
    def is_vertex(self) -> bool:
        """Whether this is a vertex, which is a single point."""
        return self.radius[0] == 0.0

    @classmethod
    def on(
        cls, circle: ExactCircle, ends: tuple[Point, Point] | None = None, half_width: float = 0.0, *, inside: bool
    ) -> Arc:
        """Return one side of a circle, or of its arc that runs counterclockwise from `ends[0]` to `ends[1]`."""
        sector = None if ends is None else _build_sector(circle, *ends)
        place, size = (to_pair(circle.x), to_pair(circle.y)), compute_root(circle.radius2)
        return cls(
            place, size, half_width, inside, sector, _compute_smallest_unfit(place, size, half_width) if inside else 0.0
        )

    def build_stop(self, circle: ExactCircle, way: tuple[Fraction, Fraction]) -> Arc:
        """Return a stop of this inner side, at the offset `way` from the centre, for discs too wide to fit inside."""
        (x, y), nothing = way, (0.0, 0.0)
        half = Sector((to_pair(-y), to_pair(x)), (to_pair(y), to_pair(-x)), reflex=False)
        place = to_pair(circle.x + x), to_pair(circle.y + y)
        return Arc(place, nothing, self.half_width, inside=False, sector=half, fits_below=self.fits_below)


Feature = Face | Arc


def to_pair(number: Fraction) -> Pair:
    """Return the pair of floats nearest to a rational number. The relative error is at most 2^-106."""
    high = float(number)
    return high, float(number - Fraction(high))


def compute_root(square: Fraction) -> Pair:
    """Return the pair of floats nearest to the square root of a rational number, which is 0 or more."""
    if square == 0:
        return 0.0, 0.0
    # The root of square * 4^shift has about _ROOT_BITS bits before the binary point.
    shift = _ROOT_BITS - (square.numerator.bit_length() - square.denominator.bit_length()) // 2
    return to_pair(Fraction(math.isqrt(math.floor(square * Fraction(4) ** shift))) / Fraction(2) ** shift)


def _compute_smallest_unfit(centre: tuple[Pair, Pair], radius: Pair, half_width: float) -> float:
    """Return the smallest radius of discs that don't fit into a circle, or seem to fit only because of rounding."""
    return radius[0] - half_width - _PLACES * (abs(centre[0][0]) + abs(centre[1][0]) + radius[0])


def _compute_nearest_root(part: Fraction, square: Fraction) -> float:
    """Return ``part / sqrt(square)``, rounded to the nearest float."""
    return math.copysign(compute_root(part * part / square)[0], part)


def _build_sector(circle: ExactCircle, a: Point, b: Point) -> Sector:
    first, last = ((Fraction(x) - circle.x, Fraction(y) - circle.y) for x, y in (a, b))
    turn = first[0] * last[1] - first[1] * last[0]
    return Sector((to_pair(first[0]), to_pair(first[1])), (to_pair(last[0]), to_pair(last[1])), turn < 0)


class WallFeature(NamedTuple):
    """A feature of a wall, and the edges of the scene file from which it is built.

    Attributes:
        feature: The feature.
        edges: Numbers of the edges. A vertex has only the lower number of its two edges.
        kind: Kind of the feature: face, vertex or arc.
    """

    feature: Feature
    edges: tuple[int, ...]
    kind: EdgeKind


class JoinedEdges(NamedTuple):
    """Neighbouring edges joined into one: straight edges on one line, or arcs on one circle in one direction.

    Attributes:
        edge: Edge from the first point to the last, with the bulge of the first edge.
        circle: Circle of joined arcs; None for straight edges.
        numbers: Numbers of the edges in the scene file.
    """

    edge: Edge
    circle: ExactCircle | None
    numbers: tuple[int, ...]

    @property
    def turn(self) -> int:
        """1 for a counterclockwise arc, -1 for a clockwise arc, 0 for a straight edge."""
        return (self.edge.bulge > 0.0) - (self.edge.bulge < 0.0)

    def compute_tangent(self, point: tuple[float, float]) -> Exact:
        """Return the direction of travel along the edges at `point`, which is their start or end."""
        if self.circle is None:
            a, b = to_exact(self.edge.a), to_exact(self.edge.b)
            return b[0] - a[0], b[1] - a[1]
        x, y = to_exact(point)
        return self.turn * (self.circle.y - y), self.turn * (x - self.circle.x)

    def is_continued_by(self, other: JoinedEdges) -> bool:
        """Whether `other`, which begins where these edges end, continues their line or circle smoothly."""
        return self.circle == other.circle and self.turn == other.turn and is_smooth_joint(self, other)

    def join_next(self, other: JoinedEdges) -> JoinedEdges:
        """Return these edges joined with `other`, which continues them smoothly."""
        edge = Edge(self.edge.a, other.edge.b, self.edge.bulge)
        return JoinedEdges(edge, self.circle, (*self.numbers, *other.numbers))


def build_features(outline: Outline, widest_m: float = math.inf) -> tuple[WallFeature, ...]:
    """Return the features of a wall, on both sides of each edge.

    Where a disc meets two features at once, it hits the first of them. Faces and arcs come first, in the order of the
    edges. Then come vertices. Where a vertex adjoins a face, a disc meets the face at the same time or earlier. So the
    impact is on the face, which has the correct normal. Stops come last. An arc has stops only if a disc of the radius
    `widest_m` does not fit inside: see `find_stops`.
    """
    if outline.radius == 0.0:
        return (WallFeature(Arc.vertex(outline.points[0], outline.half_width), (0,), EdgeKind.VERTEX),)
    runs, sides, stops = join_edges(outline), list[WallFeature](), list[WallFeature]()
    for k, run in enumerate(runs):
        sides += _build_sides(run, outline.half_width)
        inner = sides[-2]
        if run.circle is not None and isinstance(inner.feature, Arc) and inner.feature.fits_below <= widest_m:
            offsets = find_stops(runs, k, closed=outline.closed)
            stops += (inner._replace(feature=inner.feature.build_stop(run.circle, offset)) for offset in offsets)
    return (*sides, *_build_vertices(runs, outline), *stops)


def are_decidable(one: Feature, other: Feature, *, elastic: bool) -> bool:
    """Whether two simultaneous impacts of a disc on features without friction have the same result in both orders.

    The result is True for two faces at an angle of 90 degrees. If both faces are elastic, the result is also True at
    60, 45 and 30 degrees. The orders have the same result at all angles pi/n, but only these angles have rational
    squared cosines, which can be tested exactly. For two impacts on the same feature the result is True, because the
    second impact can occur only after the disc has left the feature.
    """
    if one == other:
        return True
    if not isinstance(one, Face) or not isinstance(other, Face):
        return False
    (ax, ay), (bx, by) = _compute_direction(one), _compute_direction(other)
    dot = ax * bx + ay * by  # this is also the inner product of the normals: directions turned by 90 degrees
    if dot == 0:
        return True
    square = dot * dot / ((ax * ax + ay * ay) * (bx * bx + by * by))
    return elastic and dot < 0 and square in (Fraction(1, 4), Fraction(1, 2), Fraction(3, 4))


def _compute_direction(face: Face) -> Exact:
    (x, x_rest), (y, y_rest) = face.along
    return Fraction(x) + Fraction(x_rest), Fraction(y) + Fraction(y_rest)


def to_exact(point: tuple[float, float]) -> Exact:
    """Return a point as rational numbers."""
    return Fraction(point[0]), Fraction(point[1])


def is_smooth_joint(one: JoinedEdges, other: JoinedEdges) -> bool:
    """Whether the direction of the line is the same just before and just after the joint of two series of edges."""
    (ax, ay), (bx, by) = one.compute_tangent(one.edge.b), other.compute_tangent(other.edge.a)
    return ax * by - ay * bx == 0 and ax * bx + ay * by > 0


def join_edges(outline: Outline) -> list[JoinedEdges]:
    """Return the edges of a chain in order. Successive edges on one line or circle are joined. A circle is one edge."""
    if outline.radius is not None:
        (x, y), radius = to_exact(outline.points[0]), Fraction(outline.radius)
        return [JoinedEdges(outline.stretches[0].edge, ExactCircle(x, y, radius * radius), (0,))]
    runs: list[JoinedEdges] = []
    for number, edge in enumerate(outline.edges):
        run = JoinedEdges(edge, compute_circle(edge) if edge.bulge else None, (number,))
        if runs and runs[-1].is_continued_by(run):
            runs[-1] = runs[-1].join_next(run)
        else:
            runs.append(run)
    if outline.closed and len(runs) > 1 and runs[-1].is_continued_by(runs[0]):
        runs[0] = runs.pop().join_next(runs[0])
    return runs


def _build_sides(run: JoinedEdges, half_width: float) -> Iterator[WallFeature]:
    a, b, _ = run.edge
    if run.circle is None:
        yield WallFeature(Face.between(a, b, half_width), run.numbers, EdgeKind.FACE)
        yield WallFeature(Face.between(b, a, half_width), run.numbers, EdgeKind.FACE)
        return
    # A sector runs counterclockwise. A whole circle has no sector.
    ends = None if a == b else (a, b) if run.turn > 0 else (b, a)
    for inside in (True, False):
        arc = Arc.on(run.circle, ends, half_width, inside=inside)
        yield WallFeature(arc, run.numbers, EdgeKind.ARC)


def _build_vertices(runs: list[JoinedEdges], outline: Outline) -> Iterator[WallFeature]:
    if outline.radius is not None:
        return
    if not outline.closed:
        yield WallFeature(Arc.vertex(runs[0].edge.a, outline.half_width), runs[0].numbers[:1], EdgeKind.VERTEX)
    joints = zip(runs, (*runs[1:], runs[0]) if outline.closed else runs[1:], strict=outline.closed)
    for before, after in joints:
        if before.edge.a != before.edge.b and not is_smooth_joint(before, after):
            lower = min(before.numbers[-1], after.numbers[0])
            yield WallFeature(Arc.vertex(after.edge.a, outline.half_width), (lower,), EdgeKind.VERTEX)
    if not outline.closed:
        yield WallFeature(Arc.vertex(runs[-1].edge.b, outline.half_width), runs[-1].numbers[-1:], EdgeKind.VERTEX)


def rotate_by_quarters(way: Exact) -> list[Exact]:
    """Return a vector and its rotations by 90, 180 and 270 degrees counterclockwise."""
    x, y = way
    return [(x, y), (-y, x), (-x, -y), (y, -x)]


def find_stops(runs: list[JoinedEdges], k: int, *, closed: bool) -> list[Exact]:
    """Return the vectors from an arc's centre to its stops: points that stop discs which are too wide to fit inside.

    A disc with exactly the arc's radius touches the whole arc at once, so a few points can represent the arc. A whole
    circle has four stops, a quarter turn apart. A disc with the arc's radius can't leave an arc of more than half a
    circle. Such an arc has two stops, each a quarter turn from one of its ends. Exactly half a circle has one stop, in
    the middle. In a shorter arc, the disc touches an end of the arc first, or the end and the whole arc together. So a
    shorter arc has stops only at ends at which the wall continues smoothly, where rounding may place the point of
    contact outside of the edge.
    """
    run = runs[k]
    if run.circle is None:
        return []
    first, last = ((x - run.circle.x, y - run.circle.y) for x, y in map(to_exact, run.edge[:2]))
    turn = run.turn * (first[0] * last[1] - first[1] * last[0])
    if run.edge.a == run.edge.b:
        return rotate_by_quarters(first)
    if turn > run.circle.radius2 * _NEARLY_HALF:
        smooth_first = (closed or k > 0) and is_smooth_joint(runs[k - 1], run)
        smooth_last = (closed or k + 1 < len(runs)) and is_smooth_joint(run, runs[(k + 1) % len(runs)])
        return [first] * smooth_first + [last] * smooth_last
    return [rotate_by_quarters(first)[run.turn]] + [rotate_by_quarters(last)[-run.turn]] * (turn != 0)
