"""Outcomes of runs, each with a word, a symbol, a colour and a definition."""

from __future__ import annotations

from enum import Enum

from carom.comparator import Grade
from carom.execution.job import Status
from carom.execution.results import Row
from carom.report.document import Cell


class Mark(Enum):
    """The outcome of a run: its grade, or the kind of failure. Two pairs of similar outcomes share a symbol."""

    EXACT = ("exact", "✓", "equal to PIC except for rounding", "green")
    EXACT_32 = ("exact (float32)", "✓", "equal to PIC except for rounding of 32-bit floats", "green")
    CLOSE = ("close", "≃", "finds every impact, with at most a hundredth of PIT's largest error", "green")
    SAMPLED = (
        "sampled",
        "≈",
        "finds every impact, with no larger errors than PIT can have at the same step size",
        "cyan",
    )
    INACCURATE = (
        "inaccurate",
        "▲",
        "an impact is early, an error is larger than PIT can have, or the run contradicts itself",
        "yellow",
    )
    DIVERGED = ("diverged", "↗", "the trajectory diverged from PIC's, but each step is as accurate as PIT's", "yellow")
    DIVERGED_INACCURATE = (
        "diverged inaccurate",
        "⇗",
        "the trajectory diverged from PIC's, and a step is worse than PIT's",
        "red",
    )
    WRONG = ("wrong", "✗", "misses or invents an impact, has impacts out of order, or ends differently", "bold red")
    UNGRADED = ("not graded", "○", "the scene has no unique answer, or no impact to grade", "dim")
    UNSCORED = ("not scored", "?", "PIC can't solve the scene, so there is no reference", "dim")
    UNSUPPORTED = ("unsupported", "∅", "the scene needs a feature that the engine does not have", "dim")
    UNAVAILABLE = ("unavailable", "∅", "the engine is not installed", "dim")
    CRASHED = ("crashed", "†", "the engine ended its process", "bold magenta")
    TIMED_OUT = ("timed out", "⧖", "the engine exceeded the time limit", "bold magenta")
    FAILED = ("failed", "!", "the adapter raised an error or returned an invalid result", "bold magenta")
    ABSENT = ("not planned", "·", "another profile has the same settings", "dim")

    def __init__(self, word: str, symbol: str, meaning: str, style: str) -> None:
        self.word = word
        self.symbol = symbol
        self.meaning = meaning
        self.style = style

    @property
    def css(self) -> str:
        """CSS class of the outcome in the HTML report."""
        return self.word.partition(" (")[0].replace(" ", "-")

    @property
    def sentence(self) -> str:
        """The word of the outcome and its meaning."""
        return f"{self.word}: {self.meaning}"

    @property
    def cell(self) -> Cell:
        """A table cell that shows the word, with the meaning as a tooltip."""
        return Cell(self.word, title=self.sentence, css=self.css, symbol=self.symbol, style=self.style)

    @property
    def rank(self) -> int | None:
        """The rank of a grade, from 0 (exact) to 6 (wrong); None for other outcomes."""
        return _RANKS.get(self)

    @property
    def ran(self) -> bool:
        """Whether the engine returned a result that was compared with the reference."""
        return self in GRADED


_OF_GRADE = {grade: Mark[grade.name] for grade in Grade}

#: The outcomes that are grades, each with its grade.
GRADED = {mark: grade for grade, mark in _OF_GRADE.items()} | {Mark.EXACT_32: Grade.EXACT}
_RANKS = {mark: list(Grade).index(grade) for mark, grade in GRADED.items() if grade is not Grade.UNGRADED}
#: Outcomes of runs whose errors are far smaller than those of checking once per step.
RIGHT = frozenset({Mark.EXACT, Mark.EXACT_32, Mark.CLOSE})
#: Outcomes of runs in which the engine did not return a complete result.
BROKEN = frozenset({Mark.CRASHED, Mark.TIMED_OUT, Mark.FAILED})


def mark_of(row: Row) -> Mark:
    """Return the outcome of a row of results."""
    return parse_mark(row.status, row.grade, row.score.float_bits if row.score else None)


def parse_mark(status: Status, grade: Grade | None, float_bits: int | None) -> Mark:
    """Return the outcome of a run from the fields of its line in results.jsonl."""
    if status is not Status.RAN:
        return Mark[status.name]
    return Mark.UNSCORED if grade is None else mark_of_grade(grade, float_bits or 64)


def mark_of_grade(grade: Grade, float_bits: int) -> Mark:
    """Return the outcome for a grade. The outcome for *exact* depends on the width of the floats."""
    return Mark.EXACT_32 if grade is Grade.EXACT and float_bits == 32 else _OF_GRADE[grade]
