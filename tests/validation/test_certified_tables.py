"""Certified runs on finite walls, against brute force of other formulas and closed forms, and where they must end."""

import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from tests.cases import each, release_after
from tests.scene_builders import disc_at, require_value, staged, wall_at
from tests.validation import table_runs
from tests.validation.random_tables import draw_table
from tests.validation.table_runs import Table, Walk

from carom import Disc, Scene, certify, solve_pic
from carom.model.trace import EdgeKind
from carom.model.walls import AnyWall, Chain, Ring, Wall
from carom.solvers.certified.result import Degenerate, Ending

STADIUM = Chain(points_m=[(-2, -2), (2, -2), (2, 2), (-2, 2)], bulges=(0.0, 1.0, 0.0, 1.0), closed=True)


def build_table_scene(
    velocity: tuple[float, float], *walls: AnyWall, place: tuple[float, float] = (0.0, 0.0), **more: Any
) -> Scene:
    return staged("table", disc_at(*place, *velocity), *walls, **{"duration_s": 10.0, **more})


def draw_tables(first: int, count: int, *, moves: bool = False) -> Iterator[Table]:
    """Yield tables that neither fall nor are driven; or else, by `moves`, those of which one is true, or both."""
    drawn = (found for found in map(draw_table, itertools.count(first)) if found is not None)
    wanted = (table for kind, table in drawn if (", " in kind) is moves)
    yield from itertools.islice(wanted, count)


def find_contradictions(table: Table, impacts: int) -> list[int]:
    """Return the impacts that brute force of 600 bits has outside of what is said to be proven."""
    certified = certify(table_runs.build_table_scene(table), max_impacts=impacts)
    assert len(certified.trace.impacts) == impacts
    found = []
    with ctx.workprec(table_runs.PRECISION):
        walk = Walk(table)
        for k, (row, radii) in enumerate(zip(certified.trace.impacts, certified.radii, strict=True)):
            met = walk.step()
            assert met is not None
            wall, state = int(row["second"]), met.state
            told = [(row["time_s"], radii["time_s"], state.time)]
            told += zip(row["velocity_first_after"], radii["velocity_first_after"], (state.vx, state.vy), strict=True)
            within = all(abs(arb(float(value)) - truth) <= arb(float(radius)) for value, radius, truth in told)
            if wall != -1 - met.line or not within:
                found.append(k)
    return found


@each(
    "moves, first, count, impacts",
    release_after(1, [(True, 0, 1, 6), (False, 0, 6, 12), (False, 10**5, 400, 12), (True, 10**5, 200, 12)]),
)
def test_certified_runs_match_brute_force_on_random_tables(moves: bool, first: int, count: int, impacts: int) -> None:
    """All impacts on random tables of finite walls are within their radii of 600-bit brute force."""
    # The tables have bulges of both signs, re-entrant joints, thick bars, islands, cut sides and walls with
    # restitutions of their own; some fall or are driven.
    tables = draw_tables(first, count, moves=moves)
    assert {k: bad for k, one in enumerate(tables) if (bad := find_contradictions(one, impacts))} == {}


def test_half_width_off_by_1e_12_contradicts_brute_force(monkeypatch: pytest.MonkeyPatch) -> None:
    """A table whose half widths are off by a part in 10^12 gives a certified run that contradicts brute force."""
    (one,) = draw_tables(0, 1)
    lines = tuple(line._replace(half_width=line.half_width * (1 + 1e-12) + 1e-12) for line in one.lines)
    other = table_runs.build_table_scene(Table(lines, one.place, one.velocity, one.radius, one.restitution))
    monkeypatch.setattr(table_runs, "build_table_scene", lambda _: other)
    assert find_contradictions(one, 4) != []


