"""From numbers to verdicts, each with the numbers that it was derived from as its reason."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

from carom.comparator.consistency import Consistency, Slip
from carom.comparator.convention import ConventionMatch
from carom.comparator.local import LocalErrors
from carom.comparator.measure import Measured
from carom.comparator.order import MOST_EDITS, Order
from carom.comparator.sampling import Price
from carom.comparator.scales import Scales, largest
from carom.comparator.thresholds import THRESHOLDS, place_rounding
from carom.trace import Outcome, Trace, pair_name

__all__ = ["Evidence", "Finding", "Verdict", "findings"]


class Verdict(Enum):
    """What is wrong, if anything; the value is the sentence shown. The first four are the source paper's cases."""

    MISSED = "an impact is missed"
    LATE = "found late: wrong time and path"
    WRONG_DIRECTION = "wrong direction after the bounce"
    MULTIPLE_MISSED = "several impacts are missed"
    EARLY = "found before it happens"
    WRONG_VELOCITY = "velocities after an impact are off"
    WRONG_ORDER = "impacts come in the wrong order"
    SPURIOUS = "impacts are invented that do not happen"
    ENERGY_GAINED = "energy is gained"
    ENERGY_LOST = "energy is lost"
    CUT_SHORT = "the run ended before the scene did"
    CONVENTION = "the scene has no unique answer"
    UNDECIDED = "too close to the end of the run to be decided"
    UNCOMPARED = "there is no PIT at this step to hold it against"
    MISPLACED = "discs end in the wrong place"
    WRONG_END = "discs end with the wrong velocity"
    DRIFTS = "discs move otherwise than their velocities say"
    TURNS = "velocities change where no impact is reported"
    WRONG_STAMP = "impacts are stamped outside the step that reports them"
    WRONG_NORMAL = "the normals reported are not those of the impacts"
    MOMENTUM = "momentum is gained or lost at an impact"
    NOT_FINITE = "a number is NaN or infinite"
    NOTHING_COMPARED = "no impact lies within the horizon, so there is nothing to compare"
    CONFORMS = "agrees with the reference to rounding"


@dataclass(frozen=True)
class Finding:
    """One verdict and the numbers it was derived from, as a sentence."""

    verdict: Verdict
    reason: str


@dataclass(frozen=True)
class Evidence:
    """All that a verdict is derived from.

    Attributes:
        reference: The reference.
        observed: The trace that is judged.
        measured: What was measured of it.
        sampling: What was measured of PIT at the same step; None where that was not run.
        price: What PIT pays at worst over the phases of that step; None as well.
        scales: The scene's own scales.
        believed: How many of the reference's impacts are within the horizon.
        until_s: The horizon, seconds; infinite where the whole run is compared.
        order: The order of the impacts.
        local: Each impact against the analytic answer from the run's own state before it.
        convention: Which admissible outcome it took, where the scene has no unique answer.
        consistency: How far it is from what its own impacts and states lead to; None where it has a number that is
            NaN or infinite.
        broken: Which number that is, empty where there is none.
    """

    reference: Trace
    observed: Trace
    measured: Measured
    sampling: Measured | None
    price: Price | None
    scales: Scales
    believed: int
    until_s: float
    order: Order
    local: LocalErrors
    convention: ConventionMatch | None
    consistency: Consistency | None
    broken: str

    @property
    def nothing_compared(self) -> bool:
        """Whether there is a horizon, and no impact of the reference before it."""
        return math.isfinite(self.until_s) and not self.believed

    @property
    def ends_compared(self) -> bool:
        """Whether the final state is one that the reference's decides on: one answer, and no impact left open."""
        return self.convention is None and not self.measured.alignment.undecided

    @property
    def cut_short(self) -> bool:
        """Whether the run ended before the scene did, whatever it calls that."""
        duration_s = self.scales.time_s
        completed = self.observed.outcome is Outcome.COMPLETED
        return not completed or self.observed.end_time_s < duration_s * (1.0 - THRESHOLDS.rounding)

    @property
    def rounding(self) -> float:
        """What counts as rounding in the floats that the method declares."""
        return THRESHOLDS.rounding_of(self.observed.float_bits)

    @property
    def rounding_s(self) -> float:
        """The same of a time, seconds; in a run of many steps no more than is called close."""
        rounding_s = self.rounding * self.scales.time_s
        return min(rounding_s, THRESHOLDS.close * self.observed.dt_s) if self.observed.dt_s else rounding_s

    @property
    def place_rounding(self) -> float:
        """What rounding makes of a position in all steps of the run, over the scene's length."""
        return place_rounding(self.scales, self.observed, self.observed.float_bits)


