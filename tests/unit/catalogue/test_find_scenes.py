"""The catalogue: properties of all scenes, the search for scenes, and names of scenes as arguments."""

import re
from collections.abc import Callable

import numpy as np
import pytest
from tests.cases import each
from tests.scene_builders import run_cross_check

import carom
from carom.catalogue import CatalogueScene, Tag, all_scenes, catalogue, find_scenes
from carom.catalogue.entry import Staged
from carom.errors import UnknownNameError

ENTRIES = list(catalogue().values())


PAPER = ["paper/missed", "paper/late", "paper/wrong-direction", "paper/multiple"]


@each(
    "patterns, found",
    [
        (["paper/missed"], ["paper/missed"]),
        (["paper"], PAPER),
        (["*/cradle-*"], ["classics/cradle-gaps", "classics/cradle-touching"]),
        (["tag:no-impact"], ["classics/miss", "classics/touching-apart", "gravity/free-fall"]),
        (["paper/multiple", "paper", "paper/late"], [PAPER[-1], *PAPER[:-1]]),
    ],
)
def test_names_groups_patterns_and_tags_find_scenes(patterns: list[str], found: list[str]) -> None:
    """A name, group, pattern or tag finds its scenes once, by pattern and then in the catalogue's order."""
    assert [entry.name for entry in find_scenes(patterns)] == found


@each(
    "wrong, meant",
    [
        ("paper/mised", "paper/missed"),
        ("galperin", "classics/galperin-100"),
        ("head-on", "classics/head-on"),
        ("classic", "classics"),
        ("tag:wall", "tag:walls"),
    ],
)
def test_unknown_scene_name_is_refused_with_suggestion(wrong: str, meant: str) -> None:
    """The error for an unknown name suggests the nearest known name, or refers to `carom scenes`."""
    with pytest.raises(UnknownNameError, match=re.escape(f"{wrong!r}; did you mean {meant!r}?")):
        find_scenes([wrong])
    with pytest.raises(UnknownNameError, match="`carom scenes` lists them"):
        find_scenes(["xyzzy"])


def test_catalogue_entry_does_not_build_its_scene_for_its_name() -> None:
    """The name and group of an entry are available without building its scene."""

    def explode() -> Staged:
        raise AssertionError

    entry = CatalogueScene("group/name", "Shows nothing.", explode)
    assert (entry.name, entry.group) == ("group/name", "group")


def test_every_scene_is_complete_and_has_moderate_sizes() -> None:
    """Every scene is built once, has its entry's texts and a cited answer, and keeps the catalogue's limits."""
    frames = 5
    for entry in ENTRIES:
        scene = entry.scene
        assert (scene.name, scene.description) == (entry.name, entry.shows)
        assert entry.shows.endswith(".")
        assert entry.scene is scene
        assert len(entry.known.source) > 20, entry.name
        assert scene.duration_s <= 3, entry.name
        assert 24 <= scene.frame_rate_hz <= 60, entry.name
        assert max(abs(x) for disc in scene.discs for x in disc.position_m) < 1e3, entry.name
        assert all(0.05 <= disc.radius_m <= 1 for disc in scene.discs), entry.name
        assert all(disc.immovable or 1e-3 <= disc.mass_kg <= 1e3 for disc in scene.discs), entry.name
        last_s = max((impact.time_s for impact in entry.known.impacts), default=0.0)
        assert last_s < scene.duration_s - frames / scene.frame_rate_hz, entry.name


#: Tags that were assigned by hand. Every tag is here, and no scene has all tags.
TAGS = {
    "paper/late": "two-bodies",
    "paper/multiple": "chain",
    "classics/head-on": "in-line inelastic two-bodies",
    "classics/graze": "grazing two-bodies",
    "classics/miss": "grazing no-impact two-bodies",
    "classics/mass-ratio-1000": "mass-ratio two-bodies",
    "classics/bullet": "fast two-bodies",
    "classics/galperin-100": "chain in-line mass-ratio unstable walls",
    "classics/between-fixed": "chain immovable in-line unstable",
    "classics/cradle-touching": "chain convention in-line",
    "classics/one-into-two": "chain convention",
    "classics/gas": "chain conserved walls",
    "classics/slanted-wall": "inelastic two-bodies walls",
    "classics/deflection": "immovable two-bodies",
    "gravity/free-fall": "gravity no-impact",
    "gravity/ladder": "chain gravity inelastic two-bodies walls",
    "spin/english-stick": "two-bodies",
    "tables/stadium-rhombus": "chain two-bodies unstable walls",
    "tables/end-missed": "no-impact two-bodies walls",
    "contact/damped-stop": "in-line no-impact two-bodies walls",
    "engines/film": "fast two-bodies",
    "engines/near-miss": "no-impact two-bodies",
    "engines/gas-of-25": "chain conserved walls",
    "issues/mujoco-441": "fast immovable in-line two-bodies",
    "issues/pooltool-154": "chain conserved",
    "issues/rapier-974": "gravity inelastic two-bodies walls",
    "issues/dynamo-57": "chain convention in-line inelastic",
}


def test_tags_match_a_list_written_by_hand() -> None:
    """The tags of selected scenes equal a list written by hand, in which every tag occurs."""
    tags = {name: set(words.split()) for name, words in TAGS.items()}
    assert {name: set(all_scenes()[name].tags) for name in TAGS} == tags
    assert set().union(*tags.values()) == set(Tag)


NAME = "paper/missed"
SCENE = all_scenes()[NAME].scene


def test_carom_scene_returns_scene_by_name() -> None:
    """`carom.scene` returns the scene with the given full name."""
    assert carom.scene(NAME) == SCENE


@each("solve", [carom.solve_pic, carom.solve_pit, carom.solve_pic_framewise, carom.certify, carom.horizon])
def test_functions_accept_scene_name_instead_of_scene(solve: Callable[..., object]) -> None:
    """Carom's solvers, `certify` and `horizon` return the same for a scene's name as for the scene."""
    assert solve(NAME) == solve(SCENE)


@pytest.mark.long
def test_run_uses_scene_frame_as_default_step() -> None:
    """`carom.run` accepts a name and by default steps by the scene's frame, with the impacts of `solve_pit`."""
    trace = carom.run(NAME, "pit")
    assert trace.dt_s == 1 / SCENE.frame_rate_hz
    np.testing.assert_array_equal(trace.impacts, carom.solve_pit(SCENE).impacts)


def test_cross_check_accepts_scene_names_and_scenes() -> None:
    """A cross-check runs named scenes and scene objects together; a named scene has its known answer."""
    results = run_cross_check([NAME, SCENE.model_copy(update={"name": "mine"})], ["pit"], dts=[1 / 24])
    assert {row.job.scene.name for row in results.rows} == {NAME, "mine"}
    assert NAME in results.known


@each(
    "name, words",
    [
        ("paper/mised", "did you mean 'paper/missed'"),
        ("paper", "'paper' is not the name of a single scene; it matches: paper/missed, paper/late"),
    ],
)
def test_name_that_is_not_one_scene_is_refused(name: str, words: str) -> None:
    """The error for a misspelt name suggests the nearest one; the error for a group lists its scenes."""
    with pytest.raises(UnknownNameError, match=words):
        carom.solve_pic(name)


def test_engine_list_prints_one_line_per_engine() -> None:
    """The text of `carom.engines()` is a heading and one line per engine, which starts with its name."""
    found = carom.engines()
    assert len(repr(found).splitlines()) == len(found) + 1
    assert all(line.startswith(info.name) for line, info in zip(repr(found).splitlines()[1:], found, strict=True))
