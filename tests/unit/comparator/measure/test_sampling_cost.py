"""The price of sampling, what a run pays of it, and the grades that depend on both."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.planted.faults import DT, ROW, carried_off, delayed, faithful, faster, replayed, tunnelling
from tests.scene_builders import disc_at, staged, sure

from carom import Disc, Outcome, Score, Trace, compare, solve_pic, solve_pit
from carom.catalogue import catalogue
from carom.comparator import Grade
from carom.comparator.thresholds import THRESHOLDS

RADII, OFFSET, SPEED, START = 1.0, 0.6, 4.0, 3.01

OBLIQUE = staged("oblique", disc_at(0, 0, SPEED, 0, r=RADII / 2), disc_at(START, OFFSET, r=RADII / 2), duration_s=2.0)
REFERENCE = solve_pic(OBLIQUE)

NAMES = [name for name in catalogue() if not name.startswith("issues/")]


def found_after(late_s: float) -> float:
    """Velocity error of two equal discs, one at rest, found so late: equal masses exchange what is along the normal."""
    reach = math.sqrt(RADII**2 - OFFSET**2)
    right = np.array([reach, OFFSET]) / RADII
    line = np.array([reach - SPEED * late_s, OFFSET])
    line /= np.hypot(*line)
    return float(np.hypot(*(line[0] * line - right[0] * right)))


def late_by(reference: Trace, late_s: float) -> Trace:
    """The run that finds the one impact so late, and along the line of centres there, as PIT would."""
    impacts = reference.impacts.copy()
    impacts["time_s"] += late_s
    line = np.array([math.sqrt(RADII**2 - OFFSET**2) - SPEED * late_s, OFFSET])
    impacts["normal"] = line / np.hypot(*line)
    passed = SPEED * impacts["normal"][0, 0] * impacts["normal"]
    impacts["velocity_second_after"] = passed
    impacts["velocity_first_after"] = np.array([SPEED, 0.0]) - passed
    return replayed(reference, impacts)


def scored(observed: Trace, sampling: Trace | None = None) -> Score:
    reference = solve_pic(observed.scene)
    return compare(reference, observed, sampling=sampling or solve_pit(observed.scene, frame_rate_hz=1 / DT))


def price() -> float:
    """What PIT pays in `OBLIQUE` at worst over sixteen phases of a step, by the closed form."""
    late_s = math.ceil(REFERENCE.impacts["time_s"][0] / DT) * DT - REFERENCE.impacts["time_s"][0]
    return max(found_after((late_s + k * DT / 16) % DT) for k in range(16))


@each("part", [0.0, 1e-6, 0.005, 0.3, 0.999])
def test_the_price_paid_is_the_error_over_the_closed_form_of_the_worst_phase(part: float) -> None:
    """Found a part of a step late, an impact costs what the line of centres makes of it, over PIT's worst so far."""
    score, off = scored(late_by(REFERENCE, part * DT)), found_after(part * DT)
    assert score.total.velocity == pytest.approx(off, rel=1e-9, abs=1e-15)
    assert score.price_paid == pytest.approx(off / max(off, price()), rel=1e-9, abs=1e-12)


def test_exact_pays_nothing_and_pit_all_of_it_at_one_phase_and_never_more() -> None:
    """PIC pays 0; PIT pays at most 1 at any phase, and 1 at one of the eight."""
    assert scored(faithful(REFERENCE)).price_paid == 0.0
    paid = []
    for k in range(8):
        ahead = SPEED * k * DT / 8
        one = OBLIQUE.discs[0].model_copy(update={"position_m": (ahead, 0.0)})
        scene = OBLIQUE.model_copy(update={"discs": (one, OBLIQUE.discs[1])})
        paid.append(scored(solve_pit(scene, frame_rate_hz=1 / DT)).price_paid)
    assert max(paid) == pytest.approx(1.0, abs=1e-9)
    assert min(paid) < 0.2


def test_a_ladder_of_lateness_never_improves_the_grade() -> None:
    """Found ever later, the impact is exact, close to a hundredth of a step, sampled to a step, then inaccurate."""
    pit = late_by(REFERENCE, 0.5 * DT)
    parts = [0.0, 1e-13, 1e-9, 1e-3, 0.0075, 0.02, 0.4, 0.51, 0.97, 1.0, 1.000001, 1.1, 3.0]
    grades = [scored(late_by(REFERENCE, part * DT), pit).grade for part in parts]
    assert grades == [Grade.EXACT] * 2 + [Grade.CLOSE] * 3 + [Grade.SAMPLED] * 5 + [Grade.INACCURATE] * 3


