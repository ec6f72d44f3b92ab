"""Parts of walls, compared with points and directions that are computed from the drawing of each wall alone."""

import math

import pytest
from tests.cases import each
from tests.scene_builders import require_value

from carom.core.wall_parts import Exact, Plane, Round, WallPart, build_parts, cross, dot, subtract, to_exact
from carom.model.chain_geometry import Edge, Outline
from carom.model.trace import EdgeKind

#: Sine of an angle that is too large for a rounding error.
TURNED = 1e-6

SQUARE = ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0))
BENT = ((0.0, 0.0), (2.0, 0.0), (4.0, 0.0), (6.0, 3.0), (6.0, 7.0))
WALLS = [
    pytest.param(Outline(SQUARE, (0.0,) * 4, 0.25, True), id="square"),
    pytest.param(Outline(SQUARE[::-1], (0.0,) * 4, 0.25, True), id="clockwise square"),
    pytest.param(Outline(((2.0, 0.0), *SQUARE[1:], SQUARE[0]), (0.0,) * 5, 0.0, True), id="start inside a side"),
    pytest.param(Outline(SQUARE, (0.0, 1.0, 0.0, 1.0), 0.0, True), id="stadium"),
    pytest.param(Outline(SQUARE, (0.0, -0.5, 0.0, 0.25), 0.0, True), id="arcs of both directions"),
    pytest.param(Outline(SQUARE[::-1], (-1.0, 0.0, -1.0, 0.0), 0.0, True), id="clockwise stadium"),
    pytest.param(Outline(BENT, (0.0, 0.0, 0.5, 0.0), 0.0, False), id="open chain"),
    pytest.param(Outline(((-7.0, 1.0), (-4.0, -3.0), (4.0, -3.0)), (0.0, 0.5), 0.0, False), id="smooth end"),
    pytest.param(Outline(BENT, (0.0, 0.0, -2.0, 0.0), 0.0, False), id="open chain with a clockwise arc"),
    pytest.param(Outline(BENT[:3], (1.0, -1.0), 0.0, False), id="smooth joint of two arcs"),
    pytest.param(Outline(BENT[:3], (1.0, 1.0), 0.0, False), id="cusp"),
]


def list_edges(outline: Outline) -> list[Edge]:
    """Return the edges of a chain, from its points."""
    ends = (*outline.points[1:], outline.points[0])
    return [Edge(*edge) for edge in zip(outline.points, ends, outline.bulges, strict=False)]


def compute_direction(edge: Edge, *, at_end: bool) -> tuple[float, float]:
    """Return the unit vector along an edge at one of its ends: the chord, turned by half the angle of the arc."""
    (ax, ay), (bx, by), bulge = edge
    angle = math.atan2(by - ay, bx - ax) + (2.0 if at_end else -2.0) * math.atan(bulge)
    return math.cos(angle), math.sin(angle)


def list_corners(outline: Outline) -> set[tuple[float, float]]:
    """Return the ends of an open chain, and all points at which the direction changes."""
    edges = list_edges(outline)
    corners = set() if outline.closed else {edges[0].a, edges[-1].b}
    for before, after in zip(edges, (*edges[1:], edges[0]) if outline.closed else edges[1:], strict=False):
        (ux, uy), (vx, vy) = compute_direction(before, at_end=True), compute_direction(after, at_end=False)
        if abs(ux * vy - uy * vx) > TURNED or ux * vx + uy * vy < 0.0:
            corners.add(after.a)
    return corners


def lies_in_front(part: WallPart, point: Exact) -> bool:
    """Return whether a point is on the free side of a side, opposite one of the side's points."""
    if isinstance(part.shape, Plane):
        begin, end = require_value(part.shape.stretch)
        along = subtract(end, begin)
        is_opposite = 0 < dot(subtract(point, begin), along) < dot(along, along)
        return is_opposite and cross(along, subtract(point, begin)) > 0 < dot(part.shape.normal, subtract(point, begin))
    away = subtract(point, part.shape.centre)
    begin, end = part.shape.sector or (away, away)
    is_left, is_right = cross(begin, away) >= 0, cross(away, end) >= 0
    is_opposite = (is_left and is_right) if cross(begin, end) >= 0 else (is_left or is_right)
    return is_opposite and part.shape.inside == (dot(away, away) < part.shape.radius2)


def list_ends(part: WallPart) -> list[Exact]:
    """Return the points at which a side begins and ends."""
    if isinstance(part.shape, Plane):
        return list(part.shape.stretch or ())
    x, y = part.shape.centre
    return [(x + dx, y + dy) for dx, dy in part.shape.sector or ()]


