"""Time of impact of two discs whatever the size of their numbers.

Where a term of the fourth-degree formulas of `carom.physics.pair_time` could leave the range of floats, its numbers are
multiplied by powers of two, which round nothing; what these can't bring there is solved in rational numbers.
"""

from __future__ import annotations

import math
from fractions import Fraction

from carom.physics.pair_time import pair_time

#: Relative positions and velocities, and sums of radii, are of moderate size if their exponents (those of `math.frexp`)
#: are this at most in magnitude. The compiled form has the same limits (`core/primitives.pyx`).
_EXPONENT = 100
_MOST, _LEAST = 2.0**_EXPONENT, 2.0 ** -(_EXPONENT + 1)
#: Bits to which a root is taken: three more than a float has, so that a time, rounded once at the end, is off by an
#: eighth of a unit in its last place at most, in addition to the half that rounding takes.
_ROOT_BITS = 56


def any_pair_time(
    x1: float, y1: float, vx1: float, vy1: float, r1: float, x2: float, y2: float, vx2: float, vy2: float, r2: float
) -> float:
    """Return the seconds until two discs collide as `pair_time` does, infinity beyond the largest float."""
    row = (x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2)
    if _are_moderate(x2 - x1, y2 - y1, vx2 - vx1, vy2 - vy1, r1 + r2):
        return pair_time(*row)
    dx, dy, reach = Fraction(x2) - Fraction(x1), Fraction(y2) - Fraction(y1), Fraction(r1) + Fraction(r2)
    ux, uy = Fraction(vx2) - Fraction(vx1), Fraction(vy2) - Fraction(vy1)
    length = _EXPONENT - _exponent(max(abs(dx), abs(dy), reach))
    speed = _EXPONENT - _exponent(max(abs(ux), abs(uy)))
    scaled = _scaled(row, (length, length, speed, speed, length) * 2)
    if scaled is None or not _are_moderate(*(scaled[k + 5] - scaled[k] for k in range(4)), scaled[4] + scaled[9]):
        return _rational(dx, dy, ux, uy, reach)
    try:
        return math.ldexp(pair_time(*scaled), speed - length)
    except OverflowError:
        return math.inf


def _are_moderate(*numbers: float) -> bool:
    return all(_LEAST <= abs(number) < _MOST or number == 0.0 for number in numbers)


def _exponent(number: Fraction) -> int:
    """Return the exponent of a number as `math.frexp` does; all denominators are powers of two."""
    return number.numerator.bit_length() - number.denominator.bit_length() + 1 if number else 0


def _scaled(row: tuple[float, ...], exponents: tuple[int, ...]) -> tuple[float, ...] | None:
    """Return numbers times powers of two; None where that would round one."""
    try:
        scaled = tuple(math.ldexp(number, exponent) for number, exponent in zip(row, exponents, strict=True))
        exact = all(math.ldexp(scaled[k], -exponents[k]) == number for k, number in enumerate(row))
    except OverflowError:
        return None
    return scaled if exact else None


def _rational(dx: Fraction, dy: Fraction, ux: Fraction, uy: Fraction, reach: Fraction) -> float:
    b, c = dx * ux + dy * uy, dx * dx + dy * dy - reach * reach
    if b >= 0:
        return math.inf
    if c <= 0:
        return 0.0
    d = b * b - (ux * ux + uy * uy) * c
    if d <= 0:
        return math.inf
    try:
        return float(c / (_root(d) - b))
    except OverflowError:
        return math.inf


def _root(square: Fraction) -> Fraction:
    """Return the root of a positive number, to `_ROOT_BITS` bits or so."""
    shift = _ROOT_BITS - _exponent(square) // 2
    return Fraction(math.isqrt(math.floor(square * Fraction(4) ** shift))) / Fraction(2) ** shift
