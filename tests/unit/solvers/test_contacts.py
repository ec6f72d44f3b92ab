"""Discs that slide, roll and rest: what begins a contact, what changes it, what ends it, and what is not solved."""

import dataclasses
import math
import random

import numpy as np
import pytest
from tests.cases import each
from tests.random_scenes import draw_table_friction_scene
from tests.scene_builders import disc_at, require_value, staged, wall_at
from tests.unit.solvers.run_kinds import assert_same

from carom import Chain, Mode, Outcome, Ring, Scene, solve_pic
from carom.model.flights import free_flights
from carom.model.trace import Trace, build_spin_array
from carom.report.tracks import build_reference_tracks, compute_turnings

FLOOR = wall_at(0.0, 0.0, 0.0, 1.0)
DOWN = {"gravity_m_s2": (0.0, -10.0)}


def list_modes(trace: Trace, disc: int = 0) -> list[Mode]:
    """Return how a disc moves, in order."""
    modes = require_value(trace.modes)
    return [Mode(after) for after in modes["after"][modes["disc"] == disc].tolist()]


def build_sliding_scene(**fields: float) -> Scene:
    """A disc that slides at 3 m/s, slows down by 2 m/s^2, and rolls from half a second on."""
    fields = {"wall_friction": 0.2, "duration_s": 2.0, **DOWN, **fields}  # type: ignore[dict-item]
    return staged("slide", disc_at(0.0, 0.5, 3.0), FLOOR, **fields)


def test_trace_records_slide_and_roll_with_their_motion() -> None:
    """A trace records each contact mode with time, wall, position, velocity, spin and rates of change."""
    modes = require_value(solve_pic(build_sliding_scene()).modes)
    slide, roll = modes
    assert (slide["time_s"], slide["before"], slide["after"]) == (0.0, Mode.FLIGHT, Mode.SLIDE)
    assert (roll["time_s"], roll["before"], roll["after"]) == (0.5, Mode.SLIDE, Mode.ROLL)
    assert (slide["disc"], slide["wall"], slide["impacts"]) == (0, -1, 0)
    assert (slide["acceleration"].tolist(), slide["spin_rate"]) == ([-2.0, 0.0], -8.0)
    assert (roll["position"].tolist(), roll["velocity"].tolist(), roll["spin"]) == ([1.25, 0.5], [2.0, 0.0], -4.0)
    assert (roll["acceleration"].tolist(), roll["spin_rate"]) == ([0.0, 0.0], 0.0)


def test_flights_and_tracks_follow_a_disc_in_contact() -> None:
    """Flights, tracks and turning angles of a trace match the run's states while a disc slides and rolls."""
    scene, times = build_sliding_scene(), [0.1, 0.4, 0.5, 0.9, 1.7]
    trace = solve_pic(scene, sample_times_s=times)
    (track,) = build_reference_tracks(trace)
    assert track.positions_at(np.array(times)) == pytest.approx(
        require_value(trace.samples).position_m[:, 0], abs=1e-15
    )
    assert track.convert_to_pull(np.array([0.0, -10.0]), 1e-4).positions_at(np.array(times)) == pytest.approx(
        track.positions_at(np.array(times)), abs=1e-4
    )
    last = list(free_flights(trace))[-1]
    assert last.position_at(2.0) == pytest.approx(trace.final_position_m[0], abs=1e-15)
    # Its spin falls by 8 rad/s^2 for half a second, to -4: a turn of -1 and then of -6.
    (turning,) = compute_turnings(dataclasses.replace(trace, spins=build_spin_array([])))
    assert turning.angle_at(0.5) == pytest.approx(-1.0, abs=1e-12)
    assert turning.angle_at(2.0) == pytest.approx(-7.0, abs=1e-12)


def test_disc_struck_from_below_its_centre_leaves_the_floor() -> None:
    """A small disc that rolls under a large one lifts it off the floor; its own floor impact is ambiguous."""
    scene = staged("under", disc_at(0.0, 0.25, 4.0, r=0.25), disc_at(3.0, 0.5), FLOOR, duration_s=0.75, **DOWN)
    trace = solve_pic(scene)
    assert list_modes(trace, 1) == [Mode.REST, Mode.FLIGHT]
    assert trace.final_velocity_m_s[1, 1] != 0.0
    assert trace.impacts[["first", "second"]].tolist()[:2] == [(0, 1), (0, -1)]
    assert trace.ambiguous == (1,)


def test_disc_bounces_off_a_side_wall_and_stays_on_the_floor() -> None:
    """A bounce off a frictionless side wall, perpendicular to the floor, does not end contact with the floor."""
    scene = staged("side", disc_at(0.0, 0.5, 2.0), FLOOR, wall_at(2.0, 0.0, -1.0, 0.0), duration_s=2.0, **DOWN)
    trace = solve_pic(scene)
    assert list_modes(trace) == [Mode.SLIDE]
    assert trace.final_position_m.tolist() == [[-1.0, 0.5]]
    assert trace.final_velocity_m_s.tolist() == [[-2.0, 0.0]]


