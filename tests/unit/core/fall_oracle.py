"""Exact times of fall in rational numbers: an independent reference for the core.

A gap is a polynomial in time with rational coefficients: the squared distance of two centres minus the squared distance
of contact, or the distance from a straight wall. Its closings come from `carom.core.exact_quartic`.
"""

import math
from fractions import Fraction

from tests.unit.core.fall_cases import Encounter

from carom.core.exact_quartic import find_closings

NEVER = math.inf
#: Below this part of its terms the discriminant of a quadratic is too close to 0 for a bound on the error.
_DOUBTFUL = Fraction(2) ** -80


def compute_disc_time(case: Encounter) -> float:
    """Return the seconds until a falling disc touches a fixed one; infinity for never."""
    x, y, ux, uy, radius, fixed_x, fixed_y, fixed_radius, ax, ay = map(
        Fraction, (*case.disc, *case.fixed, *case.acceleration)
    )
    px, py, reach = x - fixed_x, y - fixed_y, radius + fixed_radius
    gap, opening = max(px * px + py * py - reach * reach, Fraction(0)), 2 * (px * ux + py * uy)
    if case.leaving is not None:
        gap, opening = Fraction(0), 2 * reach * Fraction(case.leaving)
    powers = [gap, opening, ux * ux + uy * uy + px * ax + py * ay, ux * ax + uy * ay, (ax * ax + ay * ay) / 4]
    try:
        return next(find_closings(powers), NEVER)
    except OverflowError:
        return NEVER


def solve_quadratic_time(gap: Fraction, speed: Fraction, pull: Fraction) -> float:
    """Return when a gap to a straight wall closes; one below 0, by rounding, is contact."""
    if gap < 0 and speed <= 0:
        gap = Fraction(0)
    if gap < 0 and pull < 0 and speed * speed <= 2 * gap * pull:
        return float(speed / -pull)
    return next(find_closings([gap, speed, pull / 2]), NEVER)


def is_doubtful(gap: Fraction, speed: Fraction, pull: Fraction) -> bool:
    """Return whether the apex of a parabola is so close to contact that its times are not known to some ulp."""
    return gap != 0 and abs(speed * speed - 2 * gap * pull) <= _DOUBTFUL * speed * speed
