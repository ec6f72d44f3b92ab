"""Hit or miss, times and velocities of scenes whose every impact is known, no worse than declared.

What a method that looks once a step has to pay is measured, not guessed: PIT runs the same scene at the same step. An
adapter may be as bad as that, and on top of it by what its profile's `Accuracy` owns up to. A profile whose steps are
cut does not look once a step but where bodies begin to touch, so it is allowed rounding and its promise alone.
"""

from __future__ import annotations

import math

from carom.comparator import ImpactError, Score
from carom.conformance.checks.common import numbers
from carom.conformance.subject import Subject
from carom.conformance.violation import Setup, Violation
from carom.scenes import catalogue
from carom.trace import Outcome, Trace, body_name

__all__ = ["finds_impacts", "times_are_right", "velocities_are_right"]


def finds_impacts(subject: Subject, profile: str, name: str) -> None:
    """Every impact is found that PIT finds at this step, and none is invented."""
    setup, trace, score, pit = subject.score(profile, name)
    known = catalogue()[name].known.impacts
    if trace.outcome is not Outcome.COMPLETED:
        found = "; ".join((trace.outcome.value, *trace.notes))
        raise Violation("the run ends before the scene does", expected="the scene's end", found=found, setup=setup)
    missed = [index for index in score.missed if index not in {*pit.missed, *pit.undecided}]
    if missed:
        impact = known[missed[0]]
        raise Violation(
            f"{len(missed)} of {len(known)} impacts missed",
            expected=f"{_bodies(impact.first, impact.second)} at {impact.time_s:.6g} s, as PIT finds at this step",
            found=f"{len(trace.impacts)} impacts: {_listed(trace)}",
            setup=setup,
        )
    if len(score.spurious) > len(pit.spurious):
        row = trace.impacts[score.spurious[0]]
        raise Violation(
            f"{len(score.spurious)} impacts invented",
            expected=f"{len(known)} impacts",
            found=f"one of {_bodies(int(row['first']), int(row['second']))} at {row['time_s']:.6g} s",
            setup=setup,
        )


def times_are_right(subject: Subject, profile: str, name: str) -> None:
    """The path turns no earlier than PIT's, and no later than a step, or PIT's, or what is promised for each impact."""
    setup, _, score, pit = subject.score(profile, name)
    promise_s = subject.adapter.profiles[profile].accuracy.late_steps * setup.dt_s
    # Which phase of its step an impact meets is luck: up to a whole step late is what sampling costs.
    times = [error.time_s for error in pit.errors if math.isfinite(error.time_s)]
    sampled_s = max([setup.dt_s, *times])
    early_s = max([0.0, *(-time_s for time_s in times)])
    if subject.adapter.profiles[profile].located:
        sampled_s = early_s = 0.0
    rounding_s = subject.rounding * setup.scene.duration_s
    for error in sorted(_compared(score, pit), key=lambda error: -abs(error.time_s)):
        late_s = sampled_s + promise_s * (
            error.reference + 1
        )  # each impact of a chain begins with what those before left
        if not -early_s - rounding_s <= error.time_s <= late_s + rounding_s:
            impact = catalogue()[name].known.impacts[error.reference]
            raise Violation(
                f"the impact of {_bodies(impact.first, impact.second)} comes at the wrong time",
                expected=f"{impact.time_s:.9g} s, and up to {late_s:.3g} s later ({late_s / setup.dt_s:.3g} dt)",
                found=f"{impact.time_s + error.time_s:.9g} s ({error.time_s / setup.dt_s:+.3g} dt)",
                setup=setup,
            )


def velocities_are_right(subject: Subject, profile: str, name: str) -> None:
    """Velocities after impacts, and at the end, are no worse than PIT's at this step and what is promised on top."""
    setup, trace, score, pit = subject.score(profile, name)
    located = subject.adapter.profiles[profile].located
    paid = [error.velocity for error in pit.errors if math.isfinite(error.velocity)]
    sampled = 0.0 if located else max(paid, default=0.0)
    promise = subject.adapter.profiles[profile].accuracy.velocity
    allowed = sampled + promise + subject.rounding
    for error in sorted(_compared(score, pit), key=lambda error: -error.velocity):
        if not error.velocity <= allowed:
            _raise_velocity(setup, trace, name, score, error, allowed, f"PIT {sampled:.3g}, promised {promise:.3g}")
    if score.missed or score.undecided or pit.missed or pit.undecided:
        return  # who missed an impact is on another path
    allowed = (0.0 if located else pit.total.final_velocity) + promise + subject.rounding
    if not score.total.final_velocity <= allowed:
        speed = score.scales.speed_m_s
        known = catalogue()[name].known.final_velocity_m_s or ()
        raise Violation(
            "discs end with wrong velocities",
            expected=f"{' and '.join(map(numbers, known))} m/s to {allowed * speed:.3g} m/s",
            found=f"{' and '.join(map(numbers, trace.final_velocity_m_s.tolist()))} m/s, "
            f"off by up to {score.total.final_velocity * speed:.3g} m/s",
            setup=setup,
        )


def _raise_velocity(
    setup: Setup, trace: Trace, name: str, score: Score, error: ImpactError, allowed: float, why: str
) -> None:
    impact, row = catalogue()[name].known.impacts[error.reference], trace.impacts[error.observed]
    wanted = [impact.velocity_first_after, impact.velocity_second_after]
    got = [row["velocity_first_after"].tolist(), row["velocity_second_after"].tolist()]
    pairs = [(w, g) for w, g in zip(wanted, got, strict=True) if w is not None]
    speed = score.scales.speed_m_s
    raise Violation(
        f"the impact of {_bodies(impact.first, impact.second)} at {impact.time_s:.6g} s leaves wrong velocities",
        expected=f"{' and '.join(numbers(w) for w, _ in pairs)} m/s to {allowed * speed:.3g} m/s ({why} of {speed:g})",
        found=f"{' and '.join(numbers(g) for _, g in pairs)} m/s, off by {error.velocity * speed:.3g} m/s",
        setup=setup,
    )


def _compared(score: Score, pit: Score) -> list[ImpactError]:
    """Impacts that PIT has an error of, too; without PIT's, what sampling costs is not known."""
    common = {error.reference for error in pit.errors}
    return [error for error in score.errors if error.reference in common]


def _bodies(first: int, second: int) -> str:
    return f"{body_name(first)} and {body_name(second)}"


def _listed(trace: Trace, most: int = 4) -> str:
    shown = [f"{_bodies(int(r['first']), int(r['second']))} at {r['time_s']:.6g} s" for r in trace.impacts[:most]]
    return (", ".join(shown) + (", ..." if len(trace.impacts) > most else "")) or "none"
