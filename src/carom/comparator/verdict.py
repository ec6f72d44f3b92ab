"""From numbers to verdicts, each with the numbers that it was derived from as its reason."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from carom.comparator.align import Reach
from carom.comparator.consistency import Consistency, Slip
from carom.comparator.convention import ConventionMatch
from carom.comparator.grades import Grade
from carom.comparator.grip import WrongBranches
from carom.comparator.local import LocalErrors
from carom.comparator.local_truth.score import LocalScore
from carom.comparator.measure import ImpactError, Measured, untold
from carom.comparator.order import MOST_EDITS, Order
from carom.comparator.sampling import Price
from carom.comparator.scales import Scales, largest
from carom.comparator.thresholds import THRESHOLDS
from carom.trace import Outcome, Trace, pair_name

__all__ = ["Evidence", "Finding", "Verdict", "contradictions", "findings", "lucky_phase"]


class Verdict(Enum):
    """What is wrong, if anything; the value is the sentence shown. The first four are the source paper's cases."""

    MISSED = "an impact is missed"
    LATE = "found late"
    WRONG_DIRECTION = "wrong direction after the bounce"
    MULTIPLE_MISSED = "several impacts are missed"
    EARLY = "found before it happens"
    WRONG_VELOCITY = "velocities after an impact are off"
    WRONG_SPIN = "spins after an impact are off"
    SLID = "discs slide where friction holds them"
    STUCK = "discs hold where friction lets them slide"
    WRONG_ORDER = "impacts come in the wrong order"
    SPURIOUS = "impacts are found that the reference does not have"
    ENERGY_GAINED = "discs end with more kinetic energy than the reference's"
    ENERGY_LOST = "discs end with less kinetic energy than the reference's"
    NOT_TOLD_APART = "velocities between several impacts of a disc in one step are not told apart"
    LUCKY_PHASE = "looking once a step is as good at this phase of the step, and not at others"
    CUT_SHORT = "the run ended before the scene did"
    WENT_ON = "the run goes on where the reference ends"
    CONVENTION = "the scene has no unique answer"
    UNDECIDED = "too close to the end of the run to be decided"
    UNCOMPARED = "there is no PIT at this step to hold it against"
    MISPLACED = "discs end in the wrong place"
    WRONG_END = "discs end with the wrong velocity"
    WRONG_LAST_SPIN = "discs end with the wrong spin"
    DRIFTS = "discs move otherwise than their velocities say"
    TURNS = "velocities change where no impact is reported"
    SPINS = "spins change where no impact is reported"
    WRONG_STAMP = "impacts are stamped outside the step that reports them"
    WRONG_NORMAL = "the normals reported are not those of the impacts"
    MOMENTUM = "momentum is gained or lost at an impact"
    ANGULAR = "angular momentum about the contact is gained or lost"
    NOT_FINITE = "a number is NaN or infinite"
    PARTED = "the trajectory has left the reference's"
    PASSED_THROUGH = "bodies pass through each other"
    TURNED_ALONE = "bodies turn with nothing near"
    SINKS = "discs sink into what they rest on"
    WORSE_STEPS = "steps are worse than PIT's from the same state"
    SAMPLED_STEPS = "steps are off, by no more than looking once a step costs from the same state"
    RESTED = "the reference ends where a disc comes to rest"
    NO_IMPACT = "the scene has no impact to be graded by"
    NOTHING_COMPARED = "no impact lies within the horizon, so there is nothing to compare"
    CONFORMS = "agrees with the reference to rounding"


@dataclass(frozen=True)
class Finding:
    """One verdict and the numbers it was derived from, as a sentence."""

    verdict: Verdict
    reason: str


