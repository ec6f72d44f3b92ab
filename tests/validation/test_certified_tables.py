"""Certified runs on finite walls, against brute force of other formulas and closed forms, and where they must end."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from flint import arb, ctx
from tests.campaign.comparison import Record, compare_with_envelope
from tests.campaign.envelope import compute_envelope
from tests.cases import each, release_after
from tests.scene_builders import disc_at, require_value, staged, wall_at
from tests.validation import table_runs
from tests.validation.random_tables import draw_table
from tests.validation.table_runs import Table

from carom import Disc, Scene, certify, solve_pic
from carom.model.trace import EdgeKind
from carom.model.walls import AnyWall, Chain, Ring, Wall
from carom.solvers.certified.result import Degenerate, Ending

STADIUM = Chain(points_m=[(-2, -2), (2, -2), (2, 2), (-2, 2)], bulges=(0.0, 1.0, 0.0, 1.0), closed=True)


def build_table_scene(
    velocity: tuple[float, float], *walls: AnyWall, place: tuple[float, float] = (0.0, 0.0), **more: Any
) -> Scene:
    return staged("table", disc_at(*place, *velocity), *walls, **{"duration_s": 10.0, **more})


def find_contradictions(table: Table, impacts: int) -> list[str]:
    """Return how a certified run differs from brute force by more than its radii, and PIC by more than rounding."""
    scene = table_runs.build_table_scene(table)
    certified, trace = certify(scene, max_impacts=impacts), solve_pic(scene, max_impacts=impacts)
    found = [
        one.text for one in compare_with_envelope(scene, compute_envelope(scene, trace, impacts), Record.of(trace))
    ]
    with ctx.workprec(table_runs.PRECISION):
        walk = table_runs.iterate_impacts(table)
        for k, (row, radii) in enumerate(zip(certified.trace.impacts, certified.radii, strict=True)):
            line, state = next(walk)
            told = [(row["time_s"], radii["time_s"], state.time)]
            told += zip(row["velocity_first_after"], radii["velocity_first_after"], (state.vx, state.vy), strict=True)
            within = all(abs(arb(float(value)) - truth) <= arb(float(radius)) for value, radius, truth in told)
            if int(row["second"]) != -1 - line or not within:
                found.append(f"impact {k}")
    return found if len(certified.trace.impacts) == impacts else [*found, "impacts are missing"]


#: One table of each kind: at rest on exact numbers, driven, at rest, and falling.
FIRST = (1, 4, 6, 874)


@each("numbers", release_after(1, [FIRST, range(10**5, 10**5 + 300), range(10**5 + 300, 10**5 + 600)]))
def test_certified_runs_and_pic_match_brute_force_on_random_tables(numbers: Sequence[int]) -> None:
    """Impacts on random tables of finite walls are within their radii of 600-bit brute force, and PIC's to rounding."""
    # The tables have bulges of both signs, re-entrant joints, thick bars, islands, cut sides and walls with
    # restitutions of their own; some fall or are driven. Number 874 falls on an arc with a radius of 14 km, on which
    # positions once lost digits.
    tables = {number: drawn[1] for number in numbers if (drawn := draw_table(number)) is not None}
    assert {number: found for number, one in tables.items() if (found := find_contradictions(one, 8))} == {}


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


def test_path_at_distance_r_minus_radius_still_meets_the_arc() -> None:
    """A path at distance R - r from the centre of a ring meets it from outside; only distance R + r is a graze."""
    certified = certify(build_table_scene((1, 0), Ring(centre_m=(3, -0.5), radius_m=1.0)), max_impacts=1)
    assert certified.trace.impacts["time_s"].tolist() == [3.0 - np.sqrt(2.0)]


EDGE, THIN = Chain(points_m=[(-1, -0.5), (1, -0.5)]), 2.0**-480


@each(
    "scene, impacts",
    [
        (build_table_scene((0.0, 1.0), EDGE, duration_s=0.5), 0),
        (build_table_scene((1.0, 0.0), EDGE, duration_s=0.5), 0),
        (build_table_scene((1, 0), Ring(centre_m=(4, 0.5), radius_m=0.0)), 0),
        (build_table_scene((1, 0), Ring(centre_m=(4, 0.5 - 2**-52), radius_m=0.0)), 1),
        # Only 1000 bits show that the disc grazes the thick end of this chain.
        (build_table_scene((1, 0), Chain(points_m=[(0, -THIN), (0, -1)], half_width_m=THIN), place=(-2, 0.5)), 0),
    ],
)
def test_contact_without_approach_and_exact_graze_are_no_impact(scene: Scene, impacts: int) -> None:
    """A disc that leaves an edge, moves along it, or grazes a vertex has no impact; 2^-52 m nearer it has one."""
    certified = certify(scene)
    assert certified.ending is Ending.COMPLETED
    assert len(certified.trace.impacts) == impacts


def test_tie_on_a_half_plane_is_proven_for_any_wall_number() -> None:
    """Two discs that reach a floor at one instant are a proven tie, whether the floor is wall 0 or wall 1."""
    discs = [disc_at(x, 1.0, 0.0, -1.0, r=0.25) for x in (0.0, 0.5)]
    floor, far = wall_at(0, 0, 0, 1), Chain(points_m=[(50, 50), (51, 50), (51, 51)])
    for walls, name in (((floor,), -1), ((far, floor), -2)):
        found = require_value(certify(staged("tie", *discs, *walls, duration_s=2.0)).degeneracy)
        assert (found.proven, found.bodies) == (True, (name, 0, 1))


def test_half_plane_keeps_its_number_and_restitution_next_to_a_chain() -> None:
    """Under gravity a half-plane has its own number and restitution, before or after a chain in the list."""
    floor = Wall(point_m=(0, -2), normal=(0, 1), restitution=0.5)
    post = Chain(points_m=[(3, 0), (3, 1), (4, 1)])
    for walls, body in (((post, floor), -2), ((floor, post), -1)):
        certified = certify(build_table_scene((0, 0), *walls, gravity_m_s2=(0.0, -3.0), duration_s=1.5))
        assert certified.trace.impacts["second"].tolist() == [body]
        assert certified.trace.impacts["time_s"].tolist() == [1.0]
        assert certified.trace.impacts["velocity_first_after"].tolist() == [[0.0, 1.5]]


def test_disc_as_wide_as_a_cup_fills_it_next_to_a_smaller_disc() -> None:
    """A disc that drops at 1 m/s into a half circle of its own radius returns at 1 m/s, even if another is smaller."""
    cup = Chain(points_m=[(-0.5, 0.0), (0.5, 0.0)], bulges=(1.0,))
    small = Disc(position_m=(5.0, 5.0), radius_m=0.25)
    scene = build_table_scene((0.0, -1.0), cup, place=(0.0, 1.0), duration_s=2.0)
    certified = certify(scene.model_copy(update={"discs": (*scene.discs, small)}))
    assert certified.ending is Ending.COMPLETED
    assert certified.trace.impacts["time_s"].tolist() == [1.0]
    assert certified.trace.final_velocity_m_s[0].tolist() == [0.0, 1.0]
