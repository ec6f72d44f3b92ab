"""Grades of runs, derived from measured errors."""

from __future__ import annotations

import math

import numpy as np

from carom.comparator.evidence import Evidence
from carom.comparator.grades import Grade
from carom.comparator.measure import Errors, Measured
from carom.comparator.sampling import SamplingCost, measure_changes
from carom.comparator.self_consistency import report_contradictions
from carom.comparator.step_findings import has_diverged, has_exact_steps
from carom.comparator.stepwise.score import LocalScore
from carom.comparator.thresholds import THRESHOLDS
from carom.model.trace import Outcome


def grade_run(evidence: Evidence) -> Grade:
    """Grade a run by its impacts and by its contacts, where discs slide, roll and rest; the worse grade counts.

    Where impacts give no grade, contacts alone decide. Where the trajectory has diverged before, contacts do not count,
    except for a single disc on a single wall: it ends in contact whatever its bounces were.
    """
    flight_grade, contact = _grade_flight(evidence), evidence.contact
    if contact is None:
        return flight_grade
    if flight_grade in {Grade.PARTED, Grade.PARTED_INACCURATE}:
        is_alone = len(evidence.reference.scene.discs) == len(evidence.reference.scene.walls) == 1
        return contact.grade if is_alone and contact.grade is Grade.WRONG else flight_grade
    if flight_grade is Grade.UNGRADED or not evidence.compared.impacts:
        return contact.grade if evidence.convention is None else flight_grade
    return max(flight_grade, contact.grade, key=list(Grade).index)


def _grade_flight(evidence: Evidence) -> Grade:
    """Grade by the reference's trajectory, as far as it is reliable, and by stepwise accuracy to the end."""
    trajectory_grade, local = _grade_by_trajectory(evidence), evidence.local_truth
    if local is None:
        return trajectory_grade
    if has_exact_steps(evidence):
        return Grade.EXACT if evidence.compared.impacts else Grade.UNGRADED  # nothing happened that could be graded
    if has_diverged(evidence):
        return Grade.PARTED_INACCURATE if local.grade is Grade.INACCURATE else Grade.PARTED
    if trajectory_grade is Grade.UNGRADED:
        return _grade_undecided(evidence, local)
    if (
        trajectory_grade is Grade.EXACT
        and evidence.compared.is_whole_run
        and local.agrees_alone
        and local.grade is not Grade.WRONG
    ):
        return trajectory_grade if evidence.compared.impacts else Grade.UNGRADED
    return max(trajectory_grade, local.grade, key=list(Grade).index)


def grade_trajectory(evidence: Evidence) -> Grade:
    """Grade by the reference's trajectory alone, unless the run has diverged from it."""
    return Grade.PARTED if has_diverged(evidence) else _grade_by_trajectory(evidence)


def _grade_undecided(evidence: Evidence, local: LocalScore) -> Grade:
    """Grade a run by its steps where its trajectory gives no grade."""
    ambiguous = evidence.reference.ambiguous
    tie_s = float(evidence.reference.impacts["time_s"][ambiguous[0]]) if ambiguous else math.inf
    if (local.missed_own and local.first_missed_s < tie_s - evidence.observed.dt_s) or (
        local.invented and not ambiguous
    ):
        return Grade.WRONG
    only_rests = evidence.reference.contact_s < math.inf and not evidence.compared.impacts
    is_certain = evidence.convention is None and local.grade is Grade.INACCURATE
    return local.grade if is_certain or (only_rests and local.grade is not Grade.EXACT) else Grade.UNGRADED


