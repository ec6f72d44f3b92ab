"""Checks of accuracy: impacts, times and velocities of catalogue scenes, compared with PIC.

PIT runs the same scene with the same step size. All of PIT's errors arise because it checks for overlap only once per
step. An adapter's errors may be as large as PIT's errors plus the errors that the profile declares in `Accuracy`. The
profile `located` finds the instant of contact, so only rounding and the declared errors are allowed. With a contact
margin, an engine lets bodies collide before they touch. If a profile declares such a margin, errors may also be as
large as `carom.conformance.contact_margin` computes.
"""

from __future__ import annotations

import math

import numpy as np

from carom.comparator import ImpactError, Score
from carom.conformance.adapter_under_test import CatalogueRun, Subject
from carom.conformance.checks.common import format_vector
from carom.conformance.violation import Violation, require
from carom.model.trace import Outcome, Trace, pair_name, velocities
from carom.support.formatting import format_instant, format_number, format_seconds, format_steps


def check_hits(subject: Subject, profile: str, name: str) -> None:
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


def check_times(subject: Subject, profile: str, name: str) -> None:
    """No impact is earlier than PIT's impact, or later than PIT's by more than the delay that the profile declares.

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


def check_velocities(subject: Subject, profile: str, name: str) -> None:
    """After impacts and at the end, velocity errors are at most PIT's errors plus the profile's declared errors."""
    run = subject.score(profile, name)
    _require_small_errors(subject, run, "velocity", "velocities", "m/s", run.score.scales.speed_m_s)


def check_spins(subject: Subject, profile: str, name: str) -> None:
    """After impacts and at the end, spin errors are at most PIT's errors plus the profile's declared errors."""
    run = subject.score(profile, name)
    _require_small_errors(subject, run, "spin", "spins", "rad/s, rim speeds", run.score.scales.rim_m_s)


def _require_small_errors(
    subject: Subject, run: CatalogueRun, kind: str, plural: str, unit: str, scale_m_s: float
) -> None:
    """Check the velocities or spins (`kind`) after impacts and at the end. Errors are fractions of `scale_m_s`."""
    described, final = subject.adapter.profiles[run.setup.profile], f"final_{kind}"
    declared, margins = described.accuracy.velocity, _read_errors(run.margin, kind)
    sampled = 0.0 if described.located else max(_read_errors(run.pit, kind).values(), default=0.0)
    for error in _list_compared_errors(run, kind):
        margin, size = margins.get(error.reference, 0.0), getattr(error, kind)
        limit = max(sampled, margin) + declared + subject.rounding
        parts = {"PIT's error": sampled, "declared": declared, "margin": margin}
        why = ", ".join(f"{cause} {format_number(part, 3)}" for cause, part in parts.items())
        known = _format_states(run.reference, kind, error.reference)
        found = _format_states(run.trace, kind, error.observed)
        require(
            size <= limit,  # false for NaN
            f"the impact of {_format_impact(run.reference.impacts[error.reference])} leaves wrong {plural}",
            f"{known} {unit} to within {format_number(limit * scale_m_s, 3)} m/s ({why}, each times {scale_m_s:g} m/s)",
            f"{found} {unit} ({format_number(size * scale_m_s, 3)} m/s off)",
            run.setup,
        )
    if run.misses_impacts:
        return  # after a missed impact the paths differ, so the final states can't be compared
    allowed = [score for score in (None if described.located else run.pit, run.margin) if score is not None]
    limit = max((getattr(score.total, final) for score in allowed), default=0.0) + declared + subject.rounding
    worst = getattr(run.score.total, final)
    expected = f"{_format_states(run.reference, kind)} {unit} to within {format_number(limit * scale_m_s, 3)} m/s"
    found = f"{_format_states(run.trace, kind)} {unit} (up to {format_number(worst * scale_m_s, 3)} m/s off)"
    require(worst <= limit, f"discs end with wrong {plural}", expected, found, run.setup)


def _format_states(trace: Trace, kind: str, impact: int | None = None) -> str:
    """Return the velocities or spins (`kind`) of both bodies after an impact, or of all discs at the end."""
    if kind == "velocity":
        vectors = trace.final_velocity_m_s if impact is None else velocities(trace.impacts, "after")[:, impact]
        return " and ".join(map(format_vector, vectors.tolist()))
    if trace.spins is None or trace.final_spin_rad_s is None:
        return "()"
    return format_vector(trace.final_spin_rad_s.tolist() if impact is None else trace.spins[impact].item()[2:])


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
