"""Files of every format that was written once: read, or refused in a sentence, never misread."""

import shutil
from pathlib import Path

import pytest
from tests.cases import each
from tests.in_process_pool import InProcessPool
from tests.journal_lines import read_canonical_lines

from carom.catalogue import find_scenes
from carom.errors import InputError
from carom.execution.journal import JOURNAL_FORMAT
from carom.execution.plan import build_plan
from carom.execution.run_options import Options
from carom.report.files import FORMATS
from carom.report.results_file.json_lines import format_line
from carom.report.results_file.records import read_records
from carom.studies.cross_check.run import execute, observed_journal
from carom.studies.diff.compare_records import compare_records

KEPT = Path(__file__).resolve().parents[1] / "earlier_formats"
#: What the journals are of.
OPTIONS = Options(engines=("pit",), profiles=("tuned",), dts=(1 / 24,), timing=False)
SCENES = ("paper/missed", "paper/late")


def list_formats(kind: str) -> list[int]:
    """The formats of which a file of a kind is kept."""
    return sorted(int(path.stem.rpartition("-")[2]) for path in KEPT.glob(f"{kind}-*.jsonl"))


def test_current_formats_have_a_stored_file() -> None:
    """The latest stored journal and results have the current formats, and journal format 4 is still stored."""
    assert max(list_formats("journal")) == JOURNAL_FORMAT
    assert max(list_formats("results")) == FORMATS["results"]
    assert 4 in list_formats("journal")


@each("number", list_formats("journal"))
def test_stored_journal_is_resumed_or_refused(number: int, tmp_path: Path) -> None:
    r"""A journal of the current format has every answer of its run; an earlier one is refused with its format.

    Neither file is changed.
    """
    path = tmp_path / "journal.jsonl"
    shutil.copy(KEPT / f"journal-{number}.jsonl", path)
    before, pool = path.read_bytes(), InProcessPool()
    plan = build_plan(find_scenes(list(SCENES)), OPTIONS, pool)
    if number != JOURNAL_FORMAT:
        said = f"it has the format {number} of another version of Carom, and this version uses {JOURNAL_FORMAT}"
        with pytest.raises(InputError, match=said):
            observed_journal(path, plan.options.stamp, resume=True)
    else:
        with observed_journal(path, plan.options.stamp, resume=True) as journal:
            execute(plan, pool, notes=journal)
        assert len(read_canonical_lines(path)) == 1 + len(SCENES)
    assert path.read_bytes() == before


@each("number", list_formats("results"))
def test_stored_results_are_read_or_refused(number: int) -> None:
    """Results of the current format are read and equal themselves in a diff; earlier ones are refused."""
    path = KEPT / f"results-{number}.jsonl"
    if number != FORMATS["results"]:
        with pytest.raises(InputError, match=f"is of format {number}"):
            read_records(path)
        return
    summary, lines = read_records(path)
    assert [line.scene for line in lines] == list(SCENES)
    assert [line.grade and line.grade.name for line in lines] == ["WRONG", "SAMPLED"]
    assert format_line(summary) == path.read_text(encoding="utf-8").splitlines()[0]
    assert compare_records(path, path).changes == ()
