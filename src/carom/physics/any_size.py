"""Time of impact of two discs whose numbers are too large, too small, or too far apart for floating-point formulas.

`carom.physics.pair_time` is right where no term of its fourth-degree formulas, and no rounding error of one, leaves the
range of floats. Numbers of other sizes are brought there by powers of two, which round nothing, if they are near enough
to each other. What is left is solved in rational numbers.
"""

from __future__ import annotations

import math
from fractions import Fraction

from carom.physics.pair_time import pair_time

__all__ = ["EXPONENT", "any_pair_time", "is_ordinary"]

#: Numbers below two to this, and from two to minus this (and one more) on, are ordinary: a square's square, and its
#: rounding error, are well within the range of floats.
EXPONENT = 100
_MOST, _LEAST = 2.0**EXPONENT, 2.0 ** -(EXPONENT + 1)
#: Bits to which a root is taken: twice those of a float, and some.
_ROOT_BITS = 120


def is_ordinary(*numbers: float) -> bool:
    """Return whether numbers are 0 or of an ordinary size."""
    return all(_LEAST <= abs(number) < _MOST or number == 0.0 for number in numbers)


def any_pair_time(
    x1: float, y1: float, vx1: float, vy1: float, r1: float, x2: float, y2: float, vx2: float, vy2: float, r2: float
) -> float:
    """Return the seconds until two discs collide, whatever the size of the numbers; arguments as for `pair_time`.

    Returns:
        0 where they touch or overlap and approach; infinity where they never meet, or only after more seconds than the
        largest float.
    """
    length, lengths_fit = _power((x1, y1, r1, x2, y2, r2))
    speed, speeds_fit = _power((vx1, vy1, vx2, vy2))
    if not (lengths_fit and speeds_fit):
        return _rational(x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2)
    first = (*_scaled(length, x1, y1), *_scaled(speed, vx1, vy1), *_scaled(length, r1))
    second = (*_scaled(length, x2, y2), *_scaled(speed, vx2, vy2), *_scaled(length, r2))
    time = pair_time(*first, *second)
    try:
        return math.ldexp(time, speed - length)
    except OverflowError:
        return math.inf


def _power(numbers: tuple[float, ...]) -> tuple[int, bool]:
    """Return the power of two that makes the largest as large as is ordinary, and whether that makes all ordinary."""
    exponents = [math.frexp(number)[1] for number in numbers if number != 0.0] or [0]
    return EXPONENT - max(exponents), max(exponents) - min(exponents) <= 2 * EXPONENT


def _scaled(exponent: int, *numbers: float) -> tuple[float, ...]:
    return tuple(math.ldexp(number, exponent) for number in numbers)


def _rational(
    x1: float, y1: float, vx1: float, vy1: float, r1: float, x2: float, y2: float, vx2: float, vy2: float, r2: float
) -> float:
    dx, dy = Fraction(x2) - Fraction(x1), Fraction(y2) - Fraction(y1)
    ux, uy = Fraction(vx2) - Fraction(vx1), Fraction(vy2) - Fraction(vy1)
    reach = Fraction(r1) + Fraction(r2)
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
    """Return the root of a positive number, to `_ROOT_BITS` bits or more."""
    bits = square.numerator.bit_length() - square.denominator.bit_length()
    shift = _ROOT_BITS - bits // 2
    scaled = square * Fraction(4) ** shift
    return Fraction(math.isqrt(math.floor(scaled))) / Fraction(2) ** shift
