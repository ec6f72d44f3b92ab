"""Rounding scales of an impact depend only on what leads to it; narrow floats excuse errors up to a limit."""

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest
from tests.cases import each
from tests.planted.altered_runs import change_states, record_pic, score_run
from tests.planted.faults import carried_off, faster, replay_impacts, replay_reference
from tests.scene_builders import disc_at, require_value, staged

from carom import Disc, Trace, Wall, compare, solve_pic, solve_pit
from carom.comparator import Grade, Verdict
from carom.comparator.scales import compute_median, compute_own_scales, compute_scales


def plant_spin_error(reference: Trace, size: float) -> Trace:
    trace = replay_reference(reference)
    assert reference.final_spin_rad_s is not None
    spins = require_value(reference.spins).copy()
    spins["first_after"] += size
    return dataclasses.replace(trace, spins=spins, final_spin_rad_s=reference.final_spin_rad_s + np.array([size, 0, 0]))


@each(
    "third, friction, plant, verdict",
    [
        (disc_at(0, 50, 0, 1e9), 0.0, faster, Verdict.WRONG_VELOCITY),
        (disc_at(0, 1e13), 0.0, carried_off, Verdict.MISPLACED),
        (disc_at(0, 50, spin_rad_s=1e9), 0.3, plant_spin_error, Verdict.WRONG_SPIN),
    ],
)
def test_unrelated_body_hides_no_error(
    third: Disc, friction: float, plant: Callable[[Trace, float], Trace], verdict: Verdict
) -> None:
    """An error of two discs is reported also next to a fast, distant or spinning disc that they never meet."""
    reference = solve_pic(staged("three", disc_at(0, 0, 1), disc_at(3, 0.3), third, duration_s=5, friction=friction))
    sampling = solve_pit(reference.scene)
    assert compare(reference, plant(reference, 0.0), sampling=sampling).grade is Grade.EXACT
    for size in (1e-9, 1e-6, 5e-4):
        score = compare(reference, plant(reference, size), sampling=sampling)
        assert score.grade is not Grade.EXACT
        assert verdict in score.verdicts
    assert compare(reference, plant(reference, 3.0), sampling=sampling).grade is Grade.INACCURATE


def test_speed_scale_is_the_largest_speed_that_led_to_an_impact() -> None:
    """The speed scale of an impact is the largest speed that earlier impacts have handed on to its discs."""
    # A disc at 4 m/s strikes another disc, passes on its velocity and stops. A disc at 2 m/s hits the disc at rest.
    discs = [disc_at(0, 0, 4, 0), disc_at(3, 0), disc_at(-6, 0, 2, 0), disc_at(0, 9, 1, 0), disc_at(3, 9, m=math.inf)]
    reference = solve_pic(staged("handed on", *discs, duration_s=4))
    own = compute_own_scales(reference)
    met = {
        frozenset((int(i["first"]), int(i["second"]))): s for i, s in zip(reference.impacts, own.speed_m_s, strict=True)
    }
    assert met == {frozenset((0, 1)): 4.0, frozenset((0, 2)): 4.0, frozenset((3, 4)): 1.0}
    assert own.final_speed_m_s.tolist() == [4.0, 4.0, 4.0, 1.0, 0.0]


@each("rate_hz", [60, 240, 1000])
def test_32_bit_run_is_exact_up_to_1_percent_of_a_steps_travel(rate_hz: int) -> None:
    """A 32-bit run is EXACT up to a position error of 1% of a step's travel, and MISPLACED beyond it."""
    # The travel is that of the greatest speed that led to the disc, 1 m/s here.
    reference = solve_pic(staged("long", disc_at(0, 0, 1, 0), disc_at(40, 0.2), duration_s=60))
    run = dataclasses.replace(replay_reference(reference), float_bits=32, dt_s=1 / rate_hz, state_before=None)
    sampling = solve_pit(reference.scene, frame_rate_hz=rate_hz)
    for part, exact in ((0.0, True), (0.0099, True), (0.0101, False), (1.0, False)):
        off = dataclasses.replace(run, final_position_m=run.final_position_m + np.array([[part / rate_hz, 0], [0, 0]]))
        score = compare(reference, off, sampling=sampling)
        assert (score.grade is Grade.EXACT) == exact
        assert (Verdict.MISPLACED in score.verdicts) != exact


TIE = staged(
    "tie",
    disc_at(0, 0, 1, 0),
    disc_at(3, 0.3),
    disc_at(0, 20, 1, 0),
    disc_at(8 + math.sqrt(0.75), 20.5),
    disc_at(8 + math.sqrt(0.75), 19.5),
    duration_s=12,
)


