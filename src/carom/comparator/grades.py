"""The grades of a run, from best to worst."""

from __future__ import annotations

from enum import Enum

#: Old words for the grades of diverged runs, each with today's word. Results files of earlier versions contain the old
#: words.
EARLIER_WORDS = {
    "parted": "diverged",
    "parted inaccurate": "diverged inaccurate",
    "parted_inaccurate": "diverged_inaccurate",
}


class Grade(Enum):
    """Grades from best to worst, except for the last, UNGRADED.

    `carom.report.outcome_marks` and `scoring.md` define the grades.
    """

    EXACT = "exact"
    CLOSE = "close"
    SAMPLED = "sampled"
    INACCURATE = "inaccurate"
    DIVERGED = "diverged"
    DIVERGED_INACCURATE = "diverged inaccurate"
    WRONG = "wrong"
    UNGRADED = "not graded"

    def is_at_least_as_bad_as(self, other: Grade) -> bool:
        """Whether this grade equals another grade or is worse. False if one of the two grades is UNGRADED."""
        order = list(Grade)
        return self is not Grade.UNGRADED and order.index(self) >= order.index(other)

    @classmethod
    def _missing_(cls, value: object) -> Grade | None:
        """Return the grade that had the name `value` in an earlier version of Carom."""
        return cls(EARLIER_WORDS[value]) if isinstance(value, str) and value in EARLIER_WORDS else None


def find_worst_grade(*grades: Grade) -> Grade:
    """Return the worst of some grades; UNGRADED counts as worse than all others."""
    return max(grades, key=list(Grade).index)
