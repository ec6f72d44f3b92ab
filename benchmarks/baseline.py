"""Measures two versions of Carom in turn, each in its own Python interpreter, to compare their speeds."""

from __future__ import annotations

import statistics
import subprocess
import sys
from typing import Self


class Interpreter:
    """A process of a Python interpreter, which prints a line for each line that it receives.

    Args:
        code: Program that prints a line for each line of its standard input.
        python: Path of the interpreter; None for the interpreter that runs this module.
    """

    def __init__(self, code: str, python: str | None = None) -> None:
        self._process = subprocess.Popen(  # noqa: S603 - an interpreter that the user has named, and our own text
            [python or sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def ask(self, line: str) -> list[float]:
        """Send a line to the process, and return the numbers in the line that the process prints.

        Raises:
            OSError: The process has ended.
        """
        assert self._process.stdin is not None  # noqa: S101 - a pipe was asked for
        assert self._process.stdout is not None  # noqa: S101 - a pipe was asked for
        self._process.stdin.write(f"{line}\n")
        self._process.stdin.flush()
        answer = self._process.stdout.readline()
        if not answer:
            raise OSError(f"{self._process.args[0]!r} ended with code {self._process.wait()}")  # type: ignore[index]  # args is a list
        return [float(number) for number in answer.split()]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        with self._process:
            self._process.kill()


def alternating(interpreters: list[Interpreter], line: str, rounds: int) -> list[float]:
    """Send a line to each interpreter in turn, for some rounds.

    Return the median of each interpreter's first number.
    """
    answers = [[interpreter.ask(line)[0] for interpreter in interpreters] for _ in range(rounds)]
    return [statistics.median(column) for column in zip(*answers, strict=True)]
