"""Journals contain all results bit for bit, even if the process was killed."""

import json
import math
import os
from collections.abc import Sequence
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.cases import each
from tests.scene_builders import require_value

from carom.comparator import Errors
from carom.errors import InputError
from carom.execution import journal as journal_module
from carom.execution.cache_key import JobKey
from carom.execution.job import Answer, Method, Status
from carom.execution.journal import JOURNAL_FORMAT, JournalEntry
from carom.execution.score_jobs import Measures, score_journal
from carom.studies.stress.result import CellEnding, CellResult
from carom.studies.stress.run import stress_journal

KEY = JobKey("mine", "ab" * 32, Method("pit", "tuned"), 1 / 60, 0.25, (("carom", "1"), ("numpy", "2")))


def build_measures(value: float = 0.1) -> Measures:
    return Measures(Errors(*[value] * len(fields(Errors))), 3, 2, 1, 0, 0, 2.0, "completed")


def build_entry(dt_s: float = 1 / 60, value: float = 0.1) -> JournalEntry[JobKey, Measures]:
    return JournalEntry(replace(KEY, dt_s=dt_s), Answer(Status.RAN, value=build_measures(value)))


def write_journal(folder: Path, *dts: float) -> Path:
    """Write a journal with a result of each step."""
    path = folder / "journal.jsonl"
    folder.mkdir(exist_ok=True)
    with score_journal(path) as journal:
        journal.add([build_entry(dt_s) for dt_s in dts])
    return path


