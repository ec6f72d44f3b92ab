"""A journal holds what was answered, to the bit, whatever cut it off, and a sweep that was killed goes on from it."""

import itertools
import json
import math
import os
import signal
import subprocess
import sys
import time
import tracemalloc
from collections.abc import Sequence
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.cases import each
from tests.scene_builders import disc_at, staged, sure

from carom.comparator import Errors
from carom.errors import InputError
from carom.execution import journal as journal_module
from carom.execution.cache_key import JobKey
from carom.execution.job import Answer, Job, Method, Status
from carom.execution.journal import JOURNAL_FORMAT, JournalEntry, read_canonical_lines
from carom.execution.pool import LocalPool
from carom.execution.score_jobs import Measures, score_jobs, score_journal
from carom.studies.stress.result import CellEnding, CellResult
from carom.studies.stress.run import stress_journal

KEY = JobKey("mine", "ab" * 32, Method("pit", "tuned"), 1 / 60, 0.25, (("carom", "1"), ("numpy", "2")))


def measures(value: float = 0.1) -> Measures:
    return Measures(Errors(*[value] * len(fields(Errors))), 3, 2, 1, 0, 0, 2.0, "completed")


def result(dt_s: float = 1 / 60, value: float = 0.1) -> JournalEntry[JobKey, Measures]:
    return JournalEntry(replace(KEY, dt_s=dt_s), Answer(Status.RAN, value=measures(value)))


def kept(folder: Path, *dts: float) -> Path:
    """Write a journal with a result of each step."""
    path = folder / "journal.jsonl"
    folder.mkdir(exist_ok=True)
    with score_journal(path) as journal:
        journal.add([result(dt_s) for dt_s in dts])
    return path


def test_an_entry_whose_line_would_be_too_long_is_not_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It counts in this run, and a resume, which would refuse its line, computes it again; the others are kept."""
    path, long = (
        tmp_path / "journal.jsonl",
        JournalEntry(replace(KEY, scene="x" * 5000), Answer(Status.RAN, value=measures())),
    )
    monkeypatch.setattr(journal_module, "LONGEST_LINE", 4000)
    with score_journal(path) as journal:
        journal.add([result(1 / 60), long, result(1 / 120)])
        assert len(journal.entries) == 3
    assert max(map(len, path.read_bytes().splitlines())) <= 4000
    assert steps_in(path) == [1 / 60, 1 / 120]


def test_a_line_that_is_too_long_is_refused_by_its_number(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is longer than any line of Carom's is not read: the journal is refused, and left as it is."""
    path = kept(tmp_path, 1 / 60, 1 / 120)
    before = path.read_bytes()
    monkeypatch.setattr(journal_module, "LONGEST_LINE", len(before.splitlines()[0]))
    with pytest.raises(InputError, match="line 2 is longer than"):
        steps_in(path)
    assert path.read_bytes() == before
    monkeypatch.setattr(journal_module, "LONGEST_LINE", max(map(len, before.splitlines())))
    assert steps_in(path) == [1 / 60, 1 / 120]


def steps_in(path: Path) -> list[float]:
    with score_journal(path, resume=True) as journal:
        return [found.key.dt_s for found in journal.entries.values()]


