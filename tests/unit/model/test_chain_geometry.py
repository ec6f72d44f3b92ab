"""Outlines of finite walls: what is nearest, what is inside, and which edges meet, by geometry known in closed form."""

import math
import random
from decimal import Decimal, localcontext
from fractions import Fraction

import numpy as np
import pytest
from tests.cases import each

from carom.model.chain_checks import find_crossings
from carom.model.chain_geometry import Edge, Outline, compute_circle

STADIUM = Outline(((-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)), (0.0, 1.0, 0.0, 1.0), 0.0, closed=True)


def test_a_bulge_of_one_is_half_of_a_circle() -> None:
    """The circle through both ends with the chord as its diameter, exactly."""
    circle = compute_circle(Edge((2.0, -2.0), (2.0, 2.0), 1.0))
    assert tuple(map(float, circle)) == (2.0, 0.0, 4.0)


def test_the_angle_of_an_arc_is_four_times_the_arc_tangent_of_its_bulge() -> None:
    """The chord of an angle w on a circle of radius R is 2 R sin(w/2)."""
    for bulge in (0.1, 0.5, 2.0, -3.0):
        circle = compute_circle(Edge((0.0, 0.0), (1.0, 0.0), bulge))
        chord = 2.0 * math.sqrt(circle.radius2) * math.sin(2.0 * math.atan(abs(bulge)))
        assert chord == pytest.approx(1.0, rel=1e-14)


def test_what_is_nearest_on_a_stadium() -> None:
    """Its straight sides are at y = -2 and 2, and its ends are half circles of radius 2 about (-2, 0) and (2, 0)."""
    assert STADIUM.find_nearest(0.5, -1.0) == (0.5, -2.0, 0, True)
    assert STADIUM.find_nearest(3.5, 0.0)[:3] == (4.0, 0.0, 1)
    foot = STADIUM.find_nearest(10.0, 6.0)
    assert (foot.x, foot.y) == pytest.approx((2.0 + 2.0 * 0.8, 2.0 * 0.6), abs=1e-15)
    assert STADIUM.compute_gap(0.0, 0.0, 0.5) == 1.5


def test_of_an_arc_the_nearer_end_is_nearest_beside_its_sector() -> None:
    """A point under a quarter of a circle is nearest to one of its ends."""
    quarter = Outline(((1.0, 0.0), (0.0, 1.0)), (math.sqrt(2.0) - 1.0,), 0.0)
    foot = quarter.find_nearest(2.0, -1.0)
    assert (foot.x, foot.y, foot.inner) == (1.0, 0.0, False)
    inside = quarter.find_nearest(0.1, 0.1)
    assert math.hypot(inside.x, inside.y) == pytest.approx(1.0, abs=1e-15)
    assert inside.inner


def test_inside_is_what_the_area_says() -> None:
    """Points at random are inside as often as the area of the stadium, 4 x 4 + 4 pi, is part of the box around it."""
    points = np.random.default_rng(5).uniform((-4.5, -2.5), (4.5, 2.5), (4_000, 2))
    inside = sum(STADIUM.does_enclose(x, y) for x, y in points.tolist())
    within = sum(max(abs(x) - 2.0, 0.0) ** 2 + y * y < 4.0 for x, y in points.tolist())
    assert inside == within
    assert inside / 4_000 == pytest.approx((16.0 + 4.0 * math.pi) / 45.0, abs=4 * math.sqrt(0.25 / 4_000))


def test_what_bends_inwards_is_outside() -> None:
    """A square, one side of which bends inwards by half a circle, has none of that half circle inside."""
    bitten = Outline(((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)), (-1.0, 0.0, 0.0, 0.0), 0.0, closed=True)
    assert not bitten.does_enclose(2.0, 1.0)
    assert bitten.does_enclose(2.0, 2.5)
    assert bitten.does_enclose(0.05, 0.5)


def test_a_shape_is_drawn_on_its_line() -> None:
    """Every point drawn of a stadium is on it, and what is drawn ends where it begins."""
    points = list(STADIUM.build_polyline(100))
    assert points[0] == points[-1]
    assert max(abs(STADIUM.compute_gap(x, y, 0.0)) for x, y in points) < 1e-15
    assert len(points) > 100


