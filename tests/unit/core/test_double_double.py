"""Error-free transformations of the core against rational arithmetic."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from carom.core import primitives

probe = pytest.importorskip("tests.probe")


def test_every_operation_is_rounded_to_a_double() -> None:
    """The compiler evaluates doubles as doubles: no extended precision changes a bit on the way."""
    assert probe.EVALUATION_METHOD == 0


def test_error_free_transformations_are_exact() -> None:
    """A sum, difference or product and its error add up to the exact result: no multiply-add was fused."""
    rng = np.random.default_rng(5)
    for _ in range(2000):
        a, b = (float(x) for x in rng.normal(size=2) * 10.0 ** rng.integers(-20, 20, 2))
        for transform, exact in (
            (probe.two_sum, Fraction(a) + Fraction(b)),
            (primitives.two_diff, Fraction(a) - Fraction(b)),
            (probe.two_prod, Fraction(a) * Fraction(b)),
        ):
            high, low = transform(a, b)
            assert Fraction(high) + Fraction(low) == exact
            assert high == float(exact)


def test_a_sum_of_products_survives_total_cancellation() -> None:
    """Products that cancel to 2^-100 of their size leave the right remainder."""
    high, low = probe.sum_of_products(((1.0 + 2.0**-52, 1.0 - 2.0**-52), (-1.0, 1.0), (2.0**-80, 2.0**-80)))
    assert Fraction(high) + Fraction(low) == Fraction(2) ** -160 - Fraction(2) ** -104
