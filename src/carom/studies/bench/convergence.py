"""Order of convergence: the slope of error against step size on logarithmic axes, with a confidence interval."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from carom.comparator.thresholds import THRESHOLDS

CONFIDENCE = 0.95

#: Smallest order of convergence with which a method counts as convergent. Checking once per step has order 1. With an
#: order below 1/2, halving the error requires more than four times as many steps.
LEAST_ORDER = 0.5


class Convergence(Enum):
    """Result of a fit. Each member's value is the phrase that the report shows."""

    EXACT = "exact at every step size"
    CONVERGES = "converges"
    DOES_NOT_CONVERGE = "does not converge"
    UNDECIDED = "undecided: the interval is too wide"
    TOO_FEW = "too few step sizes"


@dataclass(frozen=True)
class ConvergenceOrder:
    """A fitted power law ``error = factor * dt_s ** exponent``.

    Attributes:
        verdict: Whether the method converges, according to the exponent's confidence interval.
        exponent: The slope on logarithmic axes; NaN if there are too few points.
        low: Lower end of the exponent's confidence interval.
        high: Upper end of the exponent's confidence interval.
        factor: Value of the power law at a step size of 1 second.
        points: Number of points in the fit, which excludes errors within rounding.
    """

    verdict: Convergence
    exponent: float
    low: float
    high: float
    factor: float
    points: int


def fit_order(dts_s: Sequence[float], errors: Sequence[float]) -> ConvergenceOrder:
    """Fit the order of convergence to dimensionless errors and their step sizes.

    Errors that are infinite, unknown or within rounding are omitted. If all known errors are within rounding, the
    verdict is `EXACT`.
    """
    finite = [(dt_s, error) for dt_s, error in zip(dts_s, errors, strict=True) if math.isfinite(error)]
    above = [(dt_s, error) for dt_s, error in finite if error > THRESHOLDS.rounding]
    exponent, low, high, factor = fit_power([dt_s for dt_s, _ in above], [error for _, error in above])
    if finite and not above:
        verdict = Convergence.EXACT
    elif math.isnan(low):
        verdict = Convergence.TOO_FEW
    elif low >= LEAST_ORDER:
        verdict = Convergence.CONVERGES
    elif high < LEAST_ORDER:
        verdict = Convergence.DOES_NOT_CONVERGE
    else:
        verdict = Convergence.UNDECIDED
    return ConvergenceOrder(verdict, exponent, low, high, factor, len(above))


def fit_power(x: Sequence[float], y: Sequence[float]) -> tuple[float, float, float, float]:
    """Fit a power law to positive numbers.

    Return the exponent, both ends of its confidence interval, and the factor.

    The fit uses least squares on the logarithms. The interval assumes that deviations from the fitted line are
    independent and normally distributed. The interval is NaN for fewer than three points. All values are NaN if `x` has
    fewer than two different values.
    """
    if len(set(x)) < 2:
        return math.nan, math.nan, math.nan, math.nan
    log_x, log_y = np.log(np.asarray(x, dtype=np.float64)), np.log(np.asarray(y, dtype=np.float64))
    centred = log_x - log_x.mean()
    squares = float(centred @ centred)
    exponent = float(centred @ log_y) / squares
    offset = float(log_y.mean() - exponent * log_x.mean())
    freedom = len(log_x) - 2
    if freedom < 1:
        return exponent, math.nan, math.nan, math.exp(offset)
    residual = log_y - offset - exponent * log_x
    deviation = math.sqrt(float(residual @ residual) / freedom / squares)
    half = compute_student_quantile(0.5 + CONFIDENCE / 2, freedom) * deviation
    return exponent, exponent - half, exponent + half, math.exp(offset)


def compute_student_quantile(probability: float, freedom: int) -> float:
    """Return a quantile of Student's t-distribution. The probability must be at least 1/2 and below 1."""
    low, high = 0.0, 1.0
    while _compute_student_cdf(high, freedom) < probability:
        high *= 2.0
    while high - low > 1e-13 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _compute_student_cdf(middle, freedom) < probability else (low, middle)
    return high


def _compute_student_cdf(t: float, freedom: int) -> float:
    """Compute Student's distribution function by its finite series (Abramowitz and Stegun, 26.7.3 and 26.7.4)."""
    angle = math.atan2(t, math.sqrt(freedom))
    sine, cosine = math.sin(angle), math.cos(angle)
    odd = freedom % 2
    term, total = cosine if odd else 1.0, 0.0
    for k in range(odd, freedom - 1, 2):
        total += term
        term *= cosine * cosine * (k + 1) / (k + 2)
    both = (angle + sine * total) * 2.0 / math.pi if odd else sine * total
    return 0.5 + 0.5 * both