def test_errors_before_a_tie_decide_the_grade() -> None:
    """A missed or wrong impact before a tie decides the grade; else the run is UNGRADED, with the grade until then."""
    reference, sampling = solve_pic(TIE), solve_pit(TIE)
    assert min(reference.ambiguous) > 0
    slow = reference.impacts.copy()
    slow["velocity_second_after"][0] *= 0.5
    slow["velocity_first_after"][0] = slow["velocity_first_before"][0] - slow["velocity_second_after"][0]
    for trace, grade, word in (
        (replay_reference(reference), Grade.UNGRADED, "exact"),
        (replay_impacts(reference, reference.impacts[1:].copy()), Grade.WRONG, "wrong"),
        (replay_impacts(reference, slow), Grade.INACCURATE, "inaccurate"),
    ):
        score = compare(reference, trace, sampling=sampling)
        assert score.grade is grade
        (finding,) = [finding for finding in score.findings if finding.verdict is Verdict.CONVENTION]
        assert finding.reason.endswith(f"until then the run is {word}")
    # If the first impact is a tie, no grade until then is given.
    first = solve_pic(staged("first", *TIE.discs[2:], duration_s=12))
    score = compare(first, replay_reference(first), sampling=solve_pit(first.scene))
    assert (score.grade, score.findings[0].verdict) == (Grade.UNGRADED, Verdict.CONVENTION)
    assert "until then" not in score.findings[0].reason


def test_unknown_velocity_between_impacts_of_a_step_is_no_error() -> None:
    """If a disc meets two others in one step, only its last velocity is compared: PIC's states are EXACT."""
    # A disc strikes the first of two at 1.01 s, and that the next at 1.015 s, both in the step that begins at 1 s.
    scene = staged("chain", disc_at(0, 0, 1, 0), disc_at(2.01, 0), disc_at(3.015, 0), disc_at(9, 9), duration_s=3)
    run = record_pic(scene)
    score = score_run(run)
    assert score.grade is Grade.EXACT
    assert score.total.velocity == 0.0
    assert "1 of 2 impacts" in score.findings[0].reason
    slow = change_states(run, 1.016, speed=lambda velocity, _: 0.9 * velocity)
    assert Verdict.WRONG_VELOCITY in score_run(slow).verdicts


def test_price_of_head_on_pit_is_its_lateness() -> None:
    """In a head-on impact, where PIT's velocities are right, the price is the part of a step that PIT is late."""
    for late in (0.25, 0.75, 0.0):
        scene = staged("head-on", disc_at(0, 0, 1, 0), disc_at(2 - late / 60, 0), duration_s=3)
        pit = solve_pit(scene, frame_rate_hz=60)
        score = compare(solve_pic(scene), pit, sampling=pit)
        assert score.total.velocity <= 1e-12
        assert score.price_paid == pytest.approx(late, abs=1e-9)


def test_reason_names_a_lucky_phase_of_pit() -> None:
    """PIT with a frame at the very instant of the impact is EXACT; the reason says at 1 of 16 phases."""
    scene = staged("oblique", disc_at(0, 0, 2, 0), disc_at(1.8, 0.6), duration_s=2)  # .8 apart along x at .5 s
    reference, pit = solve_pic(scene), solve_pit(scene, frame_rate_hz=64)
    score = compare(reference, pit, sampling=pit)
    assert score.grade is Grade.EXACT
    assert score.findings[0].reason.endswith("PIT is equally accurate at 1 of 16 phases of the step")


@each("duration_s, fastest", [(0.75, 4.0), (1.25, 6.0)])
def test_speed_scale_includes_landings_and_the_end(duration_s: float, fastest: float) -> None:
    """The speed scale under gravity is the largest speed at a landing or at the end: 4 or 6 m/s."""
    # A disc dropped by 1 m at 8 m/s^2 lands after 0.5 s at 4 m/s and leaves at 2 m/s. At 1.25 s another disc, thrown
    # upwards at 4 m/s, falls at 6 m/s.
    ball, beside = disc_at(0, 1.5), disc_at(9, 9, 0, 4)
    floor = Wall(point_m=(0, 0), normal=(0, 1))
    scene = staged("drop", ball, beside, floor, wall_restitution=0.5, gravity_m_s2=(0, -8), duration_s=duration_s)
    assert compute_scales(scene, solve_pic(scene)).speed_m_s == fastest


def test_median_equals_that_of_numpy() -> None:
    """The median equals NumPy's for odd and even numbers of values, also with infinities and NaN."""
    for count in (1, 2, 3, 10, 11):
        values = np.random.default_rng(count).normal(size=count)
        for largest in (values.max(), math.inf, -math.inf, math.nan):
            changed = np.where(values == values.max(), largest, values)
            np.testing.assert_equal(compute_median(changed), np.median(changed))
