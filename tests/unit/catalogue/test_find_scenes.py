"""The catalogue: what every scene of it promises, what finds one, and that its name is taken wherever a scene is."""

import re
from collections.abc import Callable

import numpy as np
import pytest
from tests.cases import each
from tests.scene_builders import cross_checked

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
def test_a_name_a_group_a_pattern_and_a_tag_find_their_scenes(patterns: list[str], found: list[str]) -> None:
    """Scenes come in the order of the patterns, and of the catalogue within one; each comes once."""
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
def test_a_near_miss_is_answered_with_what_was_meant(wrong: str, meant: str) -> None:
    """An unknown name is refused, and the message names the nearest known one, or where there is none, the list."""
    with pytest.raises(UnknownNameError, match=re.escape(f"{wrong!r}; did you mean {meant!r}?")):
        find_scenes([wrong])
    with pytest.raises(UnknownNameError, match="`carom scenes` lists them"):
        find_scenes(["xyzzy"])


def test_listing_builds_no_scene() -> None:
    """Names and groups are known before any scene is built."""

    def explode() -> Staged:
        raise AssertionError

    entry = CatalogueScene("group/name", "Shows nothing.", explode)
    assert (entry.name, entry.group) == ("group/name", "group")


def test_every_scene_has_what_an_entry_promises() -> None:
    """It bears its entry's name and sentence, is built once, names its source, and any engine can take its sizes."""
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


#: By hand, from what each scene shows; every tag is here, and no scene has all of them.
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


def test_tags_say_what_the_scene_is() -> None:
    """A scene has the tags that a reader would give it, and no others; no tag is left out."""
    assert {name: set(all_scenes()[name].tags) for name in TAGS} == {
        name: set(tags.split()) for name, tags in TAGS.items()
    }
    assert {tag for tags in TAGS.values() for tag in tags.split()} == set(Tag)


NAME = "paper/missed"
SCENE = all_scenes()[NAME].scene


def test_a_scene_is_called_for_by_its_name() -> None:
    """`carom.scene` gives the scene of a full name."""
    assert carom.scene(NAME) == SCENE


@each("solve", [carom.solve_pic, carom.solve_pit, carom.solve_pic_framewise, carom.certify, carom.horizon])
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
    """A name selects its scene with its known answer, and a group all of its scenes."""
    results = cross_checked([NAME, SCENE.model_copy(update={"name": "mine"})], ["pit"], dts=[1 / 24])
    assert {row.job.scene.name for row in results.rows} == {NAME, "mine"}
    assert NAME in results.known


@each(
    "name, words",
    [
        ("paper/mised", "did you mean 'paper/missed'"),
        ("paper", "'paper' is not the name of a single scene; it matches: paper/missed, paper/late"),
    ],
)
def test_a_name_of_no_one_scene_is_refused(name: str, words: str) -> None:
    """The error of a misspelt name has the nearest one, and that of a group its scenes."""
    with pytest.raises(UnknownNameError, match=words):
        carom.solve_pic(name)


def test_engines_print_as_a_line_each() -> None:
    """The list of engines is a list, and its text is a heading and a line for each."""
    found = carom.engines()
    assert len(repr(found).splitlines()) == len(found) + 1
    assert all(line.startswith(info.name) for line, info in zip(repr(found).splitlines()[1:], found, strict=True))