@each("outline", WALLS)
def test_left_side_of_each_edge_comes_before_its_right_side(outline: Outline) -> None:
    """Left of the middle of an edge is in front of the edge's first side, and right of it in front of the second."""
    parts = build_parts(outline, 0.0)
    for number, ((ax, ay), (bx, by), bulge) in enumerate(list_edges(outline)):
        dx, dy = bx - ax, by - ay
        x, y = (ax + bx + bulge * dy) / 2, (ay + by - bulge * dx) / 2  # an arc to the left runs right of its chord
        own = [k for k, part in enumerate(parts) if number in part.edges and part.kind is not EdgeKind.VERTEX]
        assert own == [own[0], own[0] + 1]
        for k, side in zip(own, (1 / 1024, -1 / 1024), strict=True):
            point = to_exact((x - side * dy, y + side * dx))
            assert lies_in_front(parts[k], point)
            assert not lies_in_front(parts[k ^ 1], point)


@each("outline", WALLS)
def test_vertices_are_at_ends_and_corners(outline: Outline) -> None:
    """A wall has one vertex at each of its ends and corners, cusps included, and none at smooth joints."""
    vertices = [part.shape for part in build_parts(outline) if part.kind is EdgeKind.VERTEX]
    places = [vertex.centre for vertex in vertices if isinstance(vertex, Round)]
    assert sorted(places) == sorted(map(to_exact, list_corners(outline)))


@each("outline", WALLS)
def test_neighbours_of_a_side_touch_its_ends(outline: Outline) -> None:
    """The neighbours of a side are the vertices at its ends, or the next sides on the same side of the wall."""
    parts, corners = build_parts(outline, 0.0), set(map(to_exact, list_corners(outline)))
    for k, part in enumerate(parts):
        for place, number in zip(list_ends(part), part.neighbours, strict=bool(part.neighbours)):
            shape = parts[number].shape
            if place in corners:
                assert shape == Round(place)
            else:
                assert number % 2 == k % 2
                assert place in list_ends(parts[number])


@each("outline", WALLS)
def test_disc_on_a_straight_side_never_meets_what_touches_its_ends(outline: Outline) -> None:
    """A disc on a straight side never meets the two sides of this edge, and the vertices and stops at its ends."""
    parts = build_parts(outline)
    for k, part in enumerate(parts):
        near = {
            number
            for number, other in enumerate(parts)
            if isinstance(other.shape, Round) and other.shape.radius2 == 0 and other.shape.centre in list_ends(part)
        }
        assert set(part.never_met) == (near | {k, k ^ 1} if isinstance(part.shape, Plane) else set())


CIRCLE = Outline(((0.0, 0.0),), (), 1.0, radius=5.0)


def build_arc(a: tuple[float, float], b: tuple[float, float], bulge: float) -> Outline:
    """Return a wall of one arc, with the half width 1."""
    return Outline((a, b), (bulge,), 1.0)


@each(
    "outline, places",
    [
        pytest.param(CIRCLE, [(5, 0), (0, 5), (-5, 0), (0, -5)], id="circle"),
        pytest.param(build_arc((-5.0, 0.0), (5.0, 0.0), 1.0), [(0, -5)], id="half circle"),
        pytest.param(build_arc((5.0, 0.0), (-5.0, 0.0), -1.0), [(0, -5)], id="clockwise half circle"),
        pytest.param(build_arc((-4.0, 3.0), (4.0, 3.0), 2.0), [(-3, -4), (3, -4)], id="more than half a circle"),
        pytest.param(build_arc((4.0, 3.0), (-4.0, 3.0), -2.0), [(-3, -4), (3, -4)], id="clockwise"),
        pytest.param(build_arc((-4.0, -3.0), (4.0, -3.0), 0.5), [], id="less than half a circle"),
    ],
)
def test_stops_hold_a_disc_that_does_not_fit_into_an_arc(outline: Outline, places: list[tuple[float, float]]) -> None:
    """A circle has four stops, half a circle has one in the middle, and a longer arc a quarter turn from each end."""
    # The inner side of the wall has the radius 4. If a disc is smaller by one ulp, it has too little room for floats.
    for widest_m in (4.5, math.nextafter(4.0, 0.0)):
        assert list_stops(outline, widest_m) == set(map(to_exact, places))
    assert list_stops(outline, 3.5) == set()


@each("first, last", [(False, False), (True, False), (False, True), (True, True)])
@each("bulge", [0.5, -0.5])
def test_short_arc_has_stops_at_smooth_ends(bulge: float, *, first: bool, last: bool) -> None:
    """An arc of less than half a circle has a stop at each end at which a straight side continues it."""
    # A bulge of 1/2 turns the chord by an angle with the tangent 4/3 at each end.
    y = -3.0 + math.copysign(4.0, bulge)
    points = [*[(-7.0, y)] * first, (-4.0, -3.0), (4.0, -3.0), *[(7.0, y)] * last]
    outline = Outline(tuple(points), (*[0.0] * first, bulge, *[0.0] * last), 0.0)
    assert list_stops(outline, 5.0) == set(map(to_exact, [*[(-4.0, -3.0)] * first, *[(4.0, -3.0)] * last]))


def list_stops(outline: Outline, widest_m: float) -> set[Exact]:
    """Return the places of the stops for discs of at most a given radius."""
    shapes = [part.shape for part in build_parts(outline, widest_m)]
    return {shape.centre for shape in shapes if isinstance(shape, Round) and shape.stops_of in shapes}