def test_too_long_line_is_not_written_and_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An entry whose line would exceed the limit is not written; a journal with such a line is refused, unchanged."""
    path = tmp_path / "journal.jsonl"
    long = JournalEntry(replace(KEY, scene="x" * 5000), Answer(Status.RAN, value=build_measures()))
    monkeypatch.setattr(journal_module, "LONGEST_LINE", 4000)
    with score_journal(path) as journal:
        journal.add([build_entry(1 / 60), long, build_entry(1 / 120)])
        assert len(journal.entries) == 3
    assert read_steps(path) == [1 / 60, 1 / 120]
    before = path.read_bytes()
    head, *lines = before.splitlines()
    monkeypatch.setattr(journal_module, "LONGEST_LINE", max(map(len, lines)))
    assert read_steps(path) == [1 / 60, 1 / 120]
    monkeypatch.setattr(journal_module, "LONGEST_LINE", len(head))
    with pytest.raises(InputError, match="line 2 is longer than"):
        read_steps(path)
    assert path.read_bytes() == before


def read_steps(path: Path) -> list[float]:
    with score_journal(path, resume=True) as journal:
        return [found.key.dt_s for found in journal.entries.values()]


@given(value=st.floats(), dt_s=st.floats(min_value=0, exclude_min=True, allow_infinity=False))
def test_floats_are_stored_to_the_bit(value: float, dt_s: float, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Any float is read back with the same bits, from lines of standard JSON."""
    path, written = tmp_path_factory.mktemp("journal") / "journal.jsonl", build_entry(dt_s, value)
    with score_journal(path) as journal:
        journal.add([written])
    line = path.read_bytes().splitlines()[1]
    json.loads(line, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    with score_journal(path, resume=True) as journal:
        (read,) = journal.entries.values()
        journal.add([read])
    assert read.key == written.key
    found = require_value(read.answer.value).total.velocity
    assert math.isnan(found) if math.isnan(value) else found.hex() == value.hex()
    assert path.read_bytes().splitlines()[2] == line


FAILS = partial(CellResult, CellEnding.FAILS_AT_SIZE)
SPOTS = (
    FAILS(0.003, 0.004, 0.05, "why", ("scenes/a.toml",), 12),
    CellResult(CellEnding.NOT_RUN, reason="unavailable"),
    CellResult(CellEnding.VIOLATED, math.inf),
)
CELLS = [JournalEntry(("any", f"test-{k}", "pit/tuned"), Answer(Status.RAN, value=one)) for k, one in enumerate(SPOTS)]

ABORTED = 'ended by SIGABRT; it last printed: "ouch"\n'
CRASHED: JournalEntry[JobKey, Measures] = JournalEntry(KEY, Answer(Status.CRASHED, ABORTED))
#: What some programs end a line at, and what commands a terminal.
SIGNS = ["\u2028", "\u2029", "\x85", "\x1b[31m", "\u202e", "\x0c"]
NAMED = [JournalEntry(replace(KEY, scene=f"a{sign}b"), Answer(Status.RAN, value=build_measures())) for sign in SIGNS]


@each(
    "opened, entries",
    [(score_journal, [CRASHED]), (score_journal, NAMED), (partial(stress_journal, stamp={"quick": True}), CELLS)],
)
def test_entries_are_read_back_from_one_line_each(
    opened: Any, entries: Sequence[JournalEntry[Any, Any]], tmp_path: Path
) -> None:
    """Each entry is stored in one line, whatever characters its names contain, and is equal when read back."""
    path = tmp_path / "journal.jsonl"
    with opened(path) as journal:
        journal.add(entries)
    with opened(path, resume=True) as journal:
        assert list(journal.entries.values()) == list(entries)
    assert len(path.read_text(encoding="utf-8").splitlines()) == 1 + len(entries)


def test_journal_of_another_study_is_refused(tmp_path: Path) -> None:
    """A journal with other options or of another kind or format, and a file that is not a journal, are refused."""
    path = tmp_path / "journal.jsonl"
    with stress_journal(path, {"quick": True}) as journal:
        journal.add(CELLS)
    with pytest.raises(InputError, match="its quick is True, but this study's is False; name another folder"):
        stress_journal(path, {"quick": False}, resume=True)
    with pytest.raises(InputError, match="its journal is spots, but this study's is scores"):
        score_journal(path, resume=True)
    formats: list[dict[str, object]] = [{"format": 1, "scene": "mine"}, {"format": 1, "carom": "0.1"}, {"format": 99}]
    for line in formats:
        path.write_text(json.dumps(line) + "\n")
        said = rf"it has the format {line['format']} of another version .* this version uses {JOURNAL_FORMAT}; name"
        with pytest.raises(InputError, match=said):
            score_journal(path, resume=True)
    path.write_text("anything\n[1]\n")
    with pytest.raises(InputError, match="is not a journal of this work"):
        score_journal(path, resume=True)


def test_interrupt_while_syncing_keeps_the_first_entry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An entry is kept if Ctrl-C comes after it is written and before the disk confirms it."""
    path = tmp_path / "journal.jsonl"

    def interrupted(_file: int) -> None:
        raise KeyboardInterrupt

    journal = score_journal(path)
    monkeypatch.setattr("carom.execution.journal.FLUSH_PERIOD_S", 0.0)
    monkeypatch.setattr(os, "fsync", interrupted)
    with pytest.raises(KeyboardInterrupt):
        journal.add([build_entry(0.1)])
    monkeypatch.undo()
    journal.close()
    assert read_steps(path) == [0.1]


@each(
    "old, new", [('"dt_s":0.1', '"dt_s":"soon"'), ('"phase":0.25,', ""), ('{"key"', "[" * 10**5), ('{"key"', "null\n{")]
)
def test_malformed_line_is_refused_with_its_number(tmp_path: Path, old: str, new: str) -> None:
    """A line before the last that is no entry is refused with its number, and the file is left unchanged."""
    path = write_journal(tmp_path, 0.1, 0.2)
    path.write_text(text := path.read_text().replace(old, new, 1))
    with pytest.raises(InputError, match=r"journal.jsonl, line 2: .*remove the line") as error:
        score_journal(path, resume=True)
    assert len(str(error.value)) < 500
    assert path.read_text() == text


@each("status", [Status.CRASHED, Status.TIMED_OUT, Status.FAILED, Status.UNSUPPORTED, Status.RAN])
def test_retry_repeats_only_failed_jobs(tmp_path: Path, status: Status) -> None:
    """With `retry`, crashes, time-outs and failures count as not run; completed and unsupported jobs are kept."""
    path, answer = tmp_path / "journal.jsonl", Answer(status, "why", build_measures() if status is Status.RAN else None)
    broken, result = JournalEntry(KEY, answer), replace(SPOTS[0], status=status)
    cell = replace(CELLS[0], answer=Answer(Status.RAN, value=result))
    with score_journal(path) as journal:
        journal.add([broken])
    with score_journal(path, resume=True, retry=True) as journal:
        assert list(journal.entries.values()) == ([] if status.is_failure else [broken])
    with stress_journal(tmp_path / "stress.jsonl", {}, resume=False) as cells:
        cells.add([cell])
    with stress_journal(tmp_path / "stress.jsonl", {}, resume=True, retry=True) as cells:
        assert list(cells.entries.values()) == ([] if status.is_failure else [cell])
    assert path.read_bytes().count(b"\n") == 2  # what is not counted stays until there is a later one


def test_second_writer_of_a_journal_is_refused(tmp_path: Path) -> None:
    """A journal that another run has open is refused, and a closed one with results without `resume`."""
    path = tmp_path / "journal.jsonl"
    with score_journal(path) as first:
        for entries in ([], [build_entry()]):
            first.add(entries)
            for resume in (False, True):
                with pytest.raises(InputError, match="is being written by another process"):
                    score_journal(path, resume=resume)
    with pytest.raises(InputError, match="already contains results"):
        score_journal(path)
