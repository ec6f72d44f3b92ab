from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from carom import load_scene, solve_pic
from carom.runs.job import Answer, Method, Status, Task
from carom.runs.observe import Observe
from carom.runs.pool import InProcess
from carom.studies.stress.attack import Attack
from carom.studies.stress.breaking import RESOLUTION, breaking_point
from carom.studies.stress.run import attacks
from carom.studies.stress.spots import SpotEnding

METHOD = Method("pic", "tuned")


@pytest.fixture
def attack() -> Attack:
    return next(attack for attack in attacks() if attack.name == "mass-ratio")


class Answering(InProcess):
    """A method that is PIC up to a mass of `threshold` and does not answer beyond."""

    def __init__(self, threshold: float) -> None:
        self.threshold = threshold

    def ask(self, task: Task[Any]) -> Answer[Any]:
        assert isinstance(task, Observe)
        if task.job.scene.discs[1].mass_kg > self.threshold:
            return Answer(Status.CRASHED, "signal 11")
        return Answer(Status.RAN, value=solve_pic(task.job.scene))


@pytest.mark.parametrize("threshold", [3.0, 4.2e5, 9.9e11])
def test_the_breaking_point_is_found(attack: Attack, threshold: float, tmp_path: Path) -> None:
    """Whatever the threshold of a method, it lies between the largest size that stood and the one that did not."""
    spot = breaking_point(attack, METHOD, Answering(threshold), scenes=tmp_path / "scenes", quick=False)
    assert spot.ending is SpotEnding.GIVES_WAY
    assert spot.stands_at is not None
    assert spot.value is not None
    assert spot.stands_at <= threshold < spot.value
    assert spot.value / spot.stands_at <= RESOLUTION
    assert spot.reason == "crashed: signal 11"
    scene = load_scene(tmp_path / spot.scenes[0])  # the file beside a number shows where the method gave way
    assert scene.discs[1].mass_kg == spot.value


@pytest.mark.parametrize(("threshold", "ending"), [(math.inf, SpotEnding.STANDS), (0.5, SpotEnding.NEVER_STOOD)])
def test_an_end_of_the_axis_is_told_apart(attack: Attack, threshold: float, ending: SpotEnding, tmp_path: Path) -> None:
    """A method that stands is shown at the absurd end, with its error there; one that never stood at the harmless."""
    spot = breaking_point(attack, METHOD, Answering(threshold), scenes=tmp_path / "scenes", quick=True)
    stands = ending is SpotEnding.STANDS
    assert (spot.ending, spot.value) == (ending, attack.absurd if stands else attack.harmless)
    assert spot.stands_at is None or stands
    assert not stands or (spot.reason == "" and 0.0 <= (spot.error if spot.error is not None else 1.0) < 1e-12)


@pytest.mark.usefixtures("hostile")
def test_an_unavailable_engine_is_a_reason_and_no_number(attack: Attack, tmp_path: Path) -> None:
    """An engine that is not installed has no breaking point, and its cell says why."""
    spot = breaking_point(attack, Method("missing", "tuned"), InProcess(), scenes=tmp_path / "scenes", quick=True)
    assert (spot.ending, spot.value) == (SpotEnding.NOT_RUN, None)
    assert "unavailable: surely_not_installed is not installed" in spot.reason
