"""Velocities just after a frictionless impact: Newton's law of restitution with conservation of momentum.

The impulse acts along the line of centres only. With unit normal ``n`` from first to second, approach speed
``w = (v1 - v2).n`` and restitution ``e``,

    J = (1 + e) w / (1/m1 + 1/m2),   v1' = v1 - (J/m1) n,   v2' = v2 + (J/m2) n,

which conserves momentum, turns the normal relative velocity into ``-e`` times itself, and, for ``e = 1``, conserves
kinetic energy. An infinite mass has ``1/m = 0``. The source paper leaves this formula out; see ``docs/theory/pic.md``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.errors import InputError
from carom.support.checks import floats, vectors
from carom.support.limits import LARGEST, SMALLEST, require_within

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


def resolve_impact(
    v1: ArrayLike, m1: ArrayLike, v2: ArrayLike, m2: ArrayLike, normal: ArrayLike, restitution: ArrayLike = 1.0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the velocities of both bodies just after an impact.

    Args:
        v1: Velocity of body 1 before, metres a second; shape ``(..., 2)``.
        m1: Mass of body 1, kilograms, above 0; infinity is immovable; shape ``(...)``.
        v2: Velocity of body 2 before.
        m2: Mass of body 2; not both may be infinite.
        normal: Direction from body 1 to body 2; shape ``(..., 2)``; its length does not matter, but must not be zero.
        restitution: Coefficient of restitution, 0 to 1; shape ``(...)``.

    Returns:
        ``(v1', v2')``, each of the broadcast shape. Bodies that do not approach are returned unchanged: there is no
        impact between them.

    Raises:
        InputError: A velocity or normal is not finite, a mass is not positive, both are infinite, or the restitution
            is outside 0 to 1; a velocity or mass is not within `carom.support.limits`; or the shapes do not broadcast.

    Examples:
        >>> v1, v2 = carom.resolve_impact((1, 0), 1.0, (0, 0), 1.0, normal=(1, 0))
        >>> print(v1, v2)
        [0. 0.] [1. 0.]
    """
    velocity1, velocity2, direction = vectors("v1", v1), vectors("v2", v2), vectors("normal", normal)
    mass1, mass2, e = floats("m1", m1), floats("m2", m2), floats("restitution", restitution)
    for name, velocity in (("v1", velocity1), ("v2", velocity2)):
        require_within(name, velocity, 0.0, LARGEST)
    for name, mass in (("m1", mass1), ("m2", mass2)):
        if not np.all(mass > 0):  # NaN fails this too
            raise InputError(f"{name} must be above 0 (infinity is immovable), got {mass[~(mass > 0)].flat[0]}")
        require_within(name, mass[np.isfinite(mass)], SMALLEST, LARGEST)
    if not np.all((e >= 0) & (e <= 1)):
        raise InputError(f"restitution must be from 0 to 1, got {e[~((e >= 0) & (e <= 1))].flat[0]}")
    scale = np.max(np.abs(direction), axis=-1, keepdims=True)
    if not np.all(scale > 0):
        raise InputError("normal must not be of length zero")
    try:
        np.broadcast_shapes(
            velocity1.shape[:-1], velocity2.shape[:-1], direction.shape[:-1], mass1.shape, mass2.shape, e.shape
        )
    except ValueError as error:
        raise InputError(f"the shapes of v1, m1, v2, m2, normal and restitution do not broadcast: {error}") from None
    if np.any(np.isinf(mass1) & np.isinf(mass2)):
        raise InputError("m1 and m2 must not both be infinite: two immovable bodies never collide")
    direction = direction / scale
    n = direction / np.hypot(direction[..., :1], direction[..., 1:])
    # With the fastest body's speed and the lighter body's mass as approximate units, no intermediate result under- or
    # overflows.
    speed = np.frexp(np.maximum(np.abs(velocity1), np.abs(velocity2)).max(axis=-1))[1]
    lighter = np.frexp(np.minimum(mass1, mass2))[1]
    inverse1, inverse2 = 1.0 / np.ldexp(mass1, -lighter), 1.0 / np.ldexp(mass2, -lighter)
    relative = np.ldexp(velocity1, -speed[..., None]) - np.ldexp(velocity2, -speed[..., None])
    approach = np.sum(relative * n, axis=-1)
    j = np.where(approach > 0, (1.0 + e) * approach / (inverse1 + inverse2), 0.0)
    first, second = (np.ldexp((j * inverse)[..., None] * n, speed[..., None]) for inverse in (inverse1, inverse2))
    return velocity1 - first, velocity2 + second
