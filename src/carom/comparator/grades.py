"""The grades, from best to worst."""

from __future__ import annotations

from enum import Enum


class Grade(Enum):
    """A grade, from best to worst except the last; the value is the sentence shown."""

    EXACT = "exact: to the rounding of the floats that the method declares"
    CLOSE = "close: finds every impact, with at most a hundredth of the errors that checking once per step has at worst"
    SAMPLED = "sampled: no worse than checking once per step, as PIT does, may come out at the same step"
    INACCURATE = "inaccurate: early, or worse than PIT at the same step, or in contradiction with itself"
    PARTED = "parted: each step is no worse than PIT's from the same state; the trajectory has left the reference's"
    PARTED_INACCURATE = (
        "parted, inaccurate: misses nothing that PIT finds from the same state, but has worse steps; "
        "the trajectory has left the reference's"
    )
    WRONG = "wrong: misses or invents an impact, or has them out of order, ends otherwise than PIC, or is not finite"
    UNGRADED = "not graded: no unique answer, or nothing to decide by"

    def is_at_least_as_bad_as(self, other: Grade) -> bool:
        """Whether this grade is no better than another; UNGRADED is neither better nor worse than any."""
        order = list(Grade)
        return self is not Grade.UNGRADED and order.index(self) >= order.index(other)


def worst_grade(*grades: Grade) -> Grade:
    """Return the worst of some grades; UNGRADED counts as worse than any."""
    return max(grades, key=list(Grade).index)
