"""What commands print, kept whole in tests/snapshots: a change of it is read as a diff.

`make generated` writes them anew. Only methods of Carom's own are asked, so no engine's version is in them.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from carom.cli import app

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "tests" / "snapshots"
RESULTS = "tests/kept/results-2.jsonl"

COMMANDS = {
    "run-scene": "run paper/late -e pit -p tuned --dt 1/24 --no-timing",
    "run-paper": "run paper -e pit -p tuned --no-timing",
    "run-explain": "run paper/late -e pit -p tuned --explain",
    "diff": f"diff {RESULTS} {RESULTS}",
    "report": f"report {RESULTS}",
    "certify": "certify paper/late",
    "refused": "run paper/lat -e pit",
}


def normal(text: str) -> str:
    """The text without what depends on the clock, and without spaces that nobody sees."""
    text = re.sub(r"\b\d+(\.\d+)?(e-?\d+)? (ms|s|µs)(?= of work| of wall|\)| in)", "TIME", text)
    return "".join(f"{line.rstrip()}\n" for line in text.splitlines())


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_prints_what_is_kept(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """At 80 columns, to the letter but for run times; CAROM_SNAPSHOTS=write keeps what is printed now."""
    monkeypatch.chdir(ROOT)
    result = CliRunner(env={"COLUMNS": "80", "TERM": "dumb"}).invoke(app, COMMANDS[name].split())
    text = f"$ carom {COMMANDS[name]}\n{normal(result.output)}exit code {result.exit_code}\n"
    path = FOLDER / f"{name}.txt"
    if os.environ.get("CAROM_SNAPSHOTS") == "write":
        path.write_text(text, encoding="utf-8")
    assert path.read_text(encoding="utf-8") == text
