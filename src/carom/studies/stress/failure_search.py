"""Search for the value at which a method fails a stress test.

Values are tried from harmless to extreme until the method fails. Then the interval before the failure is bisected.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from carom.errors import InputError
from carom.execution.job import Answer, Job, Method, Status
from carom.execution.observation.engine_run import observe_job
from carom.execution.pool import TaskRunner
from carom.model.scene import Scene
from carom.model.trace import Trace
from carom.studies.stress.result import STRESS, CellEnding, CellResult, UnsavedResult
from carom.studies.stress.stress_test import CheckResult, StressTest, Trial

#: The bisection ends when the passing and the failing value differ by at most this factor.
RESOLUTION, QUICK_RESOLUTION = 1.1, 3.2


class NotCompletedError(Exception):
    """A run could not start, or ended early. The error's arguments are the reason and the status."""


class _TriedValue(NamedTuple):
    """A value, one of its trials, and the result of this trial's check."""

    value: float
    trial: Trial
    result: CheckResult

    @property
    def passes(self) -> bool:
        return not self.result.failure


def find_failure(stress_test: StressTest, method: Method, runner: TaskRunner, *, quick: bool) -> UnsavedResult:
    """Find the value at which a method fails a stress test. Return the result with a scene that reproduces it."""
    ladder = iter(stress_test.build_ladder(quick))
    runs = 0
    resolution = QUICK_RESOLUTION if quick else RESOLUTION

    passed: _TriedValue | None = None
    failed: _TriedValue | None = None
    value = next(ladder, None)
    try:
        while value is not None:
            tried, spent = _try_value(stress_test, value, method, runner, quick=quick)
            runs += spent
            passed, failed = (tried, failed) if tried.passes else (passed, tried)
            if failed is None:
                value = next(ladder, None)
            else:
                value = stress_test.find_middle_value(passed.value, failed.value, resolution) if passed else None
    except NotCompletedError as error:
        reason, status = error.args
        return UnsavedResult(CellResult(CellEnding.NOT_RUN, reason=reason, runs=runs, status=status))
    reported = failed or passed
    assert reported is not None  # noqa: S101 - a ladder has at least one value
    description = f"{reported.trial.scene.description} Here {method.name} {'fails' if failed else 'passes'}."
    scene = rename_scene(f"{stress_test.name}/{method.engine}/{method.profile}", reported.trial.scene, description)
    broke = CellEnding.FAILS_AT_SIZE if passed else CellEnding.FAILS_AT_START
    result = CellResult(
        broke if failed else CellEnding.PASSES,
        value=reported.value,
        passes_until=passed.value if passed else None,
        error=passed.result.error if passed and math.isfinite(passed.result.error) else None,
        reason=reported.result.failure or reported.result.note,
        runs=runs,
        status=reported.result.status,
    )
    return UnsavedResult(result, (scene,))


def observe(scene: Scene, method: Method, runner: TaskRunner) -> Answer[Trace]:
    """Run a method on a scene at the scene's frame rate, and return the result."""
    return observe_job(Job(scene, method, 1.0 / scene.frame_rate_hz), runner)


def rename_scene(name: str, scene: Scene, description: str) -> Scene:
    """Return the scene with a unique name, so that the scenes of all results can run together."""
    return scene.model_copy(update={"name": f"{STRESS}{name}", "description": description})


def _try_value(
    stress_test: StressTest, value: float, method: Method, runner: TaskRunner, *, quick: bool
) -> tuple[_TriedValue, int]:
    """Run the trials for a value up to the first failure. Return the worst result, and the number of runs.

    If the engine fails, the result is a failure with the engine's error as the reason.

    Raises:
        NotCompletedError: The engine is unavailable, or does not support the scene at the test's harmless value.
    """
    try:
        trials = stress_test.trials(value)
    except InputError as error:
        raise InputError(f"the stress test {stress_test.name} can't make a scene at {value:g}: {error}") from error
    passed: list[_TriedValue] = []
    for trial in trials[::2] if quick else trials:
        answer = observe(trial.scene, method, runner)
        status, trace = answer.status, answer.value
        if status is Status.UNAVAILABLE or (value == stress_test.harmless and status is Status.UNSUPPORTED):
            raise NotCompletedError(answer.problem, status)
        found = CheckResult(math.nan, answer.problem, status=status) if trace is None else trial.check(trace)
        tried = _TriedValue(value, trial, found)
        if not tried.passes:
            return tried, len(passed) + 1
        passed.append(tried)
    return max(passed, key=lambda one: one.result.error), len(passed)
