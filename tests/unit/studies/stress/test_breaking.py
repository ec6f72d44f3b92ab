from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from carom import Scene, load_scene, solve_pic
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


def test_the_scene_that_shows_the_number_is_saved(attack: Attack, tmp_path: Path) -> None:
    """The file beside a number holds the scene in which the method gave way."""
    spot = breaking_point(attack, METHOD, Answering(1e6), scenes=tmp_path / "scenes", quick=True)
    scene = load_scene(tmp_path / spot.scenes[0])
    assert isinstance(scene, Scene)
    assert scene.discs[1].mass_kg == spot.value


def test_a_method_that_stands_is_shown_at_the_absurd_end(attack: Attack, tmp_path: Path) -> None:
    """Where nothing gives way, the number is the end of the axis, and the error there is shown."""
    spot = breaking_point(attack, METHOD, Answering(math.inf), scenes=tmp_path / "scenes", quick=True)
    assert (spot.ending, spot.value, spot.reason) == (SpotEnding.STANDS, attack.absurd, "")
    assert spot.error is not None
    assert spot.error < 1e-12


def test_a_method_that_never_stood_says_so(attack: Attack, tmp_path: Path) -> None:
    """Giving way at the harmless end is told apart from giving way later."""
    spot = breaking_point(attack, METHOD, Answering(0.5), scenes=tmp_path / "scenes", quick=True)
    assert (spot.ending, spot.value, spot.stands_at) == (SpotEnding.NEVER_STOOD, attack.harmless, None)


@pytest.mark.usefixtures("hostile")
def test_an_unavailable_engine_is_a_reason_and_no_number(attack: Attack, tmp_path: Path) -> None:
    """An engine that is not installed has no breaking point, and its cell says why."""
    spot = breaking_point(attack, Method("missing", "tuned"), InProcess(), scenes=tmp_path / "scenes", quick=True)
    assert (spot.ending, spot.value) == (SpotEnding.NOT_RUN, None)
    assert "unavailable: surely_not_installed is not installed" in spot.reason
