"""Objective of the search: the order of settings from better to worse, with its reasons.

The criteria in this order; each decides only between settings that are equal by those before it:

1. **scenes wrong**: a missed or invented impact changes the motion, and small errors elsewhere do not make up for it;
2. **scenes neither exact nor close**: a method that finds the instant itself is better in kind than one that is up to a
  step late;
3. **the error over PIT's**, of each scene on a logarithmic scale. Errors differ by decades, and on a linear scale only
   the worst scene would count. It is counted in hundredths of that scale, so that the cost can decide;
4. **the cost**: seconds of the steps over those of the first profile, the median over scenes.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from carom.comparator import Grade
from carom.comparator.thresholds import THRESHOLDS

#: Hundredths of the scale from `THRESHOLDS.rounding` to its reciprocal: a factor of 1.7 each.
_PARTS = 100


@dataclass(frozen=True)
class Judged:
    """Result of a scene with some settings.

    Attributes:
        grade: Its grade; None where it was not run.
        price: Its error over PIT's at worst, see `carom.comparator.Score.price_paid`; NaN where there is none.
        missed: Number of missed impacts.
        spurious: Number of invented impacts.
        reason: Reason why it was not run.
        seconds: Seconds of all steps, NaN where they were not timed.
        float_bits: Width of the floats that the method declares, whose rounding *exact* allows.
    """

    grade: Grade | None
    price: float = math.nan
    missed: int = 0
    spurious: int = 0
    reason: str = ""
    seconds: float = math.nan
    float_bits: int = 64

    @property
    def wrong(self) -> bool:
        """Whether it is wrong; a scene that did not run counts as wrong."""
        return self.grade in {Grade.WRONG, None}

    @property
    def behind(self) -> bool:
        """Whether it is neither exact nor close."""
        return self.grade not in {Grade.EXACT, Grade.CLOSE}


@dataclass(frozen=True, order=True)
class Merit:
    """Rank of some settings: less is better; the fields decide in their order.

    Attributes:
        wrong: Scenes wrong, or not run.
        behind: Scenes neither exact nor close.
        error: The error over PIT's in hundredths, the mean over scenes: 0 is rounding, 50 the cost of sampling.
        cost: The time of the steps over that of the first profile, the median over scenes; 1 where nothing is timed.
    """

    wrong: int
    behind: int
    error: int
    cost: float = 1.0

    @property
    def respects(self) -> tuple[int, int, int]:
        """The criteria without the cost: scenes wrong, scenes neither exact nor close, and the error."""
        return self.wrong, self.behind, self.error

    def beaten_by(self, other: Merit) -> bool:
        """Whether another is as good in every respect except the cost, and better in one."""
        own, its = self.respects, other.respects
        return own != its and all(b <= a for a, b in zip(own, its, strict=True))

    def number(self, scenes: int) -> float:
        """Return one number of the same order, for an optimiser."""
        whole = (self.wrong * (scenes + 1) + self.behind) * (_PARTS + 1) + self.error
        return whole + self.cost / (1.0 + self.cost)


def error_part(judged: Judged) -> float:
    """Return a scene's error over PIT's on a logarithmic scale from 0 to 1: 0 is rounding, 1/2 is PIT's error.

    Without such a number the grade decides: an exact or close scene without an impact has error 0, a wrong one error 1.
    """
    if judged.wrong or math.isnan(judged.price):
        return 1.0 if judged.behind else 0.0
    least = THRESHOLDS.rounding
    bounded = min(max(judged.price, least), 1.0 / least)
    return (1.0 - math.log(bounded) / math.log(least)) / 2.0


def merit_of(judged: Sequence[Judged], first: Sequence[Judged] = ()) -> Merit:
    """Return the merit of the results of scenes.

    Args:
        judged: Results of the scenes, at least one.
        first: Results of the first profile by scene, with which costs are compared; if nothing was timed the cost is 1.
    """
    ratios = [own.seconds / other.seconds for own, other in zip(judged, first, strict=False) if other.seconds > 0]
    ratios = [ratio for ratio in ratios if not math.isnan(ratio)]
    return Merit(
        wrong=sum(one.wrong for one in judged),
        behind=sum(one.behind for one in judged),
        error=round(_PARTS * statistics.fmean(map(error_part, judged))),
        cost=statistics.median(ratios) if ratios else 1.0,
    )
