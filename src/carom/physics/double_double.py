"""Error-free transformations and sums of products in twice the working precision.

Each function is a sequence of single additions and multiplications, without branches, so that one source serves Python
floats, NumPy arrays and compiled code, and gives all three the same bits: every step is one correctly rounded operation
of IEEE 754, and none may be fused or reordered. A pair ``(high, low)`` stands for the exact sum of its two parts.

The transformations are exact as long as nothing over- or underflows; callers scale by powers of two first.

Sources: T. J. Dekker, "A floating-point technique for extending the available precision", Numer. Math. 18 (1971);
D. E. Knuth, TAOCP vol. 2, 4.2.2 (two_sum); T. Ogita, S. M. Rump, S. Oishi, "Accurate sum and dot product", SIAM J. Sci.
Comput. 26 (2005) (sums carried in three parts: algorithm SumK with K = 3).
"""

from __future__ import annotations

from typing import Any

#: A float or an array of floats: the arithmetic is the same.
Real = Any

__all__ = [
    "Real",
    "pair_product",
    "split",
    "sum_of_products",
    "two_diff",
    "two_prod",
    "two_sum",
]

#: 2^27 + 1: Veltkamp's constant, which splits 53 bits into 26 and 26 (and a sign).
_SPLITTER = 134217729.0


def split(a: Real) -> tuple[Real, Real]:
    """Return ``(high, low)`` of at most 26 bits each, with ``a = high + low`` exactly."""
    scaled = _SPLITTER * a
    high = scaled - (scaled - a)
    return high, a - high


def two_sum(a: Real, b: Real) -> tuple[Real, Real]:
    """Return ``(s, e)``: the rounded sum, and its rounding error, ``a + b = s + e`` exactly."""
    s = a + b
    part = s - a
    return s, (a - (s - part)) + (b - part)


def two_diff(a: Real, b: Real) -> tuple[Real, Real]:
    """Return ``(s, e)``: the rounded difference, and its rounding error, ``a - b = s + e`` exactly."""
    s = a - b
    part = s - a
    return s, (a - (s - part)) - (b + part)


def two_prod(a: Real, b: Real) -> tuple[Real, Real]:
    """Return ``(p, e)``: the rounded product, and its rounding error, ``a * b = p + e`` exactly."""
    p = a * b
    a_high, a_low = split(a)
    b_high, b_low = split(b)
    return p, ((a_high * b_high - p) + a_high * b_low + a_low * b_high) + a_low * b_low


def sum_of_products(factors: tuple[tuple[Real, Real], ...]) -> tuple[Real, Real]:
    """Return the sum of products as a pair whose high part is its nearest float.

    Products are exact, and their sum is carried in three parts: its error is about 2^-150 of the largest product.
    """
    high = middle = low = 0.0 * factors[0][0]
    for a, b in factors:
        product, error = two_prod(a, b)
        for term in (product, error):
            high, rest = two_sum(high, term)
            middle, rest = two_sum(middle, rest)
            low = low + rest
    high, middle = two_sum(high, middle)
    return two_sum(high, middle + low)


def pair_product(a_high: Real, a_low: Real, b_high: Real, b_low: Real) -> tuple[Real, Real]:
    """Return the product of two pairs as a pair, to a relative error below 2^-100."""
    product, error = two_prod(a_high, b_high)
    return two_sum(product, error + (a_high * b_low + a_low * b_high))
