"""Discs that slide, roll and rest: what begins a contact, what changes it, what ends it, and what is not solved."""

import dataclasses
import itertools
import math
import random

import numpy as np
import pytest
from tests.cases import each
from tests.random_scenes import slowing
from tests.scene_builders import disc_at, staged, sure, wall_at
from tests.unit.solvers.run_kinds import assert_same

from carom import Chain, Disc, Mode, Outcome, Scene, solve_pic
from carom.model.flights import free_flights
from carom.model.trace import Trace, build_spin_array
from carom.report.tracks import build_reference_tracks, compute_turnings

FLOOR = wall_at(0.0, 0.0, 0.0, 1.0)
DOWN = {"gravity_m_s2": (0.0, -10.0)}


def modes_of(trace: Trace, disc: int = 0) -> list[Mode]:
    """Return how a disc moves, in order."""
    return [Mode(after) for after in sure(trace.modes)["after"][sure(trace.modes)["disc"] == disc].tolist()]


def sliding(**fields: float) -> Scene:
    """A disc that slides at 3 m/s, slows down by 2 m/s^2, and rolls from half a second on."""
    fields = {"wall_friction": 0.2, "duration_s": 2.0, **DOWN, **fields}  # type: ignore[dict-item]
    return staged("slide", disc_at(0.0, 0.5, 3.0), FLOOR, **fields)


def test_a_trace_tells_each_mode_with_its_instant_and_its_motion() -> None:
    """Slide and roll: when, from what to what, on which wall, where, how fast, and how that changes."""
    modes = sure(solve_pic(sliding()).modes)
    slide, roll = modes
    assert (slide["time_s"], slide["before"], slide["after"]) == (0.0, Mode.FLIGHT, Mode.SLIDE)
    assert (roll["time_s"], roll["before"], roll["after"]) == (0.5, Mode.SLIDE, Mode.ROLL)
    assert (slide["disc"], slide["wall"], slide["impacts"]) == (0, -1, 0)
    assert (slide["acceleration"].tolist(), slide["spin_rate"]) == ([-2.0, 0.0], -8.0)
    assert (roll["position"].tolist(), roll["velocity"].tolist(), roll["spin"]) == ([1.25, 0.5], [2.0, 0.0], -4.0)
    assert (roll["acceleration"].tolist(), roll["spin_rate"]) == ([0.0, 0.0], 0.0)


def test_flights_and_tracks_lead_through_contact() -> None:
    """What a trace's flights, and the tracks that are drawn of them, say of any time is where the run is then."""
    scene, times = sliding(), [0.1, 0.4, 0.5, 0.9, 1.7]
    trace = solve_pic(scene, sample_times_s=times)
    (track,) = build_reference_tracks(trace)
    assert track.positions_at(np.array(times)) == pytest.approx(sure(trace.samples).position_m[:, 0], abs=1e-15)
    assert track.convert_to_pull(np.array([0.0, -10.0]), 1e-4).positions_at(np.array(times)) == pytest.approx(
        track.positions_at(np.array(times)), abs=1e-4
    )
    last = list(free_flights(trace))[-1]
    assert last.position_at(2.0) == pytest.approx(trace.final_position_m[0], abs=1e-15)
    # Its spin falls by 8 rad/s^2 for half a second, to -4: a turn of -1 and then of -6.
    (turning,) = compute_turnings(dataclasses.replace(trace, spins=build_spin_array([])))
    assert turning.angle_at(0.5) == pytest.approx(-1.0, abs=1e-12)
    assert turning.angle_at(2.0) == pytest.approx(-7.0, abs=1e-12)


def test_what_is_struck_from_below_its_middle_leaves_the_floor() -> None:
    """A small disc that rolls under a large one on the same floor lifts it, and is driven into the floor: ambiguous."""
    scene = staged("under", disc_at(0.0, 0.25, 4.0, r=0.25), disc_at(3.0, 0.5), FLOOR, duration_s=0.75, **DOWN)
    trace = solve_pic(scene)
    assert modes_of(trace, 1) == [Mode.REST, Mode.FLIGHT]
    assert trace.final_velocity_m_s[1, 1] != 0.0
    assert trace.impacts[["first", "second"]].tolist()[:2] == [(0, 1), (0, -1)]
    assert trace.ambiguous == (1,)


def test_a_disc_that_rolls_against_a_side_wall_leaves_it_and_keeps_to_the_floor() -> None:
    """Without friction on the side wall, which is square to the floor, its bounce is no reason to leave the floor."""
    scene = staged("side", disc_at(0.0, 0.5, 2.0), FLOOR, wall_at(2.0, 0.0, -1.0, 0.0), duration_s=2.0, **DOWN)
    trace = solve_pic(scene)
    assert modes_of(trace) == [Mode.SLIDE]
    assert trace.final_position_m.tolist() == [[-1.0, 0.5]]
    assert trace.final_velocity_m_s.tolist() == [[-2.0, 0.0]]