@given(value=st.floats(), dt_s=st.floats(min_value=0, exclude_min=True, allow_infinity=False))
def test_a_float_comes_back_to_the_bit(value: float, dt_s: float, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Whatever float an entry holds, subnormal, negative zero or infinite, its line holds it to the bit."""
    path, written = tmp_path_factory.mktemp("journal") / "journal.jsonl", result(dt_s, value)
    with score_journal(path) as journal:
        journal.add([written])
    line = path.read_bytes().splitlines()[1]
    json.loads(line, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    with score_journal(path, resume=True) as journal:
        (read,) = journal.entries.values()
        journal.add([read])
    assert read.key == written.key
    if math.isnan(value):
        assert math.isnan(sure(read.answer.value).total.velocity)
    else:
        assert sure(read.answer.value).total.velocity.hex() == value.hex()
    assert path.read_bytes().splitlines()[2] == line


SPOTS = (
    CellResult(
        "attack", "grazing", "pit/tuned", CellEnding.FAILS_AT_SIZE, 0.003, 0.004, 0.05, "why", ("scenes/a.toml",), 12
    ),
    CellResult("relation", "boost", "pic/tuned", CellEnding.NOT_RUN, reason="unavailable"),
    CellResult("relation", "boost", "pit/tuned", CellEnding.VIOLATED, math.inf),
)


CELLS = tuple(
    JournalEntry((result.kind, result.line, result.method), Answer(Status.RAN, value=result)) for result in SPOTS
)


CRASHED: JournalEntry[JobKey, Measures] = JournalEntry(
    KEY, Answer(Status.CRASHED, 'ended by SIGABRT; it last printed: "ouch"\n')
)
#: What some programs end a line at, and what commands a terminal.
SIGNS = ["\u2028", "\u2029", "\x85", "\x1b[31m", "\u202e", "\x0c"]
NAMED = [JournalEntry(replace(KEY, scene=f"a{sign}b"), Answer(Status.RAN, value=measures())) for sign in SIGNS]


@each(
    "opened, entries",
    [
        pytest.param(score_journal, [CRASHED], id="a crash has its reason and no numbers"),
        pytest.param(score_journal, NAMED, id="no sign in a name breaks a line"),
        pytest.param(partial(stress_journal, stamp={"quick": True}), CELLS, id="spots of a campaign"),
    ],
)
def test_entries_come_back_a_line_each(opened: Any, entries: Sequence[JournalEntry[Any, Any]], tmp_path: Path) -> None:
    """What a run has written down is taken up again, equal in every field."""
    path = tmp_path / "journal.jsonl"
    with opened(path) as journal:
        journal.add(entries)
    with opened(path, resume=True) as journal:
        assert list(journal.entries.values()) == list(entries)
    assert len(path.read_text(encoding="utf-8").splitlines()) == 1 + len(entries)


def test_the_journal_of_other_work_is_refused(tmp_path: Path) -> None:
    """A journal of another campaign, of another kind, format or of none is refused: the message says how it differs."""
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


@each("torn", ['{"key":{"scene', "{", "\x00\x00\x00", "\x00\x00\n", '{"key":1,\n'])
def test_a_torn_last_line_is_cut_off_and_nothing_else(tmp_path: Path, torn: str) -> None:
    """What a kill or a loss of power tears is the last line; it goes, the others stay, and the next is a line."""
    path = kept(tmp_path, 0.1, 0.2)
    whole = path.read_bytes()
    path.write_bytes(whole + torn.encode())
    assert len(read_canonical_lines(path)) == 3
    assert steps_in(path) == [0.1, 0.2]
    assert path.read_bytes() == whole
    with score_journal(path, resume=True) as journal:
        journal.add([result(0.3)])
    assert path.read_bytes().startswith(whole)
    assert steps_in(path) == [0.1, 0.2, 0.3]


def test_a_journal_without_an_entry_leaves_nothing_behind(tmp_path: Path) -> None:
    """What was ended before anything was finished leaves no journal."""
    score_journal(tmp_path / "journal.jsonl").close()
    assert list(tmp_path.iterdir()) == []


def test_a_torn_first_line_is_begun_anew(tmp_path: Path) -> None:
    """A process killed while it wrote what its journal is of leaves a journal that can be gone on with."""
    path = tmp_path / "journal.jsonl"
    path.write_text('{"journal": "sco')
    with score_journal(path, resume=True) as journal:
        journal.add([result(0.1)])
    assert steps_in(path) == [0.1]


def test_a_line_that_is_broken_in_the_middle_is_named_and_left(tmp_path: Path) -> None:
    """A line that is not the last is somebody's doing: it is named by number, and not even a torn tail is cut off."""
    path = kept(tmp_path, 0.1, 0.2)
    head, first, second = path.read_text().splitlines()
    for broken in ("not json", first.replace('"dt_s":0.1', '"dt_s":"soon"'), first.replace('"phase":0.25,', "")):
        for tail in ("", second[:50]):
            path.write_text(text := f"{head}\n{broken}\n{second}\n{tail}")
            with pytest.raises(InputError, match=r"journal.jsonl, line 2: .*remove the line"):
                score_journal(path, resume=True)
            assert path.read_text() == text


def test_content_is_compared_without_its_order(tmp_path: Path) -> None:
    """Two journals are the same where they hold the same results, in whatever order they were finished."""
    one, two, three = ((0.1, 0.2), (0.2, 0.1), (0.1, 0.3))
    found = [read_canonical_lines(kept(tmp_path / str(dts), *dts)) for dts in (one, two, three)]
    assert found[0] == found[1] != found[2]


def test_a_full_disk_is_an_error_and_the_journal_survives_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where only a part of a line could be written, that is an error; what was there before is still read."""
    path = tmp_path / "journal.jsonl"
    write = os.write
    with score_journal(path) as journal:
        journal.add([result(0.1)])
        monkeypatch.setattr(os, "write", lambda file, data: write(file, data[:10]))
        with pytest.raises(OSError, match="no space left"):
            journal.add([result(0.2)])
        monkeypatch.undo()
    assert steps_in(path) == [0.1]


def test_ctrl_c_while_the_first_line_is_written_does_not_lose_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A journal that is interrupted before the disk confirms a line keeps the line."""
    path = tmp_path / "journal.jsonl"

    def interrupted(_file: int) -> None:
        raise KeyboardInterrupt

    journal = score_journal(path)
    monkeypatch.setattr(os, "fsync", interrupted)
    with pytest.raises(KeyboardInterrupt):
        journal.add([result(0.1)])
    monkeypatch.undo()
    journal.close()
    assert steps_in(path) == [0.1]


@each("torn", [2**26, pytest.param(2**31, marks=pytest.mark.long)])
def test_a_torn_line_of_any_size_is_cut_off_without_being_read_into_memory(tmp_path: Path, torn: int) -> None:
    """A tail of gigabytes, most of them a hole, costs no more memory than a block of it."""
    path = kept(tmp_path, 0.1)
    whole = path.read_bytes()
    with path.open("ab") as file:
        file.truncate(torn)
    tracemalloc.start()
    assert steps_in(path) == [0.1]
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 16 * 2**20
    assert path.read_bytes() == whole


@each("line", ["[" * 100_000, '{"key":' * 100_000, '{"a": [' + "0," * 2**18 + "0]}", '{"expected": "a"}', "null"])
def test_a_line_of_no_sense_is_refused_in_a_sentence(tmp_path: Path, line: str) -> None:
    """Nested without end, of a quarter of a million values or of the wrong kind: a line is refused by its number."""
    path = kept(tmp_path, 0.1)
    head, first = path.read_text().splitlines()
    path.write_text(f"{head}\n{line}\n{first}\n")
    with pytest.raises(InputError, match=r"journal.jsonl, line 2: ") as error:
        score_journal(path, resume=True)
    assert len(str(error.value)) < 500
    path.write_text(f"{line}\n{first}\n")
    with pytest.raises(InputError, match="is not a journal of this work"):
        score_journal(path, resume=True)


@each("status", [Status.CRASHED, Status.TIMED_OUT, Status.FAILED, Status.UNSUPPORTED, Status.RAN])
def test_what_was_broken_off_is_run_again_where_it_is_asked_for(tmp_path: Path, status: Status) -> None:
    """With `retry` a crash, a time-out and an adapter's error count as not run; what ran, or can't be run, counts."""
    path, answer = tmp_path / "journal.jsonl", Answer(status, "why", measures() if status is Status.RAN else None)
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


def test_who_comes_second_is_told_that_another_writes(tmp_path: Path) -> None:
    """The second of two runs on one folder is refused, whether or not the first has written a result by then."""
    path = tmp_path / "journal.jsonl"
    with score_journal(path) as first:
        for written in (False, True):
            if written:
                first.add([result()])
            for resume in (False, True):
                with pytest.raises(InputError, match="is being written by another process"):
                    score_journal(path, resume=resume)
    with pytest.raises(InputError, match="holds results already"):
        score_journal(path)


#: Steps of a run: few, since it is the journal that is tried.
STEPS = 20


def cheap_jobs(count: int) -> list[Job]:
    scene = staged("campaign", disc_at(0.0, 0.0, 1.0, 0.0), disc_at(3.0, 0.3, -1.0, 0.0), duration_s=2.0)
    methods = (Method("pit", "tuned"), Method("pic", "event-driven"), Method("pic", "frame-by-frame"))
    kinds = itertools.product(range(count), methods, (0.0, 0.25, 0.5, 0.75))
    return [
        Job(scene, method, scene.duration_s / (STEPS + 0.01 * k), 0, phase)
        for k, method, phase in itertools.islice(kinds, count)
    ]


def sitting(count: int, path: Path, most: int | None = None) -> None:
    """Sweep over jobs; where `most` is given, only over that many, and wait to be killed."""
    with LocalPool(2) as pool, score_journal(path, resume=True) as journal:
        score_jobs(cheap_jobs(count)[:most], pool, journal)
        if most is not None:
            signal.pause()


def results_in(path: Path) -> int:
    return max(0, path.read_bytes().count(b"\n") - 1) if path.exists() else 0


@pytest.mark.long
def test_a_sweep_killed_three_times_ends_as_one_left_alone(tmp_path: Path) -> None:
    """Killed outright three times and gone on with, a sweep ends with the journal of one that was left alone."""
    jobs, kills, path = 96, 3, tmp_path / "killed.jsonl"
    at = []
    for k in range(kills):
        # It never finishes, however long this process may be kept waiting before it kills.
        most = jobs * (k + 1) // (kills + 1)
        with subprocess.Popen([sys.executable, __file__, str(jobs), str(path), str(most)]) as process:
            while results_in(path) < most // 3:
                assert process.poll() is None
                time.sleep(0.002)
            process.send_signal(signal.SIGKILL)
        at.append(results_in(path))
    sitting(jobs, path)
    sitting(jobs, tmp_path / "alone.jsonl")
    assert read_canonical_lines(path) == read_canonical_lines(tmp_path / "alone.jsonl")
    assert len(read_canonical_lines(path)) == jobs + 1  # and the line that says what it is of: nothing was run twice
    assert all(0 < number < jobs for number in at)
    assert at == sorted(at)


if __name__ == "__main__":
    sitting(int(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]))
