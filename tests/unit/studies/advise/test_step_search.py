"""Search for the largest passing step, on engines whose errors are given functions of the step."""

import math
from collections.abc import Callable
from itertools import pairwise

import pytest
from tests.cases import each
from tests.scene_builders import require_value

from carom.execution.job import Answer, Method, Status
from carom.model.scene import Disc, Scene
from carom.studies.advise.options import AdviceOptions
from carom.studies.advise.step_search import (
    CONFIRM,
    SearchEnding,
    StepAdvice,
    StepSearch,
    count_steps_per_frame,
    generate_step_grid,
)
from carom.studies.advise.step_trial import PhaseResult, StepTrial, compute_step_limit, list_start_phases

DEGREE = math.radians(1)
SCENE = Scene(name="one", discs=[Disc(position_m=(0.0, 0.0), radius_m=1.0)], duration_s=1.0, frame_rate_hz=60)

#: Whether anything is lost at a step, and how wrong a direction is; and, at how many even phases.
Curve = Callable[[float, int], tuple[bool, float]]


def run_search(
    curve: Curve,
    *,
    budget: int = 10**9,
    refuses_above_s: float = math.inf,
    broken: Callable[[float], bool] = lambda _: False,
    guess_s: float = math.inf,
) -> tuple[StepAdvice, list[tuple[float, int]]]:
    """Return what is found of a curve, and what was tried for it, in order."""

    def refusal(dt_s: float) -> str:
        return "too far a step" if dt_s > refuses_above_s else ""

    options = AdviceOptions(direction_error_rad=DEGREE, phases=8, budget_steps=budget)
    search = StepSearch(SCENE, Method("an", "engine"), options, guess_s, 3, refusal)
    tried = []
    while (wanted := search.request) is not None:
        tried.append((wanted.dt_s, wanted.even_phases))
        lost, error = curve(wanted.dt_s, wanted.even_phases)
        phases = wanted.even_phases + 3
        steps = compute_step_limit(SCENE.duration_s, wanted.dt_s, phases)
        reason = "crashed" if broken(wanted.dt_s) else ""
        search.add_result(
            StepTrial(wanted.dt_s, wanted.even_phases, phases, int(lost), int(lost), error, steps, reason)
        )
    return search.build_answer(), tried


def test_step_grid_has_two_steps_per_octave() -> None:
    """The grid goes in two steps per octave from the whole run to a 64th of a frame, or of a smaller guess."""
    grid = list(generate_step_grid(SCENE, math.inf))
    rates = [1 / dt_s for dt_s in grid]
    assert rates[0] == 1.0
    assert rates[-1] == pytest.approx(60 * 64)
    assert [rate for rate in rates if 50 < rate < 500] == pytest.approx([60, 90, 120, 180, 240, 360, 480])
    assert all(coarse > fine >= coarse / 1.5000001 for coarse, fine in pairwise(grid))
    assert 1 / list(generate_step_grid(SCENE, 1 / 600))[-1] == pytest.approx(600 * 64, rel=0.5)


def dt_of(trial: StepTrial | None) -> float:
    """Return the step of a trial that must be there."""
    return require_value(trial).dt_s


def test_range_below_answer_is_tested_for_two_or_three_octaves() -> None:
    """Below the answer two octaves are tested if the error is proportional to the step, otherwise three."""
    grid = list(generate_step_grid(SCENE, math.inf))
    for power, octaves in ((1.0, 2), (0.5, 3)):
        found, tried = run_search(lambda dt, _, p=power: (dt > 0.1, DEGREE * (dt * 100) ** p))  # type: ignore[misc] # a default binds
        answer = found.meets_target
        assert (dt_of(answer.largest_passing), dt_of(answer.smallest_failing)) == pytest.approx((1 / 120, 1 / 90))
        assert require_value(answer.largest_passing).even_phases == CONFIRM
        smallest_tested_s = found.trials[-1].dt_s
        assert smallest_tested_s == pytest.approx(1 / 120 / 2**octaves)
        assert not answer.finer_failures
        assert {dt for dt in grid if smallest_tested_s <= dt <= dt_of(answer.largest_passing)} <= {
            dt for dt, _ in tried
        }
        assert dt_of(found.never_misses.largest_passing) == max(dt for dt in grid if dt <= 0.1)
        assert found.ending is SearchEnding.FOUND


