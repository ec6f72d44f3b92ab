"""The grades, from best to worst."""

from __future__ import annotations

from enum import Enum


class Grade(Enum):
    """A grade. Grades are in order from best to worst, except for the last; the value is the sentence shown."""

    EXACT = "exact: to the rounding of the floats that the method declares"
    CLOSE = "close: finds every impact, with at most a hundredth of PIT's largest errors at the same step"
    SAMPLED = "sampled: no worse than PIT, which checks once per step, can be at the same step"
    INACCURATE = "inaccurate: early, worse than PIT at the same step, or in contradiction with itself"
    PARTED = (
        "parted: no step is worse than PIT's from the same state, but the trajectory has diverged from the reference's"
    )
    PARTED_INACCURATE = (
        "parted, inaccurate: finds all that PIT finds from the same state, but has worse steps, and the "
        "trajectory has diverged"
    )
    WRONG = "wrong: misses or invents an impact, has impacts out of order, ends differently from PIC, or is not finite"
    UNGRADED = "not graded: no unique answer, or nothing to grade"

    def is_at_least_as_bad_as(self, other: Grade) -> bool:
        """Whether this grade is no better than another. UNGRADED is neither better nor worse than any grade."""
        order = list(Grade)
        return self is not Grade.UNGRADED and order.index(self) >= order.index(other)


def worst_grade(*grades: Grade) -> Grade:
    """Return the worst of some grades; UNGRADED counts as worse than any."""
    return max(grades, key=list(Grade).index)
