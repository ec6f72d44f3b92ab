"""Verdicts derived from measured errors, each with its numbers as a reason."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from carom.comparator.contact import format_contact
from carom.comparator.evidence import Evidence
from carom.comparator.grades import Grade
from carom.comparator.measure import unknown_velocities
from carom.comparator.order import MOST_EDITS
from carom.comparator.scales import largest
from carom.comparator.self_consistency import format_seconds_and_steps, report_own_trajectory
from carom.comparator.step_findings import (
    has_diverged_before_miss,
    has_exact_steps,
    report_bad_steps,
    report_divergence,
    report_misreports,
    report_polygons,
    report_sinking,
)
from carom.comparator.thresholds import THRESHOLDS
from carom.comparator.verdict import Finding, Verdict
from carom.model.trace import Outcome, pair_name
from carom.support.formatting import instant, number, seconds

#: How a disc ends that neither rests nor slides or rolls, by the outcome of the reference.
_OTHER_ENDINGS = {Outcome.GLIDES: ", gliding along a wall", Outcome.CRUSHED: ", crushed between two walls"}


def derive_findings(evidence: Evidence) -> tuple[Finding, ...]:
    """Derive all verdicts on a run, each with its reason."""
    errors, is_crushed = evidence.measured.errors, evidence.reference.outcome is Outcome.CRUSHED
    # After two trajectories diverge, their impacts match only by chance.
    trajectory_rules = (
        (report_divergence, report_misreports)
        if has_diverged_before_miss(evidence)
        else (_report_hits, _report_order, _report_timing, _report_velocities, _report_spins, _report_end_state)
    )
    # Where every step is PIC's, errors of impacts come only from velocities that are not known.
    rules = (
        _report_convention,
        *(() if has_exact_steps(evidence) else (_report_ending, *trajectory_rules)),
        report_own_trajectory,
        report_sinking,
    )
    found = [Finding(Verdict.NOT_FINITE, evidence.non_finite)] if evidence.non_finite else []
    found += [finding for rule in rules for finding in rule(evidence)]
    found += list(report_bad_steps(evidence, has_findings=bool(found)))
    found += report_polygons(evidence) if found else ()
    if evidence.contact is not None and evidence.contact.grade is not Grade.EXACT:
        found.append(Finding(Verdict.CONTACT, format_contact(evidence.contact)))
    if found:
        found += _report_unknown_velocities(evidence)
    if errors and found and evidence.sampling is None:
        found.append(Finding(Verdict.UNCOMPARED, "whether sampling explains the errors is not known"))
    if evidence.has_nothing_compared and evidence.contact is None:
        times = evidence.reference.impacts["time_s"]
        first = (
            f"the first impact, at {instant(times[0])}, lies beyond it" if len(times) else "there is none in the scene"
        )
        found.append(Finding(Verdict.NOTHING_COMPARED, f"{instant(evidence.compared.until_s)}; {first}"))
    if not found and not evidence.compared.impacts and evidence.compared.is_whole_run:
        local = evidence.local_truth
        steps = "; every step agrees with free flight to rounding" if local is not None and local.agrees_alone else ""
        found.append(Finding(Verdict.NO_IMPACT, f"{instant(evidence.scales.time_s)} of free flight{steps}"))
    if not found:
        floats = "" if evidence.observed.float_bits >= 64 else f", in {evidence.observed.float_bits}-bit floats"
        unknown = "".join(f"; not told apart: {finding.reason}" for finding in _report_unknown_velocities(evidence))
        until = "" if evidence.compared.is_whole_run else f" up to {instant(evidence.compared.until_s)}"
        is_checked_beyond = not (evidence.compared.is_whole_run or is_crushed or evidence.local_truth is None)
        rest = "; to the end every step agrees with PIC from its own state" if is_checked_beyond else ""
        reason = f"{len(errors)} of {evidence.compared.impacts} impacts found{until}{floats}{unknown}{rest}"
        if (contact := evidence.contact) is not None:
            reason += f"; from {instant(contact.begin_s)} on {contact.looks} states are as Coulomb's law says"
        found.append(Finding(Verdict.CONFORMS, reason))
    if evidence.reference.contact_s < math.inf:
        beyond = "its states were not looked at" if evidence.local_truth is None else "steps are compared to the end"
        if is_crushed:
            beyond = "nothing is compared"
        ending = _OTHER_ENDINGS.get(evidence.reference.outcome, "")
        reason = f"at {instant(evidence.reference.contact_s)}{ending}; from there {beyond}"
        found.append(Finding(Verdict.RESTED, reason))
    return tuple(found)


def add_phase_dependence(found: tuple[Finding, ...], as_right: int, phases: int) -> tuple[Finding, ...]:
    """Add to the findings of a run with PIT's results that they are as right only at some phases of the step.

    For a run that conforms this is added to the reason, because nothing is wrong with the run.
    """
    note = f"PIT's impacts are as right at {as_right} of {phases} phases of the step"
    if not any(finding.verdict is Verdict.CONFORMS for finding in found):
        return (*found, Finding(Verdict.LUCKY_PHASE, note))
    return tuple(
        Finding(finding.verdict, f"{finding.reason}; {note}") if finding.verdict is Verdict.CONFORMS else finding
        for finding in found
    )


def _report_convention(evidence: Evidence) -> Iterator[Finding]:
    reference, match = evidence.reference, evidence.convention
    if match is None:
        return
    reason = (
        f"{len(reference.ambiguous)} of {len(reference.impacts)} impacts share a disc with another at the very same "
        f"instant, the first at {instant(match.group.time_s)}"
    )
    count = len(match.outcomes)
    if match.nearest is None:
        reason += "; there are too many admissible outcomes to list"
    else:
        which = f"admissible outcome {match.nearest + 1} of {count} ({match.outcomes[match.nearest].how})"
        if match.matches:
            reason += f"; matches {which}, to {number(match.distance)} of the speed"
        else:
            reason += (
                f"; matches none of {count} admissible outcomes: {number(match.distance, 3)} of the speed from {which}"
            )
    if evidence.grade_before_tie is not None:
        grade_name = (
            "undecided"
            if evidence.grade_before_tie is Grade.UNGRADED
            else evidence.grade_before_tie.name.lower().replace("_", ", ")
        )
        reason += f"; up to there the run is {grade_name}"
    yield Finding(Verdict.CONVENTION, reason)


def _report_ending(evidence: Evidence) -> Iterator[Finding]:
    observed = evidence.observed
    if evidence.is_cut_short:
        note = f": {observed.notes[0]}" if observed.notes else ""
        yield Finding(Verdict.CUT_SHORT, f"{observed.outcome.value}{note}, at {instant(observed.end_time_s)}")
    elif evidence.has_other_ending:
        reference = evidence.reference
        yield Finding(Verdict.WENT_ON, f"{reference.outcome.value}, at {instant(reference.end_time_s)}")


def _report_hits(evidence: Evidence) -> Iterator[Finding]:
    alignment, reliable_impacts = evidence.measured.alignment, evidence.compared.impacts
    expected, found = evidence.reference.impacts, evidence.observed.impacts
    if missed := alignment.missed:
        kind = Verdict.MISSED if len(missed) == 1 else Verdict.MULTIPLE_MISSED
        yield Finding(kind, f"{len(missed)} of {reliable_impacts}, {_format_first(missed, expected)}")
    if alignment.spurious:
        yield Finding(Verdict.SPURIOUS, f"{len(alignment.spurious)}, {_format_first(alignment.spurious, found)}")
    if undecided := alignment.undecided:
        first_s = expected["time_s"][undecided[0]]
        yield Finding(
            Verdict.UNDECIDED, f"{len(undecided)} of {reliable_impacts} impacts, the first at {instant(first_s)}"
        )


def _format_first(indices: Sequence[int], impacts: NDArray[np.void]) -> str:
    first = impacts[indices[0]]
    return f"the first at {instant(first['time_s'])} between {pair_name(first)}"


def _report_order(evidence: Evidence) -> Iterator[Finding]:
    order, impacts = evidence.order, evidence.reference.impacts
    if not order.inverted:
        return
    a, b = order.inverted[0]
    edits = f"{order.edits} or more" if order.edits == MOST_EDITS else str(order.edits)
    yield Finding(
        Verdict.WRONG_ORDER,
        f"{len(order.inverted)} inverted, edit distance {edits}; first that of {pair_name(impacts[a])} before "
        f"that of {pair_name(impacts[b])}, {seconds(float(impacts['time_s'][b] - impacts['time_s'][a]))} apart",
    )


def _report_timing(evidence: Evidence) -> Iterator[Finding]:
    # Two swapped impacts have each other's times, which is reported as an order.
    swapped = {index for pair in evidence.order.inverted for index in pair}
    errors = [error.time_s for error in evidence.measured.errors if error.reference not in swapped]
    for verdict, sign in ((Verdict.LATE, 1.0), (Verdict.EARLY, -1.0)):
        worst = largest((sign * error for error in errors if sign * error > 0.0), default=0.0)
        if worst > evidence.rounding_s:
            yield Finding(verdict, f"by up to {format_seconds_and_steps(worst, evidence)}")


def _report_velocities(evidence: Evidence) -> Iterator[Finding]:
    own, scales = evidence.measured.own.speed_m_s, evidence.scales
    off = [
        e for e in evidence.measured.errors if not e.velocity * scales.speed_m_s <= evidence.rounding * own[e.reference]
    ]
    worst = max(off, key=lambda error: error.velocity, default=None)
    if worst is not None:
        reason = f"by up to {number(worst.velocity, 3)} of the scene's speed"
        if own[worst.reference] < 0.5 * scales.speed_m_s:
            part = worst.velocity * scales.speed_m_s / own[worst.reference]
            reason += f", {number(part, 3)} of the greatest that led to it"
        if worst.normal_rad > evidence.rounding:
            reason += f", where the normal is turned by {number(math.degrees(worst.normal_rad), 3)} degrees"
        yield Finding(Verdict.WRONG_VELOCITY, reason)
    turned, energy = evidence.measured.largest.direction_rad, evidence.measured.largest.energy
    if turned > THRESHOLDS.direction_rad:
        yield Finding(Verdict.WRONG_DIRECTION, f"by up to {number(math.degrees(turned), 3)} degrees")
    falls = any(evidence.reference.scene.gravity_m_s2)  # then a higher disc is slower without a loss of energy
    if abs(energy) > THRESHOLDS.energy and not falls:
        verdict = Verdict.ENERGY_GAINED if energy > 0 else Verdict.ENERGY_LOST
        yield Finding(verdict, f"{number(abs(energy), 3)} of the energy at the start")


def _report_unknown_velocities(evidence: Evidence) -> Iterator[Finding]:
    """Report velocities that are not known."""
    impacts = evidence.observed.impacts
    if unknown := np.flatnonzero(unknown_velocities(evidence.observed).any(axis=0)).tolist():
        first = _format_first(unknown, impacts)
        reason = f"{len(unknown)} of {len(impacts)} impacts, {first}: the last one in the step is judged"
        yield Finding(Verdict.NOT_TOLD_APART, reason)


def _report_spins(evidence: Evidence) -> Iterator[Finding]:
    """Report errors of spins, which are NaN if no disc spins."""
    own, scales, impacts = evidence.measured.own.rim_m_s, evidence.scales, evidence.observed.impacts
    off = [e.spin for e in evidence.measured.errors if e.spin * scales.rim_m_s > evidence.rounding * own[e.reference]]
    if off:
        worst = max(off)
        yield Finding(Verdict.WRONG_SPIN, f"by up to {number(worst, 3)} of the scene's speed of rims")
    for verdict, wrong in ((Verdict.SLID, evidence.branches.slid), (Verdict.STUCK, evidence.branches.stuck)):
        if wrong:
            yield Finding(verdict, f"{len(wrong)} of {len(impacts)}, {_format_first(wrong, impacts)}")


def _report_end_state(evidence: Evidence) -> Iterator[Finding]:
    """Report errors of the final state, if the reference has a unique one and no impact is undecided."""
    if evidence.convention is not None or evidence.measured.alignment.undecided:
        return
    place, velocity = evidence.measured.largest.final_position, evidence.measured.largest.final_velocity
    beyond = evidence.measured.ends > evidence.end_rounding(evidence.measured, exactly=True)
    off_place, off_velocity, off_spin = (bool(np.any(row)) for row in beyond)
    if off_place:
        yield Finding(Verdict.MISPLACED, f"by up to {number(place, 3)} of the largest radius")
    if off_velocity:
        yield Finding(Verdict.WRONG_END, f"by up to {number(velocity, 3)} of the scene's speed")
    if off_spin:
        spin = evidence.measured.largest.final_spin
        yield Finding(Verdict.WRONG_LAST_SPIN, f"by up to {number(spin, 3)} of the scene's speed of rims")
