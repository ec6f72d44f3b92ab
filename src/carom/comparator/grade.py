"""From numbers to a grade."""

from __future__ import annotations

import math

from carom.comparator.consistency import Consistency
from carom.comparator.measure import Measured
from carom.comparator.score import Grade
from carom.comparator.thresholds import THRESHOLDS
from carom.comparator.verdict import Evidence
from carom.trace import Outcome

__all__ = ["equals_pit", "grade"]


def grade(evidence: Evidence) -> Grade:
    """Grade a comparison: the worst that is certain decides, and what can't be decided is not graded."""
    if evidence.broken or evidence.observed.outcome is Outcome.NON_FINITE:
        return Grade.WRONG
    if evidence.convention is None and _is_wrong(evidence):
        return Grade.WRONG
    if not _own_path_holds(evidence):
        return Grade.INACCURATE
    if evidence.convention is not None or evidence.nothing_compared:
        return Grade.UNGRADED
    if _is_exact(evidence):
        return Grade.EXACT
    if evidence.sampling is None:
        return Grade.UNGRADED
    if not _impacts_are_sampled(evidence, evidence.sampling):
        return Grade.INACCURATE
    if evidence.measured.alignment.undecided:
        return Grade.UNGRADED
    return Grade.SAMPLED if _end_is_sampled(evidence, evidence.sampling) else Grade.INACCURATE


def equals_pit(evidence: Evidence, against_pit: Measured) -> bool:
    """Whether a run has the impacts of PIT, and its end, and all else to rounding.

    Args:
        evidence: The evidence.
        against_pit: What was measured of the run against PIT.
    """
    alignment, bits = against_pit.alignment, evidence.observed.float_bits
    rounding = THRESHOLDS.rounding_of(bits)
    return (
        not (alignment.missed or alignment.spurious or alignment.undecided)
        and _own_path_holds(evidence)
        and _agrees(against_pit, rounding, rounding * evidence.scales.time_s, evidence.place_rounding(bits))
    )


def _is_wrong(evidence: Evidence) -> bool:
    reference, observed, alignment = evidence.reference, evidence.observed, evidence.measured.alignment
    # A reference is whole up to where a disc comes to rest, and nobody else must end there.
    asked = Outcome.COMPLETED if reference.outcome is Outcome.AT_REST else reference.outcome
    ended = observed.outcome is not asked or (asked is Outcome.COMPLETED and evidence.cut_short)
    return bool(alignment.missed or alignment.spurious or evidence.order.inverted or ended)


def _own_path_holds(evidence: Evidence) -> bool:
    """Whether a run agrees with itself, but for what sampling and the floats that it declares explain."""
    own, bits = evidence.consistency, evidence.observed.float_bits
    if own is None:
        return False
    return own.excess.size <= evidence.place_rounding(bits) and _is_consistent(evidence, own, bits)


def _is_exact(evidence: Evidence) -> bool:
    measured, own, rounding = evidence.measured, evidence.consistency, THRESHOLDS.rounding
    place = evidence.place_rounding()
    return (
        own is not None
        and not measured.alignment.undecided
        and _agrees(measured, rounding, rounding * evidence.scales.time_s, place)
        and own.position.size <= place
        and _is_consistent(evidence, own, 64)
    )


def _is_consistent(evidence: Evidence, own: Consistency, float_bits: int) -> bool:
    """Whether a run agrees with itself in all but its positions, to the rounding of floats of a width."""
    rounding = THRESHOLDS.rounding_of(float_bits)
    return (
        own.velocity.size <= rounding
        and own.stamp_s <= rounding * evidence.scales.time_s
        and own.across <= rounding
        and own.normal_length <= rounding
        and own.momentum <= rounding
    )


def _agrees(measured: Measured, rounding: float, rounding_s: float, place: float) -> bool:
    """Whether nothing that was measured is more than rounding; beyond a horizon the end is not measured, and NaN."""
    return (
        all(abs(error.time_s) <= rounding_s and error.velocity <= rounding for error in measured.errors)
        and abs(measured.energy_error) <= rounding
        and not measured.final_velocity_error > rounding
        and not measured.final_position_error > place
    )


