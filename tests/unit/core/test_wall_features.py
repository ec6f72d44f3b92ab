"""Faces, vertices and arcs: their numbers as rational arithmetic has them, merged edges, and corners of one answer."""

import math
from fractions import Fraction

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from tests.cases import each
from tests.unit.core.feature_times import build_arc

from carom.core.wall_features import Face
from carom.core.wall_parts import Pair, Plane, Round, are_decidable, build_parts, compute_root, to_pair
from carom.model.chain_geometry import Edge, ExactCircle, Outline, compute_circle
from carom.model.trace import EdgeKind


def list_edges_by_kind(outline: Outline) -> dict[EdgeKind, list[tuple[int, ...]]]:
    """Return the edges of the features of an outline that a point meets, by kind, one side of each."""
    found: dict[EdgeKind, list[tuple[int, ...]]] = {}
    for part in build_parts(outline, widest_m=0.0):
        if part.edges not in found.setdefault(part.kind, []):
            found[part.kind].append(part.edges)
    return found


def build_chain(*points: tuple[float, float], bulges: tuple[float, ...] = (), closed: bool = False) -> Outline:
    """Return a chain without width."""
    edges = len(points) - (not closed)
    return Outline(points, bulges or (0.0,) * edges, 0.0, closed)


def test_collinear_edges_are_merged_into_one_face() -> None:
    """Three collinear edges become one face per side and two vertices; a bend of 1 ulp keeps them apart."""
    straight = build_chain((0.0, 0.0), (1.0, 0.5), (3.0, 1.5), (4.0, 2.0))
    assert list_edges_by_kind(straight) == {EdgeKind.FACE: [(0, 1, 2)], EdgeKind.VERTEX: [(0,), (2,)]}
    bent = build_chain((0.0, 0.0), (1.0, math.nextafter(0.5, 1.0)), (3.0, 1.5))
    assert list_edges_by_kind(bent) == {EdgeKind.FACE: [(0,), (1,)], EdgeKind.VERTEX: [(0,), (1,)]}
    assert len(build_parts(bent)) == 7


def test_smooth_joint_has_no_vertex() -> None:
    """A stadium has two straight sides, two half circles and no vertex."""
    stadium = build_chain((-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0), bulges=(0.0, 1.0, 0.0, 1.0), closed=True)
    assert list_edges_by_kind(stadium) == {EdgeKind.FACE: [(0,), (2,)], EdgeKind.ARC: [(1,), (3,)]}


def test_arcs_of_the_same_circle_are_merged() -> None:
    """Consecutive arcs of exactly the same circle become one arc; a bulge that differs by 1 ulp prevents it."""
    assert list_edges_by_kind(build_chain((-1.0, 0.0), (1.0, 0.0), bulges=(1.0, 1.0), closed=True)) == {
        EdgeKind.ARC: [(0, 1)]
    }
    # A bulge of 1/2 turns by (2 + i)^4 / 25 = (-7 + 24 i) / 25, which keeps these on one circle of radius 625.
    points = (625.0, 0.0), (-175.0, 600.0), (-527.0, -336.0)
    assert list_edges_by_kind(build_chain(*points, bulges=(0.5, 0.5)))[EdgeKind.ARC] == [(0, 1)]
    assert list_edges_by_kind(build_chain(*points, bulges=(0.5, math.nextafter(0.5, 1.0))))[EdgeKind.ARC] == [
        (0,),
        (1,),
    ]


def test_first_and_last_edge_of_a_closed_chain_are_merged() -> None:
    """A square that starts in the middle of a side has four faces and four vertices."""
    square = build_chain((2.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0), (0.0, 0.0), closed=True)
    found = list_edges_by_kind(square)
    assert found[EdgeKind.FACE] == [(4, 0), (1,), (2,), (3,)]
    assert found[EdgeKind.VERTEX] == [(0,), (1,), (2,), (3,)]


def test_features_are_ordered_faces_arcs_vertices() -> None:
    """Features are ordered so that a face comes before the vertex at its end, which is met at the same instant."""
    order = [part.kind for part in build_parts(build_chain((0.0, 0.0), (1.0, 0.0), (1.0, 1.0)))]
    assert order == sorted(order, key=[EdgeKind.FACE, EdgeKind.ARC, EdgeKind.VERTEX].index)


def build_side(a: tuple[float, float], b: tuple[float, float]) -> Plane | Round:
    """Return the left side of an edge."""
    return build_parts(build_chain(a, b))[0].shape


