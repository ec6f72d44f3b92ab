"""From numbers to verdicts and a grade. Every threshold stands here, in one place."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from carom.comparator.convention import ConventionMatch
from carom.comparator.measure import Measured
from carom.comparator.order import MOST_EDITS, Order
from carom.comparator.score import Finding, Grade, ImpactError, Scales, Verdict
from carom.trace import Outcome, Trace, wall_index

__all__ = ["THRESHOLDS", "Evidence", "Thresholds", "findings", "grade"]


@dataclass(frozen=True)
class Thresholds:
    """Where an error begins to count.

    Attributes:
        rounding: Times over the scene's duration, velocities over its speed. The known answers are reproduced to this.
        rounding_32: The same for what a method that computes in 32-bit floats may differ from PIT by: a hundred of its
            units in the last place. To be exact, or to conform, it must keep to `rounding` like everybody else.
        direction_rad: A direction wrong by more than this is called wrong: a degree, about what shows in a picture.
        energy: Energy over the energy at the start. Float64 engines drift by 1e-13 and float32 ones by 1e-7 through
            rounding; a millionth is neither.
    """

    rounding: float = 1e-12
    rounding_32: float = 1e-5
    direction_rad: float = math.radians(1.0)
    energy: float = 1e-6

    def rounding_of(self, float_bits: int) -> float:
        """Return what counts as rounding where a method of this width of floats is held against PIT."""
        return self.rounding if float_bits >= 64 else self.rounding_32


THRESHOLDS = Thresholds()


@dataclass(frozen=True)
class Evidence:
    """All that a verdict is derived from.

    Attributes:
        reference: The reference.
        observed: The trace that is judged.
        measured: What was measured of it.
        sampling: What was measured of PIT at the same step; None where that was not run.
        scales: The scene's own scales.
        believed: How many of the reference's impacts are within the horizon.
        order: The order of the impacts.
        convention: Which admissible outcome it took, where the scene has no unique answer.
    """

    reference: Trace
    observed: Trace
    measured: Measured
    sampling: Measured | None
    scales: Scales
    believed: int
    order: Order
    convention: ConventionMatch | None


def findings(evidence: Evidence) -> tuple[Finding, ...]:
    """Derive every verdict that the numbers support, each with its reason."""
    errors = evidence.measured.errors
    found = [*_convention(evidence), *_hits(evidence), *_order(evidence), *_timing(evidence), *_motion(evidence)]
    if errors and found and evidence.sampling is None:
        reason = "whether sampling explains the errors is not known"
        found.append(Finding(Verdict.UNCOMPARED, reason))
    if not found:
        found.append(Finding(Verdict.CONFORMS, f"{len(errors)} of {evidence.believed} impacts found"))
    return tuple(found)


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
    if observed.outcome is not Outcome.COMPLETED:
        note = f": {observed.notes[0]}" if observed.notes else ""
        yield Finding(Verdict.CUT_SHORT, f"{observed.outcome.value}{note}, at {observed.end_time_s:.6g} s")
    if alignment.missed:
        kind = Verdict.MISSED if len(alignment.missed) == 1 else Verdict.MULTIPLE_MISSED
        first = reference.impacts[alignment.missed[0]]
        reason = (
            f"{len(alignment.missed)} of {evidence.believed}, the first at {first['time_s']:.6g} s "
            f"between {_bodies(first)}"
        )
        yield Finding(kind, reason)
    if alignment.spurious:
        first = observed.impacts[alignment.spurious[0]]
        reason = f"{len(alignment.spurious)}, the first at {first['time_s']:.6g} s between {_bodies(first)}"
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
        f"{len(order.inverted)} inverted, edit distance {edits}; first that of {_bodies(impacts[a])} before "
        f"that of {_bodies(impacts[b])}, {float(impacts['time_s'][b] - impacts['time_s'][a]):.3g} s apart",
    )


def _timing(evidence: Evidence) -> Iterator[Finding]:
    # Two impacts that have changed places are each at the other's time: that is said already.
    errors = [e for e in evidence.measured.errors if e.reference not in evidence.order.out_of_place]
    dt_s = evidence.observed.dt_s
    late = max([0.0, *(error.time_s for error in errors)])
    early = min([0.0, *(error.time_s for error in errors)])
    for verdict, worst in ((Verdict.LATE, late), (Verdict.EARLY, early)):
        if abs(worst) > THRESHOLDS.rounding * evidence.scales.time_s:
            steps = f", {abs(worst) / dt_s:.3g} dt" if dt_s else ""
            yield Finding(verdict, f"by up to {abs(worst):.3g} s{steps}")


def _motion(evidence: Evidence) -> Iterator[Finding]:
    errors = evidence.measured.errors
    turned = max((error.direction_rad for error in errors), default=0.0)
    worst = max(errors, key=lambda error: error.velocity, default=None)
    if worst is not None and worst.velocity > THRESHOLDS.rounding:
        reason = f"by up to {worst.velocity:.3g} of the scene's speed"
        if worst.normal_rad > THRESHOLDS.rounding:
            reason += f", where the normal is turned by {math.degrees(worst.normal_rad):.3g} degrees"
        yield Finding(Verdict.WRONG_VELOCITY, reason)
    if turned > THRESHOLDS.direction_rad:
        yield Finding(Verdict.WRONG_DIRECTION, f"by up to {math.degrees(turned):.3g} degrees")
    energy_error = evidence.measured.energy_error
    if abs(energy_error) > THRESHOLDS.energy:
        verdict = Verdict.ENERGY_GAINED if energy_error > 0 else Verdict.ENERGY_LOST
        yield Finding(verdict, f"{abs(energy_error):.3g} of the energy at the start")


def _bodies(impact: object) -> str:
    first, second = int(impact["first"]), int(impact["second"])  # type: ignore[index] # a row of a structured array
    return f"disc {first} and {f'disc {second}' if second >= 0 else f'wall {wall_index(second)}'}"


def grade(evidence: Evidence) -> Grade:
    """Grade a comparison."""
    reference, observed, measured = evidence.reference, evidence.observed, evidence.measured
    alignment, errors, sampling, scales = measured.alignment, measured.errors, evidence.sampling, evidence.scales
    if evidence.convention is not None:
        return Grade.UNGRADED
    if (
        alignment.missed
        or alignment.spurious
        or evidence.order.inverted
        or observed.outcome is not _asked_of(reference)
    ):
        return Grade.WRONG
    if alignment.undecided:
        return Grade.UNGRADED
    rounding, rounding_s = THRESHOLDS.rounding, THRESHOLDS.rounding * scales.time_s
    time_s, velocity = _worst(errors)
    if time_s <= rounding_s and velocity <= rounding and abs(measured.energy_error) <= rounding:
        return Grade.EXACT
    if sampling is None:
        return Grade.UNGRADED
    # Held against PIT where both have an error: an impact that PIT misses can't be found worse than by PIT.
    common = {error.reference for error in sampling.errors}
    time_s, velocity = _worst(tuple(error for error in errors if error.reference in common))
    pit_time_s, pit_velocity = _worst(sampling.errors)
    rounding = THRESHOLDS.rounding_of(observed.float_bits)
    rounding_s = rounding * scales.time_s
    no_worse = (
        # Which phase of its step an impact meets is luck: up to a whole step late is what sampling costs.
        time_s <= max(pit_time_s, observed.dt_s) + rounding_s
        and velocity <= pit_velocity + rounding
        and abs(measured.energy_error) <= max(abs(sampling.energy_error) + rounding, THRESHOLDS.energy)
    )
    return Grade.SAMPLED if no_worse else Grade.INACCURATE


def _asked_of(reference: Trace) -> Outcome:
    """Return how a run must end: a reference is whole up to where a disc comes to rest, and nobody else must end."""
    return Outcome.COMPLETED if reference.outcome is Outcome.AT_REST else reference.outcome


def _worst(errors: tuple[ImpactError, ...]) -> tuple[float, float]:
    return (
        max((abs(error.time_s) for error in errors), default=0.0),
        max((error.velocity for error in errors), default=0.0),
    )
