"""From numbers to a grade."""

from __future__ import annotations

import math

import numpy as np

from carom.comparator.evidence import Evidence
from carom.comparator.grades import Grade
from carom.comparator.measure import Errors, Measured
from carom.comparator.sampling import Price, changes
from carom.comparator.self_consistency import contradictions
from carom.comparator.step_findings import has_parted, steps_are_exact
from carom.comparator.stepwise.score import LocalScore
from carom.comparator.thresholds import THRESHOLDS
from carom.model.trace import Outcome


def grade(evidence: Evidence) -> Grade:
    """Grade a comparison: by impacts, and where discs slide, roll and rest by what they do there; the worse decides.

    Where nothing is there to be graded by impacts, what discs do in contact decides alone. Where trajectories parted
    before, it tells nothing, unless one disc on one wall is in contact in the end, whatever its bounces were.
    """
    free, contact = _grade_of_flight(evidence), evidence.contact
    if contact is None:
        return free
    if free in {Grade.PARTED, Grade.PARTED_INACCURATE}:
        alone = len(evidence.reference.scene.discs) == len(evidence.reference.scene.walls) == 1
        return contact.grade if alone and contact.grade is Grade.WRONG else free
    if free is Grade.UNGRADED or not evidence.reach.impacts:
        return contact.grade if evidence.convention is None else free
    return max(free, contact.grade, key=list(Grade).index)


def _grade_of_flight(evidence: Evidence) -> Grade:
    """Grade by the reference's trajectory, as far as that is reliable, and by local truth to the end."""
    whole, local = _by_trajectory(evidence), evidence.local_truth
    if local is None:
        return whole
    if steps_are_exact(evidence):
        return Grade.EXACT if evidence.reach.impacts else Grade.UNGRADED  # where nothing happens nothing is shown
    if has_parted(evidence):
        return Grade.PARTED_INACCURATE if local.grade is Grade.INACCURATE else Grade.PARTED
    if whole is Grade.UNGRADED:
        return _where_undecided(evidence, local)
    if whole is Grade.EXACT and evidence.reach.whole and local.agrees_alone and local.grade is not Grade.WRONG:
        return whole if evidence.reach.impacts else Grade.UNGRADED
    return max(whole, local.grade, key=list(Grade).index)


def grade_of_trajectory(evidence: Evidence) -> Grade:
    """Grade as far as the reference is reliable: by its trajectory alone, unless the run's own has left it."""
    return Grade.PARTED if has_parted(evidence) else _by_trajectory(evidence)


def _where_undecided(evidence: Evidence, local: LocalScore) -> Grade:
    """Grade a run that its trajectory does not decide on: that bodies passed through each other is certain still."""
    ambiguous = evidence.reference.ambiguous
    tie_s = float(evidence.reference.impacts["time_s"][ambiguous[0]]) if ambiguous else math.inf
    if (local.missed_own and local.first_missed_s < tie_s - evidence.observed.dt_s) or (
        local.invented and not ambiguous
    ):
        return Grade.WRONG
    rests = evidence.reference.contact_s < math.inf and not evidence.reach.impacts
    certain = evidence.convention is None and local.grade is Grade.INACCURATE
    return local.grade if certain or (rests and local.grade is not Grade.EXACT) else Grade.UNGRADED


def _by_trajectory(evidence: Evidence) -> Grade:
    """Grade by the reference's trajectory: the worst that is certain decides; what can't be decided is not graded."""
    if evidence.broken or evidence.observed.outcome is Outcome.NON_FINITE:
        return Grade.WRONG
    if evidence.convention is None and _is_wrong(evidence):
        return Grade.WRONG
    if evidence.nothing_compared:
        return Grade.UNGRADED
    if not _agrees_with_itself(evidence):
        return Grade.INACCURATE
    if evidence.convention is not None:
        certain = evidence.up_to_tie in {Grade.WRONG, Grade.INACCURATE}
        return evidence.up_to_tie if evidence.up_to_tie is not None and certain else Grade.UNGRADED
    undecided = bool(evidence.measured.alignment.undecided)
    to_rounding = _agrees(evidence, evidence.measured, evidence.rounding_s)
    if to_rounding and not undecided and _agrees_with_itself(evidence, but_for_sampling=False):
        return Grade.EXACT
    if evidence.sampling is None or evidence.price is None:
        return Grade.UNGRADED
    close, sampled = (
        _impacts_are_close(evidence, evidence.price),
        _impacts_are_sampled(evidence, evidence.sampling, evidence.price),
    )
    if not (close or sampled):
        return Grade.INACCURATE
    if undecided:
        return Grade.UNGRADED
    if close and _ends_as_well(evidence, evidence.price, THRESHOLDS.close):
        return Grade.CLOSE
    # Where states were looked at, nothing but sampling has led to the end: then any phase's will do.
    local = evidence.local_truth
    only_sampled = local is not None and list(Grade).index(local.grade) <= list(Grade).index(Grade.SAMPLED)
    ends = _ends_as_well(evidence, evidence.price if only_sampled else evidence.sampling.largest)
    return Grade.SAMPLED if sampled and ends else Grade.INACCURATE


def equals_pit(evidence: Evidence) -> bool:
    """Whether a run has the impacts of PIT, and its end, and all else to rounding."""
    if evidence.against_pit is None:
        return False
    alignment = evidence.against_pit.alignment
    return (
        not (alignment.missed or alignment.spurious or alignment.undecided)
        and _agrees_with_itself(evidence)
        and _agrees(evidence, evidence.against_pit, evidence.rounding * evidence.scales.time_s)
    )


def _is_wrong(evidence: Evidence) -> bool:
    alignment = evidence.measured.alignment
    return bool(alignment.missed or alignment.spurious or evidence.order.inverted or evidence.ended_otherwise)


