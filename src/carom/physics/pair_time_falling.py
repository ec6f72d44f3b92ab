"""Time of impact of a falling disc and an immovable one, to the nearest float or its neighbour.

Seen from the immovable disc, the other moves on a parabola, and the squared distance less that of contact is a quartic
in t. Its roots are found in integers, exactly: every float is a fraction whose denominator is a power of two. Sturm's
theorem counts the roots in an interval; halving isolates those at which the quartic turns negative, and goes on
until floats can't tell the ends apart. A root at which it only touches zero is a graze of zero depth, and no impact.

Source: J. C. F. Sturm's theorem with pseudo-remainders: D. E. Knuth, TAOCP vol. 2, 4.6.1, exercise 22.
"""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import islice, pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    Polynomial = list[int]  # lowest power first

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
    gap = squared_gap((px, py), (ux, uy), (ax, ay), reach, leaving)
    if gap[0] <= 0:
        gap[0] = Fraction(0)
    return next(touches(gap), math.inf)


def exact_fall(powers: Sequence[Sequence[tuple[float, float]]], begin: float, is_closed: bool, index: int) -> float:
    """Return an instant at which a gap closes, in seconds after `begin`; infinity if there are no more.

    Args:
        powers: Of each power of time, lowest first, numbers whose products sum up to it.
        begin: From when on, seconds.
        is_closed: Whether the gap is 0 then, whatever the powers say.
        index: Which of these instants, from 0; -1 for the sign of the gap at `begin` instead.
    """
    gap = [sum((Fraction(a) * Fraction(b) for a, b in products), Fraction(0)) for products in powers]
    start = Fraction(begin)
    for lowest in range(len(gap)):
        for k in reversed(range(lowest, len(gap) - 1)):
            gap[k] += start * gap[k + 1]
    if is_closed:
        gap[0] = Fraction(0)
    if index < 0:
        return float((gap[0] > 0) - (gap[0] < 0))
    return next(islice(touches(gap), index, None), math.inf)


def squared_gap(
    place: tuple[Fraction, Fraction],
    velocity: tuple[Fraction, Fraction],
    gravity: tuple[Fraction, Fraction],
    reach: Fraction,
    leaving: float | None = None,
) -> list[Fraction]:
    """Return the squared distance from the origin less that of `reach` as a quartic in time, lowest power first.

    Where `leaving` is a speed, the two have just touched, and leave each other at it.
    """
    (px, py), (ux, uy), (ax, ay) = place, velocity, gravity
    gap, opening = px * px + py * py - reach * reach, 2 * (px * ux + py * uy)
    if leaving is not None:
        gap, opening = Fraction(0), 2 * reach * Fraction(leaving)
    return [gap, opening, ux * ux + uy * uy + px * ax + py * ay, ux * ax + uy * ay, (ax * ax + ay * ay) / 4]


def touches(gap: Sequence[Fraction]) -> Iterator[float]:
    """Yield the instants from now on at which a gap closes; 0 where it is closed and does not open.

    It is a polynomial in time, lowest power first, whose denominators are powers of two. Below 0 now, it has to open
    first.
    """
    powers = list(gap)
    while powers and powers[0] == 0:  # in contact: what the gap does next is for the lowest power left to say
        del powers[0]
    if not powers:
        return
    if powers[0] < 0 and len(powers) < len(gap):
        yield 0.0
    unit = max(power.denominator for power in powers)  # all are powers of two
    yield from falls_below_zero([int(power * unit) for power in powers])


def falls_below_zero(polynomial: Sequence[int]) -> Iterator[float]:
    """Yield the instants t > 0 at which a polynomial turns negative, in their order; it is not 0 at t = 0."""
    p = list(polynomial)
    while p[-1] == 0:
        del p[-1]
    chain = _sturm_chain(p)
    at_infinity = _changes([q[-1] for q in chain])
    low, high, scale = 0, 1, 0  # the interval is from low to high, over 2^scale
    before = _changes([q[0] for q in chain])
    while before != at_infinity:
        while _changes([_at(q, high, scale) for q in chain]) == before or _at(p, high, scale) == 0:
            high *= 2
        while (before - (after := _changes([_at(q, high, scale) for q in chain]))) > 1:
            low, high, scale = 2 * low, 2 * high, scale + 1
            middle = (low + high) // 2
            while _at(p, middle, scale) == 0:  # an end must not be a root
                low, high, middle, scale = 2 * low, 2 * high, 2 * middle + 1, scale + 1
            halfway = _changes([_at(q, middle, scale) for q in chain])
            if halfway == before:
                low = middle
            else:
                high = middle
        if _at(p, low, scale) > 0 > _at(p, high, scale):  # and no touch of zero, nor a rise
            yield _bisected(p, low, high, scale)
        low, before, high = high, after, 2 * high


def _bisected(p: Polynomial, low: int, high: int, scale: int) -> float:
    """Return the one root between two instants at which a polynomial turns negative, to the nearest float or so."""
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
