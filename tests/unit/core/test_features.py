"""Faces, vertices and arcs hold what the numbers of a file make of them, as rational arithmetic has it."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from carom.core.wall_features import Arc, Face, Pair, pair_of, root_of
from carom.model.chain_geometry import Edge, ExactCircle, circle_of

coordinates = st.floats(-1e6, 1e6).filter(lambda value: value == 0.0 or abs(value) > 1e-12)
points = st.tuples(coordinates, coordinates)
bulges = st.floats(1e-6, 1e6).flatmap(lambda value: st.sampled_from((value, -value)))


def exact(pair: Pair) -> Fraction:
    return Fraction(pair[0]) + Fraction(pair[1])


def test_half_a_circle_counterclockwise_has_its_centre_midway() -> None:
    """A bulge of 1, the tangent of 45 degrees, is half a circle: its centre is the midpoint of its ends."""
    circle = circle_of(Edge((-3.0, 0.0), (3.0, 0.0), 1.0))
    assert circle == ExactCircle(Fraction(0), Fraction(0), Fraction(9))


def test_the_sign_of_a_bulge_is_the_sense_of_its_turn() -> None:
    """From (1, 0) to (0, 1) counterclockwise about the origin the bulge is tan(22.5 degrees); clockwise, minus that."""
    k = math.tan(math.pi / 8)
    there, back = circle_of(Edge((1.0, 0.0), (0.0, 1.0), k)), circle_of(Edge((1.0, 0.0), (0.0, 1.0), -k))
    assert (float(there.x), float(there.y)) == pytest.approx((0.0, 0.0), abs=1e-15)
    assert (float(back.x), float(back.y)) == pytest.approx((1.0, 1.0), abs=1e-15)
    assert float(there.radius2) == pytest.approx(1.0, abs=1e-15)


@given(points, points, bulges)
def test_both_ends_are_exactly_on_the_circle_of_a_bulge(
    a: tuple[float, float], b: tuple[float, float], k: float
) -> None:
    """Centre and squared radius are rational: no digit is lost, and turning the arc round changes nothing."""
    assume(a != b)
    circle = circle_of(Edge(a, b, k))
    for x, y in (a, b):
        assert (Fraction(x) - circle.x) ** 2 + (Fraction(y) - circle.y) ** 2 == circle.radius2
    assert circle_of(Edge(b, a, -k)) == circle


@given(points, points)
def test_a_face_has_its_free_side_on_the_left(a: tuple[float, float], b: tuple[float, float]) -> None:
    """The vector along it is exact; its length, and the normal turned left from it, are to the last digit."""
    assume(a != b)
    face = Face.between(a, b)
    ex, ey = exact(face.along[0]), exact(face.along[1])
    assert (ex, ey) == (Fraction(b[0]) - Fraction(a[0]), Fraction(b[1]) - Fraction(a[1]))
    length2 = ex * ex + ey * ey
    assert abs(exact(face.length) ** 2 / length2 - 1) <= Fraction(2) ** -104
    for component, part in zip(face.normal, (-ey, ex), strict=True):
        assert abs(Fraction(component) ** 2 - part * part / length2) <= 2 * abs(component) * Fraction(
            math.ulp(component)
        )
        assert component * part >= 0


@given(points, points, st.floats(1e-3, 1e3))
def test_an_arc_knows_whether_it_is_more_than_half_a_circle(
    a: tuple[float, float], b: tuple[float, float], k: float
) -> None:
    """A bulge above 1 is the tangent of more than 45 degrees, and its arc more than half of the circle."""
    assume(a != b)
    sector = Arc.on(circle_of(Edge(a, b, k)), (a, b), inside=True).sector
    assert sector is not None
    assert sector.reflex == (k > 1.0)


@given(st.fractions(Fraction(1, 10**9), 10**9))
def test_pairs_of_rationals_and_of_their_roots_are_right_to_a_hundred_bits(number: Fraction) -> None:
    """A pair is within 2^-104 of its exact value, and its head is the nearest float."""
    assert abs(exact(pair_of(number)) / number - 1) <= Fraction(2) ** -104
    assert abs(exact(root_of(number)) ** 2 / number - 1) <= Fraction(2) ** -103
    assert root_of(number * number)[0] == pair_of(number)[0] == float(number)
    assert root_of(Fraction(0)) == (0.0, 0.0)
