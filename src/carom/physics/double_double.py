"""Error-free transformations and sums of products in twice the working precision, on plain floats.

A pair ``(high, low)`` stands for the exact sum of its two parts. Every step is one correctly rounded operation of IEEE
754, and none may be fused or reordered; all are exact as long as nothing over- or underflows. The compiled form is
`core/double_double.h`.

Sources: T. J. Dekker, "A floating-point technique for extending the available precision", Numer. Math. 18 (1971);
D. E. Knuth, TAOCP vol. 2, 4.2.2 (two_sum); T. Ogita, S. M. Rump, S. Oishi, "Accurate sum and dot product", SIAM J. Sci.
Comput. 26 (2005) (sums carried in three parts: algorithm SumK with K = 3); J. R. Shewchuk, "Adaptive precision
floating-point arithmetic", Discrete Comput. Geom. 18 (1997) (exact sums: grow-expansion with zero elimination).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

Pair = tuple[float, float]

#: 2^27 + 1: Veltkamp's constant, which splits 53 bits into 26 and 26 (and a sign).
_SPLITTER = 134217729.0


def split(a: float) -> Pair:
    """Return ``(high, low)`` of at most 26 bits each, with ``a = high + low`` exactly."""
    scaled = _SPLITTER * a
    high = scaled - (scaled - a)
    return high, a - high


def two_sum(a: float, b: float) -> Pair:
    """Return ``(s, e)``: the rounded sum, and its rounding error, ``a + b = s + e`` exactly."""
    s = a + b
    part = s - a
    return s, (a - (s - part)) + (b - part)


def two_diff(a: float, b: float) -> Pair:
    """Return ``(s, e)``: the rounded difference, and its rounding error, ``a - b = s + e`` exactly."""
    s = a - b
    part = s - a
    return s, (a - (s - part)) - (b + part)


def two_prod(a: float, b: float) -> Pair:
    """Return ``(p, e)``: the rounded product, and its rounding error, ``a * b = p + e`` exactly."""
    p = a * b
    a_high, a_low = split(a)
    b_high, b_low = split(b)
    return p, ((a_high * b_high - p) + a_high * b_low + a_low * b_high) + a_low * b_low


def sum_of_products(factors: Iterable[Pair]) -> Pair:
    """Return the sum of products as a pair whose high part is its nearest float.

    Products are exact, and their sum is carried in three parts: its error is about 2^-150 of the largest product.
    """
    high = middle = low = 0.0
    for a, b in factors:  # `two_prod` and `two_sum` in place: calls take longer than what they do
        product, scaled = a * b, _SPLITTER * a
        a_high = scaled - (scaled - a)
        a_low, scaled = a - a_high, _SPLITTER * b
        b_high = scaled - (scaled - b)
        b_low = b - b_high
        error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
        for term in (product, error):
            total = high + term
            part = total - high
            high, rest = total, (high - (total - part)) + (term - part)
            total = middle + rest
            part = total - middle
            middle, low = total, low + ((middle - (total - part)) + (rest - part))
    high, middle = two_sum(high, middle)
    return two_sum(high, middle + low)


def exact_products(p: Sequence[float], q: Sequence[float], sign: float = 1.0) -> list[float]:
    """Return terms whose exact sum is that of `p` times that of `q` times the sign, 1 or -1."""
    return [term for a in p for b in q for term in two_prod(sign * a, b)]


def exact_sum(terms: Iterable[float]) -> Pair:
    """Return a sum as a pair of its sign, right to 2^-100 of itself, however much of the terms cancels."""
    parts: list[float] = []  # which do not overlap, the smallest first: their sum is that of all terms so far
    for term in terms:
        total, kept = term, []
        for part in parts:
            total, rest = two_sum(total, part)
            if rest != 0.0:
                kept.append(rest)
        parts = [*kept, total] if total != 0.0 else kept
    high = low = 0.0
    for part in reversed(parts):  # the first of them fill `high`, the others add less and less to `low`
        high, rest = two_sum(high, part)
        low = low + rest
    return two_sum(high, low)


def pair_product(a: Pair, b: Pair) -> Pair:
    """Return the product of two pairs as a pair, to a relative error below 2^-100."""
    product, error = two_prod(a[0], b[0])
    return two_sum(product, error + (a[0] * b[1] + a[1] * b[0]))