def test_failing_steps_below_passing_ones_are_reported() -> None:
    """If 1/180 and 1/240 s fail and larger steps pass, the answer is smaller than these, and not monotone."""
    found, _ = run_search(lambda dt, _: (1 / 300 < dt < 1 / 150, 1e-3 * dt), guess_s=1 / 400)
    answer = found.meets_target
    assert dt_of(answer.largest_passing) == pytest.approx(1 / 360)
    assert [1 / trial.dt_s for trial in answer.finer_failures] == pytest.approx([180, 240])
    assert answer.coarser_passes[0].dt_s == 1.0
    assert answer.coarser_passes[-1].dt_s == pytest.approx(1 / 120)
    assert answer.smallest_failing == answer.finer_failures[-1]


def test_failure_at_64_phases_moves_answer_to_next_finer_step() -> None:
    """A step that passes at 8 phases but fails at 64 counts as failing, and the next finer step is confirmed."""
    found, tried = run_search(lambda dt, even: (dt > 0.02 or (even == CONFIRM and dt > 0.012), 1e-3 * dt))
    answer = found.never_misses
    assert (dt_of(answer.largest_passing), dt_of(answer.smallest_failing)) == pytest.approx((1 / 90, 1 / 60))
    assert require_value(answer.smallest_failing).even_phases == CONFIRM
    assert (dt_of(answer.largest_passing), CONFIRM) in tried
    assert found.trials[-1].dt_s <= dt_of(answer.largest_passing) / 4 * (1 + 1e-9)


def test_answer_in_whole_steps_per_frame_is_confirmed() -> None:
    """The largest passing step with a whole number of steps per frame is also confirmed at 64 phases."""
    found, tried = run_search(lambda dt, _: (dt > 1 / 80, 1e-3 * dt))
    for answer in (found.never_misses, found.meets_target):
        assert (dt_of(answer.largest_passing), dt_of(answer.frame_divisor)) == pytest.approx((1 / 90, 1 / 120))
        assert require_value(answer.frame_divisor).even_phases == CONFIRM
        assert (dt_of(answer.frame_divisor), CONFIRM) in tried
    found, _ = run_search(lambda dt, even: (dt > 1 / 80 or (even == CONFIRM and 1 / 130 < dt < 1 / 110), 1e-3 * dt))
    assert dt_of(found.never_misses.largest_passing) == pytest.approx(1 / 180)
    assert found.never_misses.frame_divisor is found.never_misses.largest_passing
    large, _ = run_search(lambda dt, _: (False, 1e-3 * dt))
    assert dt_of(large.meets_target.largest_passing) == 1.0
    assert count_steps_per_frame(dt_of(large.meets_target.frame_divisor), 60) == 1


def test_error_independent_of_step_ends_search_at_frame() -> None:
    """An error of 3° at every step ends the search at a frame, or at PIT's step; a slowly falling one does not."""
    found, tried = run_search(lambda dt, _: (dt > 0.2, math.radians(3.0)))
    assert (found.ending, found.meets_target.largest_passing) == (SearchEnding.FLAT, None)
    assert min(dt for dt, _ in tried) == pytest.approx(1 / 60)
    sinking, _ = run_search(lambda dt, _: (False, math.radians(9.0) * dt**0.2))
    assert sinking.ending is SearchEnding.FINEST
    needy, tried = run_search(lambda *_: (False, math.radians(3.0)), guess_s=1 / 1000)
    assert needy.ending is SearchEnding.FLAT
    assert min(dt for dt, _ in tried) <= 1 / 1000


