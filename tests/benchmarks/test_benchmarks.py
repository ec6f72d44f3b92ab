"""Benchmarks: command lines, kinds of motion and the file of the benchmark of memory."""

import argparse
import re
import runpy
import sys
from pathlib import Path

import pytest
from benchmarks.arguments import count, parser, run
from benchmarks.kinds import PIC_TARGETS
from benchmarks.kinds_worker import KINDS, time_pic, time_pit
from benchmarks.memory import CHANGED, write_copies
from tests.cases import each

from carom.errors import InputError
from carom.report.results_file.records import read_records
from carom.studies.diff.compare_records import compare_records

ROOT = Path(__file__).parents[2]
MODULES = sorted(
    path
    for path in (ROOT / "benchmarks").glob("*.py")
    if f'parser("benchmarks.{path.stem}"' in path.read_text(encoding="utf-8")
)


def called(path: Path, monkeypatch: pytest.MonkeyPatch, *arguments: str) -> object:
    """Run a module as a command, and return its exit code."""
    monkeypatch.setattr(sys, "argv", [str(path), *arguments])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(path), run_name="__main__")
    return ended.value.code


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_every_benchmark_answers_help_and_refuses_what_it_does_not_know(
    path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """`--help` says how it is called and what it measures; an unknown option ends it with a line and exit code 2."""
    assert called(path, monkeypatch, "--help") == 0
    told = capsys.readouterr().out
    assert told.startswith(f"usage: python -m benchmarks.{path.stem} ")
    assert called(path, monkeypatch, "--nonsense") == 2
    assert "unrecognized arguments: --nonsense" in capsys.readouterr().err


def test_no_benchmark_is_packaged() -> None:
    """What is made into the wheel imports none of them, so none has to be in it."""
    packaged = [path for folder in ("src", "adapters") for path in (ROOT / folder).rglob("*.py")]
    assert packaged
    importing = re.compile(r"^\s*(from|import) benchmarks\b", re.MULTILINE)
    assert not [path for path in packaged if importing.search(path.read_text(encoding="utf-8"))]


def test_there_are_benchmarks() -> None:
    """The search for benchmarks finds those that the documentation names."""
    assert {"pic", "certified", "certified_answers", "time_of_impact"} <= {path.stem for path in MODULES}


@each("text", ["0", "-3", "2.5", "nan", "inf", "ten", ""])
def test_a_number_that_is_none_is_refused_with_its_text(text: str) -> None:
    """A count is a whole number of 1 or more; anything else is named."""
    with pytest.raises(argparse.ArgumentTypeError, match=rf"got '{text}'"):
        count(text)
    assert count("1e6") == 1_000_000


def test_an_error_of_caroms_own_is_a_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """What a benchmark refuses is said in its own words, without a traceback, with exit code 2."""

    def main() -> None:
        raise InputError("so many discs do not fit")

    monkeypatch.setattr(sys, "argv", ["x"])
    with pytest.raises(SystemExit) as ended:
        run(parser("benchmarks.x", "Nothing: ``python -m benchmarks.x``."), main)
    assert ended.value.code == 2
    assert "so many discs do not fit" in capsys.readouterr().err


# Scenes of the benchmark of the kinds of motion -----------------------------------------------------------------------


_DISCS, _IMPACTS, _LIMIT_S = 5, 6, 60.0


@each("kind", KINDS)
def test_each_kind_builds_and_has_impacts(kind: str) -> None:
    """PIC finds the number of impacts that is asked for, in every kind of motion."""
    _, events = time_pic(kind, _DISCS, _IMPACTS, "all", 1, _LIMIT_S)
    assert events >= _IMPACTS


@each("kind", KINDS)
def test_each_kind_runs_by_frames(kind: str) -> None:
    """PIT runs every kind of motion over the frames that are asked for."""
    _, frames = time_pit(kind, _DISCS, 2, "all", 1, _LIMIT_S)
    assert frames == 2


def test_each_kind_has_a_target() -> None:
    """Every kind but the plain gas is compared with a target."""
    assert set(PIC_TARGETS) == set(KINDS) - {"plain"}


# The large file of the benchmark of memory is one that Carom reads, and the second one differs where it says ----------


@pytest.mark.long
def test_copies_are_read_and_differ_in_one_row_of_twenty(tmp_path: Path) -> None:
    """Each row is a cell of its own, and each changed row that has errors is a change."""
    old, new = tmp_path / "old.jsonl", tmp_path / "new.jsonl"
    write_copies(old, 1300, changed=False)
    write_copies(new, 1300, changed=True)
    _, lines = read_records(old)
    assert len({(line.scene, line.engine, line.profile, line.dt_s) for line in lines}) == 1300
    assert len(compare_records(old, new).changes) == sum(line.total is not None for line in lines[::CHANGED])
