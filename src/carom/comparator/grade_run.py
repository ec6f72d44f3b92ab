"""Fifth stage of a comparison: grade a run, and compare its errors with those of PIT."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from carom.comparator.grades import Grade, find_worst_grade
from carom.comparator.measure.errors import Measured
from carom.comparator.measure.sampling_cost import SamplingCost, measure_changes, measure_impact_errors
from carom.comparator.measure.stepwise_score import LocalScore
from carom.comparator.scales import find_largest
from carom.comparator.score import Score
from carom.comparator.thresholds import THRESHOLDS
from carom.comparator.verdict import Finding, Verdict
from carom.comparator.verdicts.judged_run import JudgedRun
from carom.model.trace import Outcome


def grade_run(judged: JudgedRun) -> Score:
    """Grade a run."""
    grade, equals_pit, lucky_phase = _grade_flight_and_contact(judged), _has_pit_results(judged), None
    findings, cost = judged.findings, judged.sampling_cost
    if equals_pit and grade in {Grade.EXACT, Grade.CLOSE} and cost is not None and cost.close_phases < cost.phases:
        lucky_phase = (cost.close_phases, cost.phases)
        findings = _add_phase_dependence(findings, *lucky_phase)
    return Score(
        expected=judged.compared.impacts,
        errors=judged.measured.errors,
        missed=judged.alignment.missed,
        spurious=judged.alignment.spurious,
        undecided=judged.alignment.undecided,
        total=judged.measured.largest,
        sampling=None if judged.sampling is None else judged.sampling.largest,
        against_pit=None if judged.measured_against_pit is None else judged.measured_against_pit.largest,
        pit_missed=None if judged.pit_alignment is None else judged.pit_alignment.missed,
        price_paid=_compute_price_paid(judged),
        findings=findings,
        grade=grade,
        float_bits=judged.observed.float_bits,
        scales=judged.scales,
        equals_pit=equals_pit,
        edits=judged.edits,
        beyond_horizon=len(judged.reference.impacts) - judged.compared.impacts,
        horizon_s=None if judged.compared.is_whole_run else judged.compared.until_s,
        local=judged.local,
        convention=judged.convention,
        consistency=judged.consistency,
        local_truth=judged.local_truth,
        diverged_s=judged.diverged_s if judged.has_diverged_before_miss else None,
        pit_diverged_s=judged.pit_diverged_s,
        lucky_phase=lucky_phase,
        contact=judged.contact,
    )


def grade_trajectory(judged: JudgedRun) -> Grade:
    """Grade a run by its differences from the reference; DIVERGED if the paths differ although no step is wrong."""
    return Grade.DIVERGED if judged.has_diverged else _grade_by_trajectory(judged)


def _add_phase_dependence(found: tuple[Finding, ...], as_right: int, phases: int) -> tuple[Finding, ...]:
    """Report that the run equals PIT, and that PIT is less accurate at other phases of the step.

    If nothing is wrong with the run, the first verdict is CONFORMS, and the report is added to the reason of CONFORMS.
    """
    note = f"PIT is equally accurate at {as_right} of {phases} phases of the step"
    if found[0].verdict is Verdict.CONFORMS:
        return (Finding(Verdict.CONFORMS, f"{found[0].reason}; {note}"), *found[1:])
    return (*found, Finding(Verdict.LUCKY_PHASE, note))


def _grade_flight_and_contact(judged: JudgedRun) -> Grade:
    """Grade the impacts of a run and the contacts in which its discs slide, roll and rest. Return the worse grade.

    If the impacts can't be graded, the grade of the contacts is returned. If the trajectory diverged, contacts are
    ignored, because different bounces lead to different contacts. But wrong contacts count if the scene has a single
    disc and a single wall, because the final motion then does not depend on the bounces.
    """
    flight_grade, contact = _grade_flight(judged), judged.contact
    if contact is None:
        return flight_grade
    if flight_grade in {Grade.DIVERGED, Grade.DIVERGED_INACCURATE}:
        is_alone = len(judged.reference.scene.discs) == len(judged.reference.scene.walls) == 1
        return contact.grade if is_alone and contact.grade is Grade.WRONG else flight_grade
    if flight_grade is Grade.UNGRADED or not judged.compared.impacts:
        return contact.grade if judged.convention is None else flight_grade
    return find_worst_grade(flight_grade, contact.grade)


def _grade_flight(judged: JudgedRun) -> Grade:
    """Grade the trajectory as far as the reference is reliable, and grade each single step to the end of the run."""
    trajectory_grade, local = _grade_by_trajectory(judged), judged.local_truth
    if local is None:
        return trajectory_grade
    if judged.has_exact_steps:
        return Grade.EXACT if judged.compared.impacts else Grade.UNGRADED  # without impacts there is nothing to grade
    if judged.has_diverged:
        return Grade.DIVERGED_INACCURATE if local.grade is Grade.INACCURATE else Grade.DIVERGED
    if trajectory_grade is Grade.UNGRADED:
        return _grade_undecided(judged, local)
    agrees_alone = local.agrees_alone and local.grade is not Grade.WRONG
    if trajectory_grade is Grade.EXACT and judged.compared.is_whole_run and agrees_alone:
        return trajectory_grade if judged.compared.impacts else Grade.UNGRADED
    return find_worst_grade(trajectory_grade, local.grade)


def _grade_undecided(judged: JudgedRun, local: LocalScore) -> Grade:
    """Grade a run only by its single steps, because its trajectory can't be graded."""
    ambiguous = judged.reference.ambiguous
    tie_s = float(judged.reference.impacts["time_s"][ambiguous[0]]) if ambiguous else math.inf
    if (local.missed_own and local.first_missed_s < tie_s - judged.observed.dt_s) or (local.invented and not ambiguous):
        return Grade.WRONG
    only_rests = judged.reference.contact_s < math.inf and not judged.compared.impacts
    is_certain = judged.convention is None and local.grade is Grade.INACCURATE
    return local.grade if is_certain or (only_rests and local.grade is not Grade.EXACT) else Grade.UNGRADED