@dataclass(frozen=True)
class Evidence:
    """All that a verdict is derived from: what a `Score` shows, and what that was found from.

    Attributes:
        reach: What of the reference is believed.
        measured: What was measured of the observed trace against it.
        sampling: What was measured of PIT at the same step; None where that was not run.
        against_pit: What was measured of the observed trace against that PIT; None as well.
        price: What PIT pays at worst over the phases of that step; None as well.
        consistency: None where the observed trace has a number that is NaN or infinite.
        branches: Which of its impacts took the wrong branch of friction.
        broken: Which number that is, empty where there is none.
        local_truth: Each step against PIC from the observed trace's own state; None where states were not looked at.
        told_otherwise: Whether it reports other impacts than its states show.
        pit_s: Times of the impacts of PIT; None where it was not run.
        up_to_tie: The grade up to the first instant that has no unique answer; None where there is none, or nothing
            before it.
    """

    reference: Trace
    observed: Trace
    scales: Scales
    reach: Reach
    measured: Measured
    sampling: Measured | None
    against_pit: Measured | None
    price: Price | None
    order: Order
    local: LocalErrors
    convention: ConventionMatch | None
    consistency: Consistency | None
    branches: WrongBranches
    broken: str
    local_truth: LocalScore | None
    told_otherwise: bool
    pit_s: NDArray[np.float64] | None
    up_to_tie: Grade | None

    @property
    def steps_are_exact(self) -> bool:
        """Whether the whole run is PIC's, step by step and in its end, whatever of it could be told apart.

        Of several impacts of a disc in one step, an engine that tells no velocities shows the outcome alone.
        """
        local, largest = self.local_truth, self.measured.largest
        if local is None or local.grade is not Grade.EXACT or self.told_otherwise or self.convention is not None:
            return False
        if self.ended_otherwise or self.broken or largest.final_spin > self.rounding or any(_own_path(self)):
            return False
        if self.reach.whole:
            return bool(np.all(self.measured.ends[:2] <= self.end_rounding(self.measured, exactly=True)[:2]))
        # Up to a horizon the last impact of each disc says the same: errors hand themselves on.
        latest: dict[int, float] = {}
        for error in self.measured.errors:
            row = self.reference.impacts[error.reference]
            latest |= dict.fromkeys((int(row["first"]), int(row["second"])), error.velocity)
        return bool(latest) and all(off <= self.rounding for disc, off in latest.items() if disc >= 0)

    @property
    def parted(self) -> bool:
        """Whether the trajectory has left the reference's though no step passes through anything, or invents anything.

        Not where the run reports other impacts than its states show, ends early, or the scene has no unique answer.
        """
        local = self.local_truth
        if local is None or local.missed_own or local.invented or self.told_otherwise or self.broken:
            return False
        if self.steps_are_exact:
            return False
        return self.convention is None and self.parted_s is not None and not self.ended_otherwise

    @property
    def parted_s(self) -> float | None:
        """When the first impact is that the reference and the run do not share in this order, seconds; or None."""
        swapped = [a for a, _ in self.order.inverted]
        return _first_unshared(self.measured, self.reference, self.observed.impacts["time_s"], swapped)

    @property
    def pit_parted_s(self) -> float | None:
        """The same of PIT at this step."""
        if self.sampling is None or self.pit_s is None:
            return None
        return _first_unshared(self.sampling, self.reference, self.pit_s, ())

    @property
    def nothing_compared(self) -> bool:
        """Whether there is a horizon, and no impact of the reference before it."""
        return not self.reach.whole and not self.reach.impacts

    @property
    def cut_short(self) -> bool:
        """Whether the run ended before the scene did, whatever it calls that."""
        completed = self.observed.outcome is Outcome.COMPLETED
        return not completed or self.observed.end_time_s < self.scales.time_s * (1.0 - THRESHOLDS.rounding)

    @property
    def ended_otherwise(self) -> bool:
        """Whether the run ended otherwise than the reference; where discs come to rest nobody else must end."""
        asked = Outcome.COMPLETED if self.reference.outcome is Outcome.AT_REST else self.reference.outcome
        return self.observed.outcome is not asked or (asked is Outcome.COMPLETED and self.cut_short)

    @property
    def rounding(self) -> float:
        """What counts as rounding in the floats that the method declares."""
        return THRESHOLDS.rounding_of(self.observed.float_bits)

    @property
    def rounding_s(self) -> float:
        """The same of a time, seconds."""
        return THRESHOLDS.time_rounding_of(self.observed.float_bits, self.scales.time_s, self.observed.dt_s)

    @property
    def place_rounding(self) -> float:
        """What rounding makes of a position in all steps of the run, over its own reach."""
        steps = self.scales.time_s / self.observed.dt_s if self.observed.dt_s else 0.0
        return THRESHOLDS.place_rounding_of(self.observed.float_bits, steps)

    def is_rounding(self, error: ImpactError, measured: Measured) -> bool:
        """Whether the errors of an impact's velocities and spins are rounding, of what led to it."""
        own, at, scales = measured.own, error.reference, self.scales
        return (
            error.velocity * scales.speed_m_s <= self.rounding * own.speed_m_s[at]
            and not error.spin * scales.rim_m_s > self.rounding * own.rim_m_s[at]
        )

    def end_rounding(self, measured: Measured, *, exactly: bool) -> NDArray[np.float64]:
        """What rounding of what led to them makes of final places, velocities and rims, as `Measured.ends` has them.

        Narrow floats round a place further and further; *exact* ends at a hundredth of a step's travel, as of a time.
        """
        own = measured.own
        place = self.place_rounding * own.reach_m
        if exactly:
            step_m = own.final_speed_m_s * self.observed.dt_s
            # What never moves is not rounded step by step.
            most = np.where(own.final_speed_m_s > 0.0, THRESHOLDS.close * step_m, self.rounding * own.reach_m)
            place = np.minimum(place, most) if self.observed.dt_s else place
        return np.stack([place, self.rounding * own.final_speed_m_s, self.rounding * own.final_rim_m_s])


