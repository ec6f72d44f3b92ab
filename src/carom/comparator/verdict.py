"""From numbers to verdicts and a grade. Every threshold stands here, in one place."""

from __future__ import annotations

import math
from dataclasses import dataclass

from carom.comparator.measure import Measured
from carom.comparator.score import Finding, Grade, ImpactError, Scales, Verdict
from carom.trace import Outcome, Trace

__all__ = ["THRESHOLDS", "Thresholds", "findings", "grade"]


@dataclass(frozen=True)
class Thresholds:
    """Where an error begins to count.

    Attributes:
        rounding: Times over the scene's duration, velocities over its speed. The known answers are reproduced to this.
        direction_rad: A direction wrong by more than this is called wrong: a degree, about what shows in a picture.
        energy: Energy over the energy at the start. Float64 engines drift by 1e-13 and float32 ones by 1e-7 through
            rounding; a millionth is neither.
    """

    rounding: float = 1e-12
    direction_rad: float = math.radians(1.0)
    energy: float = 1e-6


THRESHOLDS = Thresholds()


def findings(
    reference: Trace, observed: Trace, measured: Measured, sampling: Measured | None, scales: Scales
) -> tuple[Finding, ...]:
    """Derive every verdict that the numbers support, each with its reason."""
    alignment, errors, energy_error = measured.alignment, measured.errors, measured.energy_error
    found: list[Finding] = []
    if reference.ambiguous:
        at = reference.impacts["time_s"][reference.ambiguous[0]]
        found.append(
            Finding(
                Verdict.CONVENTION,
                f"{len(reference.ambiguous)} of {len(reference.impacts)} impacts share a disc with another at the very "
                f"same instant, the first at {at:.6g} s; the reference takes them by the lower body numbers first",
            )
        )
    if observed.outcome is not Outcome.COMPLETED:
        note = f": {observed.notes[0]}" if observed.notes else ""
        reason = f"{observed.outcome.value}{note}, at {observed.end_time_s:.6g} s"
        found.append(Finding(Verdict.CUT_SHORT, reason))
    if alignment.missed:
        kind = Verdict.MISSED if len(alignment.missed) == 1 else Verdict.MULTIPLE_MISSED
        first = reference.impacts[alignment.missed[0]]
        reason = (
            f"{len(alignment.missed)} of {len(reference.impacts)}, the first at {first['time_s']:.6g} s "
            f"between {_bodies(first)}"
        )
        found.append(Finding(kind, reason))
    if alignment.spurious:
        first = observed.impacts[alignment.spurious[0]]
        reason = f"{len(alignment.spurious)}, the first at {first['time_s']:.6g} s between {_bodies(first)}"
        found.append(Finding(Verdict.SPURIOUS, reason))
    if alignment.undecided:
        first = reference.impacts[alignment.undecided[0]]
        reason = f"{len(alignment.undecided)} of {len(reference.impacts)} impacts, the first at {first['time_s']:.6g} s"
        found.append(Finding(Verdict.UNDECIDED, reason))
    found += _timing(observed, errors, scales)
    turned = max((error.direction_rad for error in errors), default=0.0)
    if turned > THRESHOLDS.direction_rad:
        found.append(Finding(Verdict.WRONG_DIRECTION, f"by up to {math.degrees(turned):.3g} degrees"))
    if abs(energy_error) > THRESHOLDS.energy:
        verdict = Verdict.ENERGY_GAINED if energy_error > 0 else Verdict.ENERGY_LOST
        found.append(Finding(verdict, f"{abs(energy_error):.3g} of the energy at the start"))
    if errors and found and sampling is None:
        reason = "whether sampling explains the errors is not known"
        found.append(Finding(Verdict.UNCOMPARED, reason))
    if not found:
        found.append(Finding(Verdict.CONFORMS, f"{len(errors)} of {len(reference.impacts)} impacts found"))
    return tuple(found)


def _timing(observed: Trace, errors: tuple[ImpactError, ...], scales: Scales) -> list[Finding]:
    found = []
    late = max([0.0, *(error.time_s for error in errors)])
    early = min([0.0, *(error.time_s for error in errors)])
    for verdict, worst in ((Verdict.LATE, late), (Verdict.EARLY, early)):
        if abs(worst) > THRESHOLDS.rounding * scales.time_s:
            steps = f", {abs(worst) / observed.dt_s:.3g} dt" if observed.dt_s else ""
            found.append(Finding(verdict, f"by up to {abs(worst):.3g} s{steps}"))
    return found


def _bodies(impact: object) -> str:
    first, second = int(impact["first"]), int(impact["second"])  # type: ignore[index] # a row of a structured array
    return f"disc {first} and {f'disc {second}' if second >= 0 else f'wall {-1 - second}'}"


def grade(reference: Trace, observed: Trace, measured: Measured, sampling: Measured | None, scales: Scales) -> Grade:
    """Grade a comparison; `sampling` is what was measured of PIT at the same step, None where that was not run."""
    alignment, errors = measured.alignment, measured.errors
    if reference.ambiguous:
        return Grade.UNGRADED
    if alignment.missed or alignment.spurious or observed.outcome is not reference.outcome:
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
    no_worse = (
        # Which phase of its step an impact meets is luck: up to a whole step late is what sampling costs.
        time_s <= max(pit_time_s, observed.dt_s) + rounding_s
        and velocity <= pit_velocity + rounding
        and abs(measured.energy_error) <= max(abs(sampling.energy_error) + rounding, THRESHOLDS.energy)
    )
    return Grade.SAMPLED if no_worse else Grade.INACCURATE


def _worst(errors: tuple[ImpactError, ...]) -> tuple[float, float]:
    return (
        max((abs(error.time_s) for error in errors), default=0.0),
        max((error.velocity for error in errors), default=0.0),
    )
