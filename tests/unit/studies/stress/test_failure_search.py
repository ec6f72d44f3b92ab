"""Where a method fails, and whether it does what was reported of others."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.cases import each
from tests.in_process_pool import InProcessPool
from tests.scene_builders import require_value

from carom import Trace, load_scene, solve_pic, solve_pit
from carom.catalogue import BugReport, Symptom, all_scenes
from carom.execution.job import Answer, Method, Status, Task
from carom.execution.observation.engine_run import ObserveTask
from carom.model.scene import Need
from carom.model.trace import Outcome
from carom.studies.stress.bug_reports import find_symptom
from carom.studies.stress.failure_search import RESOLUTION, find_failure
from carom.studies.stress.result import CellEnding
from carom.studies.stress.run import STRESS_TESTS
from carom.studies.stress.stress_test import StressTest

METHOD = Method("pic", "tuned")


@pytest.fixture
def stress_test() -> StressTest:
    return next(stress_test for stress_test in STRESS_TESTS if stress_test.name == "mass-ratio")


class Answering(InProcessPool):
    """A method that is PIC up to a mass of `threshold` and does not answer beyond."""

    def __init__(self, threshold: float) -> None:
        self.threshold = threshold

    def run(self, task: Task[Any]) -> Answer[Any]:
        assert isinstance(task, ObserveTask)
        if task.job.scene.discs[1].mass_kg > self.threshold:
            return Answer(Status.CRASHED, "signal 11")
        return Answer(Status.RAN, value=solve_pic(task.job.scene))


@each("threshold", [3.0, 4.2e5, 9.9e11])
def test_failure_point_is_found_within_resolution(stress_test: StressTest, threshold: float, tmp_path: Path) -> None:
    """The threshold is between the largest passing and the smallest failing value, within the resolution."""
    result = find_failure(stress_test, METHOD, Answering(threshold), quick=False).save(tmp_path)
    assert result.ending is CellEnding.FAILS_AT_SIZE
    failed = require_value(result.value)
    assert require_value(result.passes_until) <= threshold < failed
    assert failed / require_value(result.passes_until) <= RESOLUTION
    assert result.reason == "crashed: signal 11"
    scene = load_scene(tmp_path / result.scenes[0])  # the file next to a number shows where the method failed
    assert scene.discs[1].mass_kg == failed


@each("threshold, ending", [(math.inf, CellEnding.PASSES), (0.5, CellEnding.FAILS_AT_START)])
def test_passing_all_or_failing_at_start_is_distinguished(
    stress_test: StressTest, threshold: float, ending: CellEnding
) -> None:
    """A method that always passes is reported with the extreme value, one that never passes with the harmless one."""
    result = find_failure(stress_test, METHOD, Answering(threshold), quick=True).result
    stands = ending is CellEnding.PASSES
    assert (result.ending, result.value) == (ending, stress_test.extreme if stands else stress_test.harmless)
    assert result.passes_until is None or stands
    assert not stands or (result.reason == "" and 0.0 <= (result.error if result.error is not None else 1.0) < 1e-12)


@pytest.mark.usefixtures("hostile")
def test_unavailable_engine_has_reason_instead_of_failure_point(stress_test: StressTest) -> None:
    """An engine that is not installed has no failure point, and its cell states the reason."""
    result = find_failure(stress_test, Method("missing", "tuned"), InProcessPool(), quick=True).result
    assert (result.ending, result.value) == (CellEnding.NOT_RUN, None)
    assert "unavailable: surely_not_installed is not installed" in result.reason


BUG_REPORTS = {entry.name: entry for entry in all_scenes().values() if isinstance(entry, BugReport)}
NOW = [entry for entry in BUG_REPORTS.values() if Need.GRAVITY not in entry.scene.needs]


def test_pic_shows_no_reported_symptom() -> None:
    """In each bug report's scene without gravity, PIC shows neither the reported symptom nor another error."""
    for entry in NOW:
        assert find_symptom(entry, solve_pic(entry.scene))[::2] == (False, ""), entry.name


def scale_final_velocity(entry: BugReport, factor: float) -> Trace:
    trace = solve_pic(entry.scene)
    return replace(trace, final_velocity_m_s=trace.final_velocity_m_s * factor)


def test_missed_impact_symptom_is_detected() -> None:
    """PIT passes through the thin wall of a report, which is detected as the reported missed impact."""
    entry = BUG_REPORTS["issues/mujoco-441"]
    assert find_symptom(entry, solve_pit(entry.scene)) == (True, 2.0, "1 impact is missed")


def test_sticking_symptom_needs_more_than_three_percent() -> None:
    """Half the velocity is the reported sticking; a velocity 3 % too low is an error, but not the symptom."""
    entry = BUG_REPORTS["issues/jolt-1403"]
    stuck = replace(solve_pic(entry.scene), final_velocity_m_s=np.array([[0.5, 0.0], [0.5, 0.0]]))
    assert find_symptom(entry, stuck)[0]
    seen, _, reason = find_symptom(entry, scale_final_velocity(entry, 0.97))
    assert (seen, reason) == (False, "off by 0.03 times the scene's greatest speed")


def test_energy_loss_and_gain_symptoms_are_distinguished() -> None:
    """Too low velocities are the symptom of lost energy only, too high velocities that of gained energy."""
    entry = BUG_REPORTS["issues/rapier-615"]
    assert find_symptom(entry, scale_final_velocity(entry, 0.9))[0]
    assert not find_symptom(entry, scale_final_velocity(entry, 1.1))[0]
    assert find_symptom(replace(entry, symptom=Symptom.GAINS_ENERGY), scale_final_velocity(entry, 1.1))[0]


def test_escaped_body_symptom_is_detected() -> None:
    """A ball that ends outside the table shows the symptom, with the reason "beyond a wall"."""
    entry = BUG_REPORTS["issues/pooltool-217"]
    gone = replace(solve_pic(entry.scene), final_position_m=np.array([[5.0, 2.0]]))
    seen, _, reason = find_symptom(entry, gone)
    assert seen
    assert "beyond a wall" in reason


def test_nan_state_is_symptom_only_where_reported() -> None:
    """A NaN state is the reported symptom in one scene, and an error without the symptom in another."""
    for name, expected in (("issues/hardspheredynamics-8", True), ("issues/jolt-1403", False)):
        entry = BUG_REPORTS[name]
        lost = replace(solve_pic(entry.scene), final_velocity_m_s=np.full((2, 2), np.nan), outcome=Outcome.NON_FINITE)
        seen, _, reason = find_symptom(entry, lost)
        assert (seen, reason) == (expected, Outcome.NON_FINITE.value)
