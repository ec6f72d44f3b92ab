"""The documents are found by the words that people search, and answer by task."""

from __future__ import annotations

import re
from functools import cache

import pytest
import yaml
from tests.documents.blocks import PAGES, ROOT

import carom

#: Words that people search, and the page that is theirs.
SEARCHED = {
    "substeps": "docs/which-step.md",
    "tunnelling": "docs/tunnelling.md",
    "CCD": "docs/tunnelling.md",
    "bullet": "docs/tunnelling.md",
    "animation": "docs/lecture.md",
    "pass through": "docs/tunnelling.md",
    "glossary": "docs/glossary.md",
    "licence": "README.md",
}
TASKS = ("tunnelling", "which-step", "settings", "regressions", "lecture")
#: A heading counts as much as this many words of text; the site's search prefers headings, too.
HEADING = 10


@cache
def weights(word: str) -> dict[str, float]:
    """How much of each page is this word: its share of the text, with a heading's words counted more."""
    pattern, found = re.compile(rf"\b{word}", re.IGNORECASE), {}
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        headings = "\n".join(re.findall(r"^#+ .*", text, re.MULTILINE))
        hits = len(pattern.findall(text)) + HEADING * len(pattern.findall(headings))
        found[page.relative_to(ROOT).as_posix()] = hits / len(text.split())
    return found


@pytest.mark.parametrize(("word", "page"), SEARCHED.items())
def test_a_word_that_people_search_finds_its_page(word: str, page: str) -> None:
    """No other page speaks of it more."""
    assert weights(word)[page] > 0
    assert weights(word)[page] == max(weights(word).values())


@pytest.mark.parametrize("task", TASKS)
def test_a_page_of_a_task_is_short_and_has_a_command(task: str) -> None:
    """It is read in two minutes, and something in it can be run."""
    text = (ROOT / "docs" / f"{task}.md").read_text(encoding="utf-8")
    assert len(re.sub(r"(?s)```.*?```", "", text).split()) <= 400
    assert re.search(r"^```(sh|python)$", text, re.MULTILINE)


def test_the_glossary_has_twelve_words() -> None:
    """A paragraph a word."""
    text = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
    assert len(re.findall(r"^\*\*.+?\*\*: \S", text, re.MULTILINE)) == 12


def test_the_gallery_plays_scenes_of_the_catalogue() -> None:
    """Each replay is of a scene that there is, and of PIT where it differs from PIC."""
    text = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    found = re.findall(r"<!-- replay: (\S+)(?: (\d+))? -->", text)
    assert len(found) == text.count("<!--") >= 5
    for name, rate in found:
        score = carom.compare(carom.solve_pic(name), carom.solve_pit(name, frame_rate_hz=float(rate) if rate else None))
        assert score.findings, name


def test_contributors_have_a_part_of_their_own() -> None:
    """What only who works on Carom needs stands in no other part of the navigation, and every page is in one."""
    # Tags of Python are for extensions; what is asked for here is the navigation.
    nav = yaml.safe_load("nav:" + (ROOT / "mkdocs.yml").read_text(encoding="utf-8").partition("\nnav:")[2])["nav"]
    parts = {name: part for one in nav for name, part in one.items()}

    def pages(part: object) -> list[str]:
        if isinstance(part, str):
            return [part]
        if isinstance(part, dict):
            return [page for one in part.values() for page in pages(one)]
        return [page for one in part for page in pages(one)] if isinstance(part, list) else []

    assert {"contributing.md", "releasing.md", "reliability.md", "decisions/README.md"} <= set(
        pages(parts["For contributors"])
    )
    everything = [page for part in parts.values() for page in pages(part)]
    assert len(everything) == len(set(everything))
    texts = {path.relative_to(ROOT / "docs").as_posix() for path in PAGES if path.is_relative_to(ROOT / "docs")}
    assert {page for page in texts if not page.startswith("decisions/0")} <= set(everything)
