"""Obstacles with exact coordinates. An obstacle is a half-plane, or a side or vertex of a finite wall.

All coordinates are rational numbers. A finite wall consists of several obstacles, in the order of
`carom.core.wall_features.build_features`: its straight sides (faces), the sides of its arcs, and its vertices. At each
of its ends, a side continues with a vertex, or at a smooth joint with the next side. At a smooth joint, a disc touches
both sides at the same time.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import NamedTuple

from carom.core.wall_features import (
    Exact,
    JoinedEdges,
    find_stops,
    is_smooth_joint,
    join_edges,
    rotate_by_quarters,
    to_exact,
)
from carom.model.chain_geometry import Outline
from carom.model.scene import Scene
from carom.model.trace import EdgeKind, wall_body

_NOWHERE = Fraction(0)


class Between(NamedTuple):
    """First and last point of the edge to which a straight side belongs."""

    begin: Exact
    end: Exact


class Plane(NamedTuple):
    """A half-plane, or one side of an edge.

    Attributes:
        point: Point on the surface, in metres.
        normal: Vector of any length that points away from the wall.
        stretch: Edge to which the side belongs; None for a half-plane.
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
        stops2: Square of the arc's radius for a stop, a point of an arc that only discs too large for the arc can meet;
            0 for all other shapes.
    """

    centre: Exact
    radius2: Fraction
    inside: bool = False
    sector: Between | None = None
    stops2: Fraction = _NOWHERE


@dataclass(frozen=True, slots=True)
class Obstacle:
    """A part of a wall that a disc can meet: a half-plane, a side of an edge or arc, or a vertex.

    Attributes:
        wall: Number of the wall.
        shape: Shape of the part.
        half_width: The wall consists of all points within this distance of the line in its middle, in metres.
        kind: Kind of the part; None for a half-plane.
        edges: Numbers of the edges to which the part belongs. A vertex has only the lower number.
        neighbours: Body numbers of the obstacles that adjoin this one at its beginning and at its end; None where no
            obstacle adjoins it.
    """

    wall: int
    shape: Plane | Round
    half_width: Fraction = _NOWHERE
    kind: EdgeKind | None = None
    edges: tuple[int, ...] = ()
    neighbours: tuple[int | None, int | None] = (None, None)


def obstacles_of(scene: Scene) -> tuple[Obstacle, ...]:
    """Return all obstacles of a scene, wall by wall. Each half-plane is one obstacle."""
    found: list[Obstacle] = []
    widest = Fraction(float(scene.arrays.radius_m.max(initial=0.0)))
    for k, wall in enumerate(scene.arrays.walls):
        if isinstance(wall, Outline):
            found += _build_outline_obstacles(k, wall, len(found), widest)
        else:
            found.append(Obstacle(k, Plane(to_exact(wall[:2]), to_exact(wall[2:]))))
    return tuple(found)


def subtract(a: Exact, b: Exact) -> Exact:
    """Return the difference of two vectors."""
    return a[0] - b[0], a[1] - b[1]


def dot(a: tuple[float, float] | Exact, b: tuple[float, float] | Exact) -> Fraction:
    """Return the exact inner product of two vectors."""
    return Fraction(a[0]) * Fraction(b[0]) + Fraction(a[1]) * Fraction(b[1])


def _build_outline_obstacles(k: int, outline: Outline, before: int, widest: Fraction) -> list[Obstacle]:
    """Return the obstacles of a finite wall: the sides of its edges, its vertices, and the points of `_build_stop`.

    `before` is the number of obstacles of earlier walls, and `widest` is the largest radius of a disc, in metres.
    """
    runs, thick = join_edges(outline), Fraction(outline.half_width)
    if outline.radius == 0.0:
        return [Obstacle(k, Round(to_exact(outline.points[0]), _NOWHERE), thick, EdgeKind.VERTEX, (0,))]
    sides = [Obstacle(k, *side, run.numbers) for run in runs for side in _build_sides(run, thick)]
    stops = [
        _build_stop(side, side.shape, offset)
        for n, side in enumerate(sides[::2])
        if isinstance(side.shape, Round) and (widest + thick) ** 2 >= side.shape.radius2
        for offset in find_stops(runs, n, closed=outline.closed)
    ]
    if runs[0].edge.a == runs[-1].edge.b and len(runs) == 1:  # a whole circle has no joint
        return [*sides, *stops]
    vertices: list[Obstacle] = []
    joints = [(i - 1, i) for i in range(len(runs))] if outline.closed else [(i, i + 1) for i in range(-1, len(runs))]
    for left, right in joints:
        before_it, after_it = before + 2 * (left % len(runs)), before + 2 * (right % len(runs))
        left_run = runs[left] if left >= 0 or outline.closed else None
        right_run = runs[right] if right < len(runs) else None
        if left_run and right_run and is_smooth_joint(left_run, right_run):
            takers = [(after_it + side, before_it + side) for side in (0, 1)]
        else:
            vertex = before + len(sides) + len(vertices)
            takers = [(vertex, vertex)] * 2
            vertices.append(_build_vertex(k, left_run, right_run, thick))
        for side, (forward, backward) in enumerate(takers):
            if left_run:
                _link_side(sides, before_it - before + side, left_run, 1, wall_body(forward))
            if right_run:
                _link_side(sides, after_it - before + side, right_run, 0, wall_body(backward))
    return [*sides, *vertices, *stops]


def _build_stop(side: Obstacle, arc: Round, offset: Exact) -> Obstacle:
    """Return a point of an arc that stops discs which are too large for the inside of the arc."""
    ((cx, cy), radius2, *_), (_, left, _, right) = arc, rotate_by_quarters(offset)
    shape = Round((cx + offset[0], cy + offset[1]), _NOWHERE, sector=Between(left, right), stops2=radius2)
    return replace(side, shape=shape, neighbours=(None, None))


def _link_side(sides: list[Obstacle], number: int, run: JoinedEdges, end: int, body: int) -> None:
    """Store the obstacle that adjoins a side at an end. On a clockwise arc, beginning and end are exchanged."""
    at_begin, at_end = sides[number].neighbours
    at_the_end = bool(end) == (run.turn >= 0)
    sides[number] = replace(sides[number], neighbours=(at_begin, body) if at_the_end else (body, at_end))


def _build_vertex(k: int, left: JoinedEdges | None, right: JoinedEdges | None, thick: Fraction) -> Obstacle:
    """Return the vertex between two edges. At an end of an open chain, one of the two edges is None."""
    ends = []
    if left:
        ends.append((left.numbers[-1], left.edge.b))
    if right:
        ends.append((right.numbers[0], right.edge.a))
    place, number = ends[0][1], min(number for number, _ in ends)
    return Obstacle(k, Round(to_exact(place), _NOWHERE), thick, EdgeKind.VERTEX, (number,))


def _build_sides(run: JoinedEdges, thick: Fraction) -> Iterator[tuple[Plane | Round, Fraction, EdgeKind]]:
    """Yield the left side and the right side of a series of smoothly joined edges."""
    a, b = to_exact(run.edge.a), to_exact(run.edge.b)
    if run.circle is None:
        ex, ey = subtract(b, a)
        for normal in ((-ey, ex), (ey, -ex)):
            yield Plane(a, normal, Between(a, b)), thick, EdgeKind.FACE
        return
    centre = run.circle.x, run.circle.y
    first, last = (subtract(a, centre), subtract(b, centre))
    sector = None
    if a != b:
        sector = Between(first, last) if run.turn > 0 else Between(last, first)
    for inside in (run.turn > 0, run.turn < 0):
        yield Round(centre, run.circle.radius2, inside, sector), thick, EdgeKind.ARC
