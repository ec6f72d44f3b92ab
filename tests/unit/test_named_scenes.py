"""The name of a scene in the catalogue is taken wherever a scene is."""

from __future__ import annotations

import importlib
from collections.abc import Callable

import numpy as np
import pytest
from tests.stage import cross_checked

import carom
from carom.errors import UnknownNameError
from carom.scenes import all_scenes

NAME = "paper/missed"
SCENE = all_scenes()[NAME].scene


def test_a_scene_is_called_for_by_its_name() -> None:
    """`carom.scene` gives the scene of a full name, and is still the module of scenes."""
    assert carom.scene(NAME) == SCENE
    assert importlib.import_module("carom.scene").Scene is carom.Scene
    assert carom.scene(NAME) == SCENE


@pytest.mark.parametrize(
    "solve", [carom.solve_pic, carom.solve_pit, carom.solve_pic_framewise, carom.certify, carom.horizon]
)
def test_whatever_takes_a_scene_takes_a_name(solve: Callable[..., object]) -> None:
    """Carom's own methods, certified runs and their horizons make of a name what they make of the scene."""
    assert solve(NAME) == solve(SCENE)


@pytest.mark.long
def test_a_run_takes_a_name_and_the_scenes_frame() -> None:
    """A run without a step takes the scene's own frame, in which PIT misses this impact."""
    trace = carom.run(NAME, "pit")
    assert trace.dt_s == 1 / SCENE.frame_rate_hz
    np.testing.assert_array_equal(trace.impacts, carom.solve_pit(SCENE).impacts)


def test_a_cross_check_takes_names_and_groups() -> None:
    """A name stands for its scene with its known answer, and a group for all of its scenes."""
    results = cross_checked([NAME, SCENE.model_copy(update={"name": "mine"})], ["pit"], dts=[1 / 24])
    assert {row.job.scene.name for row in results.rows} == {NAME, "mine"}
    assert NAME in results.known


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("paper/mised", "did you mean 'paper/missed'"),
        ("paper", "'paper' is no one scene; it stands for: paper/missed, paper/late"),
    ],
)
def test_a_name_of_no_one_scene_is_refused(name: str, words: str) -> None:
    """A misspelt name gets the nearest one, and a group the scenes that it stands for."""
    with pytest.raises(UnknownNameError, match=words):
        carom.solve_pic(name)


def test_engines_print_as_a_line_each() -> None:
    """The list of engines is a list, and its text is a heading and a line for each."""
    found = carom.engines()
    assert len(repr(found).splitlines()) == len(found) + 1
    assert all(line.startswith(info.name) for line, info in zip(repr(found).splitlines()[1:], found, strict=True))
