"""Verdicts derived from measured errors. Each verdict gives a reason with numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from carom.comparator.align_impacts import MOST_EDITS
from carom.comparator.grades import Grade
from carom.comparator.measure.consistency import Deviation
from carom.comparator.measure.contact import ContactErrors, ContactScore
from carom.comparator.measure.errors import unknown_velocities
from carom.comparator.measure.measured_run import MeasuredRun
from carom.comparator.scales import find_largest
from carom.comparator.thresholds import THRESHOLDS
from carom.comparator.verdict import Finding, Verdict
from carom.comparator.verdicts import stepwise_verdicts
from carom.comparator.verdicts.judged_run import JudgedRun
from carom.model.trace import Outcome, pair_name
from carom.support.formatting import (
    format_count,
    format_instant,
    format_metres,
    format_number,
    format_seconds,
    format_steps,
)

#: Descriptions of a disc's final motion other than resting, sliding and rolling, by outcome of the reference.
_OTHER_ENDINGS = {Outcome.GLIDES: ", gliding along a wall", Outcome.CRUSHED: ", crushed between two walls"}

#: If friction's lever arm differs from the disc's radius by less than this fraction, their difference is shown, because
#: their quotient would be shown as 1.
_NEAR_THE_RIM = 5e-4


def derive_verdicts(run: MeasuredRun, grade_before_tie: Grade | None) -> JudgedRun:
    """Derive all verdicts on a run.

    `grade_before_tie` is the run's grade before the first simultaneous impacts that have no unique result.
    """
    judged = JudgedRun.of(
        run,
        grade_before_tie=grade_before_tie,
        drifts=tuple(_report_drifts(run)),
        contradictions=tuple(_report_contradictions(run)),
    )
    found = [Finding(Verdict.NOT_FINITE, run.non_finite)] if run.non_finite else []
    found += _report_convention(judged)
    # If every step agrees with PIC, only unknown velocities can cause errors of impacts.
    if not judged.has_exact_steps:
        found += _report_ending(judged)
        if judged.has_diverged_before_miss:  # after two trajectories diverge, impacts only match by chance
            found += [*stepwise_verdicts.report_divergence(judged), *stepwise_verdicts.report_misreports(judged)]
        else:
            found += [*_report_missed_and_spurious(judged), *_report_order(judged), *_report_timing(judged)]
            found += [*_report_velocities(judged), *_report_spins(judged), *_report_end_state(judged)]
    found += [*judged.drifts, *judged.contradictions, *stepwise_verdicts.report_sinking(judged)]
    found += list(stepwise_verdicts.report_bad_steps(judged, has_findings=bool(found)))
    found += stepwise_verdicts.report_polygons(judged) if found else ()
    if (contact := judged.contact) is not None and contact.grade is not Grade.EXACT:
        found.append(Finding(Verdict.CONTACT, _format_contact(contact)))
    if found:
        found += _report_unknown_velocities(judged)
        if judged.measured.errors and judged.pit is None:
            found.append(Finding(Verdict.UNCOMPARED, "so it is unknown whether sampling explains the errors"))
    found += _report_nothing_compared(judged)
    found += () if found else _report_nothing_wrong(judged)
    found += _report_rest(judged)
    return replace(judged, findings=tuple(found))


def _report_nothing_compared(judged: JudgedRun) -> Iterator[Finding]:
    if judged.has_nothing_compared and judged.contact is None:
        times = judged.reference.impacts["time_s"]
        beyond = "the scene has no impact"
        if len(times):
            beyond = f"the first impact, at {format_instant(times[0])}, is beyond the horizon"
        yield Finding(Verdict.NOTHING_COMPARED, f"the horizon is {format_instant(judged.compared.until_s)}; {beyond}")


def _report_nothing_wrong(judged: JudgedRun) -> Iterator[Finding]:
    """Report that a run agrees with the reference, or that the scene has no impact by which a run can be graded."""
    compared, local, contact = judged.compared, judged.local_truth, judged.contact
    if not compared.impacts and compared.is_whole_run:
        steps = "; every step agrees with free flight to rounding" if local is not None and local.agrees_alone else ""
        yield Finding(Verdict.NO_IMPACT, f"{format_instant(judged.scales.time_s)} of free flight{steps}")
        return
    floats = "" if judged.observed.float_bits >= 64 else f", in {judged.observed.float_bits}-bit floats"
    unknown = "".join(f"; unknown: {finding.reason}" for finding in _report_unknown_velocities(judged))
    until = "" if compared.is_whole_run else f" up to {format_instant(compared.until_s)}"
    reason = f"{len(judged.measured.errors)} of {compared.impacts} impacts found{until}{floats}{unknown}"
    if not (compared.is_whole_run or judged.reference.outcome is Outcome.CRUSHED or local is None):
        reason += "; to the end, every step agrees with PIC, started from the run's own state"
    if contact is not None:
        reason += f"; {contact.compared_states} states from {format_instant(contact.begin_s)} on follow Coulomb's law"
    yield Finding(Verdict.CONFORMS, reason)


def _report_rest(judged: JudgedRun) -> Iterator[Finding]:
    reference = judged.reference
    if reference.contact_s < math.inf:
        beyond = "its states were not checked" if judged.local_truth is None else "steps are compared until the end"
        if reference.outcome is Outcome.CRUSHED:
            beyond = "nothing is compared"
        ending = _OTHER_ENDINGS.get(reference.outcome, "")
        yield Finding(Verdict.RESTED, f"at {format_instant(reference.contact_s)}{ending}; after that {beyond}")


def _report_convention(judged: JudgedRun) -> Iterator[Finding]:
    reference, match = judged.reference, judged.convention
    if match is None:
        return
    tied, first = f"{len(reference.ambiguous)} of {len(reference.impacts)}", format_instant(match.group.time_s)
    reason = f"{tied} impacts share a disc with another impact at the same instant, the first at {first}"
    if match.nearest is None:
        reason += "; there are too many possible outcomes to list"
    else:
        count, scale = len(match.outcomes), "of the scene's greatest speed"
        which = f"possible outcome {match.nearest + 1} of {count} ({match.outcomes[match.nearest].how})"
        if match.matches:
            reason += f"; matches {which}, except for {format_number(match.distance)} {scale}"
        else:
            difference = f"the run differs by {format_number(match.distance, 3)} {scale} from {which}"
            reason += f"; matches none of the {count} possible outcomes; {difference}"
    if (before := judged.grade_before_tie) is not None:
        grade_name = "undecided" if before is Grade.UNGRADED else before.name.lower().replace("_", ", ")
        reason += f"; until then the run is {grade_name}"
    yield Finding(Verdict.CONVENTION, reason)


def _report_ending(judged: JudgedRun) -> Iterator[Finding]:
    observed = judged.observed
    if judged.is_cut_short:
        note = f": {observed.notes[0]}" if observed.notes else ""
        yield Finding(Verdict.CUT_SHORT, f"{observed.outcome.value}{note}, at {format_instant(observed.end_time_s)}")
    elif judged.has_other_ending:
        reference = judged.reference
        yield Finding(Verdict.WENT_ON, f"{reference.outcome.value}, at {format_instant(reference.end_time_s)}")


def _report_missed_and_spurious(judged: JudgedRun) -> Iterator[Finding]:
    alignment, reliable_impacts = judged.alignment, judged.compared.impacts
    expected, found = judged.reference.impacts, judged.observed.impacts
    if missed := alignment.missed:
        kind = Verdict.MISSED if len(missed) == 1 else Verdict.MULTIPLE_MISSED
        yield Finding(kind, f"{len(missed)} of {reliable_impacts}, {_format_first(missed, expected)}")
    if alignment.spurious:
        yield Finding(Verdict.SPURIOUS, f"{len(alignment.spurious)}, {_format_first(alignment.spurious, found)}")
    if undecided := alignment.undecided:
        first = format_instant(expected["time_s"][undecided[0]])
        yield Finding(Verdict.UNDECIDED, f"{len(undecided)} of {reliable_impacts} impacts, the first at {first}")


def _format_first(indices: Sequence[int], impacts: NDArray[np.void]) -> str:
    first = impacts[indices[0]]
    return f"the first at {format_instant(first['time_s'])} between {pair_name(first)}"


def _report_order(judged: JudgedRun) -> Iterator[Finding]:
    if not judged.inverted:
        return
    (a, b), impacts = judged.inverted[0], judged.reference.impacts
    edits = f"{judged.edits} or more" if judged.edits == MOST_EDITS else str(judged.edits)
    yield Finding(
        Verdict.WRONG_ORDER,
        f"{format_count(len(judged.inverted), 'pair')} of impacts, edit distance {edits}; the impact of "
        f"{pair_name(impacts[a])} must be {format_seconds(float(impacts['time_s'][b] - impacts['time_s'][a]))} before "
        f"that of {pair_name(impacts[b])}",
    )


def _report_timing(judged: JudgedRun) -> Iterator[Finding]:
    # Two impacts in the wrong order also have wrong times, but only the wrong order is reported.
    swapped = {index for pair in judged.inverted for index in pair}
    errors = [error.time_s for error in judged.measured.errors if error.reference not in swapped]
    for verdict, sign in ((Verdict.LATE, 1.0), (Verdict.EARLY, -1.0)):
        worst = find_largest([sign * error for error in errors if sign * error > 0.0], default=0.0)
        if worst > judged.rounding_s:
            yield Finding(verdict, f"by up to {_format_seconds_and_steps(worst, judged)}")


def _report_velocities(judged: JudgedRun) -> Iterator[Finding]:
    own_speeds, scales = judged.baseline.find_own_scales(judged.reference).speed_m_s, judged.scales
    allowed = judged.rounding * own_speeds
    wrong = [e for e in judged.measured.errors if not e.velocity * scales.speed_m_s <= allowed[e.reference]]
    worst = max(wrong, key=lambda error: error.velocity, default=None)
    if worst is not None:
        reason = f"by up to {format_number(worst.velocity, 3)} times the scene's greatest speed"
        if own_speeds[worst.reference] < 0.5 * scales.speed_m_s:
            part = worst.velocity * scales.speed_m_s / own_speeds[worst.reference]
            reason += f", or {format_number(part, 3)} times the greatest speed that led to the impact"
        if worst.normal_rad > judged.rounding:
            degrees = format_number(math.degrees(worst.normal_rad), 3)
            reason += f", at an impact whose normal is wrong by {degrees} degrees"
        yield Finding(Verdict.WRONG_VELOCITY, reason)
    direction_rad, energy = judged.measured.largest.direction_rad, judged.measured.largest.energy
    if direction_rad > THRESHOLDS.direction_rad:
        yield Finding(Verdict.WRONG_DIRECTION, f"by up to {format_number(math.degrees(direction_rad), 3)} degrees")
    falls = any(judged.reference.scene.gravity_m_s2)  # with gravity, kinetic energy is not conserved
    if abs(energy) > THRESHOLDS.energy and not falls:
        verdict = Verdict.ENERGY_GAINED if energy > 0 else Verdict.ENERGY_LOST
        yield Finding(verdict, f"{format_number(abs(energy), 3)} of the scene's energy")


def _report_unknown_velocities(judged: JudgedRun) -> Iterator[Finding]:
    impacts = judged.observed.impacts
    if unknown := np.flatnonzero(unknown_velocities(judged.observed).any(axis=0)).tolist():
        first = _format_first(unknown, impacts)
        reason = f"{len(unknown)} of {len(impacts)} impacts, {first}: only the last one in its step is compared"
        yield Finding(Verdict.NOT_TOLD_APART, reason)


def _report_spins(judged: JudgedRun) -> Iterator[Finding]:
    """Report errors of spins, which are NaN if no disc spins."""
    allowed = judged.rounding * judged.baseline.find_own_scales(judged.reference).rim_m_s
    scale, impacts = judged.scales.rim_m_s, judged.observed.impacts
    wrong_spins = [e.spin for e in judged.measured.errors if e.spin * scale > allowed[e.reference]]
    if wrong_spins:
        size = format_number(max(wrong_spins), 3)
        yield Finding(Verdict.WRONG_SPIN, f"by up to {size} times the scene's greatest disc or rim speed")
    for verdict, wrong in ((Verdict.SLID, judged.branches.slid), (Verdict.STUCK, judged.branches.stuck)):
        if wrong:
            yield Finding(verdict, f"{len(wrong)} of {len(impacts)}, {_format_first(wrong, impacts)}")


def _report_end_state(judged: JudgedRun) -> Iterator[Finding]:
    """Report errors of the final state, if the reference has a unique final state and no impact is undecided."""
    if judged.convention is not None or judged.alignment.undecided:
        return
    beyond = judged.measured.ends > judged.compute_end_rounding(judged.measured, exactly=True)
    worst = judged.measured.largest
    rules = (
        (Verdict.MISPLACED, worst.final_position, "the largest radius"),
        (Verdict.WRONG_END, worst.final_velocity, "the scene's greatest speed"),
        (Verdict.WRONG_LAST_SPIN, worst.final_spin, "the scene's greatest disc or rim speed"),
    )
    for row, (verdict, error, scale) in zip(beyond, rules, strict=True):
        if np.any(row):
            yield Finding(verdict, f"by up to {format_number(error, 3)} times {scale}")


def _format_contact(score: ContactScore) -> str:
    def describe(errors: ContactErrors) -> str:
        rim = f" and {format_number(errors.rim_m_s, 3)} m/s at the rim" if errors.rim_m_s else ""
        return f"{format_metres(errors.place_m)}, {format_number(errors.velocity_m_s, 3)} m/s{rim}"

    pit = f"; PIT by {describe(score.pit)}" if score.pit is not None else ""
    wrong = "; a disc that should move stands still" if score.frozen else ""
    if score.beyond_m < 0.5 * score.errors.place_m:
        wrong += f"; moving a disc at one speed in each step explains all but {format_metres(score.beyond_m)}"
    place, speed = (THRESHOLDS.close * part for part in score.allowed[:2])
    if abs(score.quality.gap_m) > place:
        side = "off" if score.quality.gap_m > 0.0 else "inside"
        wrong += f"; a disc is held {format_metres(abs(score.quality.gap_m))} {side} its wall"
    if score.rest_m_s > speed:
        wrong += f"; a disc that should rest moves at {format_number(score.rest_m_s, 3)} m/s on average"
    if score.quality.hop_m_s > speed:
        take_offs = score.quality.take_offs
        part = f", taking off in {format_number(100.0 * take_offs)} % of the states" if take_offs else ""
        wrong += f"; a disc hops at {format_number(score.quality.hop_m_s, 3)} m/s in contact{part}"
    for event_name, late_s, most_s in zip(("bounces", "slips"), score.late, score.late_allowed, strict=True):
        if abs(late_s) > most_s:
            wrong += f"; {event_name} end {format_seconds(abs(late_s))} {'late' if late_s > 0.0 else 'early'}"
    if score.momentum_m_s > THRESHOLDS.close * score.allowed.velocity_m_s:
        off = f"{format_number(score.momentum_m_s, 3)} m/s"
        wrong += f"; angular momentum about the wall, which friction can't change, is off by {off}"
    return f"from {format_instant(score.begin_s)} on by up to {describe(score.errors)}{wrong}{pit}"


def _report_drifts(run: MeasuredRun) -> Iterator[Finding]:
    """Report positions and angular momenta that do not agree with a run's own impacts."""
    consistency = run.consistency
    if consistency is None:
        return
    if consistency.strayed > run.place_rounding:
        position = consistency.position
        reason = f"{_format_size(position.size)} times the largest radius, {_format_since(position)}"
        if consistency.strayed_excess > run.place_rounding:
            reason += f"; {format_number(consistency.excess.size, 3)} more than the overlap gained in a step explains"
        yield Finding(Verdict.DRIFTS, reason)
    if consistency.angular > run.rounding:
        reason = f"{_format_size(consistency.angular)} times the scene's greatest disc or rim speed"
        if math.isfinite(consistency.arm):
            distance, excess = f"{format_number(consistency.arm, 4)} times its radius", consistency.arm - 1.0
            if abs(excess) < _NEAR_THE_RIM:
                side = "outside" if excess > 0.0 else "inside"
                distance = f"{format_number(abs(excess), 3)} of its radius {side} its rim"
            reason += f"; a disc turns as if friction acted at {distance}"
        if consistency.angular_excess > run.rounding:
            more = format_number(consistency.angular_excess, 3)
            reason += f"; {more} more than the overlap gained in a step explains"
        yield Finding(Verdict.ANGULAR, reason)


