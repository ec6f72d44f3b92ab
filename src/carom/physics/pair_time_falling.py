"""Time of impact of a falling disc and an immovable one, to the nearest float or its neighbour.

Seen from the immovable disc, the other moves on a parabola, and the squared distance less that of contact is a quartic
in t. Its roots are found in integers, exactly: every float is a fraction whose denominator is a power of two. Sturm's
theorem counts the roots in an interval; halving isolates the earliest at which the quartic turns negative, and goes on
until floats can't tell the ends apart. A root at which it only touches zero is a graze of zero depth, and no impact.

Source: J. C. F. Sturm's theorem with pseudo-remainders: D. E. Knuth, TAOCP vol. 2, 4.6.1, exercise 22.
"""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    Polynomial = list[int]  # lowest power first

__all__ = ["encounter_time", "first_fall_below_zero"]

#: Two bits more than a float has.
_BITS = 55


def encounter_time(
    disc: Sequence[float], fixed: Sequence[float], gravity: Sequence[float], leaving: float | None = None
) -> float:
    """Return the seconds until a falling `disc` (x, y, vx, vy, radius) touches an immovable one (x, y, radius).

    0 where they touch and approach, or touch, do not move apart and are pulled together; infinity for never.

    Where the disc has just hit the immovable one, `leaving` is the speed at which it leaves it: the gap is then 0 and
    this its rate of change, whatever rounding has made of position and velocity.
    """
    x, y, ux, uy, radius, fixed_x, fixed_y, fixed_radius, ax, ay = map(Fraction, (*disc, *fixed, *gravity))
    px, py, reach = x - fixed_x, y - fixed_y, radius + fixed_radius
    gap = px * px + py * py - reach * reach
    opening = 2 * (px * ux + py * uy)
    if leaving is not None:
        gap, opening = Fraction(0), 2 * reach * Fraction(leaving)
    if gap <= 0:
        if opening < 0:
            return 0.0
        gap = Fraction(0)
    powers = [gap, opening, ux * ux + uy * uy + px * ax + py * ay, ux * ax + uy * ay, (ax * ax + ay * ay) / 4]
    while powers and powers[0] == 0:  # in contact: what the gap does next is for the lowest power left to say
        del powers[0]
    if not powers:
        return math.inf
    if powers[0] < 0:
        return 0.0
    unit = max(power.denominator for power in powers)  # all are powers of two
    return first_fall_below_zero([int(power * unit) for power in powers])


def first_fall_below_zero(polynomial: Sequence[int]) -> float:
    """Return the least t > 0 at which a polynomial turns negative, infinity for never; it is above 0 at t = 0."""
    p = list(polynomial)
    while p[-1] == 0:
        del p[-1]
    chain = _sturm_chain(p)
    at_zero, at_infinity = _changes([q[0] for q in chain]), _changes([q[-1] for q in chain])
    if at_zero == at_infinity:
        return math.inf
    low, high, scale = 0, 1, 0  # the interval is from low to high, over 2^scale
    before = at_zero
    while _changes([_at(q, high, scale) for q in chain]) == before or _at(p, high, scale) == 0:
        high *= 2
    while True:
        after = _changes([_at(q, high, scale) for q in chain])
        if before - after == 1 and _at(p, high, scale) < 0:
            break
        if before - after <= 1:  # none, or one at which it only touches: go on behind
            if after == at_infinity:
                return math.inf
            low, before, high = high, after, high + max(high - low, 1)
            while _at(p, high, scale) == 0:
                high += 1
            continue
        low, high, scale = 2 * low, 2 * high, scale + 1
        middle = (low + high) // 2
        while _at(p, middle, scale) == 0:  # an end must not be a root
            low, high, middle, scale = 2 * low, 2 * high, 2 * middle + 1, scale + 1
        halfway = _changes([_at(q, middle, scale) for q in chain])
        if halfway == before:
            low = middle
        else:
            high = middle
    while (high - low) << _BITS > high:
        low, high, scale = 2 * low, 2 * high, scale + 1
        middle = (low + high) // 2
        if _at(p, middle, scale) < 0:
            high = middle
        else:
            low = middle
    return (low + high) / (1 << (scale + 1))


def _at(p: Polynomial, t: int, scale: int) -> int:
    """Return a positive multiple of the polynomial at ``t / 2^scale``."""
    value, shift = p[-1], 0
    for coefficient in p[-2::-1]:
        shift += scale
        value = value * t + (coefficient << shift)
    return value


def _changes(values: Sequence[int]) -> int:
    """Return the number of changes of sign, zeros left out."""
    signs = [value > 0 for value in values if value]
    return sum(a != b for a, b in pairwise(signs))


def _sturm_chain(p: Polynomial) -> list[Polynomial]:
    chain = [p, [k * c for k, c in enumerate(p)][1:]]
    while len(chain[-1]) > 1:
        rest = _negative_remainder(chain[-2], chain[-1])
        if not rest:
            break
        chain.append(rest)
    return [q for q in chain if q]


def _negative_remainder(a: Polynomial, b: Polynomial) -> Polynomial:
    """Return a positive multiple of minus the remainder of a by b."""
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