def test_certified_edges_are_those_of_pic() -> None:
    """Certified runs report the same edge numbers and kinds as PIC; a half-plane has none."""
    floor = Chain(points_m=[(-4, -1), (-1, -1), (1, -1), (4, -1)])
    scene = build_table_scene((0.25, -1), floor, Wall(point_m=(0, 3), normal=(0, -1)), duration_s=9.0)
    for trace in (certify(scene).trace, solve_pic(scene)):
        assert require_value(trace.edges).tolist() == [(1, EdgeKind.FACE), (-1, -1), (2, EdgeKind.FACE)]


def test_impact_on_a_smooth_seam_is_certified() -> None:
    """An impact exactly where a face joins a vertex or a tangent arc has one certified answer."""
    at_the_end = build_table_scene((0, -1), Chain(points_m=[(-2, -1), (0, -1)]))
    certified = certify(at_the_end)
    assert certified.ending is Ending.COMPLETED
    (row,) = certified.trace.impacts
    assert (row["time_s"], row["velocity_first_after"].tolist()) == (0.5, [0.0, 1.0])
    assert row["normal"].tolist() == [0.0, -1.0]
    assert certified.radii["normal"].max() < 1e-15
    tangent = certify(build_table_scene((0, 1), STADIUM, place=(2, 0)))
    assert tangent.trace.impacts["time_s"].tolist() == [1.5, 4.5, 7.5]
    assert tangent.trace.final_position_m.tolist() == [[2.0, -1.0]]
    assert max(tangent.radii["time_s"]) < 1e-15


def test_right_angled_corner_commutes_and_acute_corner_is_degenerate() -> None:
    """Simultaneous impacts in a right-angled corner commute; in a corner of another angle they end the run."""
    room = Chain(points_m=[(-3, -3), (3, -3), (3, 3), (-3, 3)], closed=True)
    square = certify(build_table_scene((1, 1), room, duration_s=4.0))
    assert square.ending is Ending.COMPLETED
    assert square.commuted == ((0, 1),)
    assert square.trace.final_velocity_m_s.tolist() == [[-1.0, -1.0]]
    # Two edges that the axis halves: exactly alike, above and below.
    wedge = certify(build_table_scene((1, 0), Chain(points_m=[(-4, 3), (5, 0), (-4, -3)]), duration_s=9.0))
    found = require_value(wedge.degeneracy)
    assert (found.kind, found.bodies) == (Degenerate.SHARED_INSTANT, (-1, 0))


TOUCHED, GLIDES, OVERLAPS = Degenerate.TOUCHING_START, Degenerate.RESTING_CONTACT, Degenerate.OVERLAPPING_START


@each(
    "scene, kind",
    [
        (build_table_scene((0, -1), Chain(points_m=[(-1, -0.5), (1, -0.5)])), TOUCHED),
        (build_table_scene((0, -1), Ring(centre_m=(0, -1.5), radius_m=1.0)), TOUCHED),
        (build_table_scene((0, -1), Ring(centre_m=(0, 0.5), radius_m=1.0)), TOUCHED),
        (build_table_scene((1, 0), Ring(centre_m=(0, 0.5), radius_m=1.0)), GLIDES),
        (build_table_scene((0, -1), Chain(points_m=[(-1, -0.5 + 2**-54), (1, -0.5 + 2**-54)])), OVERLAPS),
    ],
)
def test_contact_with_a_finite_wall_at_the_start_is_degenerate(scene: Scene, kind: Degenerate) -> None:
    """A disc that touches, overlaps or glides along a finite wall at the start ends the run at once."""
    certified = certify(scene)
    found = require_value(certified.degeneracy)
    assert certified.ending is Ending.DEGENERATE
    assert (found.kind, found.bodies, found.proven) == (kind, (-1, 0), True)