def test_discs_pressed_together_on_a_slope_end_the_run() -> None:
    """Two discs that stay in contact on a slope end the run with PRESSED and a note."""
    nx, ny = 0.6, 0.8
    low = disc_at(0.5 * nx + ny, 0.5 * ny - nx, inertia_factor=0.5)
    high = disc_at(0.5 * nx, 0.5 * ny, inertia_factor=0.25)
    trace = solve_pic(staged("queue", high, low, wall_at(0.0, 0.0, nx, ny), wall_friction=0.9, duration_s=1.0, **DOWN))
    assert trace.outcome is Outcome.PRESSED
    assert "stays in touch with disc" in trace.notes[0]


def test_disc_wedged_between_floor_and_side_wall_ends_the_run() -> None:
    """A spinning disc held by floor and side wall ends the run at 0 s with CORNER and a note on both walls."""
    walls = (FLOOR, wall_at(0.0, 0.0, 1.0, 0.0))
    trace = solve_pic(
        staged("corner", disc_at(0.5, 0.5, spin_rad_s=20.0), *walls, wall_friction=0.25, duration_s=1.0, **DOWN)
    )
    assert (trace.outcome, trace.end_time_s) == (Outcome.CORNER, 0.0)
    assert trace.notes == ("disc 0 is wedged between wall 0 and wall 1",)


def test_window_keeps_only_the_modes_within_it() -> None:
    """A trace of the window from 0.25 s to 1 s has only the mode that begins at 0.5 s."""
    modes = require_value(solve_pic(build_sliding_scene(), window_s=(0.25, 1.0)).modes)
    assert modes["time_s"].tolist() == [0.5]


def test_event_loop_with_contact_matches_all_pairs_to_the_bit() -> None:
    """Discs that bounce, roll and collide have the impacts and modes of a run that computes all pairs."""
    discs = [disc_at(1.3 * k, 0.6 + 0.37 * k, 0.5 - 0.3 * k) for k in range(5)]
    rain = staged(
        "rain", *discs, FLOOR, restitution=0.9, wall_restitution=0.5, wall_friction=0.1, duration_s=6.0, **DOWN
    )
    # Two that come head-on, before a third reaches a wall.
    pair = disc_at(0, 1, 0, 3), disc_at(0, 5, 0, -3), disc_at(9, 1.5, 0, -1), FLOOR
    scenes = [
        rain,
        staged("table", *pair, table_deceleration_m_s2=0.1, duration_s=2.0),
        *map(draw_table_friction_scene, range(3)),
    ]
    runs = [assert_same(scene, 10_000) for scene in scenes]
    assert runs[0].impacts > 100
    assert runs[0].log.modes() is not None


def run_over_edge(speed: float, *points: tuple[float, float], **fields: float) -> Trace:
    """Run a disc that rolls along a line of edges from (0, 0) on."""
    disc = disc_at(0.0, 0.5, speed, spin_rad_s=-2.0 * speed)
    laws = {"wall_friction": 0.5, "wall_restitution": 0.0, "duration_s": 1.0, **DOWN, **fields}
    return solve_pic(staged("edge", disc, Chain(points_m=((-5.0, 0.0), *points)), **laws))


@each("speed, flies", [(3.0, True), (math.sqrt(5.0), True), (2.2, False)])
def test_rolling_disc_flies_off_an_edge_if_fast_enough(speed: float, flies: bool) -> None:
    """A rolling disc flies off the end of an edge if u^2 >= g R, here 5; a slower one ends the run with EDGE."""
    trace = run_over_edge(speed, (1.0, 0.0))
    if flies:
        assert trace.outcome is Outcome.COMPLETED
        assert list_modes(trace) == [Mode.ROLL, Mode.FLIGHT]
        assert trace.final_position_m[0] == pytest.approx((speed, 0.5 - 5.0 * (1.0 - 1.0 / speed) ** 2), abs=1e-15)
    else:
        assert trace.outcome is Outcome.EDGE
        assert trace.end_time_s == pytest.approx(1.0 / speed)
        assert trace.final_position_m[0].tolist() == [1.0, 0.5]
        assert "end of a straight edge of wall 0" in trace.notes[0]


