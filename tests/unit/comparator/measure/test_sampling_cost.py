"""The price of sampling, what a run pays of it, and the grades that depend on both."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.planted.faults import DT, ROW, carried_off, delayed, faster, replay_impacts, replay_reference, tunnelling
from tests.scene_builders import alter_impact, disc_at, require_value, staged

from carom import Disc, Score, Trace, compare, solve_pic, solve_pit
from carom.catalogue import catalogue
from carom.comparator import Grade
from carom.comparator.thresholds import THRESHOLDS

RADII, OFFSET, SPEED, START = 1.0, 0.6, 4.0, 3.01

OBLIQUE = staged("oblique", disc_at(0, 0, SPEED, 0, r=RADII / 2), disc_at(START, OFFSET, r=RADII / 2), duration_s=2.0)
REFERENCE = solve_pic(OBLIQUE)

NAMES = [name for name in catalogue() if not name.startswith("issues/")]


def compute_velocity_error(late_s: float) -> float:
    """Velocity error of two equal discs, one at rest, found so late: equal masses exchange what is along the normal."""
    reach = math.sqrt(RADII**2 - OFFSET**2)
    right = np.array([reach, OFFSET]) / RADII
    line = np.array([reach - SPEED * late_s, OFFSET])
    line /= np.hypot(*line)
    return float(np.hypot(*(line[0] * line - right[0] * right)))


def delay_impact(reference: Trace, late_s: float) -> Trace:
    """The run that finds the one impact so late, and along the line of centres there, as PIT would."""
    impacts = reference.impacts.copy()
    impacts["time_s"] += late_s
    line = np.array([math.sqrt(RADII**2 - OFFSET**2) - SPEED * late_s, OFFSET])
    impacts["normal"] = line / np.hypot(*line)
    passed = SPEED * impacts["normal"][0, 0] * impacts["normal"]
    impacts["velocity_second_after"] = passed
    impacts["velocity_first_after"] = np.array([SPEED, 0.0]) - passed
    return replay_impacts(reference, impacts)


def score_run(observed: Trace, sampling: Trace | None = None) -> Score:
    reference = solve_pic(observed.scene)
    return compare(reference, observed, sampling=sampling or solve_pit(observed.scene, frame_rate_hz=1 / DT))


def compute_worst_pit_error() -> float:
    """What PIT pays in `OBLIQUE` at worst over sixteen phases of a step, by the closed form."""
    late_s = math.ceil(REFERENCE.impacts["time_s"][0] / DT) * DT - REFERENCE.impacts["time_s"][0]
    return max(compute_velocity_error((late_s + k * DT / 16) % DT) for k in range(16))


@each("part", [0.0, 1e-6, 0.005, 0.3, 0.999])
def test_price_is_the_velocity_error_over_pits_worst_phase(part: float) -> None:
    """The price paid is the closed-form velocity error of a late impact over PIT's largest at sixteen phases."""
    score, off = score_run(delay_impact(REFERENCE, part * DT)), compute_velocity_error(part * DT)
    assert score.total.velocity == pytest.approx(off, rel=1e-9, abs=1e-15)
    assert score.price_paid == pytest.approx(off / max(off, compute_worst_pit_error()), rel=1e-9, abs=1e-12)


def test_price_of_pit_is_1_at_its_worst_phase() -> None:
    """PIT pays at most 1 at eight phases of a step, 1 at one of them, and less than 0.2 at another."""
    paid = []
    for k in range(8):
        ahead = disc_at(SPEED * k * DT / 8, 0, SPEED, 0, r=RADII / 2)
        scene = OBLIQUE.model_copy(update={"discs": (ahead, OBLIQUE.discs[1])})
        paid.append(score_run(solve_pit(scene, frame_rate_hz=1 / DT)).price_paid)
    assert max(paid) == pytest.approx(1.0, abs=1e-9)
    assert min(paid) < 0.2


def test_grade_never_improves_with_lateness() -> None:
    """An impact found ever later is EXACT, then CLOSE, SAMPLED up to one step, and INACCURATE beyond."""
    pit = delay_impact(REFERENCE, 0.5 * DT)
    parts = [0.0, 1e-13, 1e-9, 1e-3, 0.0075, 0.02, 0.4, 0.51, 0.97, 1.0, 1.000001, 1.1, 3.0]
    grades = [score_run(delay_impact(REFERENCE, part * DT), pit).grade for part in parts]
    assert grades == [Grade.EXACT] * 2 + [Grade.CLOSE] * 3 + [Grade.SAMPLED] * 5 + [Grade.INACCURATE] * 3


def test_price_is_relative_to_the_whole_change_if_pit_misses() -> None:
    """If PIT misses the impact at every phase, the price is relative to the impact's whole velocity change."""
    pit = solve_pit(OBLIQUE, frame_rate_hz=0.4)  # one frame before the impact, the next after the end
    assert len(pit.impacts) == 0
    changed = math.sqrt(1 - (OFFSET / RADII) ** 2)  # all that is along the normal, over the speed
    late = dataclasses.replace(delay_impact(REFERENCE, 1e-4), dt_s=2.5)
    score = score_run(late, pit)
    assert score.price_paid == pytest.approx(compute_velocity_error(1e-4) / changed, rel=1e-6)
    assert score.grade is Grade.CLOSE
    nothing = score_run(pit, pit)
    assert nothing.price_paid == pytest.approx(1.0, rel=1e-15)
    assert nothing.grade is Grade.WRONG


