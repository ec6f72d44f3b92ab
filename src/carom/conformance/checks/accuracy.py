"""Checks of accuracy: impacts, times and velocities of scenes with known answers.

PIT runs the same scene with the same step size. All of PIT's errors arise because it checks for overlap only once per
step. An adapter's errors may be as large as PIT's errors plus the errors that the profile declares in `Accuracy`. The
profile `located` finds the instant of contact, so only rounding and the declared errors are allowed. With a contact
margin, an engine lets bodies collide before they touch. If a profile declares such a margin, errors may also be as
large as `carom.conformance.contact_margin` computes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from carom.comparator import ImpactError, Score
from carom.conformance.adapter_under_test import CatalogueRun, Subject
from carom.conformance.checks.common import format_vector
from carom.conformance.violation import Violation, require
from carom.model.trace import Outcome, pair_name
from carom.support.formatting import format_instant, format_number, format_seconds, format_steps


def finds_impacts(subject: Subject, profile: str, name: str) -> None:
    """The engine finds every impact that PIT finds.

    The engine invents no impacts, except those that PIT also invents or that the declared contact margin explains.
    """
    run = subject.score(profile, name)
    trace, score, due = run.trace, run.score, run.reference.impacts
    found = "; ".join((trace.outcome.value, *trace.notes))
    ended = trace.outcome is Outcome.COMPLETED
    require(ended, "the run ends before the scene does", "the scene's end", found, run.setup)
    pit_scores = [run.pit] if run.margin is None else [run.pit, run.margin]
    excused = {index for other in pit_scores for index in (*other.missed, *other.undecided)}
    missed = [index for index in score.missed if index not in excused]
    if missed:
        problem, expected = f"{len(missed)} of {len(due)} impacts are missed", _format_impact(due[missed[0]])
        found = f"{len(trace.impacts)} impacts: {', '.join(map(_format_impact, trace.impacts[:4])) or 'none'}"
        suffix = ", ..." if len(trace.impacts) > 4 else ""
        raise Violation(problem, f"{expected}, which PIT finds with the same step size", f"{found}{suffix}", run.setup)
    if len(score.spurious) > max(len(other.spurious) for other in pit_scores):
        problem, one = f"{len(score.spurious)} impacts are invented", _format_impact(trace.impacts[score.spurious[0]])
        raise Violation(problem, f"{len(due)} impacts", f"an impact of {one}", run.setup)


def times_are_right(subject: Subject, profile: str, name: str) -> None:
    """No impact is earlier than PIT's, or later than PIT's by more than the declared delay.

    Unless Carom shortens the steps, a delay of one step is always allowed. If the profile declares a contact margin, an
    impact may also be as early or late as if bodies collided at this margin.
    """
    run, described = subject.score(profile, name), subject.adapter.profiles[profile]
    dt_s, promise_s = run.setup.dt_s, described.accuracy.late_steps * run.setup.dt_s
    # An engine that checks once per step detects an impact up to one step late.
    times = _read_errors(run.pit, "time_s").values()
    sampled_s, early_s = max([dt_s, *times]), max([0.0, *(-time_s for time_s in times)])
    if described.located:
        sampled_s = early_s = 0.0
    rounding_s = subject.rounding * run.setup.scene.duration_s
    margin = _read_errors(run.margin, "time_s")
    for error in _list_compared_errors(run, "time_s"):
        # Each impact may add the declared delay to the delays of earlier impacts.
        shifted_s = margin.get(error.reference, 0.0)
        late_s = max(sampled_s, shifted_s) + promise_s * (error.reference + 1)
        impact = run.reference.impacts[error.reference]
        true_s, error_text = float(impact["time_s"]), format_steps(error.time_s, dt_s)
        later = f"or up to {format_seconds(late_s)} later ({format_steps(late_s, dt_s)})"
        earlier = f" or {format_seconds(-shifted_s)} earlier" if shifted_s < 0 else ""
        require(
            min(-early_s, shifted_s) - rounding_s <= error.time_s <= late_s + rounding_s,
            f"the impact of {pair_name(impact)} is at the wrong time",
            f"{format_number(true_s, 9)} s, {later}{earlier}",
            f"{format_number(true_s + error.time_s, 9)} s ({error_text} off)",
            run.setup,
        )


class _AllowedErrors(NamedTuple):
    """Allowed errors of velocities or spins by cause, as fractions of the scene's speed.

    Attributes:
        sampled: PIT's largest error after an impact.
        promise: The error that the profile declares.
        margin: The errors that the declared contact margin explains, by the number of the impact.
        rounding: The error that rounding explains.
        end: The allowed error at the end of the run, from all causes.
    """

    sampled: float
    promise: float
    margin: Mapping[int, float]
    rounding: float
    end: float

    def compute_limit(self, impact: int) -> float:
        """Return the allowed error after an impact."""
        return max(self.sampled, self.margin.get(impact, 0.0)) + self.promise + self.rounding


def _compute_allowed_errors(subject: Subject, run: CatalogueRun, kind: str) -> _AllowedErrors:
    """Return the allowed errors of velocities or spins (`kind`)."""
    described, final = subject.adapter.profiles[run.setup.profile], f"final_{kind}"
    promise, margin = described.accuracy.velocity, _read_errors(run.margin, kind)
    errors_of_pit = [] if described.located else _read_errors(run.pit, kind).values()
    end = 0.0 if described.located else getattr(run.pit.total, final)
    end = max(end, getattr(run.margin.total, final) if run.margin else 0.0) + promise + subject.rounding
    return _AllowedErrors(max(errors_of_pit, default=0.0), promise, margin, subject.rounding, end)


def velocities_are_right(subject: Subject, profile: str, name: str) -> None:
    """After impacts and at the end, velocity errors are at most PIT's errors plus the profile's declared errors."""
    run = subject.score(profile, name)
    trace, speed, allowed = run.trace, run.score.scales.speed_m_s, _compute_allowed_errors(subject, run, "velocity")
    for error in _list_compared_errors(run, "velocity"):
        margin_error, max_error = allowed.margin.get(error.reference, 0.0), allowed.compute_limit(error.reference)
        impact, row = run.known.impacts[error.reference], trace.impacts[error.observed]
        fields = [field for field in ("velocity_first_after", "velocity_second_after") if getattr(impact, field)]
        known_velocities, got = [getattr(impact, field) for field in fields], [row[field].tolist() for field in fields]
        parts = (allowed.sampled, allowed.promise, margin_error)
        sampled, promised, margin = (format_number(part, 3) for part in parts)
        why = f"PIT's error {sampled}, declared {promised}, margin {margin}, each times {speed:g} m/s"
        require(
            error.velocity <= max_error,
            f"the impact of {_format_impact(run.reference.impacts[error.reference])} leaves wrong velocities",
            f"{_format_vectors(known_velocities)} m/s to within {format_number(max_error * speed, 3)} m/s ({why})",
            f"{_format_vectors(got)} m/s, off by {format_number(error.velocity * speed, 3)} m/s",
            run.setup,
        )
    if run.misses_impacts:
        return  # after a missed impact the paths differ, so the final velocities can't be compared
    worst, limit = run.score.total.final_velocity, format_number(allowed.end * speed, 3)
    expected = f"{_format_vectors(run.known.final_velocity_m_s or ())} m/s to within {limit} m/s"
    found = f"{_format_vectors(trace.final_velocity_m_s.tolist())} m/s"
    found += f", off by up to {format_number(worst * speed, 3)} m/s"
    require(worst <= allowed.end, "discs end with wrong velocities", expected, found, run.setup)


def spins_are_right(subject: Subject, profile: str, name: str) -> None:
    """After impacts and at the end, spin errors are at most PIT's errors plus the profile's declared errors."""
    run = subject.score(profile, name)
    trace, speed, allowed = run.trace, run.score.scales.rim_m_s, _compute_allowed_errors(subject, run, "spin")
    why = f"PIT's error {format_number(allowed.sampled, 3)}, declared {format_number(allowed.promise, 3)}"
    for error in _list_compared_errors(run, "spin"):
        max_error, impact = allowed.compute_limit(error.reference), run.known.impacts[error.reference]
        known_spins = [spin for spin in (impact.spin_first_after, impact.spin_second_after) if spin is not None]
        got = [] if trace.spins is None else list(trace.spins[error.observed].item()[2:])
        require(
            error.spin <= max_error,  # false for NaN
            f"the impact of {_format_impact(run.reference.impacts[error.reference])} leaves wrong spins",
            f"{format_vector(known_spins)} rad/s, rim speeds to within {format_number(max_error * speed, 3)} m/s"
            f" ({why})",
            f"{format_vector(got)} rad/s, rim speeds off by {format_number(error.spin * speed, 3)} m/s",
            run.setup,
        )
    if run.misses_impacts:
        return
    found = [] if trace.final_spin_rad_s is None else trace.final_spin_rad_s.tolist()
    limit = format_number(allowed.end * speed, 3)
    expected = f"{format_vector(run.known.final_spin_rad_s or ())} rad/s, rim speeds to within {limit} m/s"
    right = run.score.total.final_spin <= allowed.end
    require(right, "discs end with wrong spins", expected, f"{format_vector(found)} rad/s", run.setup)


def _list_compared_errors(run: CatalogueRun, field: str) -> list[ImpactError]:
    """Return the errors of the impacts that PIT also finds, the largest error first.

    The checks compare these errors with PIT's.
    """
    common = {error.reference for error in run.pit.errors}
    compared = [error for error in run.score.errors if error.reference in common]
    return sorted(compared, key=lambda error: -abs(getattr(error, field)))


def _read_errors(score: Score | None, field: str) -> dict[int, float]:
    """Return the finite errors in `field`, with the numbers of the impacts as keys."""
    all_errors = {error.reference: getattr(error, field) for error in (score.errors if score else ())}
    return {impact: error for impact, error in all_errors.items() if math.isfinite(error)}


def _format_impact(row: np.void) -> str:
    return f"{pair_name(row)} at {format_instant(row['time_s'])}"


def _format_vectors(velocities: Sequence[Sequence[float]]) -> str:
    return " and ".join(map(format_vector, velocities))
