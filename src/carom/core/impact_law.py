"""The law of impact for arrays: many impacts at once, with and without friction.

Without friction, the law is Newton's law of restitution with conservation of momentum. The impulse acts along the line
of centres only. With the unit normal ``n`` from first to second, the approach speed ``w = (v1 - v2).n`` and the
restitution ``e``,

    J = (1 + e) w / (1/m1 + 1/m2),   v1' = v1 - (J/m1) n,   v2' = v2 + (J/m2) n,

An infinite mass has ``1/m = 0``. See ``docs/theory/pic.md``.

With friction, the law is that of `core/impact_law.h`. Spins are given as rim speeds ``R w`` (radius times spin) in
m/s, because the law adds them to velocities.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from carom.errors import InputError
from carom.support.checks import check_floats, check_vectors
from carom.support.limits import LARGEST, SMALLEST, require_within

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


def resolve_impact(
    v1: ArrayLike, m1: ArrayLike, v2: ArrayLike, m2: ArrayLike, normal: ArrayLike, restitution: ArrayLike = 1.0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the velocities of both bodies just after an impact.

    Args:
        v1: Velocity of body 1 before the impact, in m/s; shape ``(..., 2)``.
        m1: Mass of body 1, in kilograms, above 0; infinity for an immovable body; shape ``(...)``.
        v2: Velocity of body 2 before the impact.
        m2: Mass of body 2; `m1` and `m2` must not both be infinite.
        normal: Direction from body 1 to body 2, of any length except zero; shape ``(..., 2)``.
        restitution: Coefficient of restitution, 0 to 1; shape ``(...)``.

    Returns:
        ``(v1', v2')``, each of the broadcast shape. Two bodies that do not approach have no impact, and their
        velocities are returned unchanged.

    Raises:
        InputError: A velocity or normal is not finite, a mass is not positive, both masses are infinite, or the
            restitution is outside 0 to 1. A velocity or mass is outside `carom.support.limits`. The shapes do not
            broadcast.

    Examples:
        >>> v1, v2 = carom.resolve_impact((1, 0), 1.0, (0, 0), 1.0, normal=(1, 0))
        >>> print(v1, v2)
        [0. 0.] [1. 0.]
    """
    velocity1, velocity2, direction = check_vectors("v1", v1), check_vectors("v2", v2), check_vectors("normal", normal)
    mass1, mass2, e = check_floats("m1", m1), check_floats("m2", m2), check_floats("restitution", restitution)
    for name, velocity in (("v1", velocity1), ("v2", velocity2)):
        require_within(name, velocity, 0.0, LARGEST)
    for name, mass in (("m1", mass1), ("m2", mass2)):
        if not np.all(mass > 0):  # false for NaN, too
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
    # Speeds are divided by about the greatest speed, and masses by about the smaller mass. So no intermediate result is
    # too large or too small for floats.
    speed = np.frexp(np.maximum(np.abs(velocity1), np.abs(velocity2)).max(axis=-1))[1]
    lighter = np.frexp(np.minimum(mass1, mass2))[1]
    inverse1, inverse2 = 1.0 / np.ldexp(mass1, -lighter), 1.0 / np.ldexp(mass2, -lighter)
    relative = np.ldexp(velocity1, -speed[..., None]) - np.ldexp(velocity2, -speed[..., None])
    approach = np.sum(relative * n, axis=-1)
    j = np.where(approach > 0, (1.0 + e) * approach / (inverse1 + inverse2), 0.0)
    first, second = (np.ldexp((j * inverse)[..., None] * n, speed[..., None]) for inverse in (inverse1, inverse2))
    return velocity1 - first, velocity2 + second


class RoughBodies(NamedTuple):
    """The first bodies, or the second bodies, of `m` impacts. A wall has infinite mass.

    Attributes:
        velocity: Velocities, in m/s, shape ``(m, 2)``.
        rim: Rim speeds ``R w`` (radius times spin), counterclockwise, in m/s, shape ``(m,)``.
        mass: Masses, in kilograms, shape ``(m,)``.
        inertia: The factors k in the moments of inertia ``k m R^2``; infinity for a body that does not turn; shape
            ``(m,)``.
    """

    velocity: NDArray[np.float64]
    rim: NDArray[np.float64]
    mass: NDArray[np.float64]
    inertia: NDArray[np.float64]


