"""From numbers to verdicts, each with the numbers that it was derived from as its reason."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from carom.comparator.contact import in_contact
from carom.comparator.evidence import Evidence
from carom.comparator.grades import Grade
from carom.comparator.measure import untold
from carom.comparator.order import MOST_EDITS
from carom.comparator.scales import largest
from carom.comparator.self_consistency import in_seconds, own_path
from carom.comparator.step_findings import (
    bad_steps,
    has_left,
    misreported,
    parted,
    polygons,
    sinking,
    steps_are_exact,
)
from carom.comparator.thresholds import THRESHOLDS
from carom.comparator.verdict import Finding, Verdict
from carom.model.trace import Outcome, pair_name
from carom.support.formatting import instant, number, seconds

#: What a disc does that neither comes to rest nor slides or rolls, by how the reference ended.
_OTHERWISE = {Outcome.GLIDES: ", gliding along a wall", Outcome.CRUSHED: ", crushed between two walls"}


def findings(evidence: Evidence) -> tuple[Finding, ...]:
    """Derive every verdict that the numbers support, each with its reason."""
    errors, crushed = evidence.measured.errors, evidence.reference.outcome is Outcome.CRUSHED
    # Beyond the instant at which two trajectories part, which impact is which is chance.
    apart = (parted, misreported) if has_left(evidence) else (_hits, _order, _timing, _motion, _turning, _end)
    # Where every step is PIC's, what is off of an impact is what was not told apart.
    rules = (_convention, *(() if steps_are_exact(evidence) else (_ending, *apart)), own_path, sinking)
    found = [Finding(Verdict.NOT_FINITE, evidence.broken)] if evidence.broken else []
    found += [finding for rule in rules for finding in rule(evidence)]
    found += list(bad_steps(evidence, told=bool(found)))
    found += polygons(evidence) if found else ()
    if evidence.contact is not None and evidence.contact.grade is not Grade.EXACT:
        found.append(Finding(Verdict.CONTACT, in_contact(evidence.contact)))
    if found:
        found += _not_told(evidence)
    if errors and found and evidence.sampling is None:
        found.append(Finding(Verdict.UNCOMPARED, "whether sampling explains the errors is not known"))
    if evidence.nothing_compared and evidence.contact is None:
        times = evidence.reference.impacts["time_s"]
        first = (
            f"the first impact, at {instant(times[0])}, lies beyond it" if len(times) else "there is none in the scene"
        )
        found.append(Finding(Verdict.NOTHING_COMPARED, f"{instant(evidence.reach.until_s)}; {first}"))
    if not found and not evidence.reach.impacts and evidence.reach.whole:
        local = evidence.local_truth
        steps = "; every step agrees with free flight to rounding" if local is not None and local.agrees_alone else ""
        found.append(Finding(Verdict.NO_IMPACT, f"{instant(evidence.scales.time_s)} of free flight{steps}"))
    if not found:
        floats = "" if evidence.observed.float_bits >= 64 else f", in {evidence.observed.float_bits}-bit floats"
        unknown = "".join(f"; not told apart: {finding.reason}" for finding in _not_told(evidence))
        until = "" if evidence.reach.whole else f" up to {instant(evidence.reach.until_s)}"
        looked = not (evidence.reach.whole or crushed or evidence.local_truth is None)
        rest = "; to the end every step agrees with PIC from its own state" if looked else ""
        reason = f"{len(errors)} of {evidence.reach.impacts} impacts found{until}{floats}{unknown}{rest}"
        if (contact := evidence.contact) is not None:
            reason += f"; from {instant(contact.begin_s)} on {contact.looks} states are as Coulomb's law says"
        found.append(Finding(Verdict.CONFORMS, reason))
    if evidence.reference.contact_s < math.inf:
        beyond = "its states were not looked at" if evidence.local_truth is None else "steps are compared to the end"
        if crushed:
            beyond = "nothing is compared"
        there = _OTHERWISE.get(evidence.reference.outcome, "")
        found.append(Finding(Verdict.RESTED, f"at {instant(evidence.reference.contact_s)}{there}; from there {beyond}"))
    return tuple(found)


def lucky_phase(found: tuple[Finding, ...], as_right: int, phases: int) -> tuple[Finding, ...]:
    """Return the findings of a run that is PIT's, and as good as it is at some phases of the step only, with that said.

    Of one that conforms it stands in the reason: nothing is wrong with it.
    """
    share = f"PIT's impacts are as right at {as_right} of {phases} phases of the step"
    if not any(finding.verdict is Verdict.CONFORMS for finding in found):
        return (*found, Finding(Verdict.LUCKY_PHASE, share))
    return tuple(
        Finding(finding.verdict, f"{finding.reason}; {share}") if finding.verdict is Verdict.CONFORMS else finding
        for finding in found
    )


def _convention(evidence: Evidence) -> Iterator[Finding]:
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
    if evidence.up_to_tie is not None:
        word = (
            "undecided" if evidence.up_to_tie is Grade.UNGRADED else evidence.up_to_tie.name.lower().replace("_", ", ")
        )
        reason += f"; up to there the run is {word}"
    yield Finding(Verdict.CONVENTION, reason)


def _ending(evidence: Evidence) -> Iterator[Finding]:
    observed = evidence.observed
    if evidence.cut_short:
        note = f": {observed.notes[0]}" if observed.notes else ""
        yield Finding(Verdict.CUT_SHORT, f"{observed.outcome.value}{note}, at {instant(observed.end_time_s)}")
    elif evidence.ended_otherwise:
        reference = evidence.reference
        yield Finding(Verdict.WENT_ON, f"{reference.outcome.value}, at {instant(reference.end_time_s)}")


def _hits(evidence: Evidence) -> Iterator[Finding]:
    alignment, believed = evidence.measured.alignment, evidence.reach.impacts
    expected, found = evidence.reference.impacts, evidence.observed.impacts
    if missed := alignment.missed:
        kind = Verdict.MISSED if len(missed) == 1 else Verdict.MULTIPLE_MISSED
        yield Finding(kind, f"{len(missed)} of {believed}, {_first(missed, expected)}")
    if alignment.spurious:
        yield Finding(Verdict.SPURIOUS, f"{len(alignment.spurious)}, {_first(alignment.spurious, found)}")
    if undecided := alignment.undecided:
        first_s = expected["time_s"][undecided[0]]
        yield Finding(Verdict.UNDECIDED, f"{len(undecided)} of {believed} impacts, the first at {instant(first_s)}")


def _first(indices: Sequence[int], impacts: NDArray[np.void]) -> str:
    first = impacts[indices[0]]
    return f"the first at {instant(first['time_s'])} between {pair_name(first)}"


def _order(evidence: Evidence) -> Iterator[Finding]:
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


def _timing(evidence: Evidence) -> Iterator[Finding]:
    # Two impacts that have changed places are each at the other's time: that is said already.
    swapped = {index for pair in evidence.order.inverted for index in pair}
    errors = [error.time_s for error in evidence.measured.errors if error.reference not in swapped]
    for verdict, sign in ((Verdict.LATE, 1.0), (Verdict.EARLY, -1.0)):
        worst = largest((sign * error for error in errors if sign * error > 0.0), default=0.0)
        if worst > evidence.rounding_s:
            yield Finding(verdict, f"by up to {in_seconds(worst, evidence)}")


def _motion(evidence: Evidence) -> Iterator[Finding]:
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
    falls = any(evidence.reference.scene.gravity_m_s2)  # then what is higher is slower, and has lost nothing
    if abs(energy) > THRESHOLDS.energy and not falls:
        verdict = Verdict.ENERGY_GAINED if energy > 0 else Verdict.ENERGY_LOST
        yield Finding(verdict, f"{number(abs(energy), 3)} of the energy at the start")


def _not_told(evidence: Evidence) -> Iterator[Finding]:
    """What of a run nobody can judge."""
    impacts = evidence.observed.impacts
    if unknown := np.flatnonzero(untold(evidence.observed).any(axis=0)).tolist():
        reason = (
            f"{len(unknown)} of {len(impacts)} impacts, {_first(unknown, impacts)}: the last one in the step is judged"
        )
        yield Finding(Verdict.NOT_TOLD_APART, reason)


def _turning(evidence: Evidence) -> Iterator[Finding]:
    """What is off about spins; NaN if no disc spins."""
    own, scales, impacts = evidence.measured.own.rim_m_s, evidence.scales, evidence.observed.impacts
    off = [e.spin for e in evidence.measured.errors if e.spin * scales.rim_m_s > evidence.rounding * own[e.reference]]
    if off:
        worst = max(off)
        yield Finding(Verdict.WRONG_SPIN, f"by up to {number(worst, 3)} of the scene's speed of rims")
    for verdict, wrong in ((Verdict.SLID, evidence.branches.slid), (Verdict.STUCK, evidence.branches.stuck)):
        if wrong:
            yield Finding(verdict, f"{len(wrong)} of {len(impacts)}, {_first(wrong, impacts)}")


def _end(evidence: Evidence) -> Iterator[Finding]:
    """Where the run ended, if the reference decides on that: one answer, no impact left open, and no horizon."""
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
