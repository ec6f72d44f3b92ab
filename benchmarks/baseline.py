"""Baseline of another environment's Carom: the same measurement in both, in turn, so that only ratios count."""

from __future__ import annotations

import statistics
import subprocess
import sys
from typing import Self


class Interpreter:
    """A process of a Python interpreter that answers each line it is sent with a line.

    Args:
        code: Program that reads lines from standard input, and prints one for each.
        python: The interpreter; this one where none is given.
    """

    def __init__(self, code: str, python: str | None = None) -> None:
        self._process = subprocess.Popen(  # noqa: S603 - an interpreter that the user has named, and our own text
            [python or sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def ask(self, line: str) -> list[float]:
        """Return the numbers that it answers with.

        Raises:
            OSError: It has ended.
        """
        assert self._process.stdin is not None  # noqa: S101 - a pipe was asked for
        assert self._process.stdout is not None  # noqa: S101 - a pipe was asked for
        self._process.stdin.write(f"{line}\n")
        self._process.stdin.flush()
        answer = self._process.stdout.readline()
        if not answer:
            raise OSError(f"{self._process.args[0]!r} ended with code {self._process.wait()}")  # type: ignore[index]  # it is the list above
        return [float(number) for number in answer.split()]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        with self._process:
            self._process.kill()


def alternating(interpreters: list[Interpreter], line: str, rounds: int) -> list[float]:
    """Return the median of each interpreter's first number of `rounds` answers, asked in turn."""
    answers = [[interpreter.ask(line)[0] for interpreter in interpreters] for _ in range(rounds)]
    return [statistics.median(column) for column in zip(*answers, strict=True)]