def _first_unshared(
    measured: Measured, reference: Trace, observed_s: NDArray[np.float64], swapped: Sequence[int]
) -> float | None:
    expected_s, alignment = reference.impacts["time_s"], measured.alignment
    times = [float(expected_s[k]) for k in (*alignment.missed, *swapped)]
    times += [float(observed_s[k]) for k in alignment.spurious]
    return min(times, default=None)


def findings(evidence: Evidence) -> tuple[Finding, ...]:
    """Derive every verdict that the numbers support, each with its reason."""
    errors = evidence.measured.errors
    # Beyond the instant at which two trajectories part, which impact is which is chance.
    apart = (_parted,) if evidence.parted else (_hits, _order, _timing, _motion, _turning, _end)
    # Where every step is PIC's, what is off of an impact is what was not told apart.
    rules = (_convention, *(() if evidence.steps_are_exact else apart), _own_path, _sinking)
    found = [Finding(Verdict.NOT_FINITE, evidence.broken)] if evidence.broken else []
    found += [finding for rule in rules for finding in rule(evidence)]
    found += list(_steps(evidence, told=bool(found)))
    if found:
        found += _not_told(evidence)
    if errors and found and evidence.sampling is None:
        found.append(Finding(Verdict.UNCOMPARED, "whether sampling explains the errors is not known"))
    if evidence.nothing_compared:
        times = evidence.reference.impacts["time_s"]
        first = f"the first impact, at {times[0]:.6g} s, lies beyond it" if len(times) else "there is none in the scene"
        found.append(Finding(Verdict.NOTHING_COMPARED, f"{evidence.reach.until_s:.6g} s; {first}"))
    if not found and not evidence.reach.impacts and evidence.reach.whole:
        local = evidence.local_truth
        steps = "; every step agrees with free flight to rounding" if local is not None and local.agrees_alone else ""
        found.append(Finding(Verdict.NO_IMPACT, f"{evidence.scales.time_s:.6g} s of free flight{steps}"))
    if not found:
        floats = "" if evidence.observed.float_bits >= 64 else f", in {evidence.observed.float_bits}-bit floats"
        unknown = "".join(f"; not told apart: {finding.reason}" for finding in _not_told(evidence))
        until = "" if evidence.reach.whole else f" up to the horizon, {evidence.reach.until_s:.6g} s"
        looked = not evidence.reach.whole and evidence.local_truth is not None
        rest = "; to the end every step agrees with PIC from its own state" if looked else ""
        reason = f"{len(errors)} of {evidence.reach.impacts} impacts found{until}{floats}{unknown}{rest}"
        found.append(Finding(Verdict.CONFORMS, reason))
    if evidence.reference.outcome is Outcome.AT_REST:
        beyond = "its states were not looked at" if evidence.local_truth is None else "steps are compared to the end"
        found.append(Finding(Verdict.RESTED, f"at {evidence.reference.end_time_s:.6g} s; from there {beyond}"))
    return tuple(found)


def lucky_phase(evidence: Evidence, found: tuple[Finding, ...]) -> tuple[Finding, ...]:
    """Return the findings of a run that is PIT's, and as good as it is at some phases of the step only, with that said.

    Of one that conforms it stands in the reason: nothing is wrong with it.
    """
    price = evidence.price
    if price is None or price.as_close == price.phases:
        return found
    share = f"PIT's impacts are as right at {price.as_close} of {price.phases} phases of the step"
    if not any(finding.verdict is Verdict.CONFORMS for finding in found):
        return (*found, Finding(Verdict.LUCKY_PHASE, share))
    return tuple(
        Finding(finding.verdict, f"{finding.reason}; {share}") if finding.verdict is Verdict.CONFORMS else finding
        for finding in found
    )