@each(
    "discs, ring, impacts_s, kind, bodies",
    [
        ((disc_at(0, 0, 1), disc_at(1, 0)), Ring(centre_m=(0, 9), radius_m=1), [], TOUCHED, (0, 1)),
        ((disc_at(-2, 0, 1), disc_at(0.5, 0)), Ring(centre_m=(2, 0), radius_m=1), [1.5], GLIDES, (-1, 0, 1)),
        (
            (disc_at(2.5, 0), disc_at(2.5, -1.125, 0, 1, r=0.125)),
            Ring(centre_m=(0, 0), radius_m=3),
            [0.5],
            GLIDES,
            (-1, 0, 1),
        ),
    ],
)
def test_touching_discs_near_a_ring_are_degenerate(
    discs: tuple[Disc, Disc], ring: Ring, impacts_s: list[float], kind: Degenerate, bodies: tuple[int, ...]
) -> None:
    """Discs that touch far from a ring, or are struck against it from outside or along its inside, end the run."""
    certified = certify(staged("ring", *discs, ring, duration_s=9.0))
    found = require_value(certified.degeneracy)
    assert certified.trace.impacts["time_s"].tolist() == impacts_s
    assert (found.kind, found.bodies) == (kind, bodies)


def test_path_at_distance_r_minus_radius_still_meets_the_arc() -> None:
    """A path at distance R - r from the centre of a ring meets it from outside; only distance R + r is a graze."""
    certified = certify(build_table_scene((1, 0), Ring(centre_m=(3, -0.5), radius_m=1.0)), max_impacts=1)
    assert certified.trace.impacts["time_s"].tolist() == [3.0 - np.sqrt(2.0)]


def test_contact_without_approach_is_no_impact() -> None:
    """A disc that touches an edge and leaves or moves along it completes without an impact."""
    for velocity in ((0.0, 1.0), (1.0, 0.0)):
        certified = certify(build_table_scene(velocity, Chain(points_m=[(-1, -0.5), (1, -0.5)]), duration_s=0.5))
        assert certified.ending is Ending.COMPLETED
        assert len(certified.trace.impacts) == 0


def test_exact_graze_of_a_vertex_is_no_impact() -> None:
    """Rational arithmetic decides that an exact graze is no impact; 2^-52 m nearer it is one."""
    post = Ring(centre_m=(4, 0.5), radius_m=0.0)
    assert len(certify(build_table_scene((1, 0), post)).trace.impacts) == 0
    nearer = Ring(centre_m=(4, 0.5 - 2**-52), radius_m=0.0)
    assert len(certify(build_table_scene((1, 0), nearer)).trace.impacts) == 1


def test_tie_on_a_half_plane_is_proven_for_any_wall_number() -> None:
    """Two discs that reach a floor at one instant are a proven tie, whether the floor is wall 0 or wall 1."""
    discs = [disc_at(x, 1.0, 0.0, -1.0, r=0.25) for x in (0.0, 0.5)]
    floor, far = wall_at(0, 0, 0, 1), Chain(points_m=[(50, 50), (51, 50), (51, 51)])
    for walls, name in (((floor,), -1), ((far, floor), -2)):
        found = require_value(certify(staged("tie", *discs, *walls, duration_s=2.0)).degeneracy)
        assert (found.proven, found.bodies) == (True, (name, 0, 1))


def test_friction_on_chains_and_rings_matches_pic() -> None:
    """Certified velocities and spins on rough chains and rings agree with PIC to 1e-10."""
    walls = (STADIUM, Ring(centre_m=(-1, 0.25), radius_m=0.25, friction=2.0))
    rubs = {"wall_friction": 0.25, "wall_tangential_restitution": 0.5, "wall_restitution": 0.875}
    for direction in np.linspace(0.1, 6.1, 9):
        velocity = float(np.cos(direction)), float(np.sin(direction))
        scene = build_table_scene(velocity, *walls, place=(1.0, 0.25), **rubs)
        certified, exact = certify(scene, max_impacts=6), solve_pic(scene, max_impacts=6)
        assert certified.trace.impacts["second"].tolist() == exact.impacts["second"].tolist()
        for name in ("time_s", "velocity_first_after"):
            assert np.allclose(certified.trace.impacts[name], exact.impacts[name], rtol=1e-10, atol=1e-10)
        spins, right = (require_value(trace.spins)["first_after"] for trace in (certified.trace, exact))
        assert np.allclose(spins, right, rtol=1e-10, atol=1e-10)


