"""The grades, from best to worst."""

from __future__ import annotations

from enum import Enum


class Grade(Enum):
    """Grades from best to worst, except for the last, UNGRADED.

    `carom.report.outcome_marks` and `scoring.md` define them.
    """

    EXACT = "exact"
    CLOSE = "close"
    SAMPLED = "sampled"
    INACCURATE = "inaccurate"
    PARTED = "parted"
    PARTED_INACCURATE = "parted inaccurate"
    WRONG = "wrong"
    UNGRADED = "not graded"

    def is_at_least_as_bad_as(self, other: Grade) -> bool:
        """Whether this grade is no better than another. UNGRADED is neither better nor worse than any grade."""
        order = list(Grade)
        return self is not Grade.UNGRADED and order.index(self) >= order.index(other)


def find_worst_grade(*grades: Grade) -> Grade:
    """Return the worst of some grades; UNGRADED counts as worse than any."""
    return max(grades, key=list(Grade).index)
