"""Formulas by which the known answers of scenes are computed.

Vectors in the plane are complex numbers here. Multiplication by a number of length 1 rotates a vector, and ``abs(a)``
is the length of a. An answer computed by the tested code would prove nothing. So this module, and the modules that
import it, do not call Carom's physics code or solvers.
"""

from __future__ import annotations

import cmath
import math
from typing import NamedTuple


def dot(a: complex, b: complex) -> float:
    """Return the scalar product of two vectors."""
    return a.real * b.real + a.imag * b.imag


def unit(a: complex) -> complex:
    """Return the unit vector in the direction of a vector."""
    return a / abs(a)


def compute_normal(approach: complex, offset: float) -> complex:
    """Return the normal of an impact: the unit vector from the first to the second disc.

    Args:
        approach: Velocity of the first disc relative to the second.
        offset: Sine of the angle from the direction of approach to the normal; 0 for a head-on impact. If the offset is
            positive, the second disc is to the left of the path.
    """
    return unit(approach) * complex(math.sqrt(1.0 - offset * offset), offset)


def compute_after_impact(
    m1: float, v1: complex, m2: float, v2: complex, normal: complex, restitution: float = 1.0
) -> tuple[complex, complex]:
    """Return both velocities after an impact.

    Relative to the common centre of mass, the normal component of each velocity is multiplied by -e.

    Args:
        m1: Mass of the first disc, in kilograms.
        v1: Velocity of the first disc before the impact.
        m2: Mass of the second disc, in kilograms; infinity for an immovable disc.
        v2: Velocity of the second disc before the impact.
        normal: Unit vector from first to second.
        restitution: Coefficient of restitution e.
    """
    n1, n2 = dot(v1, normal), dot(v2, normal)
    centre = n2 if math.isinf(m2) else (m1 * n1 + m2 * n2) / (m1 + m2)
    bounce_factor = 1.0 + restitution
    return v1 + bounce_factor * (centre - n1) * normal, v2 + bounce_factor * (centre - n2) * normal


def compute_after_wall(velocity: complex, normal: complex, restitution: float = 1.0) -> complex:
    """Return the velocity after an impact on a wall: the component along the normal is multiplied by -e."""
    along = 1j * normal
    return dot(velocity, along) * along - restitution * dot(velocity, normal) * normal


def compute_fall(position: complex, velocity: complex, time_s: float, pull: complex) -> tuple[complex, complex]:
    """Return position and velocity after `time_s` seconds under a constant acceleration."""
    return position + velocity * time_s + pull * (time_s * time_s / 2), velocity + pull * time_s


class WedgeImpact(NamedTuple):
    """Impact of a moving point on a side of a wedge.

    Attributes:
        time_s: Seconds from the start.
        upper: True for an impact on the upper side of the wedge. The lower side is at angle 0.
        velocity: Velocity of the point after the impact.
    """

    time_s: float
    upper: bool
    velocity: complex


def compute_wedge_impacts(start: complex, velocity: complex, angle: float) -> list[WedgeImpact]:
    """Compute, by unfolding, all impacts of a point that moves in a wedge and is reflected by the wedge's two sides.

    At each impact, the wedge is mirrored at the side that the point hits, and the path continues straight
    ("unfolding"). The straight path crosses rays from the apex at 1, 2, 3, ... times the wedge's angle. The n-th
    crossing is at the time t at which ``(start + t velocity) exp(-i n angle)`` is real. In the original wedge, the
    velocity after the n-th impact is ``velocity exp(-i n angle)`` for even n, and ``conj(velocity) exp(i (n + 1)
    angle)`` for odd n.

    Args:
        start: Position of the point at the start. The apex of the wedge is at 0, and the argument of `start` is between
            0 and `angle`.
        velocity: Velocity of the point at the start. The point moves anticlockwise around the apex, so it hits the
            upper side first.
        angle: Angle of the wedge, below pi.
    """
    impacts = []
    n = 1
    # Seen from the apex, the point's angle approaches the angle of its velocity. So the path crosses only rays at
    # smaller angles than the angle of the velocity.
    while n * angle < cmath.phase(velocity) % math.tau:
        turn = cmath.exp(-1j * n * angle)
        time = -(start * turn).imag / (velocity * turn).imag
        folded = velocity * turn if n % 2 == 0 else velocity.conjugate() * cmath.exp(1j * (n + 1) * angle)
        impacts.append(WedgeImpact(time, n % 2 == 1, folded))
        n += 1
    return impacts