def _agrees_with_itself(evidence: Evidence, *, but_for_sampling: bool = True) -> bool:
    """Whether a run agrees with itself, except for what the floats that it declares, and sampling, explain."""
    own = evidence.consistency
    if own is None:
        return False
    off, angular = (own.strayed_excess, own.angular_excess) if but_for_sampling else (own.strayed, own.angular)
    agrees = off <= evidence.place_rounding and angular <= evidence.rounding
    return agrees and not list(contradictions(evidence))


def _agrees(evidence: Evidence, measured: Measured, rounding_s: float) -> bool:
    """Whether nothing that was measured is more than rounding; beyond a horizon the end is not measured, and NaN.

    So are spins if no disc spins.
    """
    errors, largest = measured.errors, measured.largest
    return (
        all(abs(error.time_s) <= rounding_s and evidence.is_rounding(error, measured) for error in errors)
        and abs(largest.energy) <= min(evidence.rounding, THRESHOLDS.energy)
        and not (measured.ends > evidence.end_rounding(measured, exactly=True)).any()
    )


def _impacts_are_close(evidence: Evidence, price: Price) -> bool:
    """Whether each impact is off by a small part of a step, and of the price of sampling up to it, at most."""
    step_s = evidence.observed.dt_s or price.dt_s
    own, scales = evidence.measured.own, evidence.scales
    believed = evidence.reach.impacts
    velocity = THRESHOLDS.close * price.velocity + evidence.rounding * own.speed_m_s[:believed] / scales.speed_m_s
    spin = THRESHOLDS.close * price.spin + evidence.rounding * own.rim_m_s[:believed] / scales.rim_m_s
    return all(
        abs(error.time_s) <= THRESHOLDS.close * step_s
        and error.velocity <= velocity[error.reference]
        and not error.spin > spin[error.reference]
        for error in evidence.measured.errors
    )


def _impacts_are_sampled(evidence: Evidence, sampling: Measured, price: Price) -> bool:
    """Whether each impact is found no worse than PIT finds it, or has found one before it.

    Errors hand themselves on from impact to impact, so what PIT has paid for up to one is what sampling may have cost
    there, at this phase or another, or at the run's own lateness. An impact that PIT misses at this phase leaves both
    discs on their old paths: the velocities are off by all of its change.
    """
    known, scales, rounding_s = evidence.measured.own, evidence.scales, evidence.rounding * evidence.scales.time_s
    changed = changes(evidence.reference, evidence.scales)
    own = {error.reference: error for error in evidence.measured.errors}
    pit = {error.reference: error for error in sampling.errors}
    # Which phase of its step an impact meets is luck: up to a whole step late is what sampling costs.
    late_s, early_s, velocity, spin = evidence.observed.dt_s, 0.0, 0.0, 0.0
    known_ratio = 1.0 + THRESHOLDS.ratio_known_of(evidence.observed.float_bits)
    for index in range(evidence.reach.impacts):
        found, paid = own.get(index), pit.get(index)
        if paid is not None:
            late_s, early_s = max(late_s, paid.time_s), max(early_s, -paid.time_s)
        elsewhere_velocity, elsewhere_spin = (known_ratio * float(errors[index]) for errors in price.found)
        velocity = max(velocity, elsewhere_velocity, float(changed.velocity[index]) if paid is None else paid.velocity)
        turned = float(changed.spin[index]) if paid is None else paid.spin
        spin = max(spin, elsewhere_spin, 0.0 if math.isnan(turned) else turned)
        if found is None:
            continue
        # Where PIT misses the impact, there is no lateness to compare its own with.
        latest_s, earliest_s = (math.inf, math.inf) if paid is None else (late_s, early_s)
        local_s = float(evidence.local.time_s[found.observed])
        if local_s <= known_ratio * evidence.observed.dt_s:
            # Late by no more than a step from the run's own state, and else by what was handed on.
            latest_s = max(latest_s, known_ratio * float(price.found_off_s[index]))
        rounding = evidence.rounding * known.speed_m_s[index] / scales.speed_m_s
        if not (found.velocity <= velocity + rounding and found.time_s <= latest_s + rounding_s):
            return False
        if found.spin > spin + evidence.rounding * known.rim_m_s[index] / scales.rim_m_s:
            return False
        if found.time_s < -rounding_s:
            # Looking once a step finds no impact before it is there, as the run's own state before it tells. One that
            # is early against the reference and not from there was brought forward by the errors of those before it,
            # and what is a step late brings forward as much.
            forward_s = earliest_s if math.isnan(local_s) else max(latest_s, earliest_s)
            if local_s < -rounding_s or not -found.time_s <= forward_s + rounding_s:
                return False
    return True


def _ends_as_well(evidence: Evidence, paid: Price | Errors, part: float = 1.0) -> bool:
    """Whether a run ends no further off than a part of what PIT pays, or as its own impacts make it end.

    An energy off by a millionth is as good in any case; what was not measured of PIT's end is NaN, and allows nothing.
    """
    found, own = evidence.measured.largest, evidence.consistency
    if not abs(found.energy) <= max(part * abs(paid.energy) + evidence.rounding, THRESHOLDS.energy):
        return False
    falls = any(evidence.reference.scene.gravity_m_s2)
    if own is not None and not (falls or own.unchecked) and own.strayed <= evidence.place_rounding:
        return True
    position, velocity, spin = (
        0.0 if math.isnan(x) else part * x for x in (paid.final_position, paid.final_velocity, paid.final_spin)
    )
    scales = evidence.scales
    costs = np.array([position * scales.length_m, velocity * scales.speed_m_s, spin * scales.rim_m_s])[:, None]
    return not bool(np.any(evidence.measured.ends > costs + evidence.end_rounding(evidence.measured, exactly=False)))
