"""The extension that is installed, wherever it was built, rounds each operation by itself: its bits rest on that."""

from __future__ import annotations

from carom.core import built


def test_no_product_is_fused_with_a_sum() -> None:
    """(1 + 2^-27)^2 is 1 + 2^-26 + 2^-54, of which a product that is rounded keeps the first two: nothing is left.

    A fused multiply-add, which compilers make of the same line where they may, leaves the third.
    """
    a = 1.0 + 2.0**-27
    assert built.less_product(1.0 + 2.0**-26, a, a) == 0.0


def test_every_operation_is_rounded_to_a_double() -> None:
    """Nothing is evaluated in extended precision on the way."""
    assert built.EVALUATION_METHOD == 0
