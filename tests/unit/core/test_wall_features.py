"""What a wall's edges are merged into, and which corners have one answer."""

from __future__ import annotations

import math

import pytest
from tests.cases import each

from carom.core.wall_features import Face, are_decidable, features_of
from carom.model.chain_geometry import Outline
from carom.model.trace import EdgeKind


def kinds(outline: Outline) -> dict[EdgeKind, list[tuple[int, ...]]]:
    """Return the edges of the features of an outline that a point meets, by kind, one side of each."""
    found: dict[EdgeKind, list[tuple[int, ...]]] = {}
    for part in features_of(outline, widest_m=0.0):
        if part.edges not in found.setdefault(part.kind, []):
            found[part.kind].append(part.edges)
    return found


def chain(*points: tuple[float, float], bulges: tuple[float, ...] = (), closed: bool = False) -> Outline:
    """Return a chain without width."""
    edges = len(points) - (not closed)
    return Outline(points, bulges or (0.0,) * edges, 0.0, closed)


def test_a_line_that_goes_on_is_one_face() -> None:
    """Three pieces of one line have two sides and two ends; a piece off the line by one unit is an edge of its own."""
    straight = chain((0.0, 0.0), (1.0, 0.5), (3.0, 1.5), (4.0, 2.0))
    assert kinds(straight) == {EdgeKind.FACE: [(0, 1, 2)], EdgeKind.VERTEX: [(0,), (2,)]}
    bent = chain((0.0, 0.0), (1.0, math.nextafter(0.5, 1.0)), (3.0, 1.5))
    assert kinds(bent) == {EdgeKind.FACE: [(0,), (1,)], EdgeKind.VERTEX: [(0,), (1,)]}
    assert len(features_of(bent)) == 7


def test_a_joint_with_a_common_tangent_has_no_vertex() -> None:
    """A stadium has two straight sides, two half circles, and no corner."""
    stadium = chain((-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0), bulges=(0.0, 1.0, 0.0, 1.0), closed=True)
    assert kinds(stadium) == {EdgeKind.FACE: [(0,), (2,)], EdgeKind.ARC: [(1,), (3,)]}


def test_arcs_of_one_circle_are_one_arc() -> None:
    """Two halves are a whole circle, which has no ends; of other arcs the circle must be the same exactly."""
    assert kinds(chain((-1.0, 0.0), (1.0, 0.0), bulges=(1.0, 1.0), closed=True)) == {EdgeKind.ARC: [(0, 1)]}
    # A bulge of 1/2 turns by (2 + i)^4 / 25 = (-7 + 24 i) / 25, which keeps these on one circle of radius 625.
    points = (625.0, 0.0), (-175.0, 600.0), (-527.0, -336.0)
    assert kinds(chain(*points, bulges=(0.5, 0.5)))[EdgeKind.ARC] == [(0, 1)]
    assert kinds(chain(*points, bulges=(0.5, math.nextafter(0.5, 1.0))))[EdgeKind.ARC] == [(0,), (1,)]


def test_the_first_and_the_last_edge_of_a_closed_chain_are_merged() -> None:
    """A square that begins in the middle of a side has four sides and four corners; the joint there is none."""
    square = chain((2.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0), (0.0, 0.0), closed=True)
    found = kinds(square)
    assert found[EdgeKind.FACE] == [(4, 0), (1,), (2,), (3,)]
    assert found[EdgeKind.VERTEX] == [(0,), (1,), (2,), (3,)]


def test_faces_come_before_vertices() -> None:
    """Where a face ends, both are touched at one instant, and the face is the one that counts."""
    order = [part.kind for part in features_of(chain((0.0, 0.0), (1.0, 0.0), (1.0, 1.0)))]
    assert order == sorted(order, key=[EdgeKind.FACE, EdgeKind.ARC, EdgeKind.VERTEX].index)


def face(a: tuple[float, float], b: tuple[float, float]) -> Face:
    """Return the left side of an edge."""
    return Face.between(a, b)


@each(
    "second, smooth, elastic",
    [
        pytest.param((0.0, 3.0), True, True, id="90 degrees"),
        pytest.param((-4.0, 3.0), False, False, id="an obtuse corner"),
        pytest.param((5.0, 5.0), False, True, id="45 degrees"),
        pytest.param((-5.0, 5.0), False, False, id="135 degrees, of the same cosine except for its sign"),
        pytest.param((5.0, 4.0), False, False, id="an angle that divides no half turn"),
    ],
)
def test_which_corners_have_one_answer(second: tuple[float, float], smooth: bool, elastic: bool) -> None:
    """A right angle has one, smooth; 45 degrees has one if nothing is lost; others have none."""
    floor, slope = face((0.0, 0.0), (9.0, 0.0)), face(second, (0.0, 0.0))
    assert are_decidable(floor, slope, elastic=False) is smooth
    assert are_decidable(floor, slope, elastic=True) is (smooth or elastic)
    assert are_decidable(floor, floor, elastic=False)
