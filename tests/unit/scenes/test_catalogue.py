from __future__ import annotations

import re

import pytest

from carom.errors import UnknownNameError
from carom.scenes import CatalogueScene, Tag, all_scenes, catalogue, find_scenes
from carom.scenes.entry import Staged

ENTRIES = list(catalogue().values())
each_entry = pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)


def names(*patterns: str) -> list[str]:
    return [entry.name for entry in find_scenes(patterns)]


def test_a_full_name_finds_its_scene() -> None:
    """A full name finds that scene and no other."""
    assert names("paper/missed") == ["paper/missed"]


def test_a_group_finds_its_scenes_in_order() -> None:
    """A group finds all its scenes, in the order of the paper's cases."""
    assert names("paper") == ["paper/missed", "paper/late", "paper/wrong-direction", "paper/multiple"]


def test_a_shell_pattern_finds_all_that_match() -> None:
    """A shell pattern matches against full names."""
    assert names("*/cradle-*") == ["classics/cradle-gaps", "classics/cradle-touching"]


def test_a_tag_finds_the_scenes_that_bear_it() -> None:
    """`tag:` finds by tag."""
    assert names("tag:no-impact") == ["classics/miss", "classics/touching-apart", "gravity/free-fall"]


def test_a_scene_found_twice_is_returned_once() -> None:
    """Patterns that overlap don't repeat a scene, and the order is that of the patterns."""
    assert names("paper/multiple", "paper", "paper/late") == [
        "paper/multiple",
        "paper/missed",
        "paper/late",
        "paper/wrong-direction",
    ]


@pytest.mark.parametrize(
    ("wrong", "meant"),
    [
        ("paper/mised", "paper/missed"),
        ("galperin", "classics/galperin-100"),
        ("head-on", "classics/head-on"),
        ("classic", "classics"),
        ("tag:wall", "tag:walls"),
    ],
)
def test_a_near_miss_is_answered_with_what_was_meant(wrong: str, meant: str) -> None:
    """An unknown name is refused, and the message names the nearest known one."""
    with pytest.raises(UnknownNameError, match=re.escape(f"{wrong!r}; did you mean {meant!r}?")):
        find_scenes([wrong])


def test_a_name_near_to_nothing_points_to_the_list() -> None:
    """Where nothing is near, the message says where the names are listed."""
    with pytest.raises(UnknownNameError, match="`carom scenes` lists them"):
        find_scenes(["xyzzy"])


def test_listing_builds_no_scene() -> None:
    """Names and groups are known before any scene is built."""

    def explode() -> Staged:
        raise AssertionError

    entry = CatalogueScene("group/name", "Shows nothing.", explode)
    assert (entry.name, entry.group) == ("group/name", "group")


@each_entry
def test_scene_and_entry_agree(entry: CatalogueScene) -> None:
    """A scene bears its entry's name and sentence, and is built once."""
    assert entry.scene.name == entry.name
    assert entry.scene.description == entry.shows
    assert entry.shows.endswith(".")
    assert entry.scene is entry.scene


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


@pytest.mark.parametrize("name", TAGS)
def test_tags_say_what_the_scene_is(name: str) -> None:
    """A scene has the tags that a reader would give it, and no others."""
    assert all_scenes()[name].tags == set(TAGS[name].split())


def test_every_tag_is_some_scenes() -> None:
    """Each tag is one of those that are held against hand-written ones."""
    assert {tag for tags in TAGS.values() for tag in tags.split()} == set(Tag)


@each_entry
def test_sources_and_sizes(entry: CatalogueScene) -> None:
    """Every scene names its source and stays within sizes that any engine can take."""
    scene = entry.scene
    assert len(entry.known.source) > 20
    assert scene.duration_s <= 3
    assert 24 <= scene.frame_rate_hz <= 60
    for disc in scene.discs:
        assert max(map(abs, disc.position_m)) < 1e3
        assert 0.05 <= disc.radius_m <= 1
        assert disc.immovable or 1e-3 <= disc.mass_kg <= 1e3


@each_entry
def test_the_last_impact_is_well_before_the_end(entry: CatalogueScene) -> None:
    """An engine that is frames late still has its last impact within the scene."""
    frames = 5
    for impact in entry.known.impacts:
        assert impact.time_s < entry.scene.duration_s - frames / entry.scene.frame_rate_hz
