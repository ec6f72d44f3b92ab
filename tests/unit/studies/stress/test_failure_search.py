"""Failure points of a method, and symptoms of reported bugs."""

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.cases import each
from tests.in_process_pool import InProcessPool
from tests.scene_builders import require_value

from carom import Trace, load_scene, solve_pic
from carom.catalogue import BugReport, Symptom, all_scenes
from carom.errors import InputError
from carom.execution.job import Answer, Method, Status, Task
from carom.execution.observation.engine_run import ObserveTask
from carom.model.scene import Need
from carom.model.trace import Outcome
from carom.studies.stress.bug_reports import find_symptom
from carom.studies.stress.failure_search import RESOLUTION, find_failure
from carom.studies.stress.options import StressOptions
from carom.studies.stress.result import CellEnding
from carom.studies.stress.run import STRESS_TESTS, run_stress_campaign
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


def alter_final_state(entry: BugReport, factor: float = 1.0, **changes: Any) -> Trace:
    """Return PIC's trace with final velocities that are multiplied by a factor, and with other changes."""
    trace = solve_pic(entry.scene)
    return replace(trace, **{"final_velocity_m_s": trace.final_velocity_m_s * factor, **changes})


STUCK = {"final_velocity_m_s": np.array([[0.5, 0.0], [0.5, 0.0]])}
NAN = {"final_velocity_m_s": np.full((2, 2), np.nan), "outcome": Outcome.NON_FINITE}
GONE = {"final_position_m": np.array([[5.0, 2.0]])}
GAIN = replace(BUG_REPORTS["issues/rapier-615"], symptom=Symptom.GAINS_ENERGY)


@each(
    "entry, change, seen, reason",
    [
        ("issues/jolt-1403", STUCK, True, r"velocities are wrong by \S+ times the scene's greatest speed"),
        ("issues/jolt-1403", {"factor": 0.97}, False, "the result is wrong by 0.03 times the scene's greatest speed"),
        ("issues/jolt-1403", NAN, False, Outcome.NON_FINITE.value),
        ("issues/hardspheredynamics-8", NAN, True, Outcome.NON_FINITE.value),
        ("issues/rapier-615", {"factor": 0.9}, True, r"\S+ of the energy is lost"),
        ("issues/rapier-615", {"factor": 1.1}, False, r"the result is wrong by \S+ times the scene's energy"),
        (GAIN, {"factor": 1.1}, True, r"\S+ of the energy is gained"),
        ("issues/pooltool-217", GONE, True, r"a disc is \S+ radii inside another body or beyond a wall"),
    ],
)
def test_only_the_reported_symptom_is_seen(
    entry: BugReport | str, change: dict[str, Any], seen: bool, reason: str
) -> None:
    """Sticking, NaN, lost or gained energy and an escaped body are seen only where they were reported."""
    bug_report = BUG_REPORTS[entry] if isinstance(entry, str) else entry
    found, _, told = find_symptom(bug_report, alter_final_state(bug_report, **change))
    assert found is seen
    assert re.fullmatch(reason, told)


@pytest.mark.usefixtures("in_process")
def test_campaign_distinguishes_pic_and_pit(tmp_path: Path) -> None:
    """PIC passes tunnelling, mujoco-441 and time reversal, PIT tunnels; a full campaign continues no quick one."""
    options = StressOptions(["pic", "pit"], quick=True, jobs=1)
    results = run_stress_campaign(["tunnelling", "reversal", "mujoco-441"], options, out=tmp_path)
    for line, method, ending in (
        ("tunnelling", "pic/event-driven", CellEnding.PASSES),
        ("tunnelling", "pit/tuned", CellEnding.FAILS_AT_SIZE),
        ("reversal", "pic/event-driven", CellEnding.HOLDS),
        ("mujoco-441", "pic/event-driven", CellEnding.NOT_SEEN),
        ("mujoco-441", "pit/tuned", CellEnding.SEEN),
    ):
        assert results.cells[line, method].ending is ending
    # Head-on, the approaching half of the chord is two radii: beyond that there may be no frame.
    assert 1.0 < require_value(results.cells["tunnelling", "pit/tuned"].value) <= 10.0
    with pytest.raises(InputError, match="its quick is True, but this study's is False; name another folder"):
        run_stress_campaign(["reversal"], replace(options, quick=False), out=tmp_path, resume=True)