def _parted(evidence: Evidence) -> Iterator[Finding]:
    local = evidence.local_truth
    if local is None or evidence.parted_s is None:
        return
    pit = ""
    if evidence.sampling is not None:
        pit = " (PIT's not)" if evidence.pit_parted_s is None else f" (PIT's at {evidence.pit_parted_s:.6g} s)"
    alignment = evidence.measured.alignment
    yield Finding(
        Verdict.PARTED,
        f"at {evidence.parted_s:.6g} s{pit}; of {evidence.reach.impacts} impacts it does not have "
        f"{len(alignment.missed)}, and has {len(alignment.spurious)} others; {_own_word(local)}",
    )


def _own_word(local: LocalScore) -> str:
    """Say how good the steps of a run are, each by itself."""
    if local.grade is Grade.INACCURATE:
        return "some steps by themselves are inaccurate"
    how = "no worse than PIT's from the same state" if local.grade is Grade.SAMPLED else local.grade.name.lower()
    return f"each step by itself is {how}"


def _sinking(evidence: Evidence) -> Iterator[Finding]:
    local = evidence.local_truth
    if local is not None and (local.sinks or local.sunk_radii > evidence.rounding):
        held = "faster than by falling for each step anew" if local.sinks else "by what it falls in each step"
        yield Finding(Verdict.SINKS, f"by up to {local.sunk_radii:.3g} of the distance of contact, {held}")


def _steps(evidence: Evidence, *, told: bool) -> Iterator[Finding]:
    """What local truth finds that the trajectory does not tell: beyond the horizon, and after rest."""
    local, alignment = evidence.local_truth, evidence.measured.alignment
    if local is None or evidence.broken:
        return
    if local.missed > len(alignment.missed) or (local.missed and evidence.parted):
        pit = f"PIT misses {local.missed_by_pit} of these, too, from the same states"
        yield Finding(Verdict.PASSED_THROUGH, f"{local.missed} of {local.due} impacts due, {local.first_missed}; {pit}")
    if local.invented > len(alignment.spurious):
        yield Finding(Verdict.TURNED_ALONE, f"{local.invented}, the first {local.first_invented}")
    if local.grade is Grade.INACCURATE and (evidence.parted or not evidence.reach.whole or not told):
        yield Finding(Verdict.WORSE_STEPS, "; ".join(_faults(local)))
    if local.grade in (Grade.CLOSE, Grade.SAMPLED) and not told and not (evidence.reach.whole and local.agrees_alone):
        yield Finding(Verdict.SAMPLED_STEPS, "; ".join(_costs(local)))


def _costs(local: LocalScore) -> Iterator[str]:
    """Yield what the steps of a run are off by where that is sampling's, each with its numbers."""
    if local.judged:
        yield (
            f"velocities of {local.judged} impacts that stand alone by up to {local.velocity[1]:.3g} of their bodies' "
            f"speed, {local.ratio[1]:.3g} of what PIT pays"
        )
    if local.late_steps[1] > 0.0:
        yield f"late by up to {local.late_steps[1]:.3g} steps"
    if local.entangled:
        yield f"{local.entangled} windows hold several impacts"
    if local.missed:
        yield f"{local.missed} impacts are missed, which PIT misses from the same states"
    if local.polygon:
        yield "falling discs move along polygons"


def _faults(local: LocalScore) -> Iterator[str]:
    """Yield what makes the steps of a run inaccurate, each with its numbers."""
    judged = f"of {local.judged} impacts that stand alone"
    if local.worse_than_pit:
        free = math.isinf(local.ratio[1])
        worst = "some where PIT pays nothing" if free else f"up to {local.ratio[1]:.4g} times as much"
        off = f", restitution off by {local.restitution[0]:.3g} at the median" if local.restitution[0] > 0.0 else ""
        yield f"{local.worse_than_pit} {judged} pay more than PIT, {worst}{off}"
    if local.early:
        yield f"{local.early} {judged} come early, by up to {local.early_steps:.3g} steps"
    if local.ahead:
        yield f"{local.ahead} turns answer a meeting more than two steps ahead of it, by a margin of length"
    if local.too_late:
        yield f"{local.too_late} {judged} come later than a step, by up to {local.late_steps[1]:.3g} steps"
    if local.drifts:
        yield f"places move other than by their velocities in {local.drifts} steps, by up to {local.drift:.3g} radii"
    if local.slipped > local.rounding:
        yield f"velocities change with nothing near, by up to {local.slipped:.3g} of themselves"
    if local.energy > local.energy_rounding:
        yield f"{local.energy:.3g} of the energy is gained or lost that PIT's steps do not gain or lose"
    if local.sinks:
        yield "a disc sinks into what it rests on"