def test_a_lucky_phase_leaves_no_grade_undefined() -> None:
    """Where PIT happens to look at the very instant, a run is compared with the other phases, too."""
    lucky = dataclasses.replace(faithful(REFERENCE), method="pit")
    close, late, later = (scored(late_by(REFERENCE, part * DT), lucky) for part in (0.001, 0.3, 1.1))
    assert (close.grade, late.grade, later.grade) == (Grade.CLOSE, Grade.SAMPLED, Grade.INACCURATE)
    assert 0 < close.price_paid < 0.01 < late.price_paid < 1 < later.price_paid


def test_an_impact_that_pit_misses_costs_it_all_that_it_changes() -> None:
    """Where PIT sees nothing at any phase, the price is the whole change of velocity, and a run is graded as well."""
    pit = solve_pit(OBLIQUE, frame_rate_hz=0.4)  # one frame before the impact, the next after the end
    assert len(pit.impacts) == 0
    changed = math.sqrt(1 - (OFFSET / RADII) ** 2)  # all that is along the normal, over the speed
    late = dataclasses.replace(late_by(REFERENCE, 1e-4), dt_s=2.5)
    score = scored(late, pit)
    assert score.price_paid == pytest.approx(found_after(1e-4) / changed, rel=1e-6)
    assert score.grade is Grade.CLOSE
    nothing = scored(pit, pit)
    assert nothing.price_paid == pytest.approx(1.0, rel=1e-15)
    assert nothing.grade is Grade.WRONG


def test_an_error_where_sampling_costs_nothing_is_infinitely_worse() -> None:
    """Head-on, PIT's velocities are right at every phase, so any velocity error is the run's own.

    PIT is up to 15/16 of a step late at each of two impacts, so its worst lateness is between one and two steps.
    """
    reference = solve_pic(ROW)
    right, wrong = scored(delayed(reference, 0.3)), scored(faster(reference, 1e-6))
    assert 0.3 / 2 <= right.price_paid <= 0.3 * (1 + 1e-9)
    assert right.grade is Grade.SAMPLED
    assert (wrong.price_paid, wrong.grade) == (math.inf, Grade.INACCURATE)


def test_a_missed_impact_is_paid_for() -> None:
    """Missing an impact costs what it changes, so a run that finds nothing does not look like one without error."""
    score = scored(tunnelling(REFERENCE, 1))
    assert score.price_paid == pytest.approx(math.sqrt(1 - OFFSET**2) / price(), rel=1e-9)
    assert score.grade is Grade.WRONG


@each("value", [math.nan, math.inf])
def test_what_is_no_number_pays_more_than_any_price(value: float) -> None:
    """NaN or infinity anywhere in a run is wrong, and its price is infinite, where the number is and where not."""
    velocity = faithful(REFERENCE).impacts.copy()
    velocity["velocity_first_after"][0, 0] = value
    elsewhere = faithful(REFERENCE).final_position_m.copy()
    elsewhere[1, 1] = value
    for broken in (
        dataclasses.replace(faithful(REFERENCE), impacts=velocity),
        dataclasses.replace(faithful(REFERENCE), final_position_m=elsewhere),
    ):
        assert (scored(broken).price_paid, scored(broken).grade) == (math.inf, Grade.WRONG)


def test_a_final_velocity_that_is_no_number_is_an_infinite_error_of_the_momentum() -> None:
    """The final momentum is off by more than any number, and not by one that compares as less than everything."""
    velocity = faithful(REFERENCE).final_velocity_m_s.copy()
    velocity[1, 0] = math.nan
    score = scored(dataclasses.replace(faithful(REFERENCE), final_velocity_m_s=velocity))
    assert score.momentum_error == score.total.final_velocity == math.inf


def test_an_end_of_pit_s_that_was_not_measured_excuses_no_end() -> None:
    """PIT's run that ended early has no final state to compare; a run whose discs end a tenth of a radius aside has."""
    reference = solve_pic(catalogue()["classics/deflection"].scene)
    pit = solve_pit(reference.scene, frame_rate_hz=60)
    early = dataclasses.replace(pit, end_time_s=0.9 * pit.end_time_s)
    assert math.isnan(scored(reference, early).sampling.final_position)  # type: ignore[union-attr] # PIT was given
    assert scored(carried_off(reference, 0.1), early).grade is Grade.INACCURATE


@each("outcome", [Outcome.NON_FINITE, Outcome.WARNED, Outcome.COMPLETED])
def test_a_run_that_ends_before_an_impact_pays_more_than_any_price(outcome: Outcome) -> None:
    """A run that ends before the impact has an infinite cost, whatever outcome it reports."""
    whole = faithful(REFERENCE)
    none = {name: getattr(whole, name)[:0] for name in ("impacts", "effective_time_s", "state_before")}
    start = np.array([disc.position_m for disc in OBLIQUE.discs])
    score = scored(dataclasses.replace(whole, **none, final_position_m=start, end_time_s=0.0, outcome=outcome))
    assert (score.price_paid, score.grade) == (math.inf, Grade.WRONG)


