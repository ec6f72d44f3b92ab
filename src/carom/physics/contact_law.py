"""How a disc moves while gravity presses it to a straight wall, by Coulomb's law: it slides, rolls or rests.

Per unit of mass, with n the wall's normal, t = n turned by -90 degrees (along the wall), u the speed along t, q = R w
the rim's, the slip ``s = u + q``, k the inertia factor, P > 0 gravity into the wall, a gravity along t, friction f and
rolling resistance h:

    u' = a - f,    q' = -(f + h) / k,    f in mu P sign(s),    h in c P sign(q).

Where s is 0 friction holds it there if it can, where q is 0 rolling resistance does. Without the latter a disc rolls
if ``|a| <= mu P (1 + 1/k)``, and slips off otherwise. The law has exactly one solution forward in time: it is the
gradient flow of ``mu P |s| + c P |q|`` in the metric of kinetic energy. In an impact of impulse J the same holds of
changes of speed for rates. `docs/contact.md` derives it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from carom.physics.friction import ContactFriction, tangential_impulse


class Press(NamedTuple):
    """What presses a disc to a wall and what resists.

    Attributes:
        normal_m_s2: P, above 0: gravity into the wall.
        along_m_s2: a: gravity along the wall.
        friction: Coulomb's coefficient of the two, 0 or more.
        inverse_inertia_ratio: 1/k of the disc, 0 for one that does not turn.
        rolling_resistance: c of the two, 0 or more.
    """

    normal_m_s2: float
    along_m_s2: float
    friction: float
    inverse_inertia_ratio: float
    rolling_resistance: float = 0.0


class Frictions(NamedTuple):
    """What two frictions take, and what they hold at 0.

    Attributes:
        friction: f.
        rolling: h.
        sticks: Whether friction holds the slip at 0.
        blocks: Whether rolling resistance holds the rim at 0; never that of a disc that does not turn, nor without it.
    """

    friction: float
    rolling: float
    sticks: bool
    blocks: bool


def take(
    s1: float, q1: float, most: tuple[float, float], y: float, signs: tuple[float, float] = (0.0, 0.0)
) -> Frictions:
    """Return f and h with ``s = s1 - f (1 + y) - h y`` and ``q = q1 - (f + h) y``, ``y = 1/k``.

    With ``most = (F, H)``, f is F where s is above 0, -F where it is below, and between them where it is 0; so is h of
    H and q. q falls as h grows, whatever friction makes of it: at the h that makes it 0, f is ``s1 - q1`` cut to F, and
    cut to H, that h is the law's. All is exact on fractions.

    Args:
        s1: s without friction.
        q1: q without friction.
        most: F and H, 0 or more.
        y: 1/k, 0 or more.
        signs: Signs that s and q have already, which fix f and h; 0 for none.
    """
    (slip, rim), (f_most, h_most) = signs, most
    f = h = 0 * s1
    blocks = False
    if y and rim:
        h = h_most if rim > 0 else -h_most
    elif y and h_most:
        f = _cut(s1 - q1, f_most) if not slip else f_most if slip > 0 else -f_most
        h = _cut(q1 / y - f, h_most)
        blocks = abs(q1 / y - f) <= h_most
    if slip:
        return Frictions(f_most if slip > 0 else -f_most, h, sticks=False, blocks=blocks)
    left = s1 - h * y
    if abs(left) <= f_most * (1 + y):
        return Frictions(left / (1 + y), h, sticks=True, blocks=blocks)
    return Frictions(f_most if left > 0 else -f_most, h, sticks=False, blocks=blocks)


def _cut(x: float, most: float) -> float:
    return most if x > most else -most if x < -most else x


class Rates(NamedTuple):
    """How speed along the wall and rim's speed change, m/s2; whether the slip, and the rim's speed, are held at 0."""

    along: float
    rim: float
    sticks: bool
    blocks: bool


def rates(press: Press, slip: float, rim: float = 0.0) -> Rates:
    """Return the rates of a disc in contact.

    Args:
        press: The contact.
        slip: s, metres a second; 0 where it is 0 by the law, which rounding must not decide.
        rim: q, likewise.
    """
    y, a = press.inverse_inertia_ratio, press.along_m_s2
    most = (press.friction * press.normal_m_s2, press.rolling_resistance * press.normal_m_s2)
    by = take(a, 0.0, most, y, (slip, rim if most[1] else 0.0))
    turns = 0.0 if by.blocks else 0.0 - (by.friction + by.rolling) * y
    if by.sticks:
        return Rates(0.0 - turns, turns, sticks=True, blocks=by.blocks)
    return Rates(a - by.friction, turns, sticks=False, blocks=by.blocks)


def frictional_impulses(
    contact: ContactFriction, rolling_resistance: float, slip: float, rim: float, y: float, pressed: float
) -> Frictions:
    """Return the impulses of the two frictions in an impact on a wall whose normal one is `pressed`, a unit of mass.

    Args:
        contact: The friction of the two; what it gives back of a slip is 0 with rolling resistance.
        rolling_resistance: c.
        slip: s before it.
        rim: q before it.
        y: 1/k.
        pressed: J, 0 or more.
    """
    if rolling_resistance:
        return take(slip, rim, (contact.friction * pressed, rolling_resistance * pressed), y)
    sticks = abs((1.0 + contact.restitution) * slip / (1.0 + y)) <= contact.friction * pressed
    return Frictions(tangential_impulse(contact, slip, 1.0 + y, pressed), 0.0, sticks, blocks=False)


def zero_after(value: float, rate: float) -> float:
    """Return after how many seconds a slip, or a rim's speed, of this rate is 0; infinity for never."""
    return -value / rate if value != 0.0 and value * rate < 0.0 else math.inf


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
