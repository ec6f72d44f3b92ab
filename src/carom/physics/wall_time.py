"""Time of impact of a disc and a wall in straight uniform motion, to within 2 units in the last place.

A wall is the half-plane ``(p - q).n >= 0`` of a point q and a unit normal n, taken as they are given. The disc's rim is
at ``gap = (p - q).n - r``, closes at ``-v.n``, and touches at their quotient. Offset, radius and products are carried
as error-free pairs: the plain form is off by up to 1e14 units in the last place near contact.
"""

from __future__ import annotations

import math

from carom.physics.double_double import Pair, sum_of_products, two_diff, two_prod
from carom.physics.pair_time import approach


def wall_gap(x: float, y: float, radius: float, qx: float, qy: float, nx: float, ny: float) -> Pair:
    """Return the distance of a disc's rim from a wall as a pair, metres; negative inside the wall."""
    dx, dx_rest = two_diff(x, qx)
    dy, dy_rest = two_diff(y, qy)
    return sum_of_products(((dx, nx), (dx_rest, nx), (dy, ny), (dy_rest, ny), (-radius, 1.0)))


def wall_speed(vx: float, vy: float, nx: float, ny: float) -> Pair:
    """Return the velocity along a wall's normal as a pair, metres a second; negative towards the wall."""
    return sum_of_products(((vx, nx), (vy, ny)))


def quotient(gap: Pair, speed: Pair) -> float:
    """Return ``-gap / speed`` of two pairs, corrected once by its residual."""
    t = -gap[0] / speed[0]
    product, rest = two_prod(t, speed[0])
    return t - (((gap[0] + product) + rest) + (gap[1] + t * speed[1])) / speed[0]


def wall_time(
    x: float, y: float, vx: float, vy: float, radius: float, qx: float, qy: float, nx: float, ny: float
) -> float:
    """Return the seconds until a disc touches a wall through ``(qx, qy)`` with the normal ``(nx, ny)``.

    0 where it touches or overlaps and approaches, infinity where it does not approach. Right to 2 ulp for lengths and
    speeds between 1e-250 and 1e290.
    """
    toward, error = approach(vx, vy, nx, ny)
    if toward > error:
        return math.inf
    speed = wall_speed(vx, vy, nx, ny)
    if not speed[0] < 0.0:
        return math.inf
    gap = wall_gap(x, y, radius, qx, qy, nx, ny)
    if gap[0] <= 0.0:
        return 0.0
    return quotient(gap, speed)
