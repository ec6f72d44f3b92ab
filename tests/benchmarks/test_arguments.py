"""The benchmarks that run as modules, each found by the parser of its command line."""

from __future__ import annotations

import argparse
import re
import runpy
import sys
from pathlib import Path

import pytest
from benchmarks.arguments import count, parser, run
from tests.lengths import each

from carom.errors import InputError

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