def _grade_by_trajectory(judged: JudgedRun) -> Grade:
    """Grade a run by its largest differences from the reference; UNGRADED if they can't be determined."""
    if judged.non_finite or judged.observed.outcome is Outcome.NON_FINITE:
        return Grade.WRONG
    is_wrong = judged.alignment.missed or judged.alignment.spurious or judged.inverted or judged.has_other_ending
    if judged.convention is None and is_wrong:
        return Grade.WRONG
    if judged.has_nothing_compared:
        return Grade.UNGRADED
    if not _is_consistent(judged):
        return Grade.INACCURATE
    if judged.convention is not None:
        is_certain = judged.grade_before_tie in {Grade.WRONG, Grade.INACCURATE}
        return judged.grade_before_tie if judged.grade_before_tie is not None and is_certain else Grade.UNGRADED
    undecided = bool(judged.alignment.undecided)
    to_rounding = _is_within_rounding(judged, judged.measured, judged.rounding_s)
    if to_rounding and not undecided and _is_consistent(judged, allow_sampling=False):
        return Grade.EXACT
    if judged.sampling is None or judged.sampling_cost is None:
        return Grade.UNGRADED
    close = _has_close_impacts(judged, judged.sampling_cost)
    sampled = _has_sampled_impacts(judged, judged.sampling, judged.sampling_cost)
    if not (close or sampled):
        return Grade.INACCURATE
    if undecided:
        return Grade.UNGRADED
    if close and _has_good_end(judged, THRESHOLDS.close * judged.sampling_cost.final):
        return Grade.CLOSE
    # If all steps are graded *sampled* or better, checking once per step explains the final state. So the errors of the
    # final state may be as large as PIT's errors at PIT's worst phase.
    local = judged.local_truth
    is_only_sampled = local is not None and find_worst_grade(local.grade, Grade.SAMPLED) is Grade.SAMPLED
    pit = judged.sampling_cost.final if is_only_sampled else judged.sampling.largest.list_final_errors()
    has_good_end = _has_good_end(judged, pit)
    return Grade.SAMPLED if sampled and has_good_end else Grade.INACCURATE