def _grade_by_trajectory(evidence: Evidence) -> Grade:
    """Grade by the reference's trajectory: the worst certain fault decides; undecidable runs are not graded."""
    if evidence.non_finite or evidence.observed.outcome is Outcome.NON_FINITE:
        return Grade.WRONG
    if evidence.convention is None and _is_wrong(evidence):
        return Grade.WRONG
    if evidence.has_nothing_compared:
        return Grade.UNGRADED
    if not _is_consistent(evidence):
        return Grade.INACCURATE
    if evidence.convention is not None:
        is_certain = evidence.grade_before_tie in {Grade.WRONG, Grade.INACCURATE}
        return evidence.grade_before_tie if evidence.grade_before_tie is not None and is_certain else Grade.UNGRADED
    undecided = bool(evidence.measured.alignment.undecided)
    to_rounding = _agrees_to_rounding(evidence, evidence.measured, evidence.rounding_s)
    if to_rounding and not undecided and _is_consistent(evidence, allow_sampling=False):
        return Grade.EXACT
    if evidence.sampling is None or evidence.sampling_cost is None:
        return Grade.UNGRADED
    close, sampled = (
        _has_close_impacts(evidence, evidence.sampling_cost),
        _has_sampled_impacts(evidence, evidence.sampling, evidence.sampling_cost),
    )
    if not (close or sampled):
        return Grade.INACCURATE
    if undecided:
        return Grade.UNGRADED
    if close and _has_good_end(evidence, evidence.sampling_cost, THRESHOLDS.close):
        return Grade.CLOSE
    # Where all steps are sampled at worst, sampling alone led to the end: then PIT's worst phase is the limit.
    local = evidence.local_truth
    is_only_sampled = local is not None and list(Grade).index(local.grade) <= list(Grade).index(Grade.SAMPLED)
    has_good_end = _has_good_end(evidence, evidence.sampling_cost if is_only_sampled else evidence.sampling.largest)
    return Grade.SAMPLED if sampled and has_good_end else Grade.INACCURATE


def has_pit_results(evidence: Evidence) -> bool:
    """Whether a run has the same impacts and final state as PIT, to rounding."""
    if evidence.against_pit is None:
        return False
    alignment = evidence.against_pit.alignment
    return (
        not (alignment.missed or alignment.spurious or alignment.undecided)
        and _is_consistent(evidence)
        and _agrees_to_rounding(evidence, evidence.against_pit, evidence.rounding * evidence.scales.time_s)
    )


def _is_wrong(evidence: Evidence) -> bool:
    alignment = evidence.measured.alignment
    return bool(alignment.missed or alignment.spurious or evidence.order.inverted or evidence.has_other_ending)


def _is_consistent(evidence: Evidence, *, allow_sampling: bool = True) -> bool:
    """Whether a run agrees with itself, to the rounding of its floats and, if allowed, to what sampling explains."""
    own = evidence.consistency
    if own is None:
        return False
    strayed, angular = (own.strayed_excess, own.angular_excess) if allow_sampling else (own.strayed, own.angular)
    is_rounding = strayed <= evidence.place_rounding and angular <= evidence.rounding
    return is_rounding and not list(report_contradictions(evidence))


def _agrees_to_rounding(evidence: Evidence, measured: Measured, rounding_s: float) -> bool:
    """Whether all measured errors are within rounding.

    Final states beyond a horizon, and spins if no disc spins, are not measured and NaN.
    """
    errors, largest = measured.errors, measured.largest
    return (
        all(abs(error.time_s) <= rounding_s and evidence.is_rounding(error, measured) for error in errors)
        and abs(largest.energy) <= min(evidence.rounding, THRESHOLDS.energy)
        and not (measured.ends > evidence.end_rounding(measured, exactly=True)).any()
    )


def _has_close_impacts(evidence: Evidence, cost: SamplingCost) -> bool:
    """Whether each error is at most a small part of a step, or of the cost of sampling up to that impact."""
    step_s = evidence.observed.dt_s or cost.dt_s
    own, scales = evidence.measured.own, evidence.scales
    reliable_impacts = evidence.compared.impacts
    velocity = (
        THRESHOLDS.close * cost.velocity + evidence.rounding * own.speed_m_s[:reliable_impacts] / scales.speed_m_s
    )
    spin = THRESHOLDS.close * cost.spin + evidence.rounding * own.rim_m_s[:reliable_impacts] / scales.rim_m_s
    return all(
        abs(error.time_s) <= THRESHOLDS.close * step_s
        and error.velocity <= velocity[error.reference]
        and not error.spin > spin[error.reference]
        for error in evidence.measured.errors
    )


