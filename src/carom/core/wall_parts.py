"""Parts of finite walls that a disc can touch, in rational numbers: sides of straight edges and arcs, and vertices.

PIC rounds the parts to features (`carom.core.wall_features`). Certified runs compute with the parts themselves.

Neighbouring edges on the same line, or on the same circle, are joined. A joint has no vertex if the tangents of its two
edges have the same direction. So if a wall is cut into pieces at points exactly on it, its parts stay the same, and
impacts are bit-identical.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import NamedTuple

from carom.model.chain_geometry import Edge, ExactCircle, Outline, compute_circle
from carom.model.trace import EdgeKind

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

_NOWHERE = Fraction(0)


class Between(NamedTuple):
    """Start and end of a side of a wall, in the order in which the free space is to the left."""

    begin: Exact
    end: Exact


class Plane(NamedTuple):
    """A half-plane, or one side of a straight edge.

    Attributes:
        point: Point on the surface, in metres.
        normal: Vector of any length that points away from the wall.
        stretch: The ends of the side; None for a half-plane.
    """

    point: Exact
    normal: Exact
    stretch: Between | None = None


class Round(NamedTuple):
    """A vertex, or one side of an arc or a circle.

    Attributes:
        centre: Centre, in metres.
        radius2: Square of the radius of the line in the middle of the wall, in square metres; 0 for a vertex.
        inside: Whether the side is the inner side of an arc.
        sector: Vectors from the centre to the start and end of the arc, counterclockwise; None for a whole circle.
        stops_of: Inner side of the arc for which this point is a stop (see `_build_stops`); None for all other shapes.
    """

    centre: Exact
    radius2: Fraction = _NOWHERE
    inside: bool = False
    sector: Between | None = None
    stops_of: Round | None = None

    @property
    def is_reflex(self) -> bool:
        """Whether the side is more than half a circle, but not a whole circle."""
        return self.sector is not None and cross(*self.sector) < 0


class WallPart(NamedTuple):
    """A part of a finite wall that a disc can meet. All parts of a wall are numbered in the order of `build_parts`.

    Attributes:
        shape: Shape of the part.
        kind: Kind of the part.
        edges: Numbers of the edges to which the part belongs. For a vertex, only the lower number of its two edges.
        neighbours: Numbers of the parts that adjoin the beginning and the end of a side; empty for a vertex, a stop or
            a whole circle.
        never_met: Numbers of the parts that a disc in contact with a straight side never meets: both sides of its edge,
            and the vertices and stops at its ends.
    """

    shape: Plane | Round
    kind: EdgeKind
    edges: tuple[int, ...]
    neighbours: tuple[int, ...] = ()
    never_met: tuple[int, ...] = ()


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
    def kind(self) -> EdgeKind:
        """Kind of the two sides of the edges."""
        return EdgeKind.FACE if self.circle is None else EdgeKind.ARC

    @property
    def turn(self) -> int:
        """1 for a counterclockwise arc, -1 for a clockwise arc, 0 for a straight edge."""
        return (self.edge.bulge > 0.0) - (self.edge.bulge < 0.0)

    def compute_tangent(self, point: tuple[float, float]) -> Exact:
        """Return the direction of travel along the edges at `point`, which is their start or end."""
        if self.circle is None:
            return subtract(to_exact(self.edge.b), to_exact(self.edge.a))
        x, y = to_exact(point)
        return self.turn * (self.circle.y - y), self.turn * (x - self.circle.x)

    def is_continued_by(self, other: JoinedEdges) -> bool:
        """Whether `other`, which begins where these edges end, continues their line or circle smoothly."""
        return self.circle == other.circle and self.turn == other.turn and self.joins_smoothly(other)

    def joins_smoothly(self, other: JoinedEdges) -> bool:
        """Whether the direction of travel is the same just before and just after the joint with `other`."""
        one, two = self.compute_tangent(self.edge.b), other.compute_tangent(other.edge.a)
        return cross(one, two) == 0 and dot(one, two) > 0

    def join_next(self, other: JoinedEdges) -> JoinedEdges:
        """Return these edges joined with `other`, which continues them smoothly."""
        edge = Edge(self.edge.a, other.edge.b, self.edge.bulge)
        return JoinedEdges(edge, self.circle, (*self.numbers, *other.numbers))


def build_parts(outline: Outline, widest_m: float = math.inf) -> list[WallPart]:
    """Return the parts of a wall.

    The two sides of each edge come first, in the order of the edges, with the left side before the right side.
    Vertices come second, and stops come last. An arc has stops only if a disc of the radius `widest_m` does not fit
    inside.
    """
    if outline.radius == 0.0:
        return [WallPart(Round(to_exact(outline.points[0])), EdgeKind.VERTEX, (0,))]
    runs, closed = _join_edges(outline), outline.closed
    n, is_whole_circle = len(runs), runs[0].edge.a == runs[0].edge.b
    sides, points = list[WallPart](), list[WallPart]()
    vertex_before: dict[int, int] = {}  # number of the vertex before a series of edges; smooth joints have none
    stop_at: dict[Exact, int] = {}
    for k in () if is_whole_circle else (*range(1, n), 0) if closed else range(n + 1):
        ends = [(runs[k - 1].numbers[-1], runs[k - 1].edge.b)] if k > 0 or closed else []
        ends += [(runs[k].numbers[0], runs[k].edge.a)] if k < n else []
        if len(ends) < 2 or not runs[k - 1].joins_smoothly(runs[k]):
            lower = min(number for number, _ in ends)
            vertex_before[k] = 2 * n + len(points)
            points.append(WallPart(Round(to_exact(ends[0][1])), EdgeKind.VERTEX, (lower,)))
    for k, run in enumerate(runs):
        after = (k + 1) % n if closed else k + 1
        is_smooth = k not in vertex_before, after not in vertex_before
        for side, shape in enumerate(_build_sides(run)):
            first, last = vertex_before.get(k, 2 * ((k - 1) % n) + side), vertex_before.get(after, 2 * after + side)
            is_reversed = side == 1 if isinstance(shape, Plane) else run.turn < 0
            neighbours = () if is_whole_circle else (last, first) if is_reversed else (first, last)
            sides.append(WallPart(shape, run.kind, run.numbers, neighbours))
            if isinstance(shape, Round) and shape.inside and find_smallest_unfit(shape, outline.half_width) <= widest_m:
                for stop in _build_stops(run, shape, is_smooth):
                    stop_at[stop.centre] = 2 * n + len(points)
                    points.append(WallPart(stop, EdgeKind.ARC, run.numbers))
    for k, part in enumerate(sides):
        if isinstance(part.shape, Plane):
            vertices = (other for other in part.neighbours if other >= 2 * n)
            stops = (stop_at[end] for end in part.shape.stretch or () if end in stop_at) if stop_at else ()
            sides[k] = part._replace(never_met=(k, k ^ 1, *vertices, *stops))
    return [*sides, *points]


def _join_edges(outline: Outline) -> list[JoinedEdges]:
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


def _build_sides(run: JoinedEdges) -> tuple[Plane | Round, Plane | Round]:
    """Return the left side and the right side of a series of smoothly joined edges."""
    a, b = to_exact(run.edge.a), to_exact(run.edge.b)
    if run.circle is None:
        ex, ey = subtract(b, a)
        return Plane(a, (-ey, ex), Between(a, b)), Plane(a, (ey, -ex), Between(b, a))
    centre = run.circle.x, run.circle.y
    first, last = subtract(a, centre), subtract(b, centre)
    sector = None if a == b else Between(first, last) if run.turn > 0 else Between(last, first)
    left, right = (Round(centre, run.circle.radius2, inside, sector) for inside in (run.turn > 0, run.turn < 0))
    return left, right


def _build_stops(run: JoinedEdges, arc: Round, is_smooth: tuple[bool, bool]) -> list[Round]:
    """Return the stops of an arc: points of the arc that stop discs which are too wide to fit inside.

    A disc with exactly the arc's radius touches the whole arc at once, so a few points can represent the arc. A whole
    circle has four stops, a quarter turn apart. A disc with the arc's radius can't leave an arc of more than half a
    circle. An arc of more than half a circle has two stops, each a quarter turn from one of its ends. Exactly half a
    circle has one stop, in the middle. A disc touches an end of a shorter arc no later than the arc itself. So a
    shorter arc has stops only at ends at which the wall continues smoothly, where rounding may place the point of
    contact outside of the edge.
    """
    first, last = (subtract(to_exact(end), arc.centre) for end in run.edge[:2])
    turn = run.turn * cross(first, last)
    if first == last:
        offsets = _rotate_by_quarters(first)
    elif turn > arc.radius2 * _NEARLY_HALF:
        offsets = [first] * is_smooth[0] + [last] * is_smooth[1]
    else:
        offsets = [_rotate_by_quarters(first)[run.turn]] + [_rotate_by_quarters(last)[-run.turn]] * (turn != 0)
    return [build_stop(arc, offset) for offset in offsets]


def build_stop(arc: Round, offset: Exact) -> Round:
    """Return the stop of an arc at `offset` from its centre."""
    _, left, _, right = _rotate_by_quarters(offset)
    return Round((arc.centre[0] + offset[0], arc.centre[1] + offset[1]), sector=Between(left, right), stops_of=arc)


def _rotate_by_quarters(way: Exact) -> list[Exact]:
    """Return a vector and its rotations by 90, 180 and 270 degrees counterclockwise."""
    x, y = way
    return [(x, y), (-y, x), (-x, -y), (y, -x)]


def find_smallest_unfit(arc: Round, half_width: float) -> float:
    """Return the smallest radius of discs that don't fit into an arc, or fit with less room than floats resolve."""
    radius, (x, y) = compute_root(arc.radius2)[0], map(to_pair, arc.centre)
    return radius - half_width - _PLACES * (abs(x[0]) + abs(y[0]) + radius)


