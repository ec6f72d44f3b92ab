"""Until when a pair of bodies can't collide in PIT: a conservative bound on gap over closing speed.

The distance of two discs in straight motion is a convex function of time, so it never falls below its tangent: with the
present gap and the present closing speed, no contact comes before ``gap / closing speed``. Discs that separate go on
separating until one of them meets something. Both hold of the exact path; the discs of PIT are moved frame by frame and
rounded at each, so every comparison here keeps a margin that these roundings can't use up.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from carom.solvers.plain.bodies import Bodies

    Array = NDArray[np.float64]

__all__ = ["MARGIN", "MOST_FRAMES", "pair_free_until", "pairs_free_until", "wall_free_until", "walls_free_until"]

#: Bounds are thrown away after so many frames, which limits the roundings that a margin has to cover.
MOST_FRAMES = 2**20

#: In parts of the largest coordinate that a disc can reach. One frame, ``x + v dt``, rounds a coordinate three times
#: (step, product, sum), each by 2^-53 of it at most: two discs of two coordinates come to less than 2^-49.8, and
#: `MOST_FRAMES` of them to less than 2^-29.8.
MARGIN = 2.0**-29


def _until(now_s: float, wait_s: float) -> float:
    # Frame times and this sum are rounded, too.
    return (now_s + wait_s) * (1.0 - MARGIN)


def pair_free_until(bodies: Bodies, i: int, j: int, now_s: float, horizon_s: float) -> float:
    """Return a time before which discs `i` and `j` can't collide on their present paths, infinity for never.

    Args:
        bodies: Positions and velocities at `now_s`.
        i: A disc.
        j: Another.
        now_s: The present frame, seconds.
        horizon_s: For how long any disc is moved, seconds.
    """
    x, y, vx, vy = bodies.x, bodies.y, bodies.vx, bodies.vy
    dx, dy, ux, uy = x[j] - x[i], y[j] - y[i], vx[j] - vx[i], vy[j] - vy[i]
    speed = math.hypot(ux, uy)
    if speed == 0.0:
        return math.inf
    reach = abs(x[i]) + abs(y[i]) + abs(x[j]) + abs(y[j])
    reach += (abs(vx[i]) + abs(vy[i]) + abs(vx[j]) + abs(vy[j])) * horizon_s
    margin = MARGIN * (reach + bodies.radius[i] + bodies.radius[j])
    along = dx * ux + dy * uy
    if along >= 0.0:
        return math.inf if along > margin * speed else now_s
    distance = math.hypot(dx, dy)
    gap = distance - (bodies.radius[i] + bodies.radius[j]) - margin
    if not gap > 0.0:
        return now_s
    return _until(now_s, gap / (MARGIN * speed - along / distance))


def wall_free_until(bodies: Bodies, i: int, k: int, now_s: float, horizon_s: float) -> float:
    """Return a time before which disc `i` can't collide with wall `k` on its present path, infinity for never."""
    px, py, nx, ny = bodies.walls[k]
    along = bodies.vx[i] * nx + bodies.vy[i] * ny
    if along >= 0.0:  # the very number that PIT tests
        return math.inf
    reach = abs(bodies.x[i]) + abs(bodies.y[i]) + (abs(bodies.vx[i]) + abs(bodies.vy[i])) * horizon_s
    margin = MARGIN * (reach + abs(px) + abs(py) + bodies.radius[i])
    gap = (bodies.x[i] - px) * nx + (bodies.y[i] - py) * ny - bodies.radius[i] - margin
    return _until(now_s, gap / (MARGIN * math.hypot(bodies.vx[i], bodies.vy[i]) - along)) if gap > 0.0 else now_s


def pairs_free_until(
    dx: Array, dy: Array, ux: Array, uy: Array, contact: Array, reach: Array, now_s: float
) -> tuple[Array, NDArray[np.bool_]]:
    """Return `pair_free_until` of arrays, and which pairs approach within reach of an overlap at the present frame.

    Args:
        dx: Centre of the second less that of the first, x, metres; `dy` likewise.
        dy: See `dx`.
        ux: Velocity of the second less that of the first, x, metres a second; `uy` likewise.
        uy: See `ux`.
        contact: Sums of the radii, metres.
        reach: Sums of the coordinates that both can reach, by magnitude, metres.
        now_s: The present frame, seconds.
    """
    along, speed, distance = dx * ux + dy * uy, np.hypot(ux, uy), np.hypot(dx, dy)
    margin = MARGIN * (reach + contact)
    gap = distance - contact - margin
    approaching = along < 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        wait = _until_array(now_s, gap / (MARGIN * speed - along / distance))
    free = np.where(gap > 0.0, wait, now_s)
    apart = np.where((along > margin * speed) | (speed == 0.0), math.inf, now_s)
    return np.where(approaching, free, apart), approaching & ~(gap > 0.0)


def walls_free_until(
    depth: Array, along: Array, speed: Array, radius: Array, reach: Array, now_s: float
) -> tuple[Array, NDArray[np.bool_]]:
    """Return `wall_free_until` of arrays, and which discs approach within reach of an overlap at the present frame.

    Args:
        depth: Distances of the centres from the wall, metres.
        along: Velocities along the wall's normal, metres a second.
        speed: Speeds, metres a second.
        radius: Radii, metres.
        reach: Sums of the coordinates that a disc can reach and of the wall's, by magnitude, metres.
        now_s: The present frame, seconds.
    """
    gap = depth - radius - MARGIN * (reach + radius)
    approaching = along < 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        wait = _until_array(now_s, gap / (MARGIN * speed - along))
    free = np.where(gap > 0.0, wait, now_s)
    return np.where(approaching, free, math.inf), approaching & ~(gap > 0.0)


def _until_array(now_s: float, wait_s: Array) -> Array:
    return (now_s + wait_s) * (1.0 - MARGIN)