@pytest.mark.long
def test_run_ends_where_a_floor_bends_into_an_arc() -> None:
    """A disc that slides to the point where a floor bends into an arc, up or down, ends the run there with EDGE."""
    for number in range(60):
        rnd = random.Random(number)
        x, y, length, radius, speed, part = (rnd.uniform(0.5, 3) for _ in range(6))
        ends, r = [(x, y), (x + length, y), (x + length, y + rnd.choice((2, -2)) * radius)], radius * min(part / 3, 0.9)
        wall = Chain(points_m=ends, bulges=[0, math.copysign(1, ends[2][1] - y)])
        disc = disc_at(x + 0.1, y + r, speed, r=r)
        trace = solve_pic(staged("bend", disc, wall, wall_restitution=0.0, duration_s=9.0, gravity_m_s2=(0, -1)))
        assert trace.outcome is Outcome.EDGE
        assert trace.end_time_s == pytest.approx((length - 0.1) / speed)


def test_rolling_over_collinear_joints_changes_no_bit() -> None:
    """A disc rolls over joints of collinear edges with the same bits as over a single edge."""
    whole, pieces = run_over_edge(3.0, (1.0, 0.0)), run_over_edge(3.0, (-2.0, 0.0), (0.25, 0.0), (1.0, 0.0))
    assert pieces.final_position_m.tobytes() == whole.final_position_m.tobytes()
    assert require_value(pieces.modes).tobytes() == require_value(whole.modes).tobytes()


def test_rolling_disc_hits_a_rising_edge_of_the_same_wall() -> None:
    """A rolling disc has one impact where its wall turns upwards, and goes on rolling up the slope."""
    trace = run_over_edge(3.0, (1.0, 0.0), (4.0, 3.0))
    assert len(trace.impacts) == 1
    foot = 1.0 - 0.5 * math.tan(math.pi / 8)  # the rim touches both there
    assert trace.impacts["time_s"][0] == pytest.approx(foot / 3.0)
    assert list_modes(trace)[:3] == [Mode.ROLL, Mode.FLIGHT, Mode.ROLL]


def test_disc_flies_over_a_bend_and_lands_on_the_slope() -> None:
    """A disc that rolls onto a falling slope flies at first and lands where its parabola meets the slope."""
    trace = run_over_edge(3.0, (1.0, 0.0), (9.0, -6.0), wall_friction=0.0)
    (impact,) = trace.impacts
    # Rims are R off the slope: with (4, -3)/5 along it and (3, 4)/5 its normal, from the joint on.
    g, u, n = 10.0, 3.0, (0.6, 0.8)
    lasts = (u * n[0] + math.sqrt((u * n[0]) ** 2 - 2.0 * g * n[1] * 0.5 * (1.0 - n[1]))) / (g * n[1])
    assert impact["time_s"] == pytest.approx(1 / 3 + lasts)


@each("radius", [0.5, 2.0])
def test_disc_that_a_post_stops_slides_back_down_its_slope(radius: float) -> None:
    r"""A disc that slides up a slope at 4 m/s, and that a round post stops without a bounce, slides down again.

    On a slope of 3/4, gravity of 5 m/s^2 accelerates it by 3 m/s^2. The disc reaches the post at 1 s, after 2.5 m, and
    has slid 6 m down the slope at 3 s. A post of its own radius stops it in one impact.
    """
    reach = 2.5 + 2.0 * math.sqrt(0.5 * radius)
    post = Ring(centre_m=(0.8 * reach - 0.6 * radius, 0.6 * reach + 0.8 * radius), radius_m=radius)
    bodies = disc_at(-0.3, 0.4, 3.2, 2.4), wall_at(0.0, 0.0, -0.6, 0.8), post
    scene = staged("stopped", *bodies, gravity_m_s2=(0.0, -5.0), wall_restitution=0.0, duration_s=3.0)
    trace = solve_pic(scene, max_impacts=100)
    assert trace.outcome is Outcome.COMPLETED
    assert trace.impacts["time_s"][0] == pytest.approx(1.0, rel=1e-14)
    assert trace.final_velocity_m_s[0] == pytest.approx((-4.8, -3.6), rel=1e-6)
    assert trace.final_position_m[0] == pytest.approx((-0.8 * 3.5 - 0.3, -0.6 * 3.5 + 0.4), rel=1e-6)
    if radius == 0.5:
        assert len(trace.impacts) == 1


def test_bounces_on_an_arc_of_2_to_the_54_metres_end() -> None:
    """A disc that falls for 0.354 s onto a huge ring and bounces with e = 1/2 rests after three times as long."""
    bodies = disc_at(0.0, 0.75, 1.0), Ring(centre_m=(0.0, -(2.0**54)), radius_m=2.0**54)
    scene = staged("huge", *bodies, gravity_m_s2=(0.0, -4.0), wall_restitution=0.5, duration_s=2.0)
    trace = solve_pic(scene, max_impacts=200)
    assert trace.outcome is Outcome.AT_REST
    assert trace.end_time_s == pytest.approx(3.0 * math.sqrt(2.0 * 0.25 / 4.0), abs=1e-6)