def are_decidable(one: Plane | Round, other: Plane | Round, *, elastic: bool) -> bool:
    """Whether two simultaneous impacts of a disc on parts without friction have the same result in both orders.

    The result is True for two straight sides at an angle of 90 degrees. If both sides are elastic, the result is also
    True at 60, 45 and 30 degrees. The orders have the same result at all angles pi/n, but only these angles have
    rational squared cosines, which can be tested exactly. If both parts are the same part, the result is True, because
    a disc meets a part again only after it has left it.
    """
    if one == other:
        return True
    if isinstance(one, Round) or isinstance(other, Round):
        return False
    product = dot(one.normal, other.normal)
    if product == 0:
        return True
    square = product * product / (dot(one.normal, one.normal) * dot(other.normal, other.normal))
    return elastic and product < 0 and square in (Fraction(1, 4), Fraction(1, 2), Fraction(3, 4))


def to_exact(point: tuple[float, float]) -> Exact:
    """Return a point as rational numbers."""
    return Fraction(point[0]), Fraction(point[1])


def subtract(a: Exact, b: Exact) -> Exact:
    """Return the difference of two vectors."""
    return a[0] - b[0], a[1] - b[1]


def dot(a: Exact, b: Exact) -> Fraction:
    """Return the inner product of two vectors."""
    return a[0] * b[0] + a[1] * b[1]


def cross(a: Exact, b: Exact) -> Fraction:
    """Return the cross product of two vectors. The product is positive if b points to the left of a."""
    return a[0] * b[1] - a[1] * b[0]


def to_pair(number: Fraction) -> Pair:
    """Return the pair of floats nearest to a rational number. The relative error is at most 2^-106."""
    high = float(number)
    if high.as_integer_ratio() == number.as_integer_ratio():
        return high, 0.0
    return high, float(number - Fraction(high))


def compute_root(square: Fraction) -> Pair:
    """Return the pair of floats nearest to the square root of a rational number, which is 0 or more."""
    if square == 0:
        return 0.0, 0.0
    # The root of square * 4^shift has about _ROOT_BITS bits before the binary point.
    shift = _ROOT_BITS - (square.numerator.bit_length() - square.denominator.bit_length()) // 2
    return to_pair(Fraction(math.isqrt(math.floor(square * Fraction(4) ** shift))) / Fraction(2) ** shift)
