"""Benchmarks: command lines, kinds of motion, and the file of the memory benchmark."""

import argparse
import runpy
import sys
from pathlib import Path

import pytest
from benchmarks.arguments import count
from benchmarks.kinds import PIC_TARGETS
from benchmarks.kinds_worker import KINDS, time_pic, time_pit
from benchmarks.memory import CHANGED, write_copies
from tests.cases import each

from carom.report.results_file.results_jsonl import read_records
from carom.studies.diff.compare_records import compare_records

ROOT = Path(__file__).parents[2]
MODULES = sorted(
    path
    for path in (ROOT / "benchmarks").glob("*.py")
    if f'parser("benchmarks.{path.stem}"' in path.read_text(encoding="utf-8")
)


def run_module(path: Path, monkeypatch: pytest.MonkeyPatch, *arguments: str) -> object:
    """Run a module as a command, and return its exit code."""
    monkeypatch.setattr(sys, "argv", [str(path), *arguments])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(path), run_name="__main__")
    return ended.value.code


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_benchmarks_print_help_and_refuse_unknown_options(
    path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """`--help` prints the usage and exits with 0; an unknown option is named and exits with 2."""
    assert run_module(path, monkeypatch, "--help") == 0
    told = capsys.readouterr().out
    assert told.startswith(f"usage: python -m benchmarks.{path.stem} ")
    assert run_module(path, monkeypatch, "--nonsense") == 2
    assert "unrecognized arguments: --nonsense" in capsys.readouterr().err


@each("text", ["0", "-3", "2.5", "nan", "inf", "ten", ""])
def test_invalid_count_is_refused_with_its_text(text: str) -> None:
    """A count is a whole number of at least 1, such as 1e6; anything else is refused with its text."""
    with pytest.raises(argparse.ArgumentTypeError, match=rf"got '{text}'"):
        count(text)
    assert count("1e6") == 1_000_000


# Scenes of the benchmark of the kinds of motion -----------------------------------------------------------------------


_DISCS, _IMPACTS, _LIMIT_S = 5, 6, 60.0


@each("kind", KINDS)
def test_every_kind_of_motion_is_timed(kind: str) -> None:
    """In every kind of motion PIC finds the requested number of impacts, and PIT runs the requested frames."""
    assert time_pic(kind, _DISCS, _IMPACTS, "all", 1, _LIMIT_S)[1] >= _IMPACTS
    assert time_pit(kind, _DISCS, 2, "all", 1, _LIMIT_S)[1] == 2
    assert kind in PIC_TARGETS or kind == "plain"


# The file of the memory benchmark ------------------------------------------------------------------------------------


@pytest.mark.long
def test_large_results_file_is_readable_and_changes_are_found(tmp_path: Path) -> None:
    """All rows of the large file are different cells, and comparing two files finds each changed row with errors."""
    old, new = tmp_path / "old.jsonl", tmp_path / "new.jsonl"
    write_copies(old, 1300, changed=False)
    write_copies(new, 1300, changed=True)
    _, lines = read_records(old)
    assert len({(line.scene, line.engine, line.profile, line.dt_s) for line in lines}) == 1300
    assert len(compare_records(old, new).changes) == sum(line.total is not None for line in lines[::CHANGED])
