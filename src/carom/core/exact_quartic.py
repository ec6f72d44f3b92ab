"""Exact instants at which a gap closes. The gap is a polynomial in time.

The core uses exact instants where floats can't decide.

Every float is a fraction whose denominator is a power of two. So a polynomial with float coefficients is a polynomial
with integer coefficients, divided by a power of two. Sturm's theorem gives the number of roots in an interval.
Intervals are halved until each contains a single root. An interval in which the polynomial becomes negative is then
halved until floats can't distinguish its ends. A root without a change of sign is a graze, not an impact.

Source: J. C. F. Sturm's theorem with pseudo-remainders; D. E. Knuth, TAOCP vol. 2, 4.6.1, exercise 22.
"""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import islice, pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    Polynomial = list[int]  # coefficients, lowest power first

#: Number of bits to which instants are computed: two more than those of a float.
_BITS = 55


def solve_quartic(powers: Sequence[Sequence[tuple[float, float]]], begin: float, is_closed: bool, index: int) -> float:
    """Return an instant at which a gap closes, in seconds after `begin`; infinity if it closes at most `index` times.

    Args:
        powers: For each power of time, lowest power first, a list of pairs of numbers. The coefficient of the power is
            the sum of the pairs' products.
        begin: Instant at which the search starts, in seconds.
        is_closed: Whether the gap is exactly 0 at `begin`. If it is, 0 replaces the polynomial's value at `begin`.
        index: Index of the instant, in order of time, from 0. For the index -1, the result is the sign of the gap at
            `begin`.
    """
    gap = [sum((Fraction(a) * Fraction(b) for a, b in products), Fraction(0)) for products in powers]
    start = Fraction(begin)
    for lowest in range(len(gap)):
        for k in reversed(range(lowest, len(gap) - 1)):
            gap[k] += start * gap[k + 1]
    if index < 0:
        return float((gap[0] > 0) - (gap[0] < 0))
    if is_closed:
        gap[0] = Fraction(0)
    try:
        return next(islice(find_closings(gap), index, None), math.inf)
    except OverflowError:  # the instant is later than the largest float
        return math.inf


def find_closings(gap: Sequence[Fraction]) -> Iterator[float]:
    """Yield the times t > 0 at which a gap closes. If the gap is 0 at t = 0 and becomes negative, yield 0 first.

    The gap is given by its coefficients, lowest power of time first. The denominators of its coefficients must be
    powers of two. A gap that is negative at first must open before it can close.
    """
    powers = list(gap)
    while powers and powers[0] == 0:  # the sign of the lowest nonzero coefficient decides whether the gap opens
        del powers[0]
    if not powers:
        return
    if powers[0] < 0 and len(powers) < len(gap):
        yield 0.0
    unit = max(power.denominator for power in powers)  # all denominators are powers of two
    yield from find_falls([int(power * unit) for power in powers])


def find_falls(polynomial: Sequence[int]) -> Iterator[float]:
    """Yield the times t > 0 at which a polynomial becomes negative, in order. The polynomial is not 0 at t = 0."""
    p = list(polynomial)
    while p[-1] == 0:
        del p[-1]
    chain = _build_sturm_chain(p)
    at_infinity = _count_changes([q[-1] for q in chain])
    low, high, scale = 0, 1, 0  # the interval is from low / 2^scale to high / 2^scale
    before = _count_changes([q[0] for q in chain])
    while before != at_infinity:
        while (
            _count_changes([_compute_value(q, high, scale) for q in chain]) == before
            or _compute_value(p, high, scale) == 0
        ):
            high *= 2
        while (before - (after := _count_changes([_compute_value(q, high, scale) for q in chain]))) > 1:
            low, high, scale = 2 * low, 2 * high, scale + 1
            middle = (low + high) // 2
            while _compute_value(p, middle, scale) == 0:  # an end of an interval must not be a root
                low, high, middle, scale = 2 * low, 2 * high, 2 * middle + 1, scale + 1
            halfway = _count_changes([_compute_value(q, middle, scale) for q in chain])
            if halfway == before:
                low = middle
            else:
                high = middle
        if _compute_value(p, low, scale) > 0 > _compute_value(p, high, scale):  # p becomes negative in the interval
            yield _bisect(p, low, high, scale)
        low, before, high = high, after, 2 * high


def _bisect(p: Polynomial, low: int, high: int, scale: int) -> float:
    """Return the only root between two instants, as the nearest float or a neighbour of it.

    The polynomial must become negative at the root.
    """
    while (high - low) << _BITS > high:
        low, high, scale = 2 * low, 2 * high, scale + 1
        middle = (low + high) // 2
        if _compute_value(p, middle, scale) < 0:
            high = middle
        else:
            low = middle
    return (low + high) / (1 << (scale + 1))


def _compute_value(p: Polynomial, t: int, scale: int) -> int:
    """Return the polynomial's value at ``t / 2^scale``, multiplied by a power of two that makes it an integer."""
    value, shift = p[-1], 0
    for coefficient in p[-2::-1]:
        shift += scale
        value = value * t + (coefficient << shift)
    return value


def _count_changes(values: Sequence[int]) -> int:
    """Return how many times the sign changes along the values. Zeros are ignored."""
    signs = [value > 0 for value in values if value]
    return sum(a != b for a, b in pairwise(signs))


def _build_sturm_chain(p: Polynomial) -> list[Polynomial]:
    chain = [p, [k * c for k, c in enumerate(p)][1:]]
    while len(chain[-1]) > 1:
        rest = _compute_negative_remainder(chain[-2], chain[-1])
        if not rest:
            break
        chain.append(rest)
    return [q for q in chain if q]


def _compute_negative_remainder(a: Polynomial, b: Polynomial) -> Polynomial:
    """Return a positive multiple of -r, where r is the remainder of a divided by b."""
    rest, lead = list(a), b[-1]
    while len(rest) >= len(b):
        top, shift = rest[-1], len(rest) - len(b)
        rest = [abs(lead) * c for c in rest]
        top = top if lead > 0 else -top
        for k, c in enumerate(b):
            rest[shift + k] -= top * c
        while rest and rest[-1] == 0:
            del rest[-1]
    common = math.gcd(*rest) if rest else 1
    return [-c // common for c in rest]
