"""The impact of two rough rigid bodies in rational numbers, from Newton's laws alone: no code of Carom's.

Two rigid bodies touch at one point. An impulse P there changes velocities by P/m and spins by r x P / I, with r from
the centre to the point. So the velocity of one surface past the other changes by K P, K a symmetric 2 x 2 matrix. The
conditions on P are linear equations, whatever shape K has. The normal velocity is reversed by e. Where the bodies hold
each other the tangential one is reversed by b. If that takes more than Coulomb's cone allows, P is on the cone's edge,
against the slip.
"""

import math
from fractions import Fraction
from typing import NamedTuple

Vector = tuple[Fraction, Fraction]
Number = Fraction | int | float


class Law(NamedTuple):
    """Coefficients of an impact."""

    e: Number
    friction: Number
    b: Number


class Body(NamedTuple):
    """A body in contact: of infinite mass or inertia it is not moved or turned; `arm` leads from its centre there."""

    velocity: tuple[Number, Number]
    spin: Number
    mass: Number
    inertia: Number
    arm: tuple[Number, Number]


def _exact(vector: tuple[Number, Number]) -> Vector:
    return Fraction(vector[0]), Fraction(vector[1])


def _inverse(number: Number) -> Fraction:
    return Fraction(0) if number == math.inf else 1 / Fraction(number)


def _surface_velocity(body: Body) -> Vector:
    (vx, vy), (rx, ry), w = _exact(body.velocity), _exact(body.arm), Fraction(body.spin)
    return vx - w * ry, vy + w * rx


def _velocity_changes(body: Body, px: Fraction, py: Fraction) -> tuple[Vector, Fraction, Vector]:
    """Return the changes of velocity, spin and surface velocity that an impulse at the point of contact gives."""
    (rx, ry), im, ii = _exact(body.arm), _inverse(body.mass), _inverse(body.inertia)
    spin = (rx * py - ry * px) * ii
    return (px * im, py * im), spin, (px * im - spin * ry, py * im + spin * rx)


def resolve_exact_impact(one: Body, other: Body, normal: tuple[Number, Number], law: Law) -> tuple[Body, Body, bool]:
    """Return both bodies after their impact, and whether they slide in it.

    `normal` is a vector of any length from the first to the second.
    """
    nx, ny = _exact(normal)
    axes = ((nx, ny), (-ny, nx))  # both of one length, which cancels
    u = [a - b for a, b in zip(_surface_velocity(one), _surface_velocity(other), strict=True)]
    approach, slip = (u[0] * x + u[1] * y for x, y in axes)
    if approach <= 0:
        return one, other, False

    def change(p: Fraction, q: Fraction) -> tuple[Fraction, Fraction]:
        """Return by how much an impulse, p along the normal and q across it, lowers approach and slip."""
        px, py = p * axes[0][0] + q * axes[1][0], p * axes[0][1] + q * axes[1][1]
        d = [a + b for a, b in zip(_velocity_changes(one, px, py)[2], _velocity_changes(other, px, py)[2], strict=True)]
        return d[0] * axes[0][0] + d[1] * axes[0][1], d[0] * axes[1][0] + d[1] * axes[1][1]

    (nn, tn), (nt, tt) = change(Fraction(1), Fraction(0)), change(Fraction(0), Fraction(1))
    wanted = (1 + Fraction(law.e)) * approach, (1 + Fraction(law.b)) * slip
    determinant = nn * tt - nt * tn
    p = (wanted[0] * tt - nt * wanted[1]) / determinant
    q = (nn * wanted[1] - tn * wanted[0]) / determinant
    friction = Fraction(law.friction)
    slides = abs(q) > friction * p
    if slides:  # it slides: q = side * friction * p, and the normal velocity still ends as e asks
        side = friction if slip > 0 else -friction
        p = wanted[0] / (nn + side * nt)
        q = side * p
    px, py = p * axes[0][0] + q * axes[1][0], p * axes[0][1] + q * axes[1][1]
    return _apply_impulse(one, -px, -py), _apply_impulse(other, px, py), slides


def _apply_impulse(body: Body, px: Fraction, py: Fraction) -> Body:
    (dx, dy), dw, _ = _velocity_changes(body, px, py)
    (vx, vy), w = body.velocity, body.spin
    return body._replace(velocity=(Fraction(vx) + dx, Fraction(vy) + dy), spin=Fraction(w) + dw)
