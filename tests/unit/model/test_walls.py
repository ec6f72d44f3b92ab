"""The walls of a scene: distinguished by their fields, refused with edge and numbers, written as they were read."""

import math
from typing import Any

import pytest
from tests.cases import each

from carom import Chain, Disc, Ring, Scene, SceneError, Wall
from carom.model.scene import Need
from carom.solvers.units import Units

DISC = Disc(position_m=(0.0, 0.0), radius_m=0.5)
STADIUM = Chain(points_m=[(-2, -2), (2, -2), (2, 2), (-2, 2)], bulges=[0, 1, 0, 1], closed=True)


def build_scene(*walls: Any, **fields: Any) -> Scene:
    """Return a scene of one disc at the origin and some walls."""
    return Scene(name="walls", discs=[DISC], walls=walls, duration_s=1.0, **fields)


def test_unused_fields_of_walls_are_not_written() -> None:
    """Half-planes and chains are dumped without unused fields, so that files and digests stay the same."""
    assert Wall(point_m=(0, 1), normal=(0, 1)).model_dump() == {"point_m": (0.0, 1.0), "normal": (0.0, 1.0)}
    assert set(Chain(points_m=[(0, 0), (1, 0)]).model_dump()) == {"points_m"}


@each(
    "wall, said",
    [
        ({"points_m": [[0, 0]]}, "walls[0].points_m: must contain at least 2 points, got 1"),
        ({"points_m": [[3, 0], [4, 0]], "closed": True}, "3 points for a closed chain without bulges, got 2"),
        ({"points_m": [[3, 0], [4, 0], [4, 0]]}, "points_m[2]: must not be the point at which edge 1 begins, got (4.0"),
        ({"points_m": [[0, 0], [1e-160, 0], [3, 4]]}, "edges and radii must be at least 1.49e-154 m"),
        ({"points_m": [[0, 0], [1e-150, 0], [3, 4]]}, "edges must be at least 6.2e-120 of the greatest length"),
        ({"points_m": [[3, 0], [4, 0]], "bulges": [1, 1]}, "bulges: must have one number for each edge (1)"),
        ({"points_m": [[3, 0], [4, 0]], "bulges": [5e-324]}, "bulges[0]: makes edge 0 an arc of a radius above"),
        ({"points_m": [[3, 0], [4, 0]], "bulges": [math.inf]}, "bulges[0]: must be a finite number, got inf"),
        ({"points_m": [[3, 0], [4, 0]], "solid": True}, "solid: needs closed = true"),
        ({"points_m": [[3, 0], [5, 0], [4, 1], [4, -1]]}, "edge 2 meets edge 0 at (4, 0)"),
        ({"points_m": [[3, 0], [5, 0]], "restitution": 1.5}, "restitution: must be at most 1: above 1 each impact"),
        ({"points_m": [[3, 0], [5, 0]], "normal": [0, 1]}, "normal: belongs to another kind of wall"),
        ({"centre_m": [9, 0]}, "walls[0].radius_m: is required, but missing"),
        (5, "walls[0]: must be a table of fields, or a wall, got 5"),
        ({}, "walls[0].point_m: is required, but missing"),
    ],
)
def test_invalid_wall_is_refused_with_field_and_numbers(wall: Any, said: str) -> None:
    """The error for an invalid wall names the field or the edges, and the value or the limit."""
    with pytest.raises(SceneError) as refused:
        build_scene(wall)
    assert said in str(refused.value)


@each(
    "wall, said",
    [
        (Chain(points_m=[(-1, 0.25), (1, 0.25)]), "the disc reaches 0.25 m into edge 0 of it"),
        (Chain(points_m=[(-1, 1), (1, 1)], half_width_m=0.75), "the disc reaches 0.25 m into edge 0 of it"),
        (Chain(points_m=[(-9, -9), (9, -9), (0, 9)], closed=True, solid=True), "the disc is inside this solid wall"),
        (Ring(centre_m=(0.0, 0.25), radius_m=0.5), "the disc reaches 0.25 m into it"),
        (Ring(centre_m=(1.0, 0.0), radius_m=0.25, half_width_m=0.5), "the disc reaches 0.25 m into it"),
        (Ring(centre_m=(0.25, 0.0), radius_m=0.0), "the disc reaches 0.25 m into it"),
    ],
)
def test_disc_in_a_finite_wall_is_refused(wall: Any, said: str) -> None:
    """A disc that reaches into a chain or circle, or is inside a solid wall, is refused at the start."""
    with pytest.raises(SceneError) as refused:
        build_scene(wall)
    assert str(refused.value).startswith("discs[0].position_m: must not overlap walls[0] at the start")
    assert said in str(refused.value)


@each(
    "wall",
    [
        Chain(points_m=[(-1, 0.5), (1, 0.5)]),
        Chain(points_m=[(-9, -9), (9, -9), (0, 9)], closed=True),
        Ring(centre_m=(0, 0), radius_m=0.5),
        STADIUM,
    ],
)
def test_disc_may_touch_a_wall_and_be_inside_a_hollow_one(wall: Any) -> None:
    """Touching is not an overlap, and the inside of a chain that is not solid is free."""
    assert build_scene(wall).walls == (wall,)


def test_finite_walls_have_needs_of_their_own() -> None:
    """Straight edges, arcs, posts and wall materials are needs, so that methods without them skip the scene."""
    assert build_scene(Wall(point_m=(0, -9), normal=(0, 1))).needs == {Need.WALLS}
    assert build_scene(Chain(points_m=[(1, 1), (2, 2)])).needs == {Need.WALLS, Need.SEGMENTS}
    assert build_scene(STADIUM).needs == {Need.WALLS, Need.SEGMENTS, Need.ARCS}
    assert build_scene(Ring(centre_m=(0, 0), radius_m=3)).needs == {Need.WALLS, Need.ARCS}
    assert build_scene(Ring(centre_m=(0, -3), radius_m=1)).needs == {Need.WALLS, Need.POSTS}
    own = {Need.WALLS, Need.WALL_MATERIALS, Need.RESTITUTION}
    assert build_scene(Wall(point_m=(0, -9), normal=(0, 1), restitution=0.5)).needs == own
    rubs = build_scene(Wall(point_m=(0, -9), normal=(0, 1), friction=0.5))
    assert rubs.needs == {Need.WALLS, Need.WALL_MATERIALS, Need.FRICTION}
    same = Wall(point_m=(0, -9), normal=(0, 1), restitution=0.5, friction=0.0)
    assert build_scene(same, wall_restitution=0.5).needs == {Need.WALLS, Need.RESTITUTION}


def test_units_of_a_run_scale_every_length_of_a_wall() -> None:
    """In units of 2^10 m the points, half width and radius of walls are exactly 1/1024 of those in metres."""
    made = build_scene(STADIUM.model_copy(update={"half_width_m": 0.125}), Ring(centre_m=(1, 2), radius_m=7))
    chain, ring = Units(10, 0, 0).convert_scene(made).arrays.walls
    assert not isinstance(chain, tuple)
    assert not isinstance(ring, tuple)
    assert chain.points[0] == (-2 / 1024, -2 / 1024)
    assert (chain.half_width, ring.points, ring.radius) == (0.125 / 1024, ((1 / 1024, 2 / 1024),), 7 / 1024)
