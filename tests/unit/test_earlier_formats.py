"""Files of every format that was written once: read, or refused in a sentence, never misread."""

import json
import shutil
from pathlib import Path

import pytest
from tests.cases import each
from tests.in_process_pool import InProcessPool
from tests.journal_lines import read_canonical_lines

from carom.catalogue import find_scenes
from carom.comparator import Grade
from carom.errors import InputError
from carom.execution.codec import Codec
from carom.execution.journal import JOURNAL_FORMAT
from carom.report.files import FORMATS
from carom.report.results_file.format_2 import convert_line
from carom.report.results_file.line_codec import format_line
from carom.report.results_file.results_jsonl import read_records
from carom.studies.cross_check.options import Options
from carom.studies.cross_check.plan import build_plan
from carom.studies.cross_check.run import execute, observed_journal
from carom.studies.diff.compare_records import compare_records
from carom.studies.history.compare_cells import ReleaseRun

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
def test_stored_results_are_read(number: int) -> None:
    """Stored results of each format are read, and equal the results of the current format in a diff."""
    path = KEPT / f"results-{number}.jsonl"
    summary, lines = read_records(path)
    assert [line.scene for line in lines] == list(SCENES)
    assert [line.grade and line.grade.name for line in lines] == ["WRONG", "SAMPLED"]
    if number == FORMATS["results"]:
        assert format_line(summary) == path.read_text(encoding="utf-8").splitlines()[0]
    assert compare_records(path, KEPT / f"results-{FORMATS['results']}.jsonl").changes == ()


def test_parted_runs_of_format_2_are_read_as_diverged(tmp_path: Path) -> None:
    r"""Words and fields of format 2 for diverged runs are read with the present names and unchanged values.

    The file contains one run of each of the two renamed grades. A scene with the name "parted" keeps its name.
    """
    path = tmp_path / "results.jsonl"
    text = (KEPT / "diverged-2.jsonl").read_text(encoding="utf-8").replace('"classics/galperin-100"', '"parted"')
    path.write_text(text, encoding="utf-8")
    stored_head, *stored_rows = (json.loads(line) for line in text.splitlines())
    assert [row["grade"] for row in stored_rows] == ["parted", "parted_inaccurate"]
    summary, lines = read_records(path)
    assert [*summary.scenes] == [lines[0].scene] == ["parted"]  # only words of Carom are renamed
    assert [line.grade for line in lines] == [Grade.DIVERGED, Grade.DIVERGED_INACCURATE]
    for line, row in zip(lines, stored_rows, strict=True):
        assert (line.diverged_s, line.pit_diverged_s) == (row["parted_s"], row["pit_parted_s"])
        assert line.diverged_s is not None
        assert next(one.verdict for one in line.verdicts) == "diverged"
        assert [one.reason for one in line.verdicts] == [one["reason"] for one in row["verdicts"]]
    assert summary.verdicts["diverged"] == stored_head["verdicts"]["parted"]
    head, *rows = map(convert_line, (stored_head, *stored_rows))
    assert json.loads(format_line(summary)) == head
    assert [
        json.loads(format_line(line, spins="spin" in row["total"])) for line, row in zip(lines, rows, strict=True)
    ] == rows


def test_invalid_row_of_format_2_is_refused(tmp_path: Path) -> None:
    """A grade that is a list, or a row that is not an object, is refused with its line."""
    path = tmp_path / "results.jsonl"
    head, row, _ = (KEPT / "diverged-2.jsonl").read_text(encoding="utf-8").splitlines()
    for text in (row.replace('"grade":"parted"', '"grade":["parted"]'), "[]"):
        path.write_text(f"{head}\n{row}\n{text}\n", encoding="utf-8")
        with pytest.raises(InputError, match="line 3"):
            read_records(path)


def test_journal_of_history_is_read_with_the_word_parted() -> None:
    """A journalled grade or verdict with the earlier word is read as DIVERGED."""
    numbers = dict.fromkeys(("velocity", "late_steps", "place_rounding_m", "speed_m_s"), 1.0)
    counts = {"expected": 2, "found": 2, "lost": 0, "float_bits": 64}
    run = {"digest": "", "settings": [], "position_errors_m": [], "velocity_errors_m_s": [], **numbers, **counts}
    stored = {**run, "grade": "PARTED_INACCURATE", "verdicts": ["LATE", "PARTED"]}
    found = Codec[ReleaseRun](ReleaseRun).loads(json.dumps(stored).encode())
    assert (found.grade, found.verdicts) == ("DIVERGED_INACCURATE", ("LATE", "DIVERGED"))
