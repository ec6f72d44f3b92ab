"""What commands print, and documents of fixed results, kept whole in tests/snapshots: a change is read as a diff."""

import os
import re
from pathlib import Path

import pytest
from tests.cases import each
from tests.command import carom_command
from tests.unit.report.test_terminal import print_document
from tests.unit.studies.examples import build_advice, build_bench, build_campaign_results, build_growth

from carom.report.document import Document
from carom.studies.advise.document import build_advice_document
from carom.studies.bench.document import build_bench_document
from carom.studies.bench.growth_document import build_growth_document
from carom.studies.stress.document import build_stress_document

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "tests" / "snapshots"
RESULTS = "tests/earlier_formats/results-3.jsonl"

COLUMNS = 80
COMMANDS = {
    "run-scene": "run paper/late -e pit -p tuned --dt 1/24 --no-timing",
    "run-paper": "run paper -e pit -p tuned --no-timing",
    "run-explain": "run paper/late -e pit -p tuned --explain",
    "diff": f"diff {RESULTS} {RESULTS}",
    "report": f"report {RESULTS}",
    "certify": "certify paper/late",
    "explain": "explain missed",
    "refused": "run paper/lat -e pit",
}


def normalise_output(text: str) -> str:
    """The text without what depends on the clock, and without spaces that nobody sees."""
    text = re.sub(r"\b\d+(\.\d+)?(e-?\d+)? (ms|s|µs)(?= of work| of wall|\)| in)", "TIME", text)
    text = re.sub(
        r"; it takes \S+ ms, and ([\w -]+) takes \S+ times as long",
        r"; it takes TIME, and \1 takes RATIO times as long",
        text,
    )
    return "".join(f"{line.rstrip()}\n" for line in text.splitlines())


def assert_snapshot(name: str, text: str) -> None:
    """CAROM_SNAPSHOTS=write keeps the text."""
    path = FOLDER / f"{name}.txt"
    if os.environ.get("CAROM_SNAPSHOTS") == "write":
        path.write_text(text, encoding="utf-8")
    assert path.read_text(encoding="utf-8") == text


@pytest.mark.usefixtures("in_process")
@each("name", COMMANDS)
def test_command_output_equals_its_snapshot(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    r"""At 80 columns the output of a command equals its snapshot, except for run times.

    `CAROM_SNAPSHOTS=write` updates the snapshots.
    """
    monkeypatch.chdir(ROOT)
    result = carom_command(*COMMANDS[name].split(), columns=COLUMNS)
    text = f"$ carom {COMMANDS[name]}\n{normalise_output(result.output)}exit code {result.exit_code}\n"
    assert_snapshot(name, text)
    if "--explain" not in COMMANDS[name]:  # its lines are a list, whole where another program reads them
        assert max(map(len, result.output.splitlines())) <= COLUMNS


#: Documents of results from tests, since these studies need engines, or a clock.
DOCUMENTS = {
    "advise-document": lambda: build_advice_document(build_advice()),
    "bench-document": lambda: build_bench_document(build_bench()),
    "grow-document": lambda: build_growth_document(build_growth()),
    "stress-document": lambda: build_stress_document(build_campaign_results(one_in=8)),
}


@each("name", DOCUMENTS)
def test_document_equals_its_snapshot(name: str) -> None:
    """A document of fixed results, printed in full at 80 columns, equals its snapshot."""
    document: Document = DOCUMENTS[name]()
    assert_snapshot(name, "".join(f"{line.rstrip()}\n" for line in print_document(document, 80, full=True)))