def test_without_an_impact_or_without_pit_there_is_no_price() -> None:
    """NaN is the answer where there is nothing to pay for, or nothing to compare with."""
    apart = OBLIQUE.model_copy(update={"discs": (OBLIQUE.discs[0], Disc(position_m=(3, 3), radius_m=0.5))})
    reference = solve_pic(apart)
    score = compare(reference, faithful(reference), sampling=solve_pit(apart))
    assert (math.isnan(score.price_paid), score.grade) == (True, Grade.EXACT)
    assert math.isnan(compare(REFERENCE, late_by(REFERENCE, 1e-3)).price_paid)


def test_a_scene_that_can_not_be_shifted_is_held_against_its_own_phase() -> None:
    """Discs that touch at the start, and were in contact before, leave one phase; the price is PIT's there."""
    scene = OBLIQUE.model_copy(
        update={"discs": (OBLIQUE.discs[0].model_copy(update={"position_m": (START - 0.8, 0.0)}), OBLIQUE.discs[1])}
    )
    reference, pit = solve_pic(scene), solve_pit(scene, frame_rate_hz=60)
    score = compare(reference, pit, sampling=pit)
    assert score.price_paid in {0.0, 1.0}
    assert score.grade in {Grade.EXACT, Grade.SAMPLED}


def test_exact_is_exact_to_the_floats_that_are_declared() -> None:
    """An error of 32-bit rounding is exact for who declares 32 bits, and says so; not for who declares 64."""
    narrow = dataclasses.replace(late_by(REFERENCE, 1e-6), float_bits=32)
    assert (scored(narrow).grade, scored(narrow).float_bits) == (Grade.EXACT, 32)
    assert "32-bit floats" in scored(narrow).findings[0].reason
    assert scored(dataclasses.replace(narrow, float_bits=64)).grade is Grade.CLOSE


def test_narrow_floats_excuse_no_time_that_would_not_be_close() -> None:
    """In a long run of short steps the rounding of 32 bits is more than a hundredth of a step, and not exact."""
    scene = ROW.model_copy(update={"duration_s": 100.0})
    late = dataclasses.replace(delayed(solve_pic(scene), 0.04), float_bits=32)
    assert THRESHOLDS.rounding_32 * scene.duration_s > 0.04 * DT
    assert scored(late).grade is Grade.SAMPLED


def test_own_is_what_sampling_does_not_explain() -> None:
    """Who equals PIT has no error of its own, and who beats it the one that is left, not its distance to PIT."""
    pit = late_by(REFERENCE, 0.5 * DT)
    assert scored(pit, pit).own_velocity == 0.0
    fine = scored(late_by(REFERENCE, 1e-8), pit)
    assert sure(fine.against_pit).velocity > 0.01
    assert fine.own_velocity == fine.total.velocity < 1e-6
    assert compare(REFERENCE, pit).own_velocity is None


def test_no_number_of_a_score_stands_in_it_twice() -> None:
    """In a run that is off in everything, the numbers of the largest errors are all different, and nowhere else."""
    reference = solve_pic(catalogue()["classics/inelastic-oblique"].scene)
    pit = solve_pit(reference.scene, frame_rate_hz=50)
    coarse = dataclasses.replace(solve_pit(reference.scene, frame_rate_hz=17), dt_s=pit.dt_s)
    score = compare(reference, coarse, sampling=pit)
    plain = [getattr(score, field.name) for field in dataclasses.fields(score)]
    numbers = [value for value in plain if isinstance(value, float) and math.isfinite(value)]
    for errors in (score.total, score.sampling, score.against_pit):
        found = {name: v for name, v in dataclasses.asdict(sure(errors)).items() if math.isfinite(v) and v}
        assert not set(found.values()) & set(numbers)


@each("name", release_after(len(NAMES[::4]), [*NAMES[::4], *(name for k, name in enumerate(NAMES) if k % 4)]))
@each("finer", release_after(1, [1, 4]))
def test_pit_is_never_worse_than_pit(name: str, finer: int) -> None:
    """PIT compared with itself pays at most the price, and is not inaccurate in any scene at any step."""
    scene = catalogue()[name].scene
    reference = solve_pic(scene)
    pit = solve_pit(scene, frame_rate_hz=finer * scene.frame_rate_hz)
    score = compare(reference, pit, sampling=pit)
    assert score.grade is not Grade.INACCURATE
    assert not score.price_paid > 1


def test_grades_stand_from_best_to_worst() -> None:
    """Each grade is at least as bad as itself and as those before it; what is not graded is as bad as none."""
    order = [Grade.EXACT, Grade.CLOSE, Grade.SAMPLED, Grade.INACCURATE, Grade.WRONG]
    for worse, better in itertools.product(order, repeat=2):
        assert worse.is_at_least_as_bad_as(better) == (order.index(worse) >= order.index(better))
    assert not any(Grade.UNGRADED.is_at_least_as_bad_as(grade) for grade in order)
