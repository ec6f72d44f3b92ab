"""What a terminal shows: the answer in few lines, within the width there is, in signs that it has."""

from __future__ import annotations

import io
import re

import pytest
from rich.console import Console

import carom
from carom.pages.document import Document
from carom.pages.render.terminal import terminal
from carom.runs.pool import InProcess
from carom.scenes import find_scenes
from carom.shell.ascii_signs import ERRORS
from carom.studies.cross_check.document import cross_check_document


@pytest.fixture(scope="module")
def document() -> Document:
    """Scenes of three groups, one of a long name, by PIC, PIT and pymunk."""
    classics = [f"classics/{name}" for name in ("perfectly-inelastic", "three-in-line")]
    scenes = find_scenes(["paper/late", "paper/missed", "gravity/falling-pair", *classics])
    results = carom.cross_check(scenes, ["pic", "pit", "pymunk"], dts=[1 / 60], timing=False, pool=InProcess())
    return cross_check_document(results)


def printed(document: Document, width: int, *, full: bool = False) -> list[str]:
    """Return the lines that a terminal of a width shows."""
    buffer = io.StringIO()
    console = Console(file=buffer, width=width, highlight=False, markup=False)
    for item in terminal(document, width, full=full):
        console.print(item)
    return buffer.getvalue().splitlines()


def test_the_whole_suite_is_one_screen(document: Document) -> None:
    """At 80 columns the answer has a line a method, and the rest is the same for any number of them."""
    lines = printed(document, 80)
    methods = [line for line in lines if re.match(r"(PIT|pymunk) (default|tuned|located) ", line)]
    assert len(methods) == 4
    pit_and_four_engines_with_three_profiles = 13
    assert len(lines) - len(methods) + pit_and_four_engines_with_three_profiles <= 25


@pytest.mark.parametrize("width", [60, 80, 120, 200])
@pytest.mark.parametrize("full", [False, True])
def test_nothing_is_wider_than_the_terminal(document: Document, width: int, full: bool) -> None:
    """No line is longer than the terminal, and in tables no name is cut: a wide one is shown in parts."""
    lines = printed(document, width, full=full)
    assert max(map(len, lines)) <= width
    if full:
        assert sum(line.strip().startswith("classics/perfectly-inelastic") for line in lines) >= 1


def test_another_alphabet_gets_marks_that_it_has(document: Document) -> None:
    """In ASCII each grade still has a sign of its own, and nothing raises."""
    text = "\n".join(printed(document, 80, full=True))
    plain = " ".join(text.encode("ascii", ERRORS).decode().split())
    assert "= exact ~ close s sampled i inaccurate / parted % parted inaccurate X wrong" in plain
    assert "?" not in plain
