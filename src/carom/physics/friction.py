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
`carom/solvers/impact/law.pxd`.
"""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["Grip", "friction_impulse", "pair_rub"]


class Grip(NamedTuple):
    """How two bodies rub against each other.

    Attributes:
        friction: Coulomb's coefficient f, 0 or more.
        restitution: b, -1 to 1: the slip after an impact in which they stick, over the one before, turned round.
    """

    friction: float = 0.0
    restitution: float = 0.0


def friction_impulse(grip: Grip, slip: float, yielding: float, pressed: float) -> float:
    """Return the impulse T that friction gives.

    Args:
        grip: How the two rub.
        slip: s.
        yielding: By how much the slip falls for each unit of T, above 0: ``(1 + 1/k1)/m1 + (1 + 1/k2)/m2``.
        pressed: J, 0 or more. All of T, J and 1 / yielding may be in any one unit.
    """
    held = (1.0 + grip.restitution) * slip / yielding
    most = grip.friction * pressed
    if held > most:
        return most
    return -most if held < -most else held


def pair_rub(
    grip: Grip, dx: float, dy: float, ux: float, uy: float, surface: float, yielding: float, push: float
) -> float:
    """Return ``g = T / |d|``: with ``d = c2 - c1`` and ``u = v2 - v1`` friction gives the first disc ``g (dy, -dx)``.

    The second receives the opposite, and the spins change by ``-g |d| / (k m R)`` each. `surface` is
    ``|d| (R1 w1 + R2 w2)``, and `push` that of `carom.physics.impact_law.pair_push`: neither it nor this divides by the
    rounded length of d.
    """
    return friction_impulse(grip, dy * ux - dx * uy + surface, (dx * dx + dy * dy) * yielding, -push)
