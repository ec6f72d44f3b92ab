"""How a disc moves while gravity presses it to a straight wall, by Coulomb's law: it slides, rolls or rests.

Per unit of mass, with n the wall's normal, t = n turned by -90 degrees (along the wall), u the speed along t, q = R w
the rim's, the slip ``s = u + q``, k the inertia factor, P > 0 gravity into the wall, a gravity along t, and friction f:

    u' = a - f,    q' = -f / k,    f in f_wall P sign(s).

Where s is 0 friction holds it there if it can, which takes ``f = a / (1 + 1/k)``: the disc rolls if
``|a| <= f_wall P (1 + 1/k)``, and slips off otherwise. The law has exactly one solution forward in time: contact gives
the disc no moment about the point of contact, and friction has no part along n. `docs/contact.md` derives it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

__all__ = ["Press", "Rates", "left_of_slip", "rates", "slip_ends"]


class Press(NamedTuple):
    """What presses a disc to a wall and what resists.

    Attributes:
        normal_m_s2: P, above 0: gravity into the wall.
        along_m_s2: a: gravity along the wall.
        friction: Coulomb's coefficient of the two, 0 or more.
        inverse_inertia_ratio: 1/k of the disc, 0 for one that does not turn.
    """

    normal_m_s2: float
    along_m_s2: float
    friction: float
    inverse_inertia_ratio: float

    @property
    def most_m_s2(self) -> float:
        """The most that friction can take off the slip's rate: ``f P (1 + 1/k)``."""
        return self.friction * self.normal_m_s2 * (1.0 + self.inverse_inertia_ratio)


class Rates(NamedTuple):
    """How speed along the wall and rim's speed change, and whether friction holds the slip at 0; m/s2."""

    along: float
    rim: float
    holds: bool


def rates(press: Press, slip: float) -> Rates:
    """Return the rates of a disc in contact.

    Args:
        press: The contact.
        slip: s, metres a second; 0 where it is 0 by the law, which rounding must not decide.
    """
    if slip == 0.0 and abs(press.along_m_s2) <= press.most_m_s2:
        friction = press.along_m_s2 / (1.0 + press.inverse_inertia_ratio)
        rim = -friction * press.inverse_inertia_ratio
        return Rates(-rim, rim, holds=True)
    friction = math.copysign(press.friction * press.normal_m_s2, slip if slip != 0.0 else press.along_m_s2)
    return Rates(press.along_m_s2 - friction, 0.0 - friction * press.inverse_inertia_ratio, holds=False)


def slip_ends(slip: float, rate: float) -> float:
    """Return after how many seconds a slip of this rate of change is 0; infinity for never."""
    return -slip / rate if slip != 0.0 and slip * rate < 0.0 else math.inf


def left_of_slip(press: Press, slip: float, approach: float, restitution: float) -> float:
    """Return the slip at the end of the infinitely many bounces that begin now.

    Bounce n comes at ``w e^n``: sliding, it takes ``C w e^n`` off the slip, ``C = f (1 + e)(1 + 1/k)``, and the hop
    after it adds ``2 a e w e^n / P``. So bounces that slide one way change the slip by
    ``(2 a e / P - C sign(s)) w / (1 - e)`` in all, and if a slip of that sign is left none of them holds it. Else one
    does, or it turns round in a hop, and from there on it is as small as the bounces are: nothing is said to be left.

    Args:
        press: The contact.
        slip: s before the first of them, metres a second.
        approach: w, the speed at which it comes.
        restitution: e, below 1.
    """
    if slip == 0.0:
        return 0.0
    most = press.friction * (1.0 + restitution) * (1.0 + press.inverse_inertia_ratio)
    a_hop = 2.0 * press.along_m_s2 * restitution / press.normal_m_s2
    if abs(slip) <= most * approach:  # held by the first of them; the second slides where the hop between gives more
        if abs(a_hop) <= most * restitution:
            return 0.0
        slip, approach = a_hop * approach, approach * restitution
    sign = math.copysign(1.0, slip)
    left = slip + (a_hop - sign * most) * approach / (1.0 - restitution)
    return left if left * sign > 0.0 else 0.0
