"""The catalogue: properties of all scenes, the search for scenes, and names of scenes as arguments."""

import re
from collections.abc import Callable

import pytest
from tests.cases import each
from tests.scene_builders import run_cross_check

import carom
from carom.catalogue import BugReport, all_scenes, catalogue, find_scenes
from carom.errors import UnknownNameError

ENTRIES = list(catalogue().values())


PAPER = ["paper/missed", "paper/late", "paper/wrong-direction", "paper/multiple"]


@each(
    "patterns, found",
    [
        (["paper"], PAPER),
        (["*/cradle-*"], ["classics/cradle-gaps", "classics/cradle-touching"]),
        (["paper/multiple", "paper", "paper/late"], [PAPER[-1], *PAPER[:-1]]),
    ],
)
def test_names_groups_and_patterns_find_scenes(patterns: list[str], found: list[str]) -> None:
    """A name, group or pattern finds its scenes once, by pattern and then in the catalogue's order."""
    assert [entry.name for entry in find_scenes(patterns)] == found


@each(
    "wrong, meant",
    [
        ("paper/mised", "paper/missed"),
        ("galperin", "classics/galperin-100"),
        ("classic", "classics"),
    ],
)
def test_unknown_scene_name_is_refused_with_suggestion(wrong: str, meant: str) -> None:
    """The error for an unknown name suggests the nearest known name, or refers to `carom scenes`."""
    with pytest.raises(UnknownNameError, match=re.escape(f"{wrong!r}; did you mean {meant!r}?")):
        find_scenes([wrong])
    with pytest.raises(UnknownNameError, match="`carom scenes` lists them"):
        find_scenes(["xyzzy"])


def test_every_scene_is_complete() -> None:
    """Every scene is built once, has its entry's texts and a cited answer, and lasts five frames after it."""
    for entry in ENTRIES:
        scene = entry.scene
        assert (scene.name, scene.description) == (entry.name, entry.shows)
        assert entry.scene is scene
        assert len(entry.known.source) > 20, entry.name
        last_s = max((impact.time_s for impact in entry.known.impacts), default=0.0)
        assert last_s < scene.duration_s - 5 / scene.frame_rate_hz, entry.name


NAME = "paper/missed"
SCENE = all_scenes()[NAME].scene


@each("solve", [carom.solve_pic, carom.solve_pit, carom.solve_pic_framewise, carom.certify, carom.horizon])
def test_functions_accept_scene_name_instead_of_scene(solve: Callable[..., object]) -> None:
    """Carom's solvers, `certify` and `horizon` return the same for a scene's name as for the scene."""
    assert solve(NAME) == solve(SCENE)


def test_cross_check_accepts_scene_names_and_scenes() -> None:
    """A cross-check runs named scenes and scene objects together; a named scene has its known answer."""
    results = run_cross_check([NAME, SCENE.model_copy(update={"name": "mine"})], ["pit"], dts=[1 / 24])
    assert {row.job.scene.name for row in results.rows} == {NAME, "mine"}
    assert NAME in results.known


def test_name_that_is_not_one_scene_is_refused() -> None:
    """The error for a misspelt name suggests the nearest one; the error for a group lists its scenes."""
    with pytest.raises(UnknownNameError, match="did you mean 'paper/missed'"):
        carom.solve_pic("paper/mised")
    with pytest.raises(UnknownNameError, match="'paper' is not the name of a single scene; it matches: paper/missed, "):
        carom.solve_pic("paper")


def test_bug_reports_are_found_only_by_their_group() -> None:
    """At least 20 scenes have the address of a bug report; only their group, its pattern or a full name finds them."""
    reports = [entry for entry in all_scenes().values() if isinstance(entry, BugReport)]
    assert len(reports) >= 20
    for entry in reports:
        assert re.fullmatch(r"https://github\.com/[\w.-]+/[\w.-]+/(issues|pull)/\d+", entry.thread)
    assert find_scenes(["issues"]) == find_scenes(["issues/*"]) == reports
    assert [entry.name for entry in find_scenes(["issues/jolt-1403"])] == ["issues/jolt-1403"]
    assert not {*reports} & {*catalogue().values(), *find_scenes(["*"])}
    with pytest.raises(UnknownNameError, match="issues/jolt-1403"):
        find_scenes(["issues/jolt-1404"])
