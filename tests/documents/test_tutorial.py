"""The tutorial runs from its first cell to its last, and what it shows is what happens."""

from __future__ import annotations

import json
import re
from typing import Any

import pytest
from docs.figures.tutorial import NOTEBOOK, executed, read, texts

KEPT = read()
CODE = [cell for cell in KEPT.cells if cell.cell_type == "code"]


def replays(cell: Any) -> list[str]:
    """The frames that a cell shows, whole: a replay has nothing in it of the machine that made it."""
    shown = [output.get("data", {}).get("text/html", "") for output in cell.get("outputs", [])]
    return [html for html in shown if html.startswith("<iframe")]


@pytest.mark.long
def test_every_cell_shows_what_is_kept_of_it() -> None:
    """Run anew in an empty folder, no cell fails; each shows the same text, replay and kinds of picture."""
    for kept, run in zip(KEPT.cells, executed().cells, strict=True):
        assert texts(run) == texts(kept), kept.source
        assert [sorted(out.get("data", ())) for out in run.get("outputs", [])] == [
            sorted(out.get("data", ())) for out in kept.get("outputs", [])
        ], kept.source
        assert replays(run) == replays(kept), kept.source


def test_it_reads_on_a_code_host() -> None:
    """Each cell was run in order; pictures, a replay and tables are kept, and nothing of whose machine it was."""
    assert [cell.execution_count for cell in CODE] == list(range(1, len(CODE) + 1))
    kinds = {kind for cell in CODE for output in cell.outputs for kind in output.get("data", ())}
    assert {"text/plain", "text/html", "image/png"} <= kinds
    assert not [output for cell in CODE for output in cell.outputs if output.output_type == "error"]
    shown = json.dumps([cell.outputs for cell in CODE])
    assert "<iframe" in shown
    assert not re.search(r"/(home|root|tmp|work|Users)/", shown)
    assert NOTEBOOK.stat().st_size < 1_000_000


def test_each_exercise_has_an_answer() -> None:
    """The numbers of the exercises are those of the answers."""
    text = "\n".join(cell.source for cell in KEPT.cells if cell.cell_type == "markdown")
    exercises, answers = text.partition("## 9. Answers")[::2]
    asked = re.findall(r"^(\d)\. \*\*.+?\*\*", exercises.partition("## 8.")[2], re.MULTILINE)
    assert len(asked) == 5
    assert re.findall(r"^\*\*(\d)\.\*\*", answers, re.MULTILINE) == asked