class ContactFriction(NamedTuple):
    """Friction between two bodies.

    Attributes:
        friction: Coulomb's coefficient of friction f, 0 or more.
        restitution: Tangential restitution b, -1 to 1. If friction is strong enough, the slip (the sliding speed of the
            surfaces) after the impact is -b times the slip before.
    """

    friction: float = 0.0
    restitution: float = 0.0


class ContactFrictions(NamedTuple):
    """Friction in `m` impacts. The two fields have the same meaning as in `ContactFriction`, and the shape `(m,)`."""

    friction: NDArray[np.float64]
    restitution: NDArray[np.float64]


class Branches(NamedTuple):
    """Friction impulses T for bodies that stick, and for bodies that slide, in newton seconds; shape ``(m,)`` each.

    Attributes:
        sticking: ``T = (1 + b) s / ((1 + 1/k1)/m1 + (1 + 1/k2)/m2)``, where s is the slip.
        sliding: ``T = f J``, with the sign of the slip.
    """

    sticking: NDArray[np.float64]
    sliding: NDArray[np.float64]

    @property
    def law(self) -> NDArray[np.float64]:
        """The friction impulses that act: for each impact, the smaller of `sticking` and `sliding` in magnitude."""
        return np.where(np.abs(self.sticking) > np.abs(self.sliding), self.sliding, self.sticking)


def compute_branches(
    first: RoughBodies,
    second: RoughBodies,
    tangent: NDArray[np.float64],
    pressed: NDArray[np.float64],
    contacts: ContactFrictions,
) -> Branches:
    """Return the friction impulses in impacts with the given normal impulses.

    `tangent` is the unit normal (from first to second) turned by +90 degrees, shape ``(m, 2)``. `pressed` contains the
    normal impulses J, shape ``(m,)``.
    """
    slip = np.sum((first.velocity - second.velocity) * tangent, axis=-1) + first.rim + second.rim
    inverse_effective_mass = (1.0 + 1.0 / first.inertia) / first.mass + (1.0 + 1.0 / second.inertia) / second.mass
    sticking = (1.0 + contacts.restitution) * slip / inverse_effective_mass
    return Branches(sticking, np.copysign(contacts.friction * pressed, sticking))


def resolve_rough_impact(
    first: RoughBodies,
    second: RoughBodies,
    normal: NDArray[np.float64],
    restitution: NDArray[np.float64],
    contacts: ContactFrictions,
) -> tuple[RoughBodies, RoughBodies]:
    """Return the bodies just after their impacts. Bodies that do not approach each other are unchanged.

    Without friction, the velocities are bit-identical to those of `carom.resolve_impact`. `normal` is from first to
    second, of any length above 0, shape ``(m, 2)``. `restitution` acts along the normal and has the shape ``(m,)``.
    """
    v1, v2 = resolve_impact(first.velocity, first.mass, second.velocity, second.mass, normal, restitution)
    unit = normal / np.hypot(normal[:, 0], normal[:, 1])[:, None]
    tangent = np.stack([-unit[:, 1], unit[:, 0]], axis=1)
    approach = np.sum((first.velocity - second.velocity) * unit, axis=1)
    normal_impulse = (1.0 + restitution) * np.maximum(approach, 0.0) / (1.0 / first.mass + 1.0 / second.mass)
    tangential = compute_branches(first, second, tangent, normal_impulse, contacts).law
    return (
        first._replace(
            velocity=v1 - (tangential / first.mass)[:, None] * tangent,
            rim=first.rim - tangential / (first.inertia * first.mass),
        ),
        second._replace(
            velocity=v2 + (tangential / second.mass)[:, None] * tangent,
            rim=second.rim - tangential / (second.inertia * second.mass),
        ),
    )
