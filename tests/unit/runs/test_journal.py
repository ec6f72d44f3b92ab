from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from carom.errors import InputError
from carom.runs.cell_score import CellKey, CellResult, Measures
from carom.runs.journal import Journal, canonical, decode, encode, read_journal
from carom.runs.results import Status

KEY = CellKey("ab" * 32, "pit", "tuned", 1 / 60, 0.25, (("carom", "1"), ("numpy", "2")))


def measures(value: float = 0.1) -> Measures:
    return Measures(3, 2, 1, 0, 0, 0, value, value, value, value, value, value, value, 2.0, 120, "completed")


def result(dt_s: float = 1 / 60, value: float = 0.1) -> CellResult:
    key = CellKey(KEY.scene_sha256, KEY.engine, KEY.profile, dt_s, KEY.phase, KEY.versions)
    return CellResult(key, "mine", Status.RAN, measures=measures(value))


@given(value=st.floats(), dt_s=st.floats(min_value=0, exclude_min=True, allow_infinity=False))
def test_a_float_comes_back_to_the_bit(value: float, dt_s: float) -> None:
    """Whatever float a result holds, subnormal, negative zero or infinite, its line holds it to the bit."""
    written = result(dt_s, value)
    line = encode(written)
    json.loads(line, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    read = decode(line)
    assert read.key == written.key
    assert read.measures is not None
    if math.isnan(value):
        assert math.isnan(read.measures.velocity_error)
    else:
        assert read.measures.velocity_error.hex() == value.hex()
    assert encode(read) == line


def test_a_cell_that_was_not_run_keeps_its_reason() -> None:
    """A crash is a line, too: status and reason come back, and there are no numbers."""
    crashed = CellResult(KEY, "mine", Status.CRASHED, 'ended by SIGABRT; it last printed: "ouch"\n')
    assert decode(encode(crashed)) == crashed
    assert "\n" not in encode(crashed)


@pytest.mark.parametrize("torn", ['{"format":1,"scene":"mi', "{", "\x00\x00\x00", "\x00\x00\n", '{"format":1,\n'])
def test_a_torn_last_line_is_cut_off_and_nothing_else(tmp_path: Path, torn: str) -> None:
    """What a kill or a loss of power tears is the last line; it goes, the others stay, and the next is a line."""
    path = tmp_path / "journal.jsonl"
    with Journal(path) as journal:
        journal.add([result(0.1), result(0.2)])
    whole = path.read_bytes()
    path.write_bytes(whole + torn.encode())
    assert len(read_journal(path)) == 2
    with Journal(path, resume=True) as journal:
        assert len(journal.results) == 2
        journal.add([result(0.3)])
    assert path.read_bytes() == whole + encode(result(0.3)).encode() + b"\n"


def test_a_line_that_is_broken_in_the_middle_is_named_and_left(tmp_path: Path) -> None:
    """A line that is not the last is somebody's doing: it is named by number, and the file is not touched."""
    path = tmp_path / "journal.jsonl"
    text = f"{encode(result(0.1))}\nnot json\n{encode(result(0.2))}\n"
    path.write_text(text)
    with pytest.raises(InputError, match=r"journal.jsonl, line 2: .*remove the line"):
        Journal(path, resume=True)
    assert path.read_text() == text


def test_a_journal_of_another_format_is_refused(tmp_path: Path) -> None:
    """A line whose fields mean something else is not read as if they did not."""
    path = tmp_path / "journal.jsonl"
    path.write_text(json.dumps({"format": 99}) + "\n")
    with pytest.raises(InputError, match="not a line of a journal of format 1"):
        Journal(path, resume=True)


def test_results_are_not_overwritten_unasked(tmp_path: Path) -> None:
    """A journal that holds something is gone on with when that is asked for, and refused otherwise."""
    path = tmp_path / "journal.jsonl"
    with Journal(path) as journal:
        journal.add([result()])
    with pytest.raises(InputError, match="--resume"):
        Journal(path)


def test_two_processes_do_not_write_one_journal(tmp_path: Path) -> None:
    """While one process has a journal open, another is refused; when it is gone, however, the way is free."""
    path = tmp_path / "journal.jsonl"
    code = (
        "import sys; from pathlib import Path; from carom.runs.journal import Journal\n"
        f"journal = Journal(Path({str(path)!r})); print('open', flush=True); sys.stdin.read()"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == b"open\n"
        with pytest.raises(InputError, match="another process"):
            Journal(path)
        other.kill()
    Journal(path).close()


def test_content_is_compared_without_its_order(tmp_path: Path) -> None:
    """Two journals are the same where they hold the same results, in whatever order they were finished."""
    one, two, three = (tmp_path / name for name in ("one", "two", "three"))
    for path, dts in ((one, (0.1, 0.2)), (two, (0.2, 0.1)), (three, (0.1, 0.3))):
        with Journal(path) as journal:
            journal.add([result(dt_s) for dt_s in dts])
    assert canonical(one) == canonical(two)
    assert canonical(one) != canonical(three)


def test_a_full_disc_is_an_error_and_the_journal_survives_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where only a part of a line could be written, that is an error; what was there before is still read."""
    path = tmp_path / "journal.jsonl"
    write = os.write
    with Journal(path) as journal:
        journal.add([result(0.1)])
        monkeypatch.setattr(os, "write", lambda file, data: write(file, data[:10]))
        with pytest.raises(OSError, match="no space left"):
            journal.add([result(0.2)])
        monkeypatch.undo()
    with Journal(path, resume=True) as journal:
        assert [found.key.dt_s for found in journal.results.values()] == [0.1]
