"""What a certified run knows of walls: the features of PIC, exactly, and what goes over into what."""

from fractions import Fraction

from tests.scene_builders import disc_at, require_value, staged

from carom import Chain, Ring, Wall
from carom.core.wall_parts import Plane, Round
from carom.model.trace import EdgeKind, wall_index
from carom.model.walls import AnyWall
from carom.solvers.certified.obstacles import Obstacle, obstacles_of

STADIUM = Chain(points_m=[(-2, -2), (2, -2), (2, 2), (-2, 2)], bulges=(0.0, 1.0, 0.0, 1.0), closed=True)
CLOCKWISE = Chain(points_m=[(-2, 2), (2, 2), (2, -2), (-2, -2)], bulges=(0.0, -1.0, 0.0, -1.0), closed=True)


def build_obstacles(*walls: AnyWall) -> tuple[Obstacle, ...]:
    return obstacles_of(staged("table", disc_at(0, 0), *walls, duration_s=1))


def test_each_half_plane_is_one_exact_obstacle() -> None:
    """Each half-plane is one obstacle with the number of its wall and exact coordinates."""
    walls = (Wall(point_m=(0, -3), normal=(0, 1)), Wall(point_m=(0.1, 3), normal=(0, -1)))
    assert [one.wall for one in build_obstacles(*walls)] == [0, 1]
    assert build_obstacles(*walls)[1].shape == Plane((Fraction(0.1), Fraction(3)), (Fraction(0), Fraction(-1)))


def test_smoothly_joined_sides_are_neighbours() -> None:
    """In a stadium of either direction, each side has neighbours on the same side of the chain."""
    for chain, inner in ((STADIUM, 0), (CLOCKWISE, 1)):
        found = build_obstacles(chain)
        assert len(found) == 8
        for side in (0, 1):
            ring = [2 * k + side for k in range(4)]
            arcs = [found[number].shape for number in ring if found[number].kind is EdgeKind.ARC]
            assert all(isinstance(arc, Round) and arc.inside == (side == inner) for arc in arcs)
            for number in ring:
                begin, end = found[number].neighbours
                assert {wall_index(begin), wall_index(end)} <= set(ring) - {number}


def test_sector_of_an_arc_begins_counterclockwise() -> None:
    """The sector of a stadium's right arc begins at the floor, whichever way the chain runs."""
    for chain, floor, inner in ((STADIUM, 0, 0), (CLOCKWISE, 2, 1)):
        arc = build_obstacles(chain)[2 + inner]  # edge 1, of the side inside
        begin, _ = arc.neighbours
        assert isinstance(arc.shape, Round)
        assert require_value(arc.shape.sector).begin == (Fraction(0), Fraction(-2))
        assert wall_index(begin) == 2 * floor + inner


def test_ends_and_corners_of_a_chain_have_vertex_neighbours() -> None:
    """Both sides of an open chain's two edges have its three vertices as neighbours; a circle has none."""
    found = build_obstacles(Chain(points_m=[(2, 0), (3, 0), (3, 1)]), Ring(centre_m=(-3, 0), radius_m=1))
    assert [one.kind for one in found] == [EdgeKind.FACE] * 4 + [EdgeKind.VERTEX] * 3 + [EdgeKind.ARC] * 2
    assert [tuple(map(wall_index, one.neighbours)) for one in found] == [(4, 5), (5, 4), (5, 6), (6, 5), *[()] * 5]
