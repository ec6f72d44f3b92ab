"""What friction does to two discs, or a disc and a wall, that collide: a clip between sticking and sliding.

With n the unit normal from body 1 to body 2, t = n turned by +90 degrees, spins w counterclockwise, moments of inertia
k m R^2 and a normal impulse J (`carom.physics.impact_law`), the surface of 1 moves past that of 2 at the slip

    s = (v1 - v2).t + R1 w1 + R2 w2,

and the impulse T, along -t on body 1 and t on body 2, takes the slip to -b times itself, as far as Coulomb's cone lets:

    T = clip((1 + b) s / ((1 + 1/k1)/m1 + (1 + 1/k2)/m2), -f J, f J),
    v1' = v1 - T t / m1,   v2' = v2 + T t / m2,   R1 w1' = R1 w1 - T / (k1 m1),   R2 w2' = R2 w2 - T / (k2 m2).

It is the law of three parameters (e, f, b) of Walton, Mech. Mater. 16 (1993) 239, and Foerster, Louge, Chang and Allia,
Phys. Fluids 6 (1994) 1108; b = 0 is Coulomb's law alone, b = 1 with enough friction Garwin's superball (Am. J. Phys. 37
(1969) 88). A wall, or an immovable disc, has 1/m = 0. `docs/spin.md` derives it; the compiled form is
`carom/core/impact.h`.
"""

from __future__ import annotations

from carom.physics.rough_impact import ContactFriction as ContactFriction


def tangential_impulse(contact: ContactFriction, slip: float, inverse_effective_mass: float, pressed: float) -> float:
    """Return the impulse T that friction gives.

    Args:
        contact: How the two rub.
        slip: s.
        inverse_effective_mass: By how much the slip falls for each unit of T, above 0:
            ``(1 + 1/k1)/m1 + (1 + 1/k2)/m2``.
        pressed: J, 0 or more. All of T, J and 1 / inverse_effective_mass may be in any one unit.
    """
    sticking = (1.0 + contact.restitution) * slip / inverse_effective_mass
    most = contact.friction * pressed
    if sticking > most:
        return most
    return -most if sticking < -most else sticking


def pair_tangential_impulse(
    contact: ContactFriction,
    dx: float,
    dy: float,
    ux: float,
    uy: float,
    surface: float,
    inverse_effective_mass: float,
    normal: float,
) -> float:
    """Return ``h = T / |d|``: with ``d = c2 - c1`` and ``u = v2 - v1`` friction gives the first disc ``h (dy, -dx)``.

    The second receives the opposite, and the spins change by ``-h |d| / (k m R)`` each. `surface` is
    ``|d| (R1 w1 + R2 w2)``, and `normal` the g of `carom.physics.impact_law.normal_impulse`: neither it nor this
    divides by the rounded length of d.
    """
    return tangential_impulse(
        contact, dy * ux - dx * uy + surface, (dx * dx + dy * dy) * inverse_effective_mass, -normal
    )
