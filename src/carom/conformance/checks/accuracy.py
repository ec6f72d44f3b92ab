"""Checks of accuracy: impacts, times and velocities of scenes with known answers.

PIT runs the same scene at the same step. PIT's errors are the cost of checking for overlap once per step. An adapter's
errors may be as large as PIT's plus the errors that its profile declares in `Accuracy`. A profile with cut steps finds
the instant of contact, so only the declared errors and rounding are allowed. For a profile with a contact margin, the
allowed errors are those of `carom.conformance.contact_margin` if they are larger than PIT's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from carom.catalogue import all_scenes
from carom.comparator import ImpactError, Score
from carom.conformance.adapter_under_test import Subject
from carom.conformance.checks.common import format_vector
from carom.conformance.violation import Violation, require
from carom.model.trace import Outcome, Trace, body_name
from carom.support.formatting import format_instant, format_number, format_seconds, format_steps


def finds_impacts(subject: Subject, profile: str, name: str) -> None:
    """The engine finds every impact that PIT finds at this step, and invents none except within a promised margin."""
    setup, trace, score, pit = subject.score(profile, name)
    margin = subject.compute_margin_score(profile, name)
    others = [pit] if margin is None else [pit, margin]
    known = all_scenes()[name].known.impacts
    found = "; ".join((trace.outcome.value, *trace.notes))
    ended = trace.outcome is Outcome.COMPLETED
    require(ended, "the run ends before the scene does", "the scene's end", found, setup)
    excused = {index for other in others for index in (*other.missed, *other.undecided)}
    missed = [index for index in score.missed if index not in excused]
    if missed:
        impact = known[missed[0]]
        raise Violation(
            f"{len(missed)} of {len(known)} impacts are missed",
            expected=f"{_format_impact(impact.first, impact.second, impact.time_s)}, as PIT finds at this step",
            found=f"{len(trace.impacts)} impacts: {_format_impacts(trace)}",
            setup=setup,
        )
    if len(score.spurious) > max(len(other.spurious) for other in others):
        what, one = f"{len(score.spurious)} impacts are invented", _format_impact_row(trace.impacts[score.spurious[0]])
        raise Violation(what, expected=f"{len(known)} impacts", found=f"an impact of {one}", setup=setup)


def times_are_right(subject: Subject, profile: str, name: str) -> None:
    """A path turns no earlier than PIT's, and at most a step or PIT's lateness later, plus the declared lateness.

    With a promised margin, an impact may be as early or late as the same impact of bodies that are thicker by the
    margin.
    """
    setup, _, score, pit = subject.score(profile, name)
    promise_s = subject.adapter.profiles[profile].accuracy.late_steps * setup.dt_s
    # An impact can be anywhere in a step, so sampling can be late by up to a whole step.
    times = [error.time_s for error in pit.errors if math.isfinite(error.time_s)]
    sampled_s = max([setup.dt_s, *times])
    early_s = max([0.0, *(-time_s for time_s in times)])
    if subject.adapter.profiles[profile].located:
        sampled_s = early_s = 0.0
    rounding_s = subject.rounding * setup.scene.duration_s
    margin = {
        error.reference: error.time_s
        for error in _list_finite_errors(subject.compute_margin_score(profile, name), "time_s")
    }
    for error in sorted(_list_compared_errors(score, pit), key=lambda error: -abs(error.time_s)):
        # Errors of successive impacts add up.
        shifted_s = margin.get(error.reference, 0.0)
        late_s = max(sampled_s, shifted_s) + promise_s * (error.reference + 1)
        impact = all_scenes()[name].known.impacts[error.reference]
        require(
            min(-early_s, shifted_s) - rounding_s <= error.time_s <= late_s + rounding_s,
            f"the impact of {_format_bodies(impact.first, impact.second)} is at the wrong time",
            f"{format_number(impact.time_s, 9)} s, or up to {format_seconds(late_s)} later "
            f"({format_steps(late_s, setup.dt_s)})"
            + (f" or {format_seconds(-shifted_s)} earlier" if shifted_s < 0 else ""),
            f"{format_number(impact.time_s + error.time_s, 9)} s ({format_steps(error.time_s, setup.dt_s)} off)",
            setup,
        )


class _Allowed(NamedTuple):
    """Allowed errors of velocities or spins by cause, relative to the scene's speed."""

    sampled: float
    promise: float
    margin: Mapping[int, float]
    rounding: float
    end: float

    def compute_limit(self, impact: int) -> float:
        return max(self.sampled, self.margin.get(impact, 0.0)) + self.promise + self.rounding


def _compute_allowed_errors(subject: Subject, profile: str, name: str, kind: str) -> _Allowed:
    """Return the allowed errors of a kind after each impact and at the end."""
    described, margin = subject.adapter.profiles[profile], subject.compute_margin_score(profile, name)
    *_, pit = subject.score(profile, name)
    promise, final = described.accuracy.velocity, f"final_{kind}"
    paid = [] if described.located else [getattr(error, kind) for error in _list_finite_errors(pit, kind)]
    ends = [0.0 if described.located else getattr(pit.total, final), getattr(margin.total, final) if margin else 0.0]
    return _Allowed(
        max(paid, default=0.0),
        promise,
        {error.reference: getattr(error, kind) for error in _list_finite_errors(margin, kind)},
        subject.rounding,
        max(ends) + promise + subject.rounding,
    )


