"""Time of impact of two discs whose numbers are not of moderate size.

For such numbers, a fourth-degree term in the core's formulas could leave the range of floats. So such numbers are first
multiplied by powers of two, which is exact. If no power of two makes all of them moderate, the time is solved in
rational numbers.
"""

from __future__ import annotations

import math
from fractions import Fraction

from carom.core import primitives

#: Relative positions and velocities, and sums of radii, are of moderate size if their exponents (those of `math.frexp`)
#: are at most this in magnitude. `CAROM_PAIR_MOST` and `CAROM_PAIR_LEAST` of the core are the same limits.
_EXPONENT = 100
_MOST, _LEAST = 2.0**_EXPONENT, 2.0 ** -(_EXPONENT + 1)
#: Number of bits of a root: three more than a float has. So a time, rounded once at the end, has an error of at most an
#: eighth of a unit in its last place, in addition to the half of the rounding.
_ROOT_BITS = 56


def scaled_pair_time(
    x1: float, y1: float, vx1: float, vy1: float, r1: float, x2: float, y2: float, vx2: float, vy2: float, r2: float
) -> float:
    """Return the seconds until two discs collide, infinity beyond the largest float."""
    row = (x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2)
    dx, dy, reach = Fraction(x2) - Fraction(x1), Fraction(y2) - Fraction(y1), Fraction(r1) + Fraction(r2)
    ux, uy = Fraction(vx2) - Fraction(vx1), Fraction(vy2) - Fraction(vy1)
    length = _EXPONENT - _exponent(max(abs(dx), abs(dy), reach))
    speed = _EXPONENT - _exponent(max(abs(ux), abs(uy)))
    scaled = _scale(row, (length, length, speed, speed, length) * 2)
    if scaled is None or not _are_moderate(*(scaled[k + 5] - scaled[k] for k in range(4)), scaled[4] + scaled[9]):
        return _solve_rational(dx, dy, ux, uy, reach)
    try:
        return math.ldexp(primitives.pair_time(*scaled), speed - length)
    except OverflowError:
        return math.inf


def _are_moderate(*numbers: float) -> bool:
    return all(_LEAST <= abs(number) < _MOST or number == 0.0 for number in numbers)


def _exponent(number: Fraction) -> int:
    """Return the exponent of a number as `math.frexp` does. All denominators are powers of two."""
    return number.numerator.bit_length() - number.denominator.bit_length() + 1 if number else 0


def _scale(row: tuple[float, ...], exponents: tuple[int, ...]) -> tuple[float, ...] | None:
    """Return numbers multiplied by powers of two, or None if a product would be rounded."""
    try:
        scaled = tuple(math.ldexp(number, exponent) for number, exponent in zip(row, exponents, strict=True))
        exact = all(math.ldexp(scaled[k], -exponents[k]) == number for k, number in enumerate(row))
    except OverflowError:
        return None
    return scaled if exact else None


def _solve_rational(dx: Fraction, dy: Fraction, ux: Fraction, uy: Fraction, reach: Fraction) -> float:
    b, c = dx * ux + dy * uy, dx * dx + dy * dy - reach * reach
    if b >= 0:
        return math.inf
    if c <= 0:
        return 0.0
    d = b * b - (ux * ux + uy * uy) * c
    if d <= 0:
        return math.inf
    try:
        return float(c / (_compute_root(d) - b))
    except OverflowError:
        return math.inf


def _compute_root(square: Fraction) -> Fraction:
    """Return the root of a positive number, to about `_ROOT_BITS` bits."""
    shift = _ROOT_BITS - _exponent(square) // 2
    return Fraction(math.isqrt(math.floor(square * Fraction(4) ** shift))) / Fraction(2) ** shift