def test_half_plane_keeps_its_number_and_restitution_next_to_a_chain() -> None:
    """Under gravity a half-plane has its own number and restitution, before or after a chain in the list."""
    floor = Wall(point_m=(0, -2), normal=(0, 1), restitution=0.5)
    post = Chain(points_m=[(3, 0), (3, 1), (4, 1)])
    for walls, body in (((post, floor), -2), ((floor, post), -1)):
        certified = certify(build_table_scene((0, 0), *walls, gravity_m_s2=(0.0, -3.0), duration_s=1.5))
        assert certified.trace.impacts["second"].tolist() == [body]
        assert certified.trace.impacts["time_s"].tolist() == [1.0]
        assert certified.trace.impacts["velocity_first_after"].tolist() == [[0.0, 1.5]]


def test_each_side_of_a_square_has_its_own_normal() -> None:
    """Impacts on three sides of a closed chain have the normals of those sides, pointing into the wall."""
    square = Chain(points_m=[(-2, -2), (2, -2), (2, 2), (-2, 2)], closed=True)
    certified = certify(build_table_scene((1.0, -2.0), square, duration_s=2.5))
    assert certified.trace.impacts["time_s"].tolist() == [0.75, 1.5, 2.25]
    assert certified.trace.impacts["normal"].tolist() == [[0.0, -1.0], [1.0, 0.0], [0.0, 1.0]]


def test_disc_hits_an_arc_of_more_than_half_a_circle_from_any_side() -> None:
    r"""A disc at 1 m/s hits a round wall after exactly 1 s, at a right angle to where the wall is open.

    The wall is 254 degrees of a circle of 5/16 m, whose centre is at (-3/16, 0).
    """
    arc = Chain(points_m=[(0.0, 0.25), (0.0, -0.25)], bulges=(2.0,))
    for side in (1.0, -1.0):
        certified = certify(build_table_scene((0.0, -side), arc, place=(-0.1875, 1.8125 * side), duration_s=2.0))
        assert certified.ending is Ending.COMPLETED
        assert certified.trace.impacts["time_s"].tolist() == [1.0]
        assert certified.trace.final_velocity_m_s.tolist() == [[0.0, side]]


def test_graze_of_a_vertex_that_only_1000_bits_show_is_no_impact() -> None:
    """A disc that passes the thick end of a chain at exactly the contact distance is certified without an impact."""
    thin = 2.0**-480
    post = Chain(points_m=[(0.0, -thin), (0.0, -1.0)], half_width_m=thin)
    certified = certify(build_table_scene((1.0, 0.0), post, place=(-2.0, 0.5), duration_s=4.0))
    assert certified.ending is Ending.COMPLETED
    assert len(certified.trace.impacts) == 0


def test_disc_as_wide_as_a_cup_fills_it_next_to_a_smaller_disc() -> None:
    """A disc that drops at 1 m/s into a half circle of its own radius returns at 1 m/s, even if another is smaller."""
    cup = Chain(points_m=[(-0.5, 0.0), (0.5, 0.0)], bulges=(1.0,))
    small = Disc(position_m=(5.0, 5.0), radius_m=0.25)
    scene = build_table_scene((0.0, -1.0), cup, place=(0.0, 1.0), duration_s=2.0)
    certified = certify(scene.model_copy(update={"discs": (*scene.discs, small)}))
    assert certified.ending is Ending.COMPLETED
    assert certified.trace.impacts["time_s"].tolist() == [1.0]
    assert certified.trace.final_velocity_m_s[0].tolist() == [0.0, 1.0]