def findings(evidence: Evidence) -> tuple[Finding, ...]:
    """Derive every verdict that the numbers support, each with its reason."""
    errors = evidence.measured.errors
    rules = (_soundness, _convention, _hits, _order, _timing, _motion, _end, _own_path, _reports)
    found = [finding for rule in rules for finding in rule(evidence)]
    if errors and found and evidence.sampling is None:
        reason = "whether sampling explains the errors is not known"
        found.append(Finding(Verdict.UNCOMPARED, reason))
    if evidence.nothing_compared:
        times = evidence.reference.impacts["time_s"]
        first = f"the first impact, at {times[0]:.6g} s, lies beyond it" if len(times) else "there is none in the scene"
        found.append(Finding(Verdict.NOTHING_COMPARED, f"{evidence.until_s:.6g} s; {first}"))
    if not found:
        floats = "" if evidence.observed.float_bits >= 64 else f", in {evidence.observed.float_bits}-bit floats"
        found.append(Finding(Verdict.CONFORMS, f"{len(errors)} of {evidence.believed} impacts found{floats}"))
    return tuple(found)


def _soundness(evidence: Evidence) -> Iterator[Finding]:
    if evidence.broken:
        yield Finding(Verdict.NOT_FINITE, evidence.broken)


def _convention(evidence: Evidence) -> Iterator[Finding]:
    reference, match = evidence.reference, evidence.convention
    if match is None:
        return
    reason = (
        f"{len(reference.ambiguous)} of {len(reference.impacts)} impacts share a disc with another at the very same "
        f"instant, the first at {match.group.time_s:.6g} s"
    )
    if match.nearest is None:
        yield Finding(Verdict.CONVENTION, f"{reason}; there are too many admissible outcomes to list")
        return
    outcome, count = match.outcomes[match.nearest], len(match.outcomes)
    which = f"admissible outcome {match.nearest + 1} of {count} ({outcome.how})"
    if match.matches:
        yield Finding(Verdict.CONVENTION, f"{reason}; matches {which}, to {match.distance:.2g} of the speed")
    else:
        text = f"{reason}; matches none of {count} admissible outcomes: {match.distance:.3g} of the speed from {which}"
        yield Finding(Verdict.CONVENTION, text)


def _hits(evidence: Evidence) -> Iterator[Finding]:
    reference, observed, alignment = evidence.reference, evidence.observed, evidence.measured.alignment
    if evidence.cut_short:
        note = f": {observed.notes[0]}" if observed.notes else ""
        yield Finding(Verdict.CUT_SHORT, f"{observed.outcome.value}{note}, at {observed.end_time_s:.6g} s")
    if alignment.missed:
        kind = Verdict.MISSED if len(alignment.missed) == 1 else Verdict.MULTIPLE_MISSED
        first = reference.impacts[alignment.missed[0]]
        reason = (
            f"{len(alignment.missed)} of {evidence.believed}, the first at {first['time_s']:.6g} s "
            f"between {pair_name(first)}"
        )
        yield Finding(kind, reason)
    if alignment.spurious:
        first = observed.impacts[alignment.spurious[0]]
        reason = f"{len(alignment.spurious)}, the first at {first['time_s']:.6g} s between {pair_name(first)}"
        yield Finding(Verdict.SPURIOUS, reason)
    if alignment.undecided:
        first = reference.impacts[alignment.undecided[0]]
        reason = f"{len(alignment.undecided)} of {evidence.believed} impacts, the first at {first['time_s']:.6g} s"
        yield Finding(Verdict.UNDECIDED, reason)


def _order(evidence: Evidence) -> Iterator[Finding]:
    order, impacts = evidence.order, evidence.reference.impacts
    if not order.inverted:
        return
    a, b = order.inverted[0]
    edits = f"{order.edits} or more" if order.edits == MOST_EDITS else str(order.edits)
    yield Finding(
        Verdict.WRONG_ORDER,
        f"{len(order.inverted)} inverted, edit distance {edits}; first that of {pair_name(impacts[a])} before "
        f"that of {pair_name(impacts[b])}, {float(impacts['time_s'][b] - impacts['time_s'][a]):.3g} s apart",
    )


