"""Stress tests: scenes in which one quantity varies from harmless to extreme values, and checks of the results."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from carom.catalogue.entry import compute_deepest_overlap
from carom.execution.job import Status
from carom.model.energy import kinetic_energy
from carom.model.scene import Scene
from carom.model.trace import Outcome, Trace, Vector
from carom.studies.stress.result import STRESS
from carom.studies.stress.true_motion import TrueMotion
from carom.support.formatting import format_count, format_number

#: A method fails if its error exceeds this fraction of the velocity change by an impact. This error is too large for
#: any purpose, and larger than the usual errors of all engines at sensible step sizes. Therefore a stress test finds
#: the limits of a method, and does not measure its accuracy.
TOLERANCE = 0.1

#: Phases of the step at which the impact comes. Each value is tried at all these phases, because a method may pass at a
#: single phase by chance.
PHASES = (0.13, 0.52, 0.89)


@dataclass(frozen=True)
class CheckResult:
    """Result of the check of a trace.

    Attributes:
        error: Error of the trace, as defined by the stress test; NaN if there is nothing to measure.
        failure: Reason why the method fails; empty if it passes.
        note: Additional text about the trace, for the report.
        status: How the run ended: completed, or a kind of failure.
    """

    error: float
    failure: str = ""
    note: str = ""
    status: Status = Status.RAN


TraceCheck = Callable[[Trace], CheckResult]

_DESCRIPTIONS: dict[str, Any] = json.loads(Path(__file__).with_name("stress_tests.json").read_text(encoding="utf-8"))


@dataclass(frozen=True)
class Trial:
    """A scene of a stress test, and the check of its trace. The scene runs at its own frame rate.

    Attributes:
        scene: The scene.
        check_end: Function that checks a trace of the whole scene.
    """

    scene: Scene
    check_end: TraceCheck

    def check(self, trace: Trace) -> CheckResult:
        """Check a trace. A trace that ends early fails, unless infinitely many impacts or a lasting contact end it."""
        if not (np.isfinite(trace.final_velocity_m_s).all() and np.isfinite(trace.final_position_m).all()):
            return CheckResult(math.nan, Outcome.NON_FINITE.value)
        if trace.outcome in {Outcome.COMPLETED, Outcome.STANDSTILL} or trace.outcome.in_contact:
            return self.check_end(trace)
        note = f": {trace.notes[0]}" if trace.notes else ""
        return CheckResult(math.nan, f"{trace.outcome.value}{note}")


@dataclass(frozen=True)
class StressTest:
    """A stress test: a quantity that is varied from a harmless to an extreme value, and the scenes for each value.

    Attributes:
        name: Short name, as on the command line.
        group: Group of similar stress tests.
        axis: Description of the varied quantity, with its unit.
        harmless: The harmless end of the range. Every sound method should pass at this value.
        extreme: The extreme end of the range, which may be larger or smaller than `harmless`.
        trials: Function that returns the trials for a value. Usually, the trials differ only in the phase of the
            impact. To pass a value, a method must pass all trials of this value.
        truth: Explanation of how the correct result is known.
        failure_rule: Explanation of when a method fails.
        quick_extreme: The extreme end of the range in a quick campaign; None for `extreme`.
        whole_numbers: Whether the values must be whole numbers.
        values_per_decade: Number of tried values per decade (factor of 10). A larger number is needed if a method can
            pass at a single value by chance.
        full_only: Whether a quick campaign omits this stress test, because its runs take too long.
        final_value: An additional value after `extreme` that has no logarithm, such as a gap of 0. This value is tried,
            but bisections do not use it.
    """

    name: str
    group: str
    axis: str
    harmless: float
    extreme: float
    trials: Callable[[float], Sequence[Trial]]
    truth: str
    failure_rule: str
    quick_extreme: float | None = None
    whole_numbers: bool = False
    values_per_decade: int = 1
    full_only: bool = False
    final_value: float | None = None

    def build_ladder(self, quick: bool) -> list[float]:
        """Return the values to try, beginning at the harmless end.

        In a quick campaign, there are half as many values. There are at least 4 values, except if equal whole numbers
        are merged.
        """
        end = self.extreme if self.quick_extreme is None or not quick else self.quick_extreme
        decades = abs(math.log10(end / self.harmless))
        per_decade = self.values_per_decade / 2 if quick else self.values_per_decade
        count = max(4, math.ceil(decades * per_decade) + 1)
        values = [self.harmless * (end / self.harmless) ** (k / (count - 1)) for k in range(count)]
        # Values are rounded, so that they are easy to read.
        values = [float(f"{value:.3g}") for value in values[:-1]] + [end]
        if self.whole_numbers:
            values = sorted({round(value) * 1.0 for value in values}, reverse=end < self.harmless)
        return values if self.final_value is None else [*values, self.final_value]

    def find_middle_value(self, passes: float, fails: float, resolution: float) -> float | None:
        """Return the middle of two values on a logarithmic scale; None if their ratio is at most `resolution`."""
        if min(passes, fails) <= 0 or max(passes, fails) / min(passes, fails) <= resolution:
            return None
        middle = float(f"{math.sqrt(passes * fails):.4g}")
        if not self.whole_numbers:
            return middle
        middle = float(round(middle))
        return None if middle in (passes, fails) else middle


def build_stress_test(name: str, trials: Callable[[float], Iterable[Trial]]) -> StressTest:
    """Return the stress test with these trials, and with its description from ``stress_tests.json``.

    `name` is the test's name, such as "mass-ratio", or the name of a function, such as "_mass_ratio".

    If a text in `stress_tests.json` contains a name in braces, the name is replaced by a sentence that several stress
    tests share. All scenes get the stress test's name.
    """
    name = name.strip("_").replace("_", "-")
    fields = _DESCRIPTIONS["stress_tests"][name]
    sentences = {key: fields[key].format_map(_DESCRIPTIONS["sentences"]) for key in ("truth", "failure_rule")}

    @cache  # many methods are tested at the same value, and computing the exact motion takes longer than a run
    def build_trials(value: float) -> list[Trial]:
        title = {"name": f"{STRESS}{name}"}
        return [replace(trial, scene=trial.scene.model_copy(update=title)) for trial in trials(value)]

    return StressTest(name, trials=build_trials, **(fields | sentences))


def stress_test(trials: Callable[[float], Iterable[Trial]]) -> StressTest:
    """Decorator: make a stress test from a function that returns the trials for a value.

    The stress test has the function's name.
    """
    return build_stress_test(trials.__name__, trials)


def stress_test_at_phases(stage: Callable[[float, float], Trial]) -> StressTest:
    """Decorator: make a stress test from a function that returns the trial for a value and a phase.

    The stress test has the function's name, and tries each value at all `PHASES`.
    """
    return build_stress_test(stage.__name__, lambda value: [stage(value, phase) for phase in PHASES])


def build_velocity_check(truth: TrueMotion) -> TraceCheck:
    """Return a function that checks the final velocities of a trace.

    The error of each disc is divided by the greatest velocity change that an impact causes for this disc. Therefore
    errors in a graze are divided by a small velocity change.

    If a disc is never hit, its error is divided by the greatest change of all discs.
    """
    note = "by convention" if truth.convention else ""
    return build_closed_form_check(truth.final_velocity_m_s, len(truth.impacts), truth.greatest_change_m_s, note)


def build_closed_form_check(
    final_velocity_m_s: Sequence[Vector],
    impacts: int,
    change_m_s: Sequence[float],
    note: str = "",
    *,
    final_rim_m_s: Sequence[float] | None = None,
    cause: str = "an impact",
) -> TraceCheck:
    """Return a function that checks final velocities, and rim speeds if known.

    The errors of each disc are divided by its change in `change_m_s`.

    Args:
        final_velocity_m_s: The known velocities, in metres per second.
        impacts: Number of impacts, for messages; 0 if unknown.
        change_m_s: For each disc, the change of velocity or rim speed that impacts cause, whichever is larger, in
            metres per second; 0 for a disc that is never hit.
        note: Additional text for the report, about a trace that passes.
        final_rim_m_s: The known rim speeds ``R w``, in metres per second; None to ignore spins.
        cause: Cause of the velocity changes, for messages.
    """
    final, change = np.array(final_velocity_m_s), np.array(change_m_s)

    def check(trace: Trace) -> CheckResult:
        greatest = max(math.hypot(*disc.velocity_m_s) for disc in trace.scene.discs)
        scale = np.where(change > 0, change, change.max() or greatest or 1.0)
        error = float(np.max(np.hypot(*(trace.final_velocity_m_s - final).T) / scale))
        found = len(trace.impacts)
        is_wrong = not error <= TOLERANCE  # NaN also counts as wrong
        if is_wrong and found == 0 and impacts:
            return CheckResult(error, "no impact is found: the discs pass through each other")
        if is_wrong:
            counted = format_count(found, "impact") + (f" of {impacts}" if impacts else "")
            wrong = f"a velocity is wrong by {format_number(error)} times the change that {cause} causes"
            return CheckResult(error, f"{counted}, and {wrong}")
        if final_rim_m_s is None:
            return CheckResult(error, note=note)
        if trace.final_spin_rad_s is None:
            return CheckResult(math.nan, "no spin is reported")
        rims = trace.scene.arrays.radius_m * trace.final_spin_rad_s
        rim_error = float(np.max(np.abs(rims - np.array(final_rim_m_s)) / scale))
        if rim_error <= TOLERANCE:
            return CheckResult(max(rim_error, error), note=note)
        wrong = f"a rim speed is wrong by {format_number(rim_error)} times the change that {cause} causes"
        return CheckResult(rim_error, wrong)

    return check


def check_energy(trace: Trace) -> CheckResult:
    """Check a run of an elastic scene.

    The energy may change by at most a tenth, and an overlap must not be deeper than the smallest radius.
    """
    start = kinetic_energy(trace.scene, trace.scene.arrays.velocity_m_s)
    gained = kinetic_energy(trace.scene, trace.final_velocity_m_s) / start - 1.0
    if not abs(gained) <= TOLERANCE:
        how = "gained" if gained > 0 else "lost"
        return CheckResult(abs(gained), f"{format_number(abs(gained))} of the energy is {how}")
    overlap = compute_deepest_overlap(trace, trace.scene) / min(disc.radius_m for disc in trace.scene.discs)
    deep = "" if overlap <= 1.0 else f"a disc is {format_number(overlap)} radii inside another disc or a wall"
    return CheckResult(abs(gained), deep)


def build_pressure_check(compressibility: float) -> TraceCheck:
    """Return a function that checks the pressure p of a gas by the ratio ``Z = p V / (N k T)``.

    The check uses the impacts between discs in the last four fifths of the run.

    Z follows from the sum of `impulse * distance of the centres` over these impacts (the virial). The first fifth of
    the run is omitted, because the initial lattice still affects the pressure.
    """

    def check(trace: Trace) -> CheckResult:
        scene, radius = trace.scene, trace.scene.arrays.radius_m
        mass = np.array([disc.mass_kg for disc in scene.discs])
        energy, since = kinetic_energy(scene, scene.arrays.velocity_m_s), scene.duration_s / 5
        found = trace.impacts[(trace.impacts["second"] >= 0) & (trace.impacts["time_s"] > since)]
        first, second = found["first"], found["second"]
        push = (found["velocity_second_after"] - found["velocity_second_before"]) * mass[second][:, None]
        along = np.sum(push * found["normal"], axis=1) * (radius[first] + radius[second])
        z = 1.0 + float(np.sum(along)) / (2.0 * energy * (scene.duration_s - since))
        error = abs(z / compressibility - 1.0)
        note = f"Z = {z:.3f} from {len(found)} impacts; the known value is {compressibility:.4f}"
        return CheckResult(error, note=note) if error <= TOLERANCE else CheckResult(error, note)

    return check
