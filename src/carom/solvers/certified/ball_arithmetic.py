"""Balls: conversion from rational numbers, conversion to float64 numbers with a proven radius, and driven paths."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING, NamedTuple

from flint import arb, fmpq

if TYPE_CHECKING:
    from carom.model.prescribed_motion import Drive

ZERO = arb(0)
#: Relative error of rounding to a float64, slightly increased.
ROUNDING = 2.0**-53 * (1.0 + 2.0**-40)
#: If a ball has at least this many accurate bits, the increase of `ROUNDING` covers the ball's radius.
NEGLIGIBLE_RADIUS_BITS = 100
#: Relative margin of a length or a speed: far above float64 rounding, but small enough to add few pairs to a search.
SLACK = 2.0**-40
#: A number far above all numbers that are subnormal or have subnormal rounding errors.
SMALLEST = 2.0**-900


def ball(number: Fraction) -> arb:
    """Return a ball that contains a rational number. The ball is exact if the working precision is sufficient."""
    return arb(fmpq(number.numerator, number.denominator))


def float_below(ball: arb) -> float:
    """Return a float64 lower bound of a ball that has no negative numbers."""
    lower = ball.lower()
    value = float(lower)  # python-flint 0.9 rounds to nearest, so the result can be above `lower`
    return value if value <= lower else math.nextafter(value, 0.0)


def float_above(ball: arb) -> float:
    """Return a float64 upper bound of a ball."""
    upper = ball.upper()
    value = float(upper)
    return value if value >= upper else math.nextafter(value, math.inf)


def round_to_float(ball: arb) -> tuple[float, float]:
    """Return the float64 nearest to a ball's midpoint, and a bound of its error.

    `float(ball)` can be off by a unit in the last place. To correct this error, the exact remainder is rounded to 53
    bits and added with correct rounding. A ball's radius has 30 bits, so it is a float64.
    """
    if ball.is_zero():
        return 0.0, 0.0
    high = float(ball)
    size = abs(high)
    if not SMALLEST < size < math.inf:
        return _round_out_of_range(ball)
    rest = ball - high
    low = float(rest)
    value = high + low
    if ball.rel_accuracy_bits() >= NEGLIGIBLE_RADIUS_BITS:
        exact = low == 0.0 and rest.is_zero()
        return value, 0.0 if exact else size * ROUNDING
    return value, math.nextafter(float(ball.rad()) + size * ROUNDING, math.inf)


def _round_out_of_range(ball: arb) -> tuple[float, float]:
    """Compute `round_to_float` of a very small or large ball, which must be scaled to avoid subnormal remainders."""
    mantissa, exponent = ball.mid().man_exp()
    if mantissa == 0:
        return 0.0, math.nextafter(float(ball.rad()), math.inf)
    power = int(exponent) + int(mantissa).bit_length()
    scaled = round_to_float(ball * arb((1, -power)))
    value, radius = (math.ldexp(number, power) for number in scaled)
    if (
        math.ldexp(value, -power),
        math.ldexp(radius, -power),
    ) != scaled:  # scaling back has rounded to a subnormal number
        radius = math.nextafter(radius, math.inf)
    return value, radius


def divide_to_float(part: arb, length: arb) -> tuple[float, float]:
    """Return a float64 close to the quotient of two balls, and a bound of its error."""
    if part.is_zero():
        return 0.0, 0.0
    if min(part.rel_accuracy_bits(), length.rel_accuracy_bits()) >= NEGLIGIBLE_RADIUS_BITS:
        divided, divisor = float(part), float(length)
        value = divided / divisor  # at most 5 roundings: less than 2 from each operand, and 1 from the division
        if min(abs(value), abs(divided), divisor) > SMALLEST:
            return value, abs(value) * 6.0 * ROUNDING
    return round_to_float(+(part / length))


class BallLeg(NamedTuple):
    """A leg of a driven body, from `begin_s` to `end_s`. At time t the body's displacement is (x, y) + t (vx, vy)."""

    begin_s: float
    end_s: float
    x: arb
    y: arb
    vx: arb
    vy: arb

    def moved_at(self, time: arb) -> tuple[arb, arb]:
        """Return the displacement of the body at a time."""
        return self.x + self.vx * time, self.y + self.vy * time


def legs_of(drive: Drive) -> tuple[BallLeg, ...]:
    """Return the legs of a path. Displacements at the start of legs are exact sums of the previous legs."""
    found, x, y = [], Fraction(0), Fraction(0)  # displacement minus velocity times time
    before = (Fraction(0), Fraction(0))
    for leg in drive.legs:
        begin, (u, v) = Fraction(leg.begin_s), map(Fraction, leg.velocity)
        x, y = x + (before[0] - u) * begin, y + (before[1] - v) * begin
        before = (u, v)
        found.append(BallLeg(leg.begin_s, leg.end_s, ball(x), ball(y), arb(leg.velocity[0]), arb(leg.velocity[1])))
    return tuple(found)