def _has_pit_results(judged: JudgedRun) -> bool:
    """Whether a run has the same impacts and final state as PIT, except for rounding."""
    if judged.measured_against_pit is None:
        return False
    alignment, rounding_s = judged.measured_against_pit.alignment, judged.rounding * judged.scales.time_s
    if alignment.missed or alignment.spurious or alignment.undecided:
        return False
    return _is_consistent(judged) and _is_within_rounding(judged, judged.measured_against_pit, rounding_s)


def _is_consistent(judged: JudgedRun, *, allow_sampling: bool = True) -> bool:
    """Whether the states and impacts of a run agree with each other except for rounding.

    If `allow_sampling` is true, deviations that are caused by checking once per step are ignored.
    """
    consistency = judged.consistency
    if consistency is None:
        return False
    strayed, angular = consistency.strayed, consistency.angular
    if allow_sampling:
        strayed, angular = consistency.strayed_excess, consistency.angular_excess
    is_rounding = strayed <= judged.place_rounding and angular <= judged.rounding
    return is_rounding and not judged.contradictions


def _is_within_rounding(judged: JudgedRun, measured: Measured, rounding_s: float) -> bool:
    """Whether all measured errors are within rounding.

    An error that is not measured is NaN and is ignored: for example, a spin error if no disc spins.
    """
    largest = measured.largest
    return (
        bool((np.abs(measured.of_impacts["time_s"]) <= rounding_s).all())
        and judged.are_impacts_rounding(measured)
        and abs(largest.energy) <= min(judged.rounding, THRESHOLDS.energy)
        and not (measured.ends > judged.compute_end_rounding(measured, exactly=True)).any()
    )


def _has_close_impacts(judged: JudgedRun, cost: SamplingCost) -> bool:
    """Whether time errors are below a hundredth of a step, and all other errors below a hundredth of PIT's errors."""
    step_s = judged.observed.dt_s or cost.dt_s
    own_scales, scales = judged.baseline.find_own_scales(judged.reference), judged.scales
    errors, impacts = judged.measured.of_impacts, judged.measured.matched
    close_velocity, close_spin = THRESHOLDS.close * cost.errors[:, impacts]
    velocity = close_velocity + judged.rounding * own_scales.speed_m_s[impacts] / scales.speed_m_s
    spin = close_spin + judged.rounding * own_scales.rim_m_s[impacts] / scales.rim_m_s
    is_close = (np.abs(errors["time_s"]) <= THRESHOLDS.close * step_s) & (errors["velocity"] <= velocity)
    return bool((is_close & ~(errors["spin"] > spin)).all())


