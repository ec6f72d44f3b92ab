"""The word, symbol and sentence by which every format of the report shows what came of a cell."""

from __future__ import annotations

from enum import Enum

from carom.comparator import Grade
from carom.runs.job import Status
from carom.runs.results import Row

__all__ = ["Mark", "mark_of"]


class Mark(Enum):
    """What came of a cell. Each has a symbol of its own, so that colour is never the only sign."""

    EXACT = ("exact", "✓", Grade.EXACT, "green")
    EXACT_32 = ("exact, 32 bits", "✓", "to the rounding of the 32-bit floats that the method declares", "green")
    EXACT_16 = ("exact, 16 bits", "✓", "to the rounding of the 16-bit floats that the method declares", "green")
    CLOSE = ("close", "≃", Grade.CLOSE, "green")
    SAMPLED = ("sampled", "≈", Grade.SAMPLED, "cyan")
    INACCURATE = ("inaccurate", "▲", Grade.INACCURATE, "yellow")
    WRONG = ("wrong", "✗", Grade.WRONG, "bold red")
    UNGRADED = ("not graded", "○", Grade.UNGRADED, "dim")
    UNSCORED = ("not scored", "?", "ran, but PIC can't solve the scene, so there is nothing to hold it against", "dim")
    UNSUPPORTED = ("unsupported", "∅", "the engine declares that it can't do what the scene needs", "dim")
    UNAVAILABLE = ("unavailable", "∅", "the engine is not installed here", "dim")
    CRASHED = ("crashed", "†", "the engine ended its process", "bold magenta")
    TIMED_OUT = ("timed out", "⧖", "the engine gave no answer in time", "bold magenta")
    FAILED = ("failed", "!", "the adapter raised an error", "bold magenta")
    ABSENT = ("not planned", "·", "these settings were run under another profile's name", "dim")

    def __init__(self, word: str, symbol: str, meaning: Grade | str, style: str) -> None:
        self.word = word
        self.symbol = symbol
        # A grade's sentence begins with its own word, which stands beside it already.
        self.meaning = meaning.value.partition(": ")[2] if isinstance(meaning, Grade) else meaning
        self.style = style

    @property
    def css(self) -> str:
        """Class of the mark in the HTML report."""
        return self.word.partition(",")[0].replace(" ", "-")

    @property
    def ran(self) -> bool:
        """Whether the engine gave an answer that was held against the reference."""
        return self in _OF_GRADE.values() or self in _OF_WIDTH.values()


_OF_GRADE = {grade: Mark[grade.name] for grade in Grade}
_OF_WIDTH = {32: Mark.EXACT_32, 16: Mark.EXACT_16}
_OF_STATUS = {status: Mark[status.name] for status in Status if status is not Status.RAN}


def mark_of(row: Row | None) -> Mark:
    """Return the mark of a row; None is a cell that no row was planned for."""
    if row is None:
        return Mark.ABSENT
    if row.status is not Status.RAN:
        return _OF_STATUS[row.status]
    if row.score is None:
        return Mark.UNSCORED
    mark = _OF_GRADE[row.score.grade]
    return _OF_WIDTH.get(row.score.float_bits, mark) if mark is Mark.EXACT else mark
