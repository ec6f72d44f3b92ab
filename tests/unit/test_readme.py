"""The README is short, and what it shows is what was measured; tests/documents runs its commands."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from docs.figures import readme
from PIL import Image

from carom.live.page import GALLERY

pytestmark = pytest.mark.skipif(not readme.SAMPLE.exists(), reason="a source distribution has no reports")

README = (Path(__file__).resolve().parents[2] / "README.md").read_text()


def test_every_file_that_the_readme_links_to_exists() -> None:
    """No link of the README leads nowhere."""
    root = Path(__file__).resolve().parents[2]
    links = [link for link in re.findall(r"\]\(([^)#]+)\)", README) if "://" not in link]
    assert links
    assert [link for link in links if not (root / link).exists()] == []


def test_the_readme_is_short() -> None:
    """At most 110 lines, and a C compiler among what a machine needs."""
    assert len(README.splitlines()) <= 110
    assert "C compiler" in README


def test_the_pictures_are_there_and_small() -> None:
    """A replay that moves, the discs that one throws, a first screen, in light and dark with words, and each scene."""
    root = Path(__file__).resolve().parents[2]
    shown = re.findall(
        r'<source media="\(prefers-color-scheme: dark\)" srcset="(.+?)"><img alt="(.+?)" src="(.+?)">', README
    )
    small = re.findall(r'<img alt="(.+?)" title="carom play (.+?)" width="150" src="(.+?)">', README)
    assert [(words, named) for words, named, _ in small] == [(name, name) for name in GALLERY]
    assert (len(shown), README.count("<img")) == (3, 3 + len(small))
    assert all(len(words) > 50 for _, words, _ in shown)
    paths = [root / path for dark, _, light in shown for path in (dark, light)]
    assert sum(path.stat().st_size for path in [*paths, *(root / path for _, _, path in small)]) <= 500_000
    frames = []
    for path in paths:
        with Image.open(path) as picture:
            frames.append(getattr(picture, "n_frames", 1) > 1)
    assert frames == [False, False, True, True, False, False]


def test_the_page_of_the_whole_suite_is_small() -> None:
    """With every replay in it the sample's page has at most 3 MB."""
    assert readme.SAMPLE.with_name("index.html").stat().st_size <= 3_000_000


def test_the_table_is_that_of_the_committed_sample() -> None:
    """The README's table is what its script makes of the sample."""
    made = README.partition(readme.BEGIN)[2].partition(readme.END)[0]
    assert made == readme.table()
    for engine in ("PIC", "PIT", "pymunk", "PyBullet", "MuJoCo", "Box2D"):
        assert f"| {engine}" in made
