"""The features of a wall's outline: its faces, arcs and vertices, merged exactly.

Neighbouring edges that go on in one line, or on one circle, are one feature, and a joint at which tangents agree has no
vertex: so a wall that is cut into pieces, at points that are exactly on it, has the same features, and no impact on it
differs by a bit. All of this is decided by rational numbers, to which no rounding is done.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import NamedTuple

from carom.outline import Edge, ExactCircle, Outline, circle_of
from carom.physics.features import Arc, Face, Feature
from carom.trace import EdgeKind

Exact = tuple[Fraction, Fraction]


class WallFeature(NamedTuple):
    """A feature of a wall, and which edges of the file it is made of.

    Attributes:
        feature: The feature.
        edges: Numbers of its edges; of a vertex that of the lower edge.
        kind: Whether it is a face, a vertex or an arc.
    """

    feature: Feature
    edges: tuple[int, ...]
    kind: EdgeKind


class JoinedEdges(NamedTuple):
    """Edges that are one: straight, or on one circle and in one direction.

    Attributes:
        edge: From the first point to the last, with the bulge of the first.
        circle: What an arc is on; None of a straight one.
        numbers: Of the edges of the file.
    """

    edge: Edge
    circle: ExactCircle | None
    numbers: tuple[int, ...]

    @property
    def turn(self) -> int:
        """1 for an arc that runs counterclockwise, -1 for one that runs clockwise, 0 for a straight edge."""
        return (self.edge.bulge > 0.0) - (self.edge.bulge < 0.0)

    def tangent(self, point: tuple[float, float]) -> Exact:
        """Return the direction of the way at one of its ends."""
        if self.circle is None:
            a, b = exact(self.edge.a), exact(self.edge.b)
            return b[0] - a[0], b[1] - a[1]
        x, y = exact(point)
        return self.turn * (self.circle.y - y), self.turn * (x - self.circle.x)

    def goes_on_as(self, other: JoinedEdges) -> bool:
        """Whether another, which begins where this ends, is of the same line or circle, and goes on in its way."""
        return self.circle == other.circle and self.turn == other.turn and goes_smoothly(self, other)

    def with_next(self, other: JoinedEdges) -> JoinedEdges:
        """Return this and one that it goes on as, as one."""
        edge = Edge(self.edge.a, other.edge.b, self.edge.bulge)
        return JoinedEdges(edge, self.circle, (*self.numbers, *other.numbers))


def features_of(outline: Outline) -> tuple[WallFeature, ...]:
    """Return the features of a wall, both sides of each edge, in the order in which they are met at one instant.

    Faces and arcs come in the order of the edges, vertices after them: where a face ends, it is met no later than the
    vertex there, and its normal is the one to be taken.
    """
    if outline.radius is not None:
        kind = EdgeKind.ARC if outline.radius else EdgeKind.VERTEX
        return tuple(
            WallFeature(Arc.of_circle(outline.points[0], outline.radius, outline.half_width, inside=inside), (0,), kind)
            for inside in ((True, False) if outline.radius else (False,))
        )
    runs = runs_of(outline)
    sides = [one for run in runs for one in _sides(run, outline.half_width)]
    return (*sides, *_vertices(runs, outline))


def are_decidable(one: Feature, other: Feature, *, elastic: bool) -> bool:
    """Whether a disc that meets two smooth features at one instant goes on in the same way, whichever comes first.

    So it is at a corner of 90 degrees, and, if both are elastic, of 60, 45 and 30 degrees (that of pi/n in general, of
    which these have cosines whose squares are rational); and of a feature with itself, which is met again only after
    it was left.
    """
    if one == other:
        return True
    if not isinstance(one, Face) or not isinstance(other, Face):
        return False
    (ax, ay), (bx, by) = _along(one), _along(other)
    dot = ax * bx + ay * by  # of the normals, too, which are the ways turned by a quarter
    if dot == 0:
        return True
    square = dot * dot / ((ax * ax + ay * ay) * (bx * bx + by * by))
    return elastic and dot < 0 and square in (Fraction(1, 4), Fraction(1, 2), Fraction(3, 4))


def _along(face: Face) -> Exact:
    (x, x_rest), (y, y_rest) = face.along
    return Fraction(x) + Fraction(x_rest), Fraction(y) + Fraction(y_rest)


def exact(point: tuple[float, float]) -> Exact:
    """Return a point as rational numbers."""
    return Fraction(point[0]), Fraction(point[1])


def goes_smoothly(one: JoinedEdges, other: JoinedEdges) -> bool:
    """Whether the way goes on in the same direction at the joint of one run and the next."""
    (ax, ay), (bx, by) = one.tangent(one.edge.b), other.tangent(other.edge.a)
    return ax * by - ay * bx == 0 and ax * bx + ay * by > 0


def runs_of(outline: Outline) -> list[JoinedEdges]:
    """Return the edges of a chain in order, those that go on in one line or on one circle as one."""
    runs: list[JoinedEdges] = []
    for number, edge in enumerate(outline.edges):
        run = JoinedEdges(edge, circle_of(edge) if edge.bulge else None, (number,))
        if runs and runs[-1].goes_on_as(run):
            runs[-1] = runs[-1].with_next(run)
        else:
            runs.append(run)
    if outline.closed and len(runs) > 1 and runs[-1].goes_on_as(runs[0]):
        runs[0] = runs.pop().with_next(runs[0])
    return runs


def _sides(run: JoinedEdges, half_width: float) -> Iterator[WallFeature]:
    a, b, _ = run.edge
    if run.circle is None:
        yield WallFeature(Face.between(a, b, half_width), run.numbers, EdgeKind.FACE)
        yield WallFeature(Face.between(b, a, half_width), run.numbers, EdgeKind.FACE)
        return
    # The sector runs counterclockwise; of a whole circle there is none.
    ends = None if a == b else (a, b) if run.turn > 0 else (b, a)
    for inside in (True, False):
        arc = Arc.on(run.circle, ends, half_width, inside=inside)
        yield WallFeature(arc, run.numbers, EdgeKind.ARC)


def _vertices(runs: list[JoinedEdges], outline: Outline) -> Iterator[WallFeature]:
    if not outline.closed:
        yield WallFeature(Arc.vertex(runs[0].edge.a, outline.half_width), runs[0].numbers[:1], EdgeKind.VERTEX)
    joints = zip(runs, (*runs[1:], runs[0]) if outline.closed else runs[1:], strict=outline.closed)
    for before, after in joints:
        if before.edge.a != before.edge.b and not goes_smoothly(before, after):
            lower = min(before.numbers[-1], after.numbers[0])
            yield WallFeature(Arc.vertex(after.edge.a, outline.half_width), (lower,), EdgeKind.VERTEX)
    if not outline.closed:
        yield WallFeature(Arc.vertex(runs[-1].edge.b, outline.half_width), runs[-1].numbers[-1:], EdgeKind.VERTEX)