@each(
    "points, bulges, closed, pairs",
    [
        pytest.param([(0, 0), (2, 0), (1, 1), (1, -1)], (0, 0, 0), False, [(0, 2)], id="lines that cross"),
        pytest.param([(0, 0), (2, 0), (1, 1), (1, 0)], (0, 0, 0), False, [(0, 2)], id="an end on a line"),
        pytest.param([(0, 0), (1, 0), (0.5, 0)], (0, 0), False, [(0, 1)], id="a line that folds back"),
        pytest.param([(0, 0), (1, 0), (2, 0)], (0, 0), False, [], id="a line that goes on"),
        pytest.param([(0, 0), (2, 0), (1, 1)], (-1, 0), False, [(0, 1)], id="a line that ends on the top of an arc"),
        pytest.param([(0, 0), (2, 0), (1, 2)], (-1, 0), False, [(0, 1)], id="a line that comes out of an arc"),
        pytest.param([(0, 0), (2, 0), (2, 1)], (-1, 0), False, [], id="a line that touches an arc at the joint alone"),
        pytest.param([(0, 0), (2, 0)], (1, 1), True, [], id="two halves of a circle"),
        pytest.param([(0, 0), (2, 0)], (1, -1), True, [(0, 1)], id="one half of a circle to and fro"),
        pytest.param(
            [(0, 0), (2, 0), (2, 4), (0, 4)], (-0.9, 0, -0.9, 0), True, [], id="two arcs bent towards each other, apart"
        ),
        pytest.param(
            [(0, 0), (2, 0), (2, 1), (0, 1)], (-0.9, 0, -0.9, 0), True, [(0, 2)], id="two arcs bent through each other"
        ),
        pytest.param(
            [(0, 0), (2, 0), (2, 2), (0, 2)], (-1, 0, -1, 0), True, [(0, 2)], id="two half circles that touch"
        ),
    ],
)
def test_which_edges_meet(
    points: list[tuple[float, float]], bulges: tuple[float, ...], closed: bool, pairs: list[tuple[int, int]]
) -> None:
    """What crosses, touches and folds back is found, and joints are no meeting."""
    outline = Outline(tuple((float(x), float(y)) for x, y in points), tuple(map(float, bulges)), 0.0, closed)
    assert [(met.first, met.second) for met in find_crossings(outline.edges, closed=closed)] == pairs


def test_touching_is_decided_exactly() -> None:
    """A line one unit in the last place above the top of an arc does not meet it; one at its height does."""
    for y, expected in ((1.0, 1), (math.nextafter(1.0, 2.0), 0)):
        outline = Outline(((0.0, 0.0), (2.0, 0.0), (4.0, 0.0), (4.0, y), (0.0, y)), (-1.0, 0.0, 0.0, 0.0), 0.0)
        assert len(list(find_crossings(outline.edges, closed=False))) == expected


def exact_gap(edge: Edge, x: float, y: float) -> float:
    """Return how far a point is from an arc's circle, outwards, with 400 digits."""

    def decimal(number: Fraction) -> Decimal:
        return Decimal(number.numerator) / Decimal(number.denominator)

    circle = compute_circle(edge)
    with localcontext(prec=400):
        distance = decimal((Fraction(x) - circle.x) ** 2 + (Fraction(y) - circle.y) ** 2).sqrt()
        return float(distance - decimal(circle.radius2).sqrt())


@each("bulge", [50.0, 1.0, 0.3, 1e-3, 1e-6, 1e-9, 1e-12, 1e-15, 1e-60])
def test_however_flat_an_arc_is_its_nearest_point_is_known_to_the_rounding_of_its_ends(bulge: float) -> None:
    """The distance of points around its middle is that of exact arithmetic, on both sides and for both directions."""
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
            assert abs(math.hypot(x - foot.x, y - foot.y) - abs(exact_gap(edge, x, y))) <= room
            assert abs(exact_gap(edge, foot.x, foot.y)) <= room


@each("bulge", [0.3, 1e-6, 1e-12, 1e-15])
def test_beside_a_flat_arc_its_end_is_nearest(bulge: float) -> None:
    """A point before the one end, or behind the other, has that end for its nearest point."""
    arc = Outline(((-1.0, 0.0), (1.0, 0.0)), (bulge,), 0.0)
    for x, y, end in ((-1.5, 0.25, -1.0), (1.5, 0.25, 1.0), (-1.5, -0.25, -1.0), (1.5, -0.25, 1.0)):
        foot = arc.find_nearest(x, y)
        assert (foot.x, foot.y, foot.inner) == (end, 0.0, False)