@each(
    "second, smooth, elastic",
    [
        pytest.param((0.0, 3.0), True, True, id="90 degrees"),
        pytest.param((-4.0, 3.0), False, False, id="an obtuse corner"),
        pytest.param((5.0, 5.0), False, True, id="45 degrees"),
        pytest.param((-5.0, 5.0), False, False, id="135 degrees, of the same cosine except for its sign"),
        pytest.param((-0.0625, 0.0625), False, False, id="135 degrees at a short face"),
        pytest.param((5.0, 4.0), False, False, id="an angle that divides no half turn"),
    ],
)
def test_decidable_corners_are_recognised(second: tuple[float, float], smooth: bool, elastic: bool) -> None:
    """A right angle is decidable, 45 degrees only without energy loss, and the other corners are not."""
    floor, slope = build_side((0.0, 0.0), (9.0, 0.0)), build_side(second, (0.0, 0.0))
    assert are_decidable(floor, slope, elastic=False) is smooth
    assert are_decidable(floor, slope, elastic=True) is (smooth or elastic)
    assert are_decidable(floor, floor, elastic=False)


# Numbers of a feature -------------------------------------------------------------------------------------------------

coordinates = st.floats(-1e6, 1e6).filter(lambda value: value == 0.0 or abs(value) > 1e-12)
points = st.tuples(coordinates, coordinates)
bulges = st.floats(1e-6, 1e6).flatmap(lambda value: st.sampled_from((value, -value)))


def to_exact(pair: Pair) -> Fraction:
    return Fraction(pair[0]) + Fraction(pair[1])


def test_half_circle_has_its_centre_at_the_midpoint() -> None:
    """A bulge of 1 is half a circle: its centre is the midpoint of the edge's ends."""
    circle = compute_circle(Edge((-3.0, 0.0), (3.0, 0.0), 1.0))
    assert circle == ExactCircle(Fraction(0), Fraction(0), Fraction(9))


def test_sign_of_a_bulge_is_its_direction_of_rotation() -> None:
    """A bulge of tan(22.5 degrees) from (1, 0) to (0, 1) is centred at the origin, its negative at (1, 1)."""
    k = math.tan(math.pi / 8)
    there, back = compute_circle(Edge((1.0, 0.0), (0.0, 1.0), k)), compute_circle(Edge((1.0, 0.0), (0.0, 1.0), -k))
    assert (float(there.x), float(there.y)) == pytest.approx((0.0, 0.0), abs=1e-15)
    assert (float(back.x), float(back.y)) == pytest.approx((1.0, 1.0), abs=1e-15)
    assert float(there.radius2) == pytest.approx(1.0, abs=1e-15)


@given(points, points, bulges)
def test_circle_of_a_bulge_passes_exactly_through_both_ends(
    a: tuple[float, float], b: tuple[float, float], k: float
) -> None:
    """Both ends of an edge are exactly on its rational circle; reversing the arc keeps the circle."""
    assume(a != b)
    circle = compute_circle(Edge(a, b, k))
    for x, y in (a, b):
        assert (Fraction(x) - circle.x) ** 2 + (Fraction(y) - circle.y) ** 2 == circle.radius2
    assert compute_circle(Edge(b, a, -k)) == circle


@given(points, points)
def test_face_normal_points_to_the_left(a: tuple[float, float], b: tuple[float, float]) -> None:
    """A face has an exact direction, a length to 104 bits and a normal to the left within 2 ulp."""
    assume(a != b)
    face = Face.between(a, b)
    ex, ey = to_exact(face.along[0]), to_exact(face.along[1])
    assert (ex, ey) == (Fraction(b[0]) - Fraction(a[0]), Fraction(b[1]) - Fraction(a[1]))
    length2 = ex * ex + ey * ey
    assert abs(to_exact(face.length) ** 2 / length2 - 1) <= Fraction(2) ** -104
    for component, part in zip(face.normal, (-ey, ex), strict=True):
        assert abs(Fraction(component) ** 2 - part * part / length2) <= 2 * abs(component) * Fraction(
            math.ulp(component)
        )
        assert component * part >= 0


@given(points, points, st.floats(1e-3, 1e3))
def test_arc_sector_is_reflex_for_bulges_above_1(a: tuple[float, float], b: tuple[float, float], k: float) -> None:
    """The sector of an arc is reflex, more than half a circle, exactly if its bulge is above 1."""
    assume(a != b)
    sector = build_arc(compute_circle(Edge(a, b, k)), (a, b), inside=True).sector
    assert sector is not None
    assert sector.reflex == (k > 1.0)


@given(st.fractions(Fraction(1, 10**9), 10**9))
def test_pairs_of_rationals_and_roots_are_right_to_100_bits(number: Fraction) -> None:
    """A pair is within 2^-104 of its rational number, and the square of a root's pair within 2^-103."""
    assert abs(to_exact(to_pair(number)) / number - 1) <= Fraction(2) ** -104
    assert abs(to_exact(compute_root(number)) ** 2 / number - 1) <= Fraction(2) ** -103
    assert compute_root(number * number)[0] == to_pair(number)[0] == float(number)
    assert compute_root(Fraction(0)) == (0.0, 0.0)
