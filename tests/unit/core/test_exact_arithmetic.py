"""Double-double and exact arithmetic of the core."""

import math
from fractions import Fraction

import numpy as np
import pytest
from tests.cases import each

from carom.core import primitives
from carom.core.exact_quartic import find_falls, solve_quartic

core_functions = pytest.importorskip("tests.core_functions")


def test_error_free_transformations_are_exact() -> None:
    """`two_sum`, `two_diff` and `two_prod` return the rounded result and its exact error."""
    # A fused multiply-add would break this.
    rng = np.random.default_rng(5)
    for _ in range(2000):
        a, b = (float(x) for x in rng.normal(size=2) * 10.0 ** rng.integers(-20, 20, 2))
        for transform, exact in (
            (core_functions.two_sum, Fraction(a) + Fraction(b)),
            (primitives.two_diff, Fraction(a) - Fraction(b)),
            (core_functions.two_prod, Fraction(a) * Fraction(b)),
        ):
            high, low = transform(a, b)
            assert Fraction(high) + Fraction(low) == exact
            assert high == float(exact)


def test_sum_of_products_is_exact_under_cancellation() -> None:
    """`sum_of_products` returns the exact remainder of products that cancel to 2^-104 of their size."""
    high, low = core_functions.sum_of_products(((1.0 + 2.0**-52, 1.0 - 2.0**-52), (-1.0, 1.0), (2.0**-80, 2.0**-80)))
    assert Fraction(high) + Fraction(low) == Fraction(2) ** -160 - Fraction(2) ** -104


# The exact solver of quartics: falls are distinguished from rises and grazes, and the powers are those given ----------


def expand_roots(*roots: int) -> list[int]:
    """Return the coefficients of the product of ``t - root``, the lowest power first."""
    p = [1]
    for root in roots:
        p = [(p[k - 1] if k else 0) - root * (p[k] if k < len(p) else 0) for k in range(len(p) + 1)]
    return p


@each(
    "roots, times",
    [
        ((1, 2, 3, 4), [1.0, 3.0]),
        ((1, 1, 3, 4), [3.0]),  # a graze first
        ((1, 1, 1, 4), [1.0]),  # a threefold root is a crossing
        ((1, 1, 2, 2), []),  # two grazes
        ((1, 2, 3, 3), [1.0]),  # a graze from below is no fall
        ((-1, 1, 2, 3), [2.0]),  # below 0 at first: it rises at 1
        ((-1, 1, 2, 2), []),
        ((-1, -2, 3, 4), [3.0]),
        ((-1, -2, -3, -4), []),
        ((3, 3, 3, 3), []),
        ((2, 2), []),
        ((1000, 1001), [1000.0]),
    ],
)
def test_find_falls_ignores_rises_and_grazes(roots: tuple[int, ...], times: list[float]) -> None:
    """`find_falls` returns the positive roots at which a polynomial falls through 0, and no rise or graze."""
    assert list(find_falls(expand_roots(*roots))) == times


def test_solve_quartic_counts_closings_from_begin() -> None:
    """`solve_quartic` returns the k-th closing in seconds after `begin`, and infinity after the last one."""
    # With index -1 it returns the sign of the gap at `begin`.
    powers = [[(float(power), 1.0)] for power in expand_roots(1, 2, 3, 4)]
    assert [solve_quartic(powers, 0.5, False, index) for index in range(3)] == [0.5, 2.5, math.inf]
    assert [solve_quartic(powers, begin, False, -1) for begin in (0.5, 1.0, 1.5)] == [1.0, 0.0, -1.0]
    # If the gap is declared closed at 2.5 s, where it is at a maximum, the time is 0.
    assert solve_quartic(powers, 2.5, True, 0) == 0.0 < solve_quartic(powers, 1.75, True, 0)