def test_velocity_error_in_a_head_on_impact_costs_infinity() -> None:
    """Head-on, where PIT's velocities are right at every phase, a velocity error has an infinite price."""
    # PIT is up to 15/16 of a step late at each of two impacts, so its worst lateness is between one and two steps.
    reference = solve_pic(ROW)
    right, wrong = score_run(delayed(reference, 0.3)), score_run(faster(reference, 1e-6))
    assert 0.3 / 2 <= right.price_paid <= 0.3 * (1 + 1e-9)
    assert right.grade is Grade.SAMPLED
    assert (wrong.price_paid, wrong.grade) == (math.inf, Grade.INACCURATE)


def test_missed_impact_costs_its_whole_velocity_change() -> None:
    """A run that misses the impact pays its whole velocity change, and is WRONG."""
    score = score_run(tunnelling(REFERENCE, 1))
    assert score.price_paid == pytest.approx(math.sqrt(1 - OFFSET**2) / compute_worst_pit_error(), rel=1e-9)
    assert score.grade is Grade.WRONG


@each("value", [math.nan, math.inf])
def test_non_finite_run_has_an_infinite_price(value: float) -> None:
    """NaN or infinity in a velocity makes a run WRONG, with an infinite price and infinite errors."""
    run = replay_reference(REFERENCE)
    final = run.final_velocity_m_s.copy()
    final[1, 0] = value
    score = score_run(dataclasses.replace(run, final_velocity_m_s=final))
    assert score.total.momentum == score.total.final_velocity == math.inf
    for broken in (score, score_run(alter_impact(run, 0, velocity_first_after=(value, 0.0)))):
        assert (broken.price_paid, broken.grade) == (math.inf, Grade.WRONG)


def test_pit_that_ended_early_excuses_no_wrong_end() -> None:
    """If PIT has no final state, a run whose discs end a tenth of a radius aside is INACCURATE."""
    reference = solve_pic(catalogue()["classics/deflection"].scene)
    pit = solve_pit(reference.scene, frame_rate_hz=60)
    early = dataclasses.replace(pit, end_time_s=0.9 * pit.end_time_s)
    assert math.isnan(score_run(reference, early).sampling.final_position)  # type: ignore[union-attr] # PIT was given
    assert score_run(carried_off(reference, 0.1), early).grade is Grade.INACCURATE


def test_price_is_nan_without_an_impact_or_pit() -> None:
    """The price is NaN if the scene has no impact, or if there is no PIT run to compare with."""
    apart = OBLIQUE.model_copy(update={"discs": (OBLIQUE.discs[0], Disc(position_m=(3, 3), radius_m=0.5))})
    reference = solve_pic(apart)
    score = compare(reference, replay_reference(reference), sampling=solve_pit(apart))
    assert (math.isnan(score.price_paid), score.grade) == (True, Grade.EXACT)
    assert math.isnan(compare(REFERENCE, delay_impact(REFERENCE, 1e-3)).price_paid)


def test_exact_depends_on_the_declared_width_of_floats() -> None:
    """An error of 32-bit rounding is EXACT for a run that declares 32 bits, and CLOSE for one with 64."""
    narrow = dataclasses.replace(delay_impact(REFERENCE, 1e-6), float_bits=32)
    score = score_run(narrow)
    assert (score.grade, score.float_bits) == (Grade.EXACT, 32)
    assert "32-bit floats" in score.findings[0].reason
    assert score_run(dataclasses.replace(narrow, float_bits=64)).grade is Grade.CLOSE
    # In a long run rounding could explain a lateness of 0.04 steps, and does not excuse it.
    scene = ROW.model_copy(update={"duration_s": 100.0})
    assert THRESHOLDS.rounding_32 * scene.duration_s > 0.04 * DT
    assert score_run(dataclasses.replace(delayed(solve_pic(scene), 0.04), float_bits=32)).grade is Grade.SAMPLED


def test_own_velocity_error_excludes_what_sampling_costs() -> None:
    """A run equal to PIT has no velocity error of its own; one that is better has its total error."""
    pit = delay_impact(REFERENCE, 0.5 * DT)
    assert score_run(pit, pit).own_velocity == 0.0
    fine = score_run(delay_impact(REFERENCE, 1e-8), pit)
    assert require_value(fine.against_pit).velocity > 0.01
    assert fine.own_velocity == fine.total.velocity < 1e-6
    assert compare(REFERENCE, pit).own_velocity is None


@each("name", release_after(len(NAMES[::4]), [*NAMES[::4], *(name for k, name in enumerate(NAMES) if k % 4)]))
@each("finer", release_after(1, [1, 4]))
def test_pit_compared_with_itself_is_never_inaccurate(name: str, finer: int) -> None:
    """PIT compared with itself pays at most 1 and is not INACCURATE, at the scene's frame rate and four times it."""
    scene = catalogue()[name].scene
    reference = solve_pic(scene)
    pit = solve_pit(scene, frame_rate_hz=finer * scene.frame_rate_hz)
    score = compare(reference, pit, sampling=pit)
    assert score.grade is not Grade.INACCURATE
    assert not score.price_paid > 1


def test_grades_are_ordered_from_best_to_worst() -> None:
    """Each grade is at least as bad as itself and as all better ones; UNGRADED is as bad as none."""
    order = [Grade.EXACT, Grade.CLOSE, Grade.SAMPLED, Grade.INACCURATE, Grade.WRONG]
    for worse, better in itertools.product(order, repeat=2):
        assert worse.is_at_least_as_bad_as(better) == (order.index(worse) >= order.index(better))
    assert not any(Grade.UNGRADED.is_at_least_as_bad_as(grade) for grade in order)
