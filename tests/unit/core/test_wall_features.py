"""Faces, vertices and arcs: their numbers, compared with rational arithmetic, and merged edges."""

import math
from fractions import Fraction

from hypothesis import assume, given
from hypothesis import strategies as st

from carom.core.wall_features import Face
from carom.core.wall_parts import Pair, build_parts, compute_root, to_pair
from carom.model.chain_geometry import Edge, Outline, compute_circle
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


# Numbers of a feature -------------------------------------------------------------------------------------------------

coordinates = st.floats(-1e6, 1e6).filter(lambda value: value == 0.0 or abs(value) > 1e-12)
points = st.tuples(coordinates, coordinates)
bulges = st.floats(1e-6, 1e6).flatmap(lambda value: st.sampled_from((value, -value)))


def to_exact(pair: Pair) -> Fraction:
    return Fraction(pair[0]) + Fraction(pair[1])


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


@given(st.fractions(Fraction(1, 10**9), 10**9))
def test_pairs_of_rationals_and_roots_are_right_to_100_bits(number: Fraction) -> None:
    """A pair is within 2^-104 of its rational number, and the square of a root's pair within 2^-103."""
    assert abs(to_exact(to_pair(number)) / number - 1) <= Fraction(2) ** -104
    assert abs(to_exact(compute_root(number)) ** 2 / number - 1) <= Fraction(2) ** -103
    assert compute_root(number * number)[0] == to_pair(number)[0] == float(number)
    assert compute_root(Fraction(0)) == (0.0, 0.0)