def test_two_discs_that_rest_on_one_slope_side_by_side_press_each_other_by_name() -> None:
    """The lower one rests by friction that the upper has not: they stay in touch, which is not solved."""
    nx, ny = 0.6, 0.8
    low = disc_at(0.5 * nx + ny, 0.5 * ny - nx, inertia_factor=0.5)
    high = disc_at(0.5 * nx, 0.5 * ny, inertia_factor=0.25)
    trace = solve_pic(staged("queue", high, low, wall_at(0.0, 0.0, nx, ny), wall_friction=0.9, duration_s=1.0, **DOWN))
    assert trace.outcome is Outcome.PRESSED
    assert "stays in touch with disc" in trace.notes[0]


def test_a_disc_between_floor_and_side_wall_ends_by_name() -> None:
    """Spun so that it climbs neither, it is held by both: contact in a corner is not solved."""
    walls = (FLOOR, wall_at(0.0, 0.0, 1.0, 0.0))
    trace = solve_pic(
        staged("corner", disc_at(0.5, 0.5, spin_rad_s=20.0), *walls, wall_friction=0.25, duration_s=1.0, **DOWN)
    )
    assert (trace.outcome, trace.end_time_s) == (Outcome.CORNER, 0.0)
    assert trace.notes == ("disc 0 is wedged between wall 0 and wall 1",)


def test_what_rests_is_no_end_for_the_others() -> None:
    """One disc lies on the floor from the start; another bounces for the whole of the scene."""
    trace = solve_pic(staged("two", disc_at(0.0, 0.5), disc_at(5.0, 3.0), FLOOR, duration_s=10.0, **DOWN))
    assert trace.outcome is Outcome.COMPLETED
    assert modes_of(trace) == [Mode.REST]
    assert len(trace.impacts) == 7


def test_a_window_keeps_the_modes_within_it() -> None:
    """As it does impacts."""
    modes = sure(solve_pic(sliding(), window_s=(0.25, 1.0)).modes)
    assert modes["time_s"].tolist() == [0.5]


def test_a_disc_balanced_on_an_immovable_one_ends_at_rest() -> None:
    """On a round top there is no straight wall to be in contact with."""
    trace = solve_pic(staged("top", disc_at(0.0, 0.0, m=math.inf), disc_at(0.0, 1.0), duration_s=1.0, **DOWN))
    assert trace.outcome is Outcome.AT_REST


def test_a_bound_of_when_two_meet_changes_nothing() -> None:
    """Discs that bounce, land, roll and strike each other have the impacts and modes of a run that solves each pair."""
    discs = [disc_at(1.3 * k, 0.6 + 0.37 * k, 0.5 - 0.3 * k) for k in range(5)]
    rain = staged(
        "rain", *discs, FLOOR, restitution=0.9, wall_restitution=0.5, wall_friction=0.1, duration_s=6.0, **DOWN
    )
    # Two that come head-on, before a third reaches a wall.
    pair = disc_at(0, 1, 0, 3), disc_at(0, 5, 0, -3), disc_at(9, 1.5, 0, -1), FLOOR
    scenes = [rain, staged("table", *pair, table_deceleration_m_s2=0.1, duration_s=2.0), *map(slowing, range(3))]
    runs = [assert_same(scene, 10_000) for scene in scenes]
    assert runs[0].impacts > 100
    assert runs[0].log.modes() is not None


def over_an_edge(speed: float, *points: tuple[float, float], **fields: float) -> Trace:
    """Run a disc that rolls along a line of edges from (0, 0) on."""
    disc = disc_at(0.0, 0.5, speed, spin_rad_s=-2.0 * speed)
    laws = {"wall_friction": 0.5, "wall_restitution": 0.0, "duration_s": 1.0, **DOWN, **fields}
    return solve_pic(Scene(name="edge", discs=[disc], walls=[Chain(points_m=((-5.0, 0.0), *points))], **laws))


@each("speed, flies", [(3.0, True), (math.sqrt(5.0), True), (2.2, False)])
def test_a_disc_flies_off_an_edge_where_its_weight_holds_it_to_no_circle(speed: float, flies: bool) -> None:
    """From u^2 = P R on, here 5; slower, the run ends by name at that instant, at the end of the edge."""
    trace = over_an_edge(speed, (1.0, 0.0))
    if flies:
        assert trace.outcome is Outcome.COMPLETED
        assert modes_of(trace) == [Mode.ROLL, Mode.FLIGHT]
        assert trace.final_position_m[0] == pytest.approx((speed, 0.5 - 5.0 * (1.0 - 1.0 / speed) ** 2), abs=1e-15)
    else:
        assert trace.outcome is Outcome.EDGE
        assert trace.end_time_s == pytest.approx(1.0 / speed)
        assert trace.final_position_m[0].tolist() == [1.0, 0.5]
        assert "end of a straight edge of wall 0" in trace.notes[0]


