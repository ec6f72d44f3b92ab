"""Where a method fails, and whether it does what was reported of others."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.cases import each
from tests.scene_builders import sure

from carom import Trace, load_scene, solve_pic, solve_pit
from carom.catalogue import Complaint, Symptom, all_scenes
from carom.execution.engine_run import ObserveTask
from carom.execution.job import Answer, Method, Status, Task
from carom.execution.pool import InProcessPool
from carom.model.scene import Need
from carom.model.trace import Outcome
from carom.studies.stress.attack import Attack
from carom.studies.stress.bug_reports import find_symptom
from carom.studies.stress.failure_search import RESOLUTION, find_failure
from carom.studies.stress.result import CellEnding
from carom.studies.stress.run import list_attacks

METHOD = Method("pic", "tuned")


@pytest.fixture
def attack() -> Attack:
    return next(attack for _, attack in list_attacks() if attack.name == "mass-ratio")


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
def test_the_breaking_point_is_found(attack: Attack, threshold: float, tmp_path: Path) -> None:
    """Whatever the threshold of a method, it is between the largest size that passed and the one that failed."""
    result = find_failure(attack, METHOD, Answering(threshold), quick=False).save(tmp_path)
    assert result.ending is CellEnding.FAILS_AT_SIZE
    assert sure(result.stands_at) <= threshold < sure(result.value)
    assert sure(result.value) / sure(result.stands_at) <= RESOLUTION
    assert result.reason == "crashed: signal 11"
    scene = load_scene(tmp_path / result.scenes[0])  # the file next to a number shows where the method failed
    assert scene.discs[1].mass_kg == sure(result.value)


@each("threshold, ending", [(math.inf, CellEnding.PASSES), (0.5, CellEnding.FAILS_AT_START)])
def test_an_end_of_the_axis_is_told_apart(attack: Attack, threshold: float, ending: CellEnding) -> None:
    """A method that passes is shown at the absurd end, with its error there; one that never passed at the other."""
    result = find_failure(attack, METHOD, Answering(threshold), quick=True).result
    stands = ending is CellEnding.PASSES
    assert (result.ending, result.value) == (ending, attack.absurd if stands else attack.harmless)
    assert result.stands_at is None or stands
    assert not stands or (result.reason == "" and 0.0 <= (result.error if result.error is not None else 1.0) < 1e-12)


@pytest.mark.usefixtures("hostile")
def test_an_unavailable_engine_is_a_reason_and_no_number(attack: Attack) -> None:
    """An engine that is not installed has no breaking point, and its cell says why."""
    result = find_failure(attack, Method("missing", "tuned"), InProcessPool(), quick=True).result
    assert (result.ending, result.value) == (CellEnding.NOT_RUN, None)
    assert "unavailable: surely_not_installed is not installed" in result.reason


COMPLAINTS = {entry.name: entry for entry in all_scenes().values() if isinstance(entry, Complaint)}
NOW = [entry for entry in COMPLAINTS.values() if Need.GRAVITY not in entry.scene.needs]


def test_pic_does_nothing_that_was_complained_of() -> None:
    """In the scene of every complaint PIC does not do what was reported, nor is it off in any other way."""
    for entry in NOW:
        assert find_symptom(entry, solve_pic(entry.scene))[::2] == (False, ""), entry.name


def slowed(entry: Complaint, factor: float) -> Trace:
    trace = solve_pic(entry.scene)
    return replace(trace, final_velocity_m_s=trace.final_velocity_m_s * factor)


def test_a_miss_is_seen() -> None:
    """PIT passes the thin wall whole, and that is the reported miss."""
    entry = COMPLAINTS["issues/mujoco-441"]
    assert find_symptom(entry, solve_pit(entry.scene)) == (True, 2.0, "1 impact is missed")


def test_stuck_discs_are_seen_and_a_few_per_cent_are_not_that() -> None:
    """Half the velocity is what was reported; three per cent are an error, but not the one reported."""
    entry = COMPLAINTS["issues/jolt-1403"]
    stuck = replace(solve_pic(entry.scene), final_velocity_m_s=np.array([[0.5, 0.0], [0.5, 0.0]]))
    assert find_symptom(entry, stuck)[0]
    seen, _, reason = find_symptom(entry, slowed(entry, 0.97))
    assert not seen
    assert reason == "off by 0.03 of the scene's speed"


def test_lost_and_gained_energy_are_told_apart() -> None:
    """A complaint of lost energy is not met by energy gained."""
    entry = COMPLAINTS["issues/rapier-615"]
    assert find_symptom(entry, slowed(entry, 0.9))[0]
    assert not find_symptom(entry, slowed(entry, 1.1))[0]
    gains = replace(entry, symptom=Symptom.GAINS_ENERGY)
    assert find_symptom(gains, slowed(entry, 1.1))[0]


def test_a_body_beyond_a_wall_is_seen() -> None:
    """A ball that ends outside the table has escaped, by how many radii it says."""
    entry = COMPLAINTS["issues/pooltool-217"]
    gone = replace(solve_pic(entry.scene), final_position_m=np.array([[5.0, 2.0]]))
    seen, _, reason = find_symptom(entry, gone)
    assert seen
    assert "beyond a wall" in reason


def test_a_state_that_is_no_number_is_seen() -> None:
    """NaN is what was reported of infinite mass, and is never taken for agreement elsewhere."""
    for name, expected in (("issues/hardspheredynamics-8", True), ("issues/jolt-1403", False)):
        entry = COMPLAINTS[name]
        lost = replace(solve_pic(entry.scene), final_velocity_m_s=np.full((2, 2), np.nan), outcome=Outcome.NON_FINITE)
        seen, _, reason = find_symptom(entry, lost)
        assert (seen, reason) == (expected, Outcome.NON_FINITE.value)