@each("budget", [1, 1000, 5000, 50_000])
def test_search_stays_within_budget_and_is_deterministic(budget: int) -> None:
    """Trials stay within the budget, without an answer when it ends the search, and are the same each time."""
    curve: Curve = lambda dt, _: (False, math.radians(1000.0) * dt)  # noqa: E731 - it is named for two calls
    found, tried = run_search(curve, budget=budget)
    assert sum(compute_step_limit(1.0, dt, even + 3) for dt, even in tried) <= budget
    assert (found.ending, found.meets_target.largest_passing) == (SearchEnding.BUDGET, None)
    assert (found, tried) == run_search(curve, budget=budget)


def test_refused_steps_are_not_run_and_do_not_fail() -> None:
    """Steps that the method refuses are not tried and no failures; the finest of them is reported with its reason."""
    found, tried = run_search(lambda dt, _: (False, 1e-3 * dt), refuses_above_s=0.01)
    assert max(dt for dt, _ in tried) <= 0.01
    assert found.never_misses.smallest_failing is None
    assert found.refused_s == pytest.approx(1 / 90)
    assert found.refusal == "too far a step"
    search = StepSearch(SCENE, Method("an", "engine"), AdviceOptions(), 1.0, 3, lambda _: "no walls")
    assert search.request is None
    assert search.is_refused


def test_crash_at_large_step_fails_and_at_frame_ends_search() -> None:
    """A crash at a step above 0.3 s fails only that step; a crash at one frame ends the search without answer."""
    found, _ = run_search(lambda dt, _: (False, 1e-3 * dt), broken=lambda dt: dt > 0.3)
    assert require_value(found.never_misses.smallest_failing).reason == "crashed"
    assert found.never_misses.largest_passing is not None
    found, tried = run_search(lambda dt, _: (dt > 0.1, 1e-3 * dt), broken=lambda dt: dt < 0.02)
    assert (found.ending, found.never_misses.largest_passing) == (SearchEnding.BROKE, None)
    assert tried[-1][0] == pytest.approx(1 / 60)


def test_unknown_direction_meets_no_demand() -> None:
    """A NaN direction error meets no target; a known one does if the share of phases with a miss is allowed."""
    assert not StepTrial(0.1, 8, 11, 8, 11, math.nan, 1).meets_target(AdviceOptions(miss_probability=0.99))
    some = StepTrial(0.1, 8, 11, 1, 4, DEGREE / 2, 1)
    allowed = [some.meets_target(AdviceOptions(miss_probability=share)) for share in (0.125, 0.1, 0.0)]
    assert (allowed, some.never_misses) == ([True, False, False], False)


def test_impossible_phases_are_skipped_and_crashes_fail_a_step() -> None:
    """Impossible phases are not counted, a step without any phase is a reason, and a crash fails the step."""

    def ran(lost: bool, direction: float) -> Answer[PhaseResult]:
        return Answer(Status.RAN, value=PhaseResult(lost, direction, 10))

    impossible: Answer[PhaseResult] = Answer(Status.UNSUPPORTED, "bodies meet")
    trial = StepTrial.of(0.1, [ran(False, 0.1), impossible, ran(True, math.nan)], [ran(False, 0.2)])
    assert isinstance(trial, StepTrial)
    assert (trial.even_phases, trial.phases, trial.lost_even_phases, trial.lost_phases, trial.steps) == (2, 3, 1, 1, 30)
    assert trial.direction_error_rad == 0.2
    assert StepTrial.of(0.1, [impossible], []) == "bodies meet"
    crashed = StepTrial.of(0.1, [ran(False, 0.1)], [Answer(Status.CRASHED, "signal 11")])
    assert isinstance(crashed, StepTrial)
    assert not crashed.never_misses
    assert not crashed.meets_target(AdviceOptions())


def test_aimed_start_samples_just_before_the_impact() -> None:
    """At an aimed phase, the last check is a thousandth of a step before the impact; equal phases occur once."""
    even, aimed = list_start_phases(0.1, 8, [0.234, 0.234, 0.777])
    assert even == tuple(k / 8 for k in range(8))
    assert len(aimed) == 2
    for phase, at in zip(aimed, (0.234, 0.777), strict=True):
        looks = (at + phase * 0.1) / 0.1
        assert looks - math.floor(looks) == pytest.approx(1e-3)