def velocities_are_right(subject: Subject, profile: str, name: str) -> None:
    """Errors of velocities, after impacts and at the end, are at most PIT's errors plus the promised errors."""
    setup, trace, score, pit = subject.score(profile, name)
    known, speed = all_scenes()[name].known, score.scales.speed_m_s
    allowed = _compute_allowed_errors(subject, profile, name, "velocity")
    for error in sorted(_list_compared_errors(score, pit), key=lambda error: -error.velocity):
        turned, most = allowed.margin.get(error.reference, 0.0), allowed.compute_limit(error.reference)
        impact, row = known.impacts[error.reference], trace.impacts[error.observed]
        known_fields = [field for field in ("velocity_first_after", "velocity_second_after") if getattr(impact, field)]
        wanted, got = (
            [getattr(impact, field) for field in known_fields],
            [row[field].tolist() for field in known_fields],
        )
        sampled, promised, margin = (format_number(part, 3) for part in (allowed.sampled, allowed.promise, turned))
        why = f"PIT's error {sampled}, declared {promised}, margin {margin}, each times {speed:g} m/s"
        require(
            error.velocity <= most,
            f"the impact of {_format_impact(impact.first, impact.second, impact.time_s)} leaves wrong velocities",
            f"{_format_vectors(wanted)} m/s to {format_number(most * speed, 3)} m/s ({why})",
            f"{_format_vectors(got)} m/s, off by {format_number(error.velocity * speed, 3)} m/s",
            setup,
        )
    if score.missed or score.undecided or pit.missed or pit.undecided:
        return  # paths differ after a missed impact
    off = score.total.final_velocity
    expected = f"{_format_vectors(known.final_velocity_m_s or ())} m/s to {format_number(allowed.end * speed, 3)} m/s"
    found = (
        f"{_format_vectors(trace.final_velocity_m_s.tolist())} m/s, off by up to {format_number(off * speed, 3)} m/s"
    )
    require(off <= allowed.end, "discs end with wrong velocities", expected, found, setup)


def spins_are_right(subject: Subject, profile: str, name: str) -> None:
    """Errors of spins, after impacts and at the end, are at most PIT's errors plus the promised errors."""
    setup, trace, score, pit = subject.score(profile, name)
    known, speed = all_scenes()[name].known, score.scales.rim_m_s
    allowed = _compute_allowed_errors(subject, profile, name, "spin")
    why = f"PIT's error {format_number(allowed.sampled, 3)}, declared {format_number(allowed.promise, 3)}"
    for error in sorted(_list_compared_errors(score, pit), key=lambda error: -error.spin):
        most, impact = allowed.compute_limit(error.reference), known.impacts[error.reference]
        known_spins = [spin for spin in (impact.spin_first_after, impact.spin_second_after) if spin is not None]
        got = [] if trace.spins is None else list(trace.spins[error.observed].item()[2:])
        require(
            error.spin <= most,  # the comparison is false for NaN
            f"the impact of {_format_impact(impact.first, impact.second, impact.time_s)} leaves wrong spins",
            f"{format_vector(known_spins)} rad/s, rim speeds to {format_number(most * speed, 3)} m/s ({why})",
            f"{format_vector(got)} rad/s, rim speeds off by {format_number(error.spin * speed, 3)} m/s",
            setup,
        )
    if score.missed or score.undecided or pit.missed or pit.undecided:
        return
    found = [] if trace.final_spin_rad_s is None else trace.final_spin_rad_s.tolist()
    wanted = (
        f"{format_vector(known.final_spin_rad_s or ())} rad/s, rim speeds to {format_number(allowed.end * speed, 3)} "
        "m/s"
    )
    right = score.total.final_spin <= allowed.end
    require(right, "discs end with wrong spins", wanted, f"{format_vector(found)} rad/s", setup)


def _list_compared_errors(score: Score, pit: Score) -> list[ImpactError]:
    """Return the impacts that PIT also finds, so that the cost of sampling is known."""
    common = {error.reference for error in pit.errors}
    return [error for error in score.errors if error.reference in common]


def _list_finite_errors(score: Score | None, field: str) -> list[ImpactError]:
    """Return the impacts whose error in a field is finite; an empty list without a score."""
    return [error for error in score.errors if math.isfinite(getattr(error, field))] if score else []


def _format_bodies(first: int, second: int) -> str:
    return f"{body_name(first)} and {body_name(second)}"


def _format_impact(first: int, second: int, time_s: float) -> str:
    return f"{_format_bodies(first, second)} at {format_instant(time_s)}"


def _format_impact_row(row: np.void) -> str:
    return _format_impact(int(row["first"]), int(row["second"]), row["time_s"])


def _format_vectors(velocities: Sequence[Sequence[float]]) -> str:
    return " and ".join(map(format_vector, velocities))


def _format_impacts(trace: Trace) -> str:
    shown = ", ".join(map(_format_impact_row, trace.impacts[:4])) or "none"
    return shown + (", ..." if len(trace.impacts) > 4 else "")