def _impacts_are_sampled(evidence: Evidence, sampling: Measured) -> bool:
    """Whether each impact is found no worse than PIT finds it, or has found one before it.

    Errors hand themselves on from impact to impact, so what PIT has paid for up to one is what sampling may have cost
    there. An impact that PIT misses leaves both discs on their old paths: the velocities are off by all of its change.
    """
    observed, local_s = evidence.observed, evidence.local.time_s
    rounding = THRESHOLDS.rounding_of(observed.float_bits)
    rounding_s = rounding * evidence.scales.time_s
    own = {error.reference: error for error in evidence.measured.errors}
    pit = {error.reference: error for error in sampling.errors}
    # Which phase of its step an impact meets is luck: up to a whole step late is what sampling costs.
    late_s, early_s, velocity = observed.dt_s, 0.0, 0.0
    for index in range(evidence.believed):
        found, paid = own.get(index), pit.get(index)
        if paid is not None:
            late_s, early_s = max(late_s, paid.time_s), max(early_s, -paid.time_s)
        velocity = max(velocity, _change(evidence, index) if paid is None else paid.velocity)
        if found is None:
            continue
        # Where PIT misses the impact, there is no lateness to hold its own against.
        latest_s, earliest_s = (math.inf, math.inf) if paid is None else (late_s, early_s)
        if not (found.velocity <= velocity + rounding and found.time_s <= latest_s + rounding_s):
            return False
        if found.time_s < -rounding_s and _is_too_early(
            found.time_s, float(local_s[found.observed]), latest_s, earliest_s, rounding_s
        ):
            return False
    return True


def _is_too_early(time_s: float, local_s: float, latest_s: float, earliest_s: float, rounding_s: float) -> bool:
    """Whether an impact is found before it happens: looking once a step finds none before it is there.

    The run's own state before it tells that of the impact alone. One that is early against the reference and not from
    there was brought forward by the errors of those before it, and what is a step late brings forward as much.

    Args:
        time_s: Its error against the reference, below 0.
        local_s: Its error from its own state before; NaN where that is not known.
        latest_s: What sampling may have cost up to there.
        earliest_s: Earliest that PIT was up to there.
        rounding_s: What rounding may make of a time.
    """
    if math.isnan(local_s):
        return not -time_s <= earliest_s + rounding_s
    return local_s < -rounding_s or not -time_s <= max(latest_s, earliest_s) + rounding_s


def _change(evidence: Evidence, index: int) -> float:
    """What an impact of the reference changes of a velocity, the more changed one, over the scene's speed."""
    impact = evidence.reference.impacts[index]
    changes = (
        math.hypot(*(impact[f"velocity_{body}_after"] - impact[f"velocity_{body}_before"]))
        for body in ("first", "second")
    )
    return max(changes) / evidence.scales.speed_m_s


def _end_is_sampled(evidence: Evidence, sampling: Measured) -> bool:
    """Whether a run ends no worse than PIT, or as its own impacts, which are no worse than PIT's, make it end."""
    measured, own, bits = evidence.measured, evidence.consistency, evidence.observed.float_bits
    rounding, place = THRESHOLDS.rounding_of(bits), evidence.place_rounding(bits)
    energy = max(abs(sampling.energy_error) + rounding, THRESHOLDS.energy)
    if not abs(measured.energy_error) <= energy:
        return False
    falls = any(evidence.reference.scene.gravity_m_s2)
    if own is not None and not (falls or own.unchecked) and own.position.size <= place:
        return True
    # What was not measured of PIT is NaN, and allows nothing.
    paid = (0.0 if math.isnan(x) else x for x in (sampling.final_velocity_error, sampling.final_position_error))
    velocity, position = paid
    return (
        not measured.final_velocity_error > velocity + rounding and not measured.final_position_error > position + place
    )
