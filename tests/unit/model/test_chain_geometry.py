"""Outlines of finite walls: what is nearest, what is inside, and which edges meet, by geometry known in closed form."""

import math
import random

import mpmath
import numpy as np
import pytest
from tests.cases import each

from carom.model.chain_checks import find_crossings
from carom.model.chain_geometry import Edge, Outline

STADIUM = Outline(((-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)), (0.0, 1.0, 0.0, 1.0), 0.0, closed=True)


def test_enclosed_points_match_the_area_of_a_stadium() -> None:
    """Random points are inside a stadium as often as its area, 4 x 4 + 4 pi, is part of the sampled box."""
    points = np.random.default_rng(5).uniform((-4.5, -2.5), (4.5, 2.5), (4_000, 2))
    inside = sum(STADIUM.does_enclose(x, y) for x, y in points.tolist())
    within = sum(max(abs(x) - 2.0, 0.0) ** 2 + y * y < 4.0 for x, y in points.tolist())
    assert inside == within
    assert inside / 4_000 == pytest.approx((16.0 + 4.0 * math.pi) / 45.0, abs=4 * math.sqrt(0.25 / 4_000))


def test_inward_arc_of_a_square_is_outside() -> None:
    """If one side of a square bends inwards by half a circle, that half circle is not enclosed."""
    bitten = Outline(((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)), (-1.0, 0.0, 0.0, 0.0), 0.0, closed=True)
    assert not bitten.does_enclose(2.0, 1.0)
    assert bitten.does_enclose(2.0, 2.5)
    assert bitten.does_enclose(0.05, 0.5)


def test_polyline_of_a_stadium_is_on_its_outline() -> None:
    """Every point of the polyline is within 1e-15 m of the outline, and the last point equals the first."""
    points = list(STADIUM.build_polyline(100))
    assert points[0] == points[-1]
    assert max(abs(STADIUM.compute_gap(x, y, 0.0)) for x, y in points) < 1e-15
    assert len(points) > 100


@each(
    "points, bulges, closed, pairs",
    [
        ([(0, 0), (2, 0), (1, 1), (1, -1)], (0, 0, 0), False, [(0, 2)]),  # lines that cross
        ([(0, 0), (2, 0), (1, 1), (1, 0)], (0, 0, 0), False, [(0, 2)]),  # an end on a line
        ([(0, 0), (1, 0), (0.5, 0)], (0, 0), False, [(0, 1)]),  # a line that folds back
        ([(0, 0), (1, 0), (2, 0)], (0, 0), False, []),  # a line that goes on
        ([(0, 0), (2, 0), (1, 1)], (-1, 0), False, [(0, 1)]),  # a line that ends on the top of an arc
        ([(0, 0), (2, 0), (1, 2)], (-1, 0), False, [(0, 1)]),  # a line that comes out of an arc
        ([(0, 0), (2, 0), (2, 1)], (-1, 0), False, []),  # a line that touches an arc at the joint alone
        ([(0, 0), (2, 0)], (1, 1), True, []),  # two halves of a circle
        ([(0, 0), (2, 0)], (1, -1), True, [(0, 1)]),  # one half of a circle, there and back
        ([(0, 0), (2, 0), (2, 4), (0, 4)], (-0.9, 0, -0.9, 0), True, []),  # two arcs bent towards each other, apart
        ([(0, 0), (2, 0), (2, 1), (0, 1)], (-0.9, 0, -0.9, 0), True, [(0, 2)]),  # two arcs bent through each other
        ([(0, 0), (2, 0), (2, 2), (0, 2)], (-1, 0, -1, 0), True, [(0, 2)]),  # two half circles that touch
    ],
)
def test_crossing_edges_are_found(
    points: list[tuple[float, float]], bulges: tuple[float, ...], closed: bool, pairs: list[tuple[int, int]]
) -> None:
    """Edges that cross, touch or fold back are found, and joints of neighbouring edges are not."""
    outline = Outline(tuple((float(x), float(y)) for x, y in points), tuple(map(float, bulges)), 0.0, closed)
    assert [(met.first, met.second) for met in find_crossings(outline.edges, closed=closed)] == pairs


def test_touching_is_decided_exactly() -> None:
    """A line one unit in the last place above the top of an arc does not meet it; a line at its height does."""
    for y, expected in ((1.0, 1), (math.nextafter(1.0, 2.0), 0)):
        outline = Outline(((0.0, 0.0), (2.0, 0.0), (4.0, 0.0), (4.0, y), (0.0, y)), (-1.0, 0.0, 0.0, 0.0), 0.0)
        assert len(list(find_crossings(outline.edges, closed=False))) == expected


def compute_exact_gap(bulge: float, x: float, y: float) -> float:
    """Return how far a point is outside of the circle of the arc from (-1.25, 0.75) to (0.5, 1), with 400 digits."""
    with mpmath.workdps(400):
        k = mpmath.mpf(bulge)
        across = (k * k - 1) / (2 * k)  # times half the chord, turned by a right angle
        radius = mpmath.hypot(0.875, 0.125) * (k * k + 1) / (2 * abs(k))
        return float(mpmath.hypot(x - (-0.375 + 0.125 * across), y - (0.875 - 0.875 * across)) - radius)


@each("bulge", [50.0, 2.0, 1.0, 0.3, 1e-3, 1e-6, 1e-9, 1e-12, 1e-15, 1e-60])
def test_nearest_point_of_a_flat_arc_is_exact_to_rounding(bulge: float) -> None:
    """For bulges from 50 to 1e-60 the distance of points near the arc's middle is that of exact arithmetic."""
    # This holds on both sides of the arc and for both directions, within the rounding of the arc's ends.
    rnd = random.Random(5)
    for sign in (1.0, -1.0):
        edge = Edge((-1.25, 0.75), (0.5, 1.0), sign * bulge)
        arc = Outline(edge[:2], (edge.bulge,), 0.0)
        middle = -0.375 + 0.125 * edge.bulge, 0.875 - 0.875 * edge.bulge  # the bulge is the height over half the chord
        for _ in range(6):
            off = rnd.uniform(-0.4, 0.4), rnd.uniform(-0.4, 0.4)
            x, y = middle[0] + off[0], middle[1] + off[1]
            foot = arc.find_nearest(x, y)
            assert foot.inner
            room = 2.0**-50 * (abs(x) + abs(y) + 2.0 + (bulge if bulge > 1.0 else 0.0))
            assert abs(math.hypot(x - foot.x, y - foot.y) - abs(compute_exact_gap(edge.bulge, x, y))) <= room
            assert abs(compute_exact_gap(edge.bulge, foot.x, foot.y)) <= room


@each("bulge", [0.3, 1e-6, 1e-12, 1e-15])
def test_nearest_point_next_to_a_flat_arc_is_its_end(bulge: float) -> None:
    """A point before one end of a flat arc, or behind the other, has that end as its nearest point."""
    arc = Outline(((-1.0, 0.0), (1.0, 0.0)), (bulge,), 0.0)
    for x, y, end in ((-1.5, 0.25, -1.0), (1.5, 0.25, 1.0), (-1.5, -0.25, -1.0), (1.5, -0.25, 1.0)):
        foot = arc.find_nearest(x, y)
        assert (foot.x, foot.y, foot.inner) == (end, 0.0, False)
