"""A cross-check drawn again from its records."""

from __future__ import annotations

import base64
import gzip
import json
import re
from collections import Counter
from pathlib import Path

import pytest
from typer.testing import CliRunner

from carom.cli import app
from carom.execution.results import Results
from carom.report.grid import mark_of
from carom.report.records import read_records, records
from carom.report.render.html import html
from carom.studies.cross_check.rebuild import rebuild_document


@pytest.fixture
def folder(results: Results, tmp_path: Path) -> Path:
    """A folder with nothing but the records."""
    (tmp_path / "results.jsonl").write_text(records(results), encoding="utf-8")
    return tmp_path


def test_the_marks_drawn_again_are_those_of_the_run(results: Results, folder: Path) -> None:
    """The sentence counts the marks of the rows at their coarsest step, and the packed table has all rows' marks."""
    document = rebuild_document(*read_records(folder / "results.jsonl"))
    coarse = Counter(mark_of(row).word for row in results.rows if row.job.refinement == 0)
    counted = document.lead[0].partition("coarsest step: ")[2].removesuffix(".")
    assert sorted(counted.split("; ")) == sorted(f"{n} {word}" for word, n in coarse.items())
    (data,) = re.findall(r'data-css="cells">([^<]*)</script>', html(document))
    rows = json.loads(gzip.decompress(base64.b64decode(data)))["rows"]
    assert [row[4]["text"] for row in rows] == [mark_of(row).word for row in results.rows]


def test_the_command_prints_it_writes_it_and_replaces_nothing(folder: Path) -> None:
    """It needs no engine: the records alone make the table, the Markdown and the page; a file there is left alone."""
    page = folder / "again.html"
    run = CliRunner(env={"COLUMNS": "120", "TERM": "dumb"})
    done = run.invoke(app, ["report", str(folder), "--page", str(page), "--markdown", "-"])
    assert done.exit_code == 0
    assert done.output.startswith("# Carom cross-check, from its records")
    assert "which it does not hold" in done.output
    assert "Every scene" in page.read_text(encoding="utf-8")
    again = run.invoke(app, ["report", str(folder), "--page", str(page)])
    assert again.exit_code == 2
    assert "already exists" in again.output
    assert "Every method" in run.invoke(app, ["report", str(folder)]).output