def _convention(evidence: Evidence) -> Iterator[Finding]:
    reference, match = evidence.reference, evidence.convention
    if match is None:
        return
    reason = (
        f"{len(reference.ambiguous)} of {len(reference.impacts)} impacts share a disc with another at the very same "
        f"instant, the first at {match.group.time_s:.6g} s"
    )
    count = len(match.outcomes)
    if match.nearest is None:
        reason += "; there are too many admissible outcomes to list"
    else:
        which = f"admissible outcome {match.nearest + 1} of {count} ({match.outcomes[match.nearest].how})"
        if match.matches:
            reason += f"; matches {which}, to {match.distance:.2g} of the speed"
        else:
            reason += f"; matches none of {count} admissible outcomes: {match.distance:.3g} of the speed from {which}"
    if evidence.up_to_tie is not None:
        word = (
            "undecided" if evidence.up_to_tie is Grade.UNGRADED else evidence.up_to_tie.name.lower().replace("_", ", ")
        )
        reason += f"; up to there the run is {word}"
    yield Finding(Verdict.CONVENTION, reason)


def _hits(evidence: Evidence) -> Iterator[Finding]:
    observed, alignment, believed = evidence.observed, evidence.measured.alignment, evidence.reach.impacts
    expected, found = evidence.reference.impacts, observed.impacts
    if evidence.cut_short:
        note = f": {observed.notes[0]}" if observed.notes else ""
        yield Finding(Verdict.CUT_SHORT, f"{observed.outcome.value}{note}, at {observed.end_time_s:.6g} s")
    elif evidence.ended_otherwise:
        reference = evidence.reference
        yield Finding(Verdict.WENT_ON, f"{reference.outcome.value}, at {reference.end_time_s:.6g} s")
    if missed := alignment.missed:
        kind = Verdict.MISSED if len(missed) == 1 else Verdict.MULTIPLE_MISSED
        yield Finding(kind, f"{len(missed)} of {believed}, {_first(missed, expected)}")
    if alignment.spurious:
        yield Finding(Verdict.SPURIOUS, f"{len(alignment.spurious)}, {_first(alignment.spurious, found)}")
    if undecided := alignment.undecided:
        first_s = expected["time_s"][undecided[0]]
        yield Finding(Verdict.UNDECIDED, f"{len(undecided)} of {believed} impacts, the first at {first_s:.6g} s")


def _first(indices: Sequence[int], impacts: NDArray[np.void]) -> str:
    first = impacts[indices[0]]
    return f"the first at {first['time_s']:.6g} s between {pair_name(first)}"


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
    swapped = {index for pair in evidence.order.inverted for index in pair}
    errors = [error.time_s for error in evidence.measured.errors if error.reference not in swapped]
    for verdict, sign in ((Verdict.LATE, 1.0), (Verdict.EARLY, -1.0)):
        worst = largest((sign * error for error in errors if sign * error > 0.0), default=0.0)
        if worst > evidence.rounding_s:
            yield Finding(verdict, f"by up to {_seconds(worst, evidence)}")


def _motion(evidence: Evidence) -> Iterator[Finding]:
    own, scales = evidence.measured.own.speed_m_s, evidence.scales
    off = [
        e for e in evidence.measured.errors if not e.velocity * scales.speed_m_s <= evidence.rounding * own[e.reference]
    ]
    worst = max(off, key=lambda error: error.velocity, default=None)
    if worst is not None:
        reason = f"by up to {worst.velocity:.3g} of the scene's speed"
        if own[worst.reference] < 0.5 * scales.speed_m_s:
            part = worst.velocity * scales.speed_m_s / own[worst.reference]
            reason += f", {part:.3g} of the greatest that led to it"
        if worst.normal_rad > evidence.rounding:
            reason += f", where the normal is turned by {math.degrees(worst.normal_rad):.3g} degrees"
        yield Finding(Verdict.WRONG_VELOCITY, reason)
    turned, energy = evidence.measured.largest.direction_rad, evidence.measured.largest.energy
    if turned > THRESHOLDS.direction_rad:
        yield Finding(Verdict.WRONG_DIRECTION, f"by up to {math.degrees(turned):.3g} degrees")
    if abs(energy) > THRESHOLDS.energy:
        verdict = Verdict.ENERGY_GAINED if energy > 0 else Verdict.ENERGY_LOST
        yield Finding(verdict, f"{abs(energy):.3g} of the energy at the start")


