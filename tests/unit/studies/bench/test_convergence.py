import math

import pytest
from tests.cases import each

from carom.studies.bench.convergence import Convergence, compute_student_quantile, fit_order, fit_power

STEPS = [1 / 60, 1 / 167, 1 / 464, 1 / 1292, 1 / 3594, 1 / 10000]


@each("freedom, published", [(1, 12.706), (2, 4.303), (3, 3.182), (4, 2.776), (5, 2.571), (10, 2.228), (30, 2.042)])
def test_student_quantiles_match_published_table(freedom: int, published: float) -> None:
    """The 97.5 % quantiles of Student's t equal the published ones (NIST/SEMATECH e-Handbook, 1.3.6.7.2)."""
    assert compute_student_quantile(0.975, freedom) == pytest.approx(published, abs=5e-4)


@each("order", [1.0, 2.0])
def test_fit_recovers_order_of_a_power_law(order: float) -> None:
    """Errors that are a power of the step give that order, with an interval of zero width, and converge."""
    found = fit_order(STEPS, [0.3 * step**order for step in STEPS])
    assert found.exponent == pytest.approx(order, abs=1e-12)
    assert found.factor == pytest.approx(0.3, rel=1e-12)
    assert found.high - found.low < 1e-11
    assert found.verdict is Convergence.CONVERGES


def test_confidence_interval_matches_hand_calculation() -> None:
    """The slope and 95 % interval through (0, 0), (1, 1), (2, 1), (3, 3) are 0.9 ± 4.3027 sqrt(0.7 / 2 / 5)."""
    exponent, low, high, factor = fit_power([math.exp(k) for k in range(4)], [math.exp(k) for k in (0, 1, 1, 3)])
    assert (exponent, math.log(factor)) == pytest.approx((0.9, -0.1), abs=1e-12)
    assert high - exponent == pytest.approx(4.302653 * math.sqrt(0.7 / 2 / 5), rel=1e-6)
    assert exponent - low == pytest.approx(high - exponent, rel=1e-9)


@each(
    "errors, verdict, low, high",
    [
        ([0.030, 0.031, 0.029, 0.030, 0.0305, 0.0295], Convergence.DOES_NOT_CONVERGE, -0.5, 0.5),
        ([0.1, 0.001, 0.05, 0.01], Convergence.UNDECIDED, -math.inf, math.inf),
        ([1e-16] * 6, Convergence.EXACT, math.nan, math.nan),
        ([0.1, 0.01], Convergence.TOO_FEW, math.nan, math.nan),
        ([0.1], Convergence.TOO_FEW, math.nan, math.nan),
    ],
)
def test_convergence_verdict_follows_the_interval(
    errors: list[float], verdict: Convergence, low: float, high: float
) -> None:
    """Orders below 1/2 do not converge, intervals around 1/2 are undecided, errors at rounding are exact."""
    found = fit_order(STEPS[: len(errors)], errors)
    assert found.verdict is verdict
    assert math.isnan(found.low) if math.isnan(low) else low < found.low < found.high < high
    assert math.isfinite(found.exponent) == (len(errors) > 1 and verdict is not Convergence.EXACT)


def test_errors_at_rounding_are_excluded_from_the_fit() -> None:
    """Errors of the size of rounding are excluded from the fit of the order."""
    found = fit_order(STEPS, [*(step for step in STEPS[:4]), 0.0, 1e-15])
    assert found.points == 4
    assert found.exponent == pytest.approx(1.0, abs=1e-12)
