"""Impacts with friction on arrays, by the law of `core/impact_law.h`: many impacts at once, for comparisons.

Spins are given as speeds of rims, ``R w`` in metres a second, since the law adds them to velocities.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from carom.core.impact_law import resolve_impact

if TYPE_CHECKING:
    from numpy.typing import NDArray


class RoughBodies(NamedTuple):
    """All first bodies, or all second bodies, of `m` impacts. A wall has infinite mass.

    Attributes:
        velocity: Shape ``(m, 2)``.
        rim: ``R w``, counterclockwise, shape ``(m,)``.
        mass: Shape ``(m,)``.
        inertia: k of the moment of inertia k m R^2, infinity for a body that does not turn, shape ``(m,)``.
    """

    velocity: NDArray[np.float64]
    rim: NDArray[np.float64]
    mass: NDArray[np.float64]
    inertia: NDArray[np.float64]


class ContactFriction(NamedTuple):
    """Friction of two bodies.

    Attributes:
        friction: Coulomb's coefficient of friction, f, 0 or more.
        restitution: Tangential restitution b, -1 to 1. If the bodies stick, the slip after the impact is -b times the
            slip before.
    """

    friction: float = 0.0
    restitution: float = 0.0


class ContactFrictions(NamedTuple):
    """Friction of the bodies of `m` impacts, as `ContactFriction`; shape ``(m,)`` each."""

    friction: NDArray[np.float64]
    restitution: NDArray[np.float64]


class Branches(NamedTuple):
    """Impulses T of friction for bodies that stick, and for bodies that slide, newton seconds; shape ``(m,)`` each.

    Attributes:
        sticking: ``(1 + b) s / ((1 + 1/k1)/m1 + (1 + 1/k2)/m2)``.
        sliding: ``f J``, with the sign of the slip.
    """

    sticking: NDArray[np.float64]
    sliding: NDArray[np.float64]

    @property
    def law(self) -> NDArray[np.float64]:
        """The impulse that acts: the smaller one of the two."""
        return np.where(np.abs(self.sticking) > np.abs(self.sliding), self.sliding, self.sticking)


def branches(
    first: RoughBodies,
    second: RoughBodies,
    tangent: NDArray[np.float64],
    pressed: NDArray[np.float64],
    contacts: ContactFrictions,
) -> Branches:
    """Return the friction impulses of bodies that the normal impulses J, shape ``(m,)``, press together.

    `tangent` is the unit normal from first to second turned by +90 degrees, shape ``(m, 2)``.
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
    """Return the bodies just after their impacts. Bodies that do not approach are unchanged.

    Without friction, the velocities are the same as those of `carom.resolve_impact`, to the bit. `normal` is from first
    to second, of any length above 0, shape ``(m, 2)``. `restitution` is the restitution along the normal, shape
    ``(m,)``.
    """
    v1, v2 = resolve_impact(first.velocity, first.mass, second.velocity, second.mass, normal, restitution)
    unit = normal / np.hypot(normal[:, 0], normal[:, 1])[:, None]
    tangent = np.stack([-unit[:, 1], unit[:, 0]], axis=1)
    approach = np.sum((first.velocity - second.velocity) * unit, axis=1)
    pressed = (1.0 + restitution) * np.maximum(approach, 0.0) / (1.0 / first.mass + 1.0 / second.mass)
    tangential = branches(first, second, tangent, pressed, contacts).law
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
