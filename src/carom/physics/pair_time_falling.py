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
from typing import TYPE_CHECKING

from carom.physics.exact_quartic import find_closings as touches

if TYPE_CHECKING:
    from collections.abc import Sequence


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
