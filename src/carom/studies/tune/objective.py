"""What makes one set of settings better than another: here alone, with the reasons.

In this order, each deciding only between what those before it leave equal:

1. **scenes wrong**: who misses or invents an impact tells another story, and no small error elsewhere makes up for it;
2. **scenes neither exact nor close**: who finds the instant itself, not a step late, is of another kind;
3. **the error over PIT's**, of each scene on a scale of ratios: errors differ by decades, and on any other scale the
   worst scene alone would speak. It is counted in hundredths of that scale, so that the last may decide at all;
4. **the cost**: seconds of the steps over those of the profile that the search begins with, the median over scenes.
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
    """What came of a scene with some settings.

    Attributes:
        grade: Its grade; None where it was not run.
        price: Its error over PIT's at worst, see `carom.comparator.Score.price_paid`; NaN where there is none.
        missed: How many impacts are missed.
        spurious: How many are invented.
        reason: Why it was not run.
        seconds: Seconds of all steps, NaN where they were not timed.
        float_bits: Width of the floats that the method declares, to whose rounding *exact* is meant.
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
        """Whether it is wrong; what did not run has not found its impacts either."""
        return self.grade in {Grade.WRONG, None}

    @property
    def behind(self) -> bool:
        """Whether it is neither exact nor close."""
        return self.grade not in {Grade.EXACT, Grade.CLOSE}


@dataclass(frozen=True, order=True)
class Merit:
    """How good some settings are, the less the better; the fields decide in their order.

    Attributes:
        wrong: Scenes wrong, or not run.
        behind: Scenes neither exact nor close.
        error: The error over PIT's in hundredths, the mean over scenes: 0 is rounding, 50 what sampling costs.
        cost: The time of the steps over that of the first profile, the median over scenes; 1 where nothing is timed.
    """

    wrong: int
    behind: int
    error: int
    cost: float = 1.0

    @property
    def respects(self) -> tuple[int, int, int]:
        """What it is about except for the cost: scenes wrong, scenes neither exact nor close, and the error."""
        return self.wrong, self.behind, self.error

    def beaten_by(self, other: Merit) -> bool:
        """Whether another is as good in every respect, the cost left aside, and better in one."""
        own, its = self.respects, other.respects
        return own != its and all(b <= a for a, b in zip(own, its, strict=True))

    def number(self, scenes: int) -> float:
        """Return it as one number of the same order, for an optimiser that knows numbers alone."""
        whole = (self.wrong * (scenes + 1) + self.behind) * (_PARTS + 1) + self.error
        return whole + self.cost / (1.0 + self.cost)


def error_part(judged: Judged) -> float:
    """Return a scene's error over PIT's on a scale of ratios, 0 to 1: 0 is rounding, 1/2 is PIT's, 1 is anything.

    Where there is no such number, the grade decides: an exact or close scene without an impact has no error, and of one
    that is wrong nothing better can be said.
    """
    if judged.wrong or math.isnan(judged.price):
        return 1.0 if judged.behind else 0.0
    least = THRESHOLDS.rounding
    bounded = min(max(judged.price, least), 1.0 / least)
    return (1.0 - math.log(bounded) / math.log(least)) / 2.0


def merit_of(judged: Sequence[Judged], first: Sequence[Judged] = ()) -> Merit:
    """Return the merit of what came of the scenes.

    Args:
        judged: What came of each scene, one at least.
        first: The same of the first profile, scene by scene, for the cost; where nothing was timed the cost is 1.
    """
    ratios = [own.seconds / other.seconds for own, other in zip(judged, first, strict=False) if other.seconds > 0]
    ratios = [ratio for ratio in ratios if not math.isnan(ratio)]
    return Merit(
        wrong=sum(one.wrong for one in judged),
        behind=sum(one.behind for one in judged),
        error=round(_PARTS * statistics.fmean(map(error_part, judged))),
        cost=statistics.median(ratios) if ratios else 1.0,
    )
