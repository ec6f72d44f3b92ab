"""Conversion of balls to float64 numbers: below, above, or nearest, with a proven radius."""

from __future__ import annotations

import math

from flint import arb

#: Relative error of rounding to a float64, slightly increased.
ROUNDING = 2.0**-53 * (1.0 + 2.0**-40)
#: A ball that is accurate to this number of bits has a radius smaller than this increase.
NEGLIGIBLE_RADIUS_BITS = 100
#: Relative margin of a length or a speed: far above float64's rounding, yet so small that a search finds few more
#: pairs.
SLACK = 2.0**-40
#: A number far above subnormal numbers, and above numbers with subnormal rounding errors.
SMALLEST = 2.0**-900


def float_below(ball: arb) -> float:
    """Return a float64 no greater than any number in a ball, whose numbers are all 0 or more."""
    lower = ball.lower()
    value = float(lower)  # python-flint 0.9 rounds to the nearest, which may be above
    return value if value <= lower else math.nextafter(value, 0.0)


def float_above(ball: arb) -> float:
    """Return a float64 no less than any number in a ball."""
    upper = ball.upper()
    value = float(upper)
    return value if value >= upper else math.nextafter(value, math.inf)


def nearest(ball: arb) -> tuple[float, float]:
    """Return the float64 nearest to a ball's middle, and the greatest distance of the true value from it.

    `float(ball)` (python-flint 0.9 rounds to the nearest) leaves an exact rest of at most a unit in the last place.
    This rest is added with 53 bits, and the sum is rounded correctly. The radius has 30 bits, so it is a float64.
    """
    if ball.is_zero():
        return 0.0, 0.0
    high = float(ball)
    size = abs(high)
    if not SMALLEST < size < math.inf:
        return _nearest_out_of_range(ball)
    rest = ball - high
    low = float(rest)
    value = high + low
    if ball.rel_accuracy_bits() >= NEGLIGIBLE_RADIUS_BITS:
        exact = low == 0.0 and rest.is_zero()
        return value, 0.0 if exact else size * ROUNDING
    return value, math.nextafter(float(ball.rad()) + size * ROUNDING, math.inf)


def _nearest_out_of_range(ball: arb) -> tuple[float, float]:
    """Compute `nearest`, scaled by a power of two, if float64 has too few bits for the rest."""
    mantissa, exponent = ball.mid().man_exp()
    if mantissa == 0:
        return 0.0, math.nextafter(float(ball.rad()), math.inf)
    power = int(exponent) + int(mantissa).bit_length()
    scaled = nearest(ball * arb((1, -power)))
    value, radius = (math.ldexp(number, power) for number in scaled)
    if (math.ldexp(value, -power), math.ldexp(radius, -power)) != scaled:  # each is off by half of the least float
        radius = math.nextafter(radius, math.inf)
    return value, radius


def quotient(part: arb, length: arb) -> tuple[float, float]:
    """Return a float64 within 4 roundings of the quotient of two balls, and a bound of its error."""
    if part.is_zero():
        return 0.0, 0.0
    if min(part.rel_accuracy_bits(), length.rel_accuracy_bits()) >= NEGLIGIBLE_RADIUS_BITS:
        divided, divisor = float(part), float(length)
        value = divided / divisor  # each conversion is off by less than a unit, and the quotient by half a unit
        if min(abs(value), abs(divided), divisor) > SMALLEST:
            return value, abs(value) * 6.0 * ROUNDING
    return nearest(+(part / length))