def _has_sampled_impacts(judged: JudgedRun, sampling: Measured, cost: SamplingCost) -> bool:
    """Whether the error of each impact is at most PIT's error at that impact or at an earlier one.

    Errors propagate from impact to impact, so the limit for an impact is PIT's largest error up to this impact. If PIT
    misses an impact, both discs keep their old paths, so PIT's velocity error is the whole change of velocity in this
    impact.
    """
    own_scales, scales = judged.baseline.find_own_scales(judged.reference), judged.scales
    rounding_s, count = judged.rounding * scales.time_s, judged.compared.impacts
    known_ratio, dt_s = 1.0 + THRESHOLDS.ratio_known_of(judged.observed.float_bits), judged.observed.dt_s
    changes = judged.baseline.compute_once(measure_changes, lambda: measure_changes(judged.reference, scales))
    pit, is_found = np.concatenate([np.zeros((1, count)), changes[:, :count]]), np.zeros(count, dtype=np.bool_)
    is_found[sampling.matched] = True
    of_pit = sampling.of_impacts
    pit_spin = np.where(np.isnan(of_pit["spin"]), 0.0, of_pit["spin"])
    pit[:, sampling.matched] = of_pit["time_s"], of_pit["velocity"], pit_spin
    # Depending on the phase, a check once per step finds an impact up to a whole step late. If PIT misses the impact,
    # PIT's lateness is unknown, and any lateness is allowed.
    late_s = np.where(is_found, np.maximum.accumulate(np.maximum(pit[0], dt_s)), math.inf)
    early_s = np.where(is_found, np.maximum.accumulate(np.maximum(-pit[0], 0.0)), math.inf)
    at_worst = np.maximum.accumulate(np.maximum(pit[1:], known_ratio * cost.found), axis=1)
    errors, impacts = judged.measured.of_impacts, judged.measured.matched
    time_s, local_s = errors["time_s"], judged.local.time_s[[observed for _, observed in judged.alignment.matched]]
    velocity = at_worst[0, impacts] + judged.rounding * own_scales.speed_m_s[impacts] / scales.speed_m_s
    spin = at_worst[1, impacts] + judged.rounding * own_scales.rim_m_s[impacts] / scales.rim_m_s
    # The local lateness of an impact is measured from the exact impact that follows from the run's own state. If the
    # local lateness is at most a step, earlier impacts caused the rest of the lateness.
    later_s = np.where(local_s <= known_ratio * dt_s, known_ratio * cost.found_off_s[impacts], 0.0)
    latest_s, earliest_s = np.maximum(late_s[impacts], later_s), early_s[impacts]
    is_sampled = (errors["velocity"] <= velocity) & (time_s <= latest_s + rounding_s) & ~(errors["spin"] > spin)
    # A method that checks once per step never finds an impact before the discs touch in its own run. But discs may
    # touch earlier in the run than in the reference, because previous impacts were late. The impact is then early by at
    # most the lateness of the previous impacts.
    forward_s = np.where(np.isnan(local_s), earliest_s, np.maximum(latest_s, earliest_s))
    is_explained = ~(local_s < -rounding_s) & (-time_s <= forward_s + rounding_s)
    return bool((is_sampled & (~(time_s < -rounding_s) | is_explained)).all())


def _has_good_end(judged: JudgedRun, allowed_errors: NDArray[np.float64]) -> bool:
    """Whether the final errors are small enough, or the final state follows from the run's own impacts.

    The elements of `allowed_errors` are in the same order as in `Errors.list_final_errors`. Rounding, and an energy
    error of a millionth, are always allowed.
    """
    own, scales, (energy, *final) = judged.consistency, judged.scales, allowed_errors
    if not abs(judged.measured.largest.energy) <= max(energy + judged.rounding, THRESHOLDS.energy):
        return False
    falls = any(judged.reference.scene.gravity_m_s2)
    if own is not None and not (falls or own.unchecked) and own.strayed <= judged.place_rounding:
        return True
    allowed = np.multiply(final, [scales.length_m, scales.speed_m_s, scales.rim_m_s])[:, None]
    allowed = allowed + judged.compute_end_rounding(judged.measured, exactly=False)
    return not bool(np.any(judged.measured.ends > allowed))


def _compute_price_paid(judged: JudgedRun) -> float:
    """Return the largest ratio of an error of the run to PIT's error of the same kind; see `Score.price_paid`."""
    cost, errors = judged.sampling_cost, judged.measured.errors
    if cost is None or judged.convention is not None:
        return math.nan
    if judged.non_finite:
        return math.inf
    if not judged.compared.impacts:
        return math.nan
    if judged.has_other_ending and judged.alignment.undecided:
        return math.inf
    largest_errors = np.max(measure_impact_errors(judged.measured, judged.scales, judged.compared.impacts), axis=1)
    largest_costs = cost.errors[:, -1]
    ratios = np.where(largest_costs > THRESHOLDS.rounding, largest_errors / largest_costs, math.inf)
    # The ratio is 0 for an error within rounding, even if PIT has no error.
    price_paid = float(np.max(np.where(largest_errors <= judged.rounding, 0.0, ratios)))
    step_s = judged.observed.dt_s or cost.dt_s
    if np.max(largest_costs) <= THRESHOLDS.rounding and price_paid == 0.0 and step_s:
        # The velocities of both PIT and the run are exact in this scene, so times are compared. PIT is late by up to a
        # step per impact, and these delays add up.
        late_s = abs(find_largest([error.time_s for error in errors], default=0.0))
        return 0.0 if late_s <= judged.rounding_s else late_s / max(step_s, cost.late_s)
    return price_paid
