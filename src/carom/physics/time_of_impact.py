"""Time of impact of two discs, and of a disc and a wall, in straight uniform motion.

With ``d = c2 - c1``, ``u = v2 - v1`` and ``R = r1 + r2`` the discs touch when ``|d + t u| = R``, that is

    a t^2 + 2 b t + c = 0,   a = u.u,   b = d.u,   c = d.d - R^2 = (|d| - R)(|d| + R).

They can only collide while approaching (``b < 0``). Apart (``c > 0``) and with ``D = b^2 - a c > 0``, the earlier root
is ``t = c / (-b + sqrt(D))``: of the two ways of writing that root this one adds numbers of one sign, so nothing
cancels. ``D`` itself is taken as ``a R^2 - (d x u)^2``, equal by Lagrange's identity, because ``b^2 - a c`` loses the
miss distance of discs that are far apart. The derivation is in ``docs/physics.md``, what the source paper prints
differently in ``docs/errata.md``.

Whether bodies approach decides everything; no time or distance is ever compared with a small number.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = ["pair_time", "time_of_impact", "wall_time"]


def pair_time(dx: float, dy: float, ux: float, uy: float, contact_distance: float) -> float:
    """Seconds until two discs touch; the scalar form, of relative position `d` and relative velocity `u`.

    Args:
        dx: Centre of the second less that of the first, x, metres.
        dy: The same, y.
        ux: Velocity of the second less that of the first, x, metres a second.
        uy: The same, y.
        contact_distance: Sum of the radii, metres.

    Returns:
        0 where they touch or overlap and approach; infinity where they never meet (a graze of zero depth, ``D = 0``,
        exchanges no momentum and is no impact).
    """
    b = dx * ux + dy * uy
    if not b < 0.0:
        return math.inf
    distance = math.hypot(dx, dy)
    c = (distance - contact_distance) * (distance + contact_distance)
    if c <= 0.0:
        return 0.0
    cross = dx * uy - dy * ux
    discriminant = (ux * ux + uy * uy) * contact_distance * contact_distance - cross * cross
    if not discriminant > 0.0:
        return math.inf
    return c / (math.sqrt(discriminant) - b)


def wall_time(gap: float, normal_velocity: float) -> float:
    """Seconds until a disc touches a wall.

    Args:
        gap: Distance of the disc's rim from the wall's surface, metres; negative inside the wall.
        normal_velocity: Velocity along the wall's normal, metres a second; negative towards the wall.

    Returns:
        0 where it touches or overlaps and approaches, infinity where it does not approach.
    """
    if not normal_velocity < 0.0:
        return math.inf
    return max(gap, 0.0) / -normal_velocity


def time_of_impact(
    p1: ArrayLike, v1: ArrayLike, r1: ArrayLike, p2: ArrayLike, v2: ArrayLike, r2: ArrayLike
) -> NDArray[np.float64] | float:
    """Return the seconds from now until discs 1 and 2 collide.

    Args:
        p1: Centre of disc 1, metres; shape ``(..., 2)``.
        v1: Velocity of disc 1, metres a second; shape ``(..., 2)``.
        r1: Radius of disc 1, metres; shape ``(...)``.
        p2: Centre of disc 2.
        v2: Velocity of disc 2.
        r2: Radius of disc 2.

    Returns:
        The broadcast shape of all (a float where none is an array): 0 where the discs touch or overlap and approach,
        infinity where they never collide.

    Raises:
        InputError: A value is not finite, a radius is not positive, or a last axis is not of length 2.
    """
    position1, velocity1 = _vectors("p1", p1), _vectors("v1", v1)
    position2, velocity2 = _vectors("p2", p2), _vectors("v2", v2)
    radius1, radius2 = _radii("r1", r1), _radii("r2", r2)
    try:
        with np.errstate(over="ignore"):
            d, u = np.broadcast_arrays(position2 - position1, velocity2 - velocity1)
            contact_distance = radius1 + radius2
        np.broadcast_shapes(d.shape[:-1], contact_distance.shape)
    except ValueError as error:
        raise InputError(f"the shapes of positions, velocities and radii do not broadcast: {error}") from None
    dx, dy, ux, uy = d[..., 0], d[..., 1], u[..., 0], u[..., 1]
    with np.errstate(all="ignore"):  # as silent as the scalar form: what is no root is sorted out below
        b = dx * ux + dy * uy
        distance = np.hypot(dx, dy)
        c = (distance - contact_distance) * (distance + contact_distance)
        cross = dx * uy - dy * ux
        discriminant = (ux * ux + uy * uy) * contact_distance * contact_distance - cross * cross
        approaching = b < 0.0
        root = c / (np.sqrt(discriminant) - b)
    time = np.where(approaching & (discriminant > 0.0), root, math.inf)
    time = np.where(approaching & (c <= 0.0), 0.0, time)
    return time if time.ndim else float(time)


def _vectors(name: str, value: ArrayLike) -> NDArray[np.float64]:
    array = _finite(name, value)
    if array.ndim == 0 or array.shape[-1] != 2:
        raise InputError(f"{name} must have x and y along its last axis, got shape {array.shape}")
    return array


def _radii(name: str, value: ArrayLike) -> NDArray[np.float64]:
    array = _finite(name, value)
    if not np.all(array > 0):
        raise InputError(f"{name} must be above 0 everywhere, got {np.min(array)}")
    return array


def _finite(name: str, value: ArrayLike) -> NDArray[np.float64]:
    try:
        array: NDArray[Any] = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} must be numbers: {error}") from None
    if not np.all(np.isfinite(array)):
        raise InputError(f"{name} must be finite everywhere, got {array[~np.isfinite(array)].flat[0]}")
    return array
