"""The README is short, and what it shows is what was measured; tests/documents runs its commands."""

from __future__ import annotations

import re
from pathlib import Path

from docs.figures import readme

README = (Path(__file__).resolve().parents[2] / "README.md").read_text()


def test_every_file_that_the_readme_links_to_exists() -> None:
    """No link of the README leads nowhere."""
    root = Path(__file__).resolve().parents[2]
    links = [link for link in re.findall(r"\]\(([^)#]+)\)", README) if "://" not in link]
    assert links
    assert [link for link in links if not (root / link).exists()] == []


def test_the_readme_is_short_and_shows_one_picture() -> None:
    """At most 110 lines, one picture of at most 50 kB, and a C compiler among what a machine needs."""
    assert len(README.splitlines()) <= 110
    (picture,) = re.findall(r"!\[.*?\]\((.*?)\)", README)
    root = Path(__file__).resolve().parents[2]
    assert (root / picture) == readme.PICTURE
    assert 0 < readme.PICTURE.stat().st_size <= 50_000
    assert "C compiler" in README


def test_the_table_is_that_of_the_committed_sample() -> None:
    """The README's table is what its script makes of the sample."""
    made = README.partition(readme.BEGIN)[2].partition(readme.END)[0]
    assert made == readme.table()
    for engine in ("PIC", "PIT", "pymunk", "PyBullet", "MuJoCo", "Box2D"):
        assert f"| {engine}" in made