def _timing(evidence: Evidence) -> Iterator[Finding]:
    # Two impacts that have changed places are each at the other's time: that is said already.
    errors = [e for e in evidence.measured.errors if e.reference not in evidence.order.out_of_place]
    late = largest((error.time_s for error in errors if error.time_s > 0.0), default=0.0)
    early = largest((-error.time_s for error in errors if error.time_s < 0.0), default=0.0)
    for verdict, worst in ((Verdict.LATE, late), (Verdict.EARLY, early)):
        if worst > evidence.rounding_s:
            yield Finding(verdict, f"by up to {_seconds(worst, evidence)}")


def _motion(evidence: Evidence) -> Iterator[Finding]:
    errors = evidence.measured.errors
    turned = largest((error.direction_rad for error in errors), default=0.0)
    worst = max(errors, key=lambda error: error.velocity, default=None)
    if worst is not None and worst.velocity > evidence.rounding:
        reason = f"by up to {worst.velocity:.3g} of the scene's speed"
        if worst.normal_rad > evidence.rounding:
            reason += f", where the normal is turned by {math.degrees(worst.normal_rad):.3g} degrees"
        yield Finding(Verdict.WRONG_VELOCITY, reason)
    if turned > THRESHOLDS.direction_rad:
        yield Finding(Verdict.WRONG_DIRECTION, f"by up to {math.degrees(turned):.3g} degrees")
    energy_error = evidence.measured.largest.energy
    if abs(energy_error) > THRESHOLDS.energy:
        verdict = Verdict.ENERGY_GAINED if energy_error > 0 else Verdict.ENERGY_LOST
        yield Finding(verdict, f"{abs(energy_error):.3g} of the energy at the start")


def _end(evidence: Evidence) -> Iterator[Finding]:
    """Where the run ended, against the reference; beyond a horizon it was not measured."""
    if not evidence.ends_compared:
        return
    place, velocity = evidence.measured.largest.final_position, evidence.measured.largest.final_velocity
    if place > evidence.place_rounding:
        yield Finding(Verdict.MISPLACED, f"by up to {place:.3g} of the largest radius")
    if velocity > evidence.rounding:
        yield Finding(Verdict.WRONG_END, f"by up to {velocity:.3g} of the scene's speed")


def _own_path(evidence: Evidence) -> Iterator[Finding]:
    """Where the run's own states part from its own velocities; what its declared floats round is nothing to tell."""
    own = evidence.consistency
    if own is None:
        return
    if own.position.size > evidence.place_rounding:
        reason = f"by up to {own.position.size:.3g} of the largest radius, {_since(own.position)}"
        if own.excess.size > evidence.place_rounding:
            reason += f"; {own.excess.size:.3g} more than bodies close in a step"
        yield Finding(Verdict.DRIFTS, reason)
    if own.velocity.size > evidence.rounding:
        reason = f"by up to {own.velocity.size:.3g} of the scene's speed, {_since(own.velocity)}"
        yield Finding(Verdict.TURNS, reason)
    if own.momentum > evidence.rounding:
        reason = f"by up to {own.momentum:.3g} of the scene's speed, for the centre of mass of the two discs"
        yield Finding(Verdict.MOMENTUM, reason)


def _reports(evidence: Evidence) -> Iterator[Finding]:
    """What the run reports of its impacts and its own states contradict."""
    own, rounding = evidence.consistency, evidence.rounding
    if own is None:
        return
    if own.stamp_s > rounding * evidence.scales.time_s:
        yield Finding(Verdict.WRONG_STAMP, f"by up to {_seconds(own.stamp_s, evidence)}")
    if own.across > rounding:
        off = f"by up to {math.degrees(own.normal_rad):.3g} degrees from what the velocities change by"
        yield Finding(Verdict.WRONG_NORMAL, off)
    if own.normal_length > rounding:
        yield Finding(Verdict.WRONG_NORMAL, f"their length is up to {own.normal_length:.3g} off 1")


def _seconds(time_s: float, evidence: Evidence) -> str:
    dt_s = evidence.observed.dt_s
    return f"{time_s:.3g} s" + (f", {time_s / dt_s:.3g} dt" if dt_s else "")


def _since(slip: Slip) -> str:
    return f"disc {slip.disc} after {slip.since_s:.6g} s"
