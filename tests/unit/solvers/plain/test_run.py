"""PIC by all pairs: the run that the event-driven kernel is held to, and that serves without it."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from tests.drawn import jittered, scene_of
from tests.forms import needs_extension, plain_form
from tests.lengths import each
from tests.stage import disc_at, line, staged, sure, wall_at

from carom import Chain, Disc, Ring, Scene, solve_pic
from carom.errors import CaromError, InputError
from carom.physics.features import Mover
from carom.solvers.event_driven.run import EventDrivenRun
from carom.solvers.pic import pic_run
from carom.solvers.plain.compiled_walls import finite_wall
from carom.solvers.plain.finite_walls import FiniteWall
from carom.solvers.plain.framewise import solve_pic_framewise
from carom.solvers.plain.run import AllPairsRun
from carom.trace import Outcome, wall_body


@each("friction, ambiguous", [(0.0, ()), (0.25, (1,))])
@pytest.mark.parametrize("all_pairs", [True, pytest.param(False, marks=needs_extension)])
def test_two_impacts_at_right_angles_are_unique_without_friction_only(
    friction: float, ambiguous: tuple[int, ...], all_pairs: bool
) -> None:
    """Struck at once from the left and from below, a disc takes both impulses; with friction each changes both."""
    discs = [
        Disc(position_m=(0.0, 0.0), radius_m=0.5),
        Disc(position_m=(-2.0, 0.0), velocity_m_s=(1.0, 0.0), radius_m=0.5),
        Disc(position_m=(0.0, -2.0), velocity_m_s=(0.0, 1.0), radius_m=0.5),
    ]
    run = pic_run(Scene(name="corner", duration_s=3.0, friction=friction, discs=discs), all_pairs=all_pairs)
    run.advance_to(3.0)
    assert run.log.array()["time_s"].tolist()[:2] == [1.0, 1.0]
    assert run.log.ambiguous() == ambiguous


@needs_extension
def test_solve_pic_does_without_the_extension() -> None:
    """Without the extension the same call gives the same trace, and says why it took so long."""
    scene = scene_of(jittered(np.random.default_rng(6), 6), 3.0)
    compiled = solve_pic(scene, sample_times_s=[1.0, 2.0], max_impacts=40, window_s=(0.5, 9.0))
    with plain_form():
        plain = solve_pic(scene, sample_times_s=[1.0, 2.0], max_impacts=40, window_s=(0.5, 9.0))
    assert plain.impacts.tobytes() == compiled.impacts.tobytes()
    assert plain.ambiguous == compiled.ambiguous
    assert sure(plain.samples).position_m.tobytes() == sure(compiled.samples).position_m.tobytes()
    assert plain.final_position_m.tobytes() == compiled.final_position_m.tobytes()
    assert (len(plain.notes), compiled.notes) == (1, ())


def test_the_kernel_refuses_to_run_without_the_extension() -> None:
    """Without it, the way in for a million discs says what is missing, and what does without."""
    with plain_form(), pytest.raises(CaromError, match=r"carom\.solve_pic"):
        EventDrivenRun(line(0.0, 2.0, velocities=(1.0, 0.0)))


def test_a_run_is_not_taken_to_nan() -> None:
    """A time that is no number is refused, whatever the form."""
    for run in (AllPairsRun(line(0.0, 2.0, velocities=(1.0, 0.0))), pic_run(line(0.0, 2.0, velocities=(1.0, 0.0)))):
        with pytest.raises(InputError, match="time_s"):
            run.advance_to(math.nan)


def test_a_run_without_an_end_stays_where_the_last_impact_was() -> None:
    """Taken as far as there are impacts, a run stands at the last one, with all its positions finite."""
    for run in (AllPairsRun(line(0.0, 3.0, velocities=(1.0, 0.0))), pic_run(line(0.0, 3.0, velocities=(1.0, 0.0)))):
        run.advance_to(math.inf)
        assert run.time_s == 2.0
        np.testing.assert_array_equal(run.positions(), [[2.0, 0.0], [3.0, 0.0]])


@pytest.fixture
def at_a_wall(monkeypatch: pytest.MonkeyPatch) -> AllPairsRun:
    """A run of one disc that meets nothing, and one wall, in which time is never counted anew."""
    monkeypatch.setattr(AllPairsRun, "epoch_impacts", math.inf)
    return AllPairsRun(staged("wall", disc_at(3, 0), wall_at(0, 0, 1, 0), duration_s=1))


@pytest.mark.parametrize(("impacts", "outcome"), [(400, Outcome.COMPLETED), (401, Outcome.STANDSTILL)])
def test_time_stands_still_after_a_hundred_impacts_for_each_pair_of_bodies_at_one_instant(
    impacts: int, outcome: Outcome, at_a_wall: AllPairsRun
) -> None:
    """Of one disc and one wall, 400 impacts at one instant are let through; the next ends the run."""
    for _ in range(impacts):
        at_a_wall._carry_out(0, wall_body(0), (1.0, 0.0))  # noqa: SLF001 - what no scene of one disc makes
    assert at_a_wall.advance_to(2.0) is outcome


def test_time_that_advances_at_all_does_not_stand_still(at_a_wall: AllPairsRun) -> None:
    """Any number of impacts is fine as long as the clock moves, even by one unit in the last place."""
    time_s = 1.0
    for _ in range(5):
        for _ in range(300):
            at_a_wall._carry_out(0, wall_body(0), (time_s, 0.0))  # noqa: SLF001 - what no scene of one disc makes
        time_s = math.nextafter(time_s, 2.0)
    assert at_a_wall.advance_to(2.0) is Outcome.COMPLETED


def test_a_wall_so_far_off_in_time_that_floats_overflow_is_never_met() -> None:
    """A disc that creeps at 1e-300 m/s to a wall 4 m away does not meet it in a second, nor ever."""
    discs = (disc_at(5, 0, -1e-300, 0), disc_at(9, 9, 1, 0))
    run = AllPairsRun(staged("creep", *discs, wall_at(0, 0, 1, 0), duration_s=1))
    assert run.advance_to(1.0) is Outcome.COMPLETED
    assert run.advance_to(math.inf) is Outcome.COMPLETED
    assert run.impacts == 0


SHAPES: dict[str, Chain | Ring] = {
    "edges": Chain(points_m=[(-2, -1), (0, 1), (1, -1), (3, 0.5)], half_width_m=0.1),
    "arcs": Chain(points_m=[(-2, -2), (2, -2), (2, 2), (-2, 2)], bulges=[0, 1, -0.3, 2.5], closed=True),
    "ring": Ring(centre_m=(0.3, 0.1), radius_m=2.0),
}


@needs_extension
@pytest.mark.parametrize("name", SHAPES)
def test_the_next_feature_is_the_same(name: str) -> None:
    """Instant, feature and gliding of discs drawn by lot, some just off a feature, before a wall that moves."""
    rng = random.Random(name)
    compiled = finite_wall(SHAPES[name].outline)
    with plain_form():
        plain = finite_wall(SHAPES[name].outline)
    assert type(plain) is FiniteWall is not type(compiled)
    plain.features = compiled.features  # the same objects, so that what was left is one of either's
    met = 0
    for _ in range(300):
        velocity, drift = [(rng.uniform(-3, 3), rng.uniform(-3, 3)) for _ in range(2)]
        disc = Mover.at((rng.uniform(-5, 5), rng.uniform(-5, 5)), velocity, rng.choice([0.01, 0.4]), drift)
        last = rng.choice([None, rng.choice(plain.features).feature])
        found = compiled.next_time(disc, last)
        assert found == plain.next_time(disc, last)
        met += math.isfinite(found[0])
    assert met > 50


def test_all_impacts_of_one_frame_are_carried_out() -> None:
    """Three impacts in a single frame all happen, each at its own instant."""
    scene = line(0.0, 2.0, 4.0, 6.0, velocities=(1.0, 0.0, 0.0, 0.0))
    trace = solve_pic_framewise(scene, frame_rate_hz=0.1)
    assert trace.counts["frames"] == 1
    assert trace.impacts["time_s"].tolist() == [1.0, 2.0, 3.0]


@pytest.mark.parametrize("rate", [1.0, 0.5, 0.25])
def test_an_impact_on_a_frame_instant_happens_once(rate: float) -> None:
    """An impact exactly at a frame instant, be it the last one, is neither lost nor doubled."""
    scene = line(0.0, 5.0, velocities=(1.0, 0.0), duration_s=4.0)
    trace = solve_pic_framewise(scene, frame_rate_hz=rate)
    assert trace.impacts["time_s"].tolist() == [4.0]


def test_the_frame_rate_is_the_scenes_own_unless_given() -> None:
    """Without a rate the scene's is taken, and the trace tells the frame length."""
    scene = line(0.0, velocities=(1.0,), duration_s=2.0)
    assert solve_pic_framewise(scene).dt_s == 1 / 60
    assert solve_pic_framewise(scene).counts["frames"] == 120
    assert solve_pic_framewise(scene, frame_rate_hz=8.0).dt_s == 0.125


@each("rate", [0.0, -60.0, math.nan, math.inf])
def test_a_rate_that_is_no_positive_number_is_refused(rate: float) -> None:
    """A frame rate of zero, less, infinity or NaN is refused by name and value."""
    with pytest.raises(InputError, match=f"frame_rate_hz must be a positive number, got {rate}"):
        solve_pic_framewise(line(0.0, velocities=(1.0,)), frame_rate_hz=rate)


def test_a_rate_too_low_to_have_a_frame_length_is_refused() -> None:
    """A frame that would last longer than the largest float is refused, not raised as an overflow."""
    with pytest.raises(InputError, match="frame_rate_hz must lie between 1.49e-154 and 6.7e153".replace("+", "[+]")):
        solve_pic_framewise(line(0.0, velocities=(1.0,)), frame_rate_hz=1e-310)