def _report_contradictions(run: MeasuredRun) -> Iterator[Finding]:
    """Report contradictions between a run's states, velocities, reported times and normals."""
    found, rounding = run.consistency, run.rounding
    if found is None:
        return
    speed, rims = "times the scene's greatest speed", "times the scene's greatest disc or rim speed"
    if not found.velocity.size <= rounding:
        yield Finding(Verdict.TURNS, f"{_format_size(found.velocity.size)} {speed}, {_format_since(found.velocity)}")
    if not found.spin.size <= rounding:
        yield Finding(Verdict.SPINS, f"{_format_size(found.spin.size)} {rims}, {_format_since(found.spin)}")
    if not found.momentum <= rounding:
        reason = f"{_format_size(found.momentum)} {speed}, in the velocity of the two discs' centre of mass"
        yield Finding(Verdict.MOMENTUM, reason)
    if not found.stamp_s <= rounding * run.scales.time_s:
        yield Finding(Verdict.WRONG_STAMP, f"by up to {_format_seconds_and_steps(found.stamp_s, run)}")
    if not found.across <= rounding:
        angle = f"{format_number(math.degrees(found.normal_rad), 3)} degrees"
        yield Finding(Verdict.WRONG_NORMAL, f"{angle} from the velocity change at the impact with the largest error")
    if not found.normal_length <= rounding:
        yield Finding(Verdict.WRONG_NORMAL, f"their length differs from 1 {_format_size(found.normal_length)}")


def _format_size(size: float) -> str:
    return f"by up to {format_number(size, 3)}"


def _format_since(slip: Deviation) -> str:
    return f"disc {slip.disc} after {format_instant(slip.since_s)}"


def _format_seconds_and_steps(time_s: float, run: MeasuredRun) -> str:
    """Format a time in seconds and, if the run has steps, in steps."""
    dt_s = run.observed.dt_s
    return format_seconds(time_s) + (f", {format_steps(time_s, dt_s)}" if dt_s else "")