@pytest.mark.long
def test_a_floor_that_bends_up_or_down_smoothly_ends_where_the_arc_begins() -> None:
    """However it is rounded, the disc reaches the end of an edge there, and no two walls hold it."""
    for number in range(60):
        rnd = random.Random(number)
        x, y, length, radius, speed, part = (rnd.uniform(0.5, 3) for _ in range(6))
        ends, r = [(x, y), (x + length, y), (x + length, y + rnd.choice((2, -2)) * radius)], radius * min(part / 3, 0.9)
        wall = Chain(points_m=ends, bulges=[0, math.copysign(1, ends[2][1] - y)])
        disc = disc_at(x + 0.1, y + r, speed, r=r)
        trace = solve_pic(staged("bend", disc, wall, wall_restitution=0.0, duration_s=9.0, gravity_m_s2=(0, -1)))
        assert trace.outcome is Outcome.EDGE
        assert trace.end_time_s == pytest.approx((length - 0.1) / speed)


def test_an_edge_in_pieces_is_one() -> None:
    """A disc rolls over joints at which the wall goes straight on as if there were none."""
    whole, pieces = over_an_edge(3.0, (1.0, 0.0)), over_an_edge(3.0, (-2.0, 0.0), (0.25, 0.0), (1.0, 0.0))
    assert pieces.final_position_m.tobytes() == whole.final_position_m.tobytes()
    assert sure(pieces.modes).tobytes() == sure(whole.modes).tobytes()


def test_a_disc_in_contact_meets_what_rises_from_the_same_wall() -> None:
    """Where the line turns up the disc strikes the slope as it strikes any wall, and goes on up it."""
    trace = over_an_edge(3.0, (1.0, 0.0), (4.0, 3.0))
    assert len(trace.impacts) == 1
    foot = 1.0 - 0.5 * math.tan(math.pi / 8)  # the rim touches both there
    assert trace.impacts["time_s"][0] == pytest.approx(foot / 3.0)
    assert modes_of(trace)[:3] == [Mode.ROLL, Mode.FLIGHT, Mode.ROLL]


def test_a_disc_that_flies_over_a_bend_lands_below_it() -> None:
    """Rolling onto a slope that falls off it flies at first, and lands where the parabola meets the slope."""
    trace = over_an_edge(3.0, (1.0, 0.0), (9.0, -6.0), wall_friction=0.0)
    (impact,) = trace.impacts
    # Rims are R off the slope: with (4, -3)/5 along it and (3, 4)/5 its normal, from the joint on.
    g, u, n = 10.0, 3.0, (0.6, 0.8)
    lasts = (u * n[0] + math.sqrt((u * n[0]) ** 2 - 2.0 * g * n[1] * 0.5 * (1.0 - n[1]))) / (g * n[1])
    assert impact["time_s"] == pytest.approx(1 / 3 + lasts)


def test_a_slow_disc_on_a_hill_s_edge_turns_back_before_it() -> None:
    """Whether a mode ends before the edge is reached is for the clock: one that stops short stays."""
    trace = over_an_edge(1.0, (0.3, 0.0), wall_rolling_resistance=0.5, duration_s=3.0)
    assert trace.outcome is Outcome.COMPLETED
    assert modes_of(trace) == [Mode.ROLL, Mode.REST]
    assert trace.final_position_m[0, 0] == pytest.approx(1.5 / (2 * 0.5 * 10.0))


def test_a_landing_keeps_the_angular_momentum_about_the_floor() -> None:
    """What friction takes of a slip it takes from the disc and from its rim, in a landing as in each bounce of it.

    So v - k R w stays, up to what resistance takes, from a first touch at 1e-9 to 2e-8 m/s to rolling: the slip is left
    by the bounces, or taken by them.
    """
    for resistance, ratio, w, e, spin in itertools.product(
        (0.0, 1e-15), (0.5, 1.0), (1e-9, 2e-8), (0.1, 0.5, 0.999999), (0.5, -1.0 + 1e-10, -1.0 + 1e-7, -3.0)
    ):
        disc = Disc(position_m=(0, 1), velocity_m_s=(1, -w), radius_m=1, spin_rad_s=spin, inertia_factor=ratio)
        fields = {"wall_restitution": e, "wall_friction": 0.5, "wall_rolling_resistance": resistance, "duration_s": 1.0}
        trace = solve_pic(staged("lands", disc, FLOOR, **DOWN, **fields))
        assert modes_of(trace)[-1] is Mode.ROLL
        assert spin != -1.0 + 1e-10 or modes_of(trace) == [Mode.ROLL]  # the first of them takes it
        found = trace.final_velocity_m_s[0, 0] - ratio * sure(trace.final_spin_rad_s)[0]
        assert found == pytest.approx(1.0 - ratio * spin, abs=4e-14)