def _not_told(evidence: Evidence) -> Iterator[Finding]:
    """What of a run nobody can judge."""
    impacts = evidence.observed.impacts
    if unknown := np.flatnonzero(untold(evidence.observed).any(axis=0)).tolist():
        reason = (
            f"{len(unknown)} of {len(impacts)} impacts, {_first(unknown, impacts)}: the last one in the step is judged"
        )
        yield Finding(Verdict.NOT_TOLD_APART, reason)


def _turning(evidence: Evidence) -> Iterator[Finding]:
    """What is off about spins; NaN where nothing turns."""
    own, scales, impacts = evidence.measured.own.rim_m_s, evidence.scales, evidence.observed.impacts
    off = [e.spin for e in evidence.measured.errors if e.spin * scales.rim_m_s > evidence.rounding * own[e.reference]]
    if off:
        worst = max(off)
        yield Finding(Verdict.WRONG_SPIN, f"by up to {worst:.3g} of the scene's speed of rims")
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
        yield Finding(Verdict.MISPLACED, f"by up to {place:.3g} of the largest radius")
    if off_velocity:
        yield Finding(Verdict.WRONG_END, f"by up to {velocity:.3g} of the scene's speed")
    if off_spin:
        spin = evidence.measured.largest.final_spin
        yield Finding(Verdict.WRONG_LAST_SPIN, f"by up to {spin:.3g} of the scene's speed of rims")


def _own_path(evidence: Evidence) -> Iterator[Finding]:
    """Where the run's own states part from its own velocities; what its declared floats round is nothing to tell."""
    own = evidence.consistency
    if own is not None and own.strayed > evidence.place_rounding:
        reason = f"by up to {own.position.size:.3g} of the largest radius, {_since(own.position)}"
        if own.strayed_excess > evidence.place_rounding:
            reason += f"; {own.excess.size:.3g} more than bodies close in a step"
        yield Finding(Verdict.DRIFTS, reason)
    if own is not None and own.angular > evidence.rounding:
        reason = f"by up to {own.angular:.3g} of the scene's speed of rims"
        if math.isfinite(own.arm):
            reason += f"; friction turns a disc as if at {own.arm:.4g} times its radius"
        if own.angular_excess > evidence.rounding:
            reason += f"; {own.angular_excess:.3g} more than bodies close in a step"
        yield Finding(Verdict.ANGULAR, reason)
    yield from contradictions(evidence)


def contradictions(evidence: Evidence) -> Iterator[Finding]:
    """Yield what the run's own states and velocities contradict, where it ends up aside."""
    own, rounding = evidence.consistency, evidence.rounding
    if own is None:
        return
    speed, two_discs = "of the scene's speed", "for the centre of mass of the two discs"
    rims = "of the scene's speed of rims"
    degrees, rounding_s = math.degrees(own.normal_rad), rounding * evidence.scales.time_s
    for verdict, size, allowed, reason in (
        (Verdict.TURNS, own.velocity.size, rounding, f"{own.velocity.size:.3g} {speed}, {_since(own.velocity)}"),
        (Verdict.SPINS, own.spin.size, rounding, f"{own.spin.size:.3g} {rims}, {_since(own.spin)}"),
        (Verdict.MOMENTUM, own.momentum, rounding, f"{own.momentum:.3g} {speed}, {two_discs}"),
        (Verdict.WRONG_STAMP, own.stamp_s, rounding_s, _seconds(own.stamp_s, evidence)),
        (Verdict.WRONG_NORMAL, own.across, rounding, f"{degrees:.3g} degrees from what the velocities change by"),
    ):
        if not size <= allowed:
            yield Finding(verdict, f"by up to {reason}")
    if not own.normal_length <= rounding:
        yield Finding(Verdict.WRONG_NORMAL, f"their length is up to {own.normal_length:.3g} off 1")


def _seconds(time_s: float, evidence: Evidence) -> str:
    dt_s = evidence.observed.dt_s
    return f"{time_s:.3g} s" + (f", {time_s / dt_s:.3g} dt" if dt_s else "")


def _since(slip: Slip) -> str:
    return f"disc {slip.disc} after {slip.since_s:.6g} s"