def _has_sampled_impacts(evidence: Evidence, sampling: Measured, cost: SamplingCost) -> bool:
    """Whether no impact has larger errors than PIT has at that impact or at one before it.

    Errors propagate from impact to impact. So the largest error of PIT up to an impact is what sampling may cost there,
    at this phase, at another, or at the run's own lateness. An impact that PIT misses at this phase leaves both discs
    on their old paths: the velocity error is all of the impact's change.
    """
    known, scales, rounding_s = evidence.measured.own, evidence.scales, evidence.rounding * evidence.scales.time_s
    changed = measure_changes(evidence.reference, evidence.scales)
    own = {error.reference: error for error in evidence.measured.errors}
    pit = {error.reference: error for error in sampling.errors}
    # The phase at which an impact falls is chance: sampling costs up to a whole step of lateness.
    late_s, early_s, velocity, spin = evidence.observed.dt_s, 0.0, 0.0, 0.0
    known_ratio = 1.0 + THRESHOLDS.ratio_known_of(evidence.observed.float_bits)
    for index in range(evidence.compared.impacts):
        found, pit_error = own.get(index), pit.get(index)
        if pit_error is not None:
            late_s, early_s = max(late_s, pit_error.time_s), max(early_s, -pit_error.time_s)
        elsewhere_velocity, elsewhere_spin = (known_ratio * float(errors[index]) for errors in cost.found)
        pit_velocity = float(changed.velocity[index]) if pit_error is None else pit_error.velocity
        velocity = max(velocity, elsewhere_velocity, pit_velocity)
        pit_spin = float(changed.spin[index]) if pit_error is None else pit_error.spin
        spin = max(spin, elsewhere_spin, 0.0 if math.isnan(pit_spin) else pit_spin)
        if found is None:
            continue
        # Where PIT misses the impact, there is no lateness to compare with.
        latest_s, earliest_s = (math.inf, math.inf) if pit_error is None else (late_s, early_s)
        local_s = float(evidence.local.time_s[found.observed])
        if local_s <= known_ratio * evidence.observed.dt_s:
            # At most a step late from the run's own state; the rest was propagated from earlier impacts.
            latest_s = max(latest_s, known_ratio * float(cost.found_off_s[index]))
        rounding = evidence.rounding * known.speed_m_s[index] / scales.speed_m_s
        if not (found.velocity <= velocity + rounding and found.time_s <= latest_s + rounding_s):
            return False
        if found.spin > spin + evidence.rounding * known.rim_m_s[index] / scales.rim_m_s:
            return False
        if found.time_s < -rounding_s:
            # Sampling never finds an impact before it happens from the run's own state. An impact that is early only
            # against the reference was brought forward by errors of earlier impacts, by at most as much as they are
            # late.
            forward_s = earliest_s if math.isnan(local_s) else max(latest_s, earliest_s)
            if local_s < -rounding_s or not -found.time_s <= forward_s + rounding_s:
                return False
    return True


def _has_good_end(evidence: Evidence, cost: SamplingCost | Errors, part: float = 1.0) -> bool:
    """Whether the final errors are at most a part of PIT's, or the final state follows from the run's own impacts.

    An energy error of a millionth is always allowed. A final error of PIT that was not measured is NaN and allows
    nothing.
    """
    found, own = evidence.measured.largest, evidence.consistency
    if not abs(found.energy) <= max(part * abs(cost.energy) + evidence.rounding, THRESHOLDS.energy):
        return False
    falls = any(evidence.reference.scene.gravity_m_s2)
    if own is not None and not (falls or own.unchecked) and own.strayed <= evidence.place_rounding:
        return True
    position, velocity, spin = (
        0.0 if math.isnan(x) else part * x for x in (cost.final_position, cost.final_velocity, cost.final_spin)
    )
    scales = evidence.scales
    allowed = np.array([position * scales.length_m, velocity * scales.speed_m_s, spin * scales.rim_m_s])[:, None]
    return not bool(np.any(evidence.measured.ends > allowed + evidence.end_rounding(evidence.measured, exactly=False)))
