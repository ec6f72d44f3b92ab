"""Objective of the search: it decides which of two combinations of settings is better.

The following criteria are compared in order. A criterion only counts if all earlier criteria are equal:

1. **wrong scenes**: the number of scenes that did not run or are graded *wrong*, for example because of a missed
   impact. Small errors in other scenes can't compensate for a wrong scene;
2. **scenes that are neither exact nor close**: a method that finds the instant of an impact is better than a method
   that is late by up to a step;
3. **the error divided by PIT's error**, on a logarithmic scale, as the mean over scenes. On a linear scale, only the
   worst scene would count. The mean is rounded, so that settings with almost equal errors count as equal;
4. **the run time** of all steps, divided by the first profile's run time, as the median over scenes.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from carom.comparator import Grade
from carom.comparator.thresholds import THRESHOLDS

#: The logarithmic scale of errors extends from `THRESHOLDS.rounding` to its reciprocal. The scale has this number of
#: parts, and each part is a factor of 1.7.
_PARTS = 100


@dataclass(frozen=True)
class SceneResult:
    """Result of a scene with some settings.

    Attributes:
        grade: The grade; None if the scene was not run.
        error_ratio: The error divided by PIT's largest error; NaN if it is unknown. See
            `carom.comparator.Score.price_paid`.
        missed: Number of missed impacts.
        spurious: Number of invented impacts.
        reason: Reason why the scene was not run.
        seconds: Run time of all steps, in seconds; NaN if they were not timed.
        float_bits: Width of the floats that the method declares. Errors within the rounding of these floats count as
            exact.
    """

    grade: Grade | None
    error_ratio: float = math.nan
    missed: int = 0
    spurious: int = 0
    reason: str = ""
    seconds: float = math.nan
    float_bits: int = 64

    @property
    def is_wrong(self) -> bool:
        """Whether the grade is wrong. A scene that did not run counts as wrong."""
        return self.grade in {Grade.WRONG, None}

    @property
    def is_imprecise(self) -> bool:
        """Whether the result is neither exact nor close."""
        return self.grade not in {Grade.EXACT, Grade.CLOSE}


@dataclass(frozen=True, order=True)
class Merit:
    """Rank of a combination of settings. A smaller rank is better. The first field in which two ranks differ decides.

    Attributes:
        wrong: Number of scenes that are wrong or did not run.
        imprecise: Number of scenes that are neither exact nor close.
        error: Mean over scenes of the error divided by PIT's error, on a logarithmic scale: 0 is rounding, 50 is PIT's
            error, and 100 is wrong or not run.
        cost: Run time divided by the first profile's run time, as the median over scenes; 1 without timing.
    """

    wrong: int
    imprecise: int
    error: int
    cost: float = 1.0

    @property
    def criteria(self) -> tuple[int, int, int]:
        """The criteria without run time: wrong scenes, scenes that are neither exact nor close, and the error."""
        return self.wrong, self.imprecise, self.error

    def is_beaten_by(self, other: Merit) -> bool:
        """Return whether another rank is better in at least one criterion and worse in none. Run time is ignored."""
        own_criteria, other_criteria = self.criteria, other.criteria
        return own_criteria != other_criteria and all(b <= a for a, b in zip(own_criteria, other_criteria, strict=True))

    def to_number(self, scenes: int) -> float:
        """Convert the rank to a number for an optimiser. A smaller number is better."""
        integer_part = (self.wrong * (scenes + 1) + self.imprecise) * (_PARTS + 1) + self.error
        return integer_part + self.cost / (1.0 + self.cost)


def compute_error_on_scale(result: SceneResult) -> float:
    """Convert a scene's error to a logarithmic scale from 0 to 1: 0 is rounding, and 1/2 is as large as PIT's error.

    A scene that is graded *wrong* or did not run has the largest result, 1. If there is no error to measure, the result
    is 0 for an exact or close scene, and 1 for any other scene.
    """
    if result.is_wrong or math.isnan(result.error_ratio):
        return 1.0 if result.is_imprecise else 0.0
    rounding = THRESHOLDS.rounding
    bounded = min(max(result.error_ratio, rounding), 1.0 / rounding)
    return (1.0 - math.log(bounded) / math.log(rounding)) / 2.0


def compute_merit(results: Sequence[SceneResult], first: Sequence[SceneResult] = ()) -> Merit:
    """Compute the rank of settings from their results on scenes.

    Args:
        results: Results of at least one scene.
        first: Results of the first profile on the same scenes. Only the run times of these results are used. If `first`
            is empty, the cost is 1.
    """
    pairs = zip(results, first, strict=False)
    ratios = [one.seconds / other.seconds for one, other in pairs if other.seconds > 0 and not math.isnan(one.seconds)]
    return Merit(
        wrong=sum(one.is_wrong for one in results),
        imprecise=sum(one.is_imprecise for one in results),
        error=round(_PARTS * statistics.fmean(map(compute_error_on_scale, results))),
        cost=statistics.median(ratios) if ratios else 1.0,
    )
