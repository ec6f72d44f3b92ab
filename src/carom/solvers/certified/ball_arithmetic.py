"""Conversion of intervals: from rational numbers, and to 64-bit floats with a proven error bound."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import NamedTuple

from flint import arb, fmpq

from carom.model.prescribed_motion import Drive

BallVector = tuple[arb, arb]

ZERO = arb(0)
#: Bound of the relative error of rounding to a 64-bit float. The bound is slightly larger than 2^-53.
ROUNDING = 2.0**-53 * (1.0 + 2.0**-40)
#: If an interval has at least this many accurate bits, its width is at most the amount by which `ROUNDING` exceeds
#: 2^-53.
NEGLIGIBLE_RADIUS_BITS = 100
#: Relative tolerance of lengths and speeds in a search. The tolerance is far above the rounding of 64-bit floats, but
#: so small that the search finds few additional pairs.
SLACK = 2.0**-40
#: If a float is above this limit, its rounding error is a normal float.
SMALLEST = 2.0**-900


def ball(number: Fraction) -> arb:
    """Return an interval that contains a rational number, with width 0 if the precision is sufficient."""
    return arb(fmpq(number.numerator, number.denominator))


def float_below(ball: arb) -> float:
    """Return a lower bound, as a 64-bit float, of an interval without negative numbers."""
    lower = ball.lower()
    value = float(lower)  # python-flint 0.9 rounds to nearest, so the result can be above `lower`
    return value if value <= lower else math.nextafter(value, 0.0)


def float_above(ball: arb) -> float:
    """Return an upper bound of an interval, as a 64-bit float."""
    upper = ball.upper()
    value = float(upper)
    return value if value >= upper else math.nextafter(value, math.inf)


def round_to_float(ball: arb) -> tuple[float, float]:
    """Return the 64-bit float nearest to an interval's midpoint, and a bound of its error.

    `float(ball)` can be off by a unit in the last place. To correct this error, the exact remainder is rounded to 53
    bits and added with correct rounding. The interval's radius has 30 bits, so a 64-bit float can store it.
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
    """Return the result of `round_to_float` for very small or large numbers, by scaling them to ordinary size."""
    mantissa, exponent = ball.mid().man_exp()
    if mantissa == 0:
        return 0.0, math.nextafter(float(ball.rad()), math.inf)
    power = int(exponent) + int(mantissa).bit_length()
    scaled = round_to_float(ball * arb((1, -power)))
    value, radius = (math.ldexp(number, power) for number in scaled)
    if (
        math.ldexp(value, -power),
        math.ldexp(radius, -power),
    ) != scaled:  # scaling back has rounded the number again
        radius = math.nextafter(radius, math.inf)
    return value, radius


def divide_to_float(part: arb, length: arb) -> tuple[float, float]:
    """Return a 64-bit float close to the quotient of two intervals, and a bound of its error."""
    if part.is_zero():
        return 0.0, 0.0
    if min(part.rel_accuracy_bits(), length.rel_accuracy_bits()) >= NEGLIGIBLE_RADIUS_BITS:
        divided, divisor = float(part), float(length)
        value = divided / divisor  # at most 5 roundings: at most 2 for each operand, and 1 for the division
        if min(abs(value), abs(divided), divisor) > SMALLEST:
            return value, abs(value) * 6.0 * ROUNDING
    return round_to_float(+(part / length))


class BallLeg(NamedTuple):
    """A part of a prescribed motion, from `begin_s` to `end_s`, in which the velocity is constant.

    At time t, the body's displacement since time 0 is ``(x, y) + t (vx, vy)``.
    """

    begin_s: float
    end_s: float
    x: arb
    y: arb
    vx: arb
    vy: arb

    def moved_at(self, time: arb) -> tuple[arb, arb]:
        """Return the displacement of the body since time 0."""
        return self.x + self.vx * time, self.y + self.vy * time


def legs_of(drive: Drive) -> tuple[BallLeg, ...]:
    """Return the parts of a prescribed motion. The displacement at the start of each part is an exact sum."""
    found, x, y = [], Fraction(0), Fraction(0)  # displacement minus velocity times time
    before = (Fraction(0), Fraction(0))
    for leg in drive.legs:
        begin, (u, v) = Fraction(leg.begin_s), map(Fraction, leg.velocity)
        x, y = x + (before[0] - u) * begin, y + (before[1] - v) * begin
        before = (u, v)
        found.append(BallLeg(leg.begin_s, leg.end_s, ball(x), ball(y), arb(leg.velocity[0]), arb(leg.velocity[1])))
    return tuple(found)
