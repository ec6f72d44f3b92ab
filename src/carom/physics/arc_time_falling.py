"""Time of impact of a falling disc with a vertex, and with an arc from outside and from inside.

The squared distance from the centre is a quartic in time, as in `carom.physics.pair_time_falling`; its negative is that
of an arc from inside. A fall outside the sector is no contact, and the next one counts.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING

from carom.physics.arc_time import from_pair, is_before_arc, is_in, reach_of
from carom.physics.double_double import Pair, two_sum
from carom.physics.pair_time_falling import squared_gap, touches

if TYPE_CHECKING:
    from carom.physics.features import Arc, Mover, Point


def arc_time_falling(disc: Mover, arc: Arc, gravity: Point, leaving: float | None = None) -> float:
    """Return the seconds until a falling disc touches an arc, or a vertex, infinity where it never does.

    0 where it touches and approaches, or touches, does not move apart and is pressed against the arc: contact. Where
    the disc has just hit the arc, `leaving` is the speed at which it leaves it: the gap is then 0, whatever rounding
    has made of it.
    """
    reach = reach_of(disc, arc)
    if not reach[0] > 0.0:
        return math.inf
    place = _exact(disc.x) - _exact(arc.centre[0]), _exact(disc.y) - _exact(arc.centre[1])
    velocity, pull = (_exact(disc.ux), _exact(disc.uy)), (Fraction(gravity[0]), Fraction(gravity[1]))
    gap = squared_gap(place, velocity, pull, _exact(reach), leaving)
    if arc.inside:
        opening = -gap[1] if leaving is None else gap[1]
        gap = [-gap[0], opening, *(-power for power in gap[2:])]
    if gap[0] <= 0 and is_before_arc(disc, arc):
        gap[0] = Fraction(0)
    return next((time for time in touches(gap) if _is_in_sector_at(time, disc, arc, gravity)), math.inf)


def _exact(pair: Pair) -> Fraction:
    return Fraction(pair[0]) + Fraction(pair[1])


def _is_in_sector_at(time: float, disc: Mover, arc: Arc, gravity: Point) -> bool:
    """Whether a disc is in an arc's sector at a time, or rounding leaves that open."""
    if arc.sector is None:
        return True
    (px, moved_x), (py, moved_y) = (
        _fallen(from_pair(x, c), u, g, time)
        for x, c, u, g in zip(disc[:2], arc.centre, disc[2:4], gravity, strict=True)
    )
    return is_in(arc.sector, px, py, moved_x, moved_y)


def _fallen(x: Pair, u: Pair, g: float, time: float) -> tuple[Pair, float]:
    """Return a coordinate after a time of free fall, and how far at most it has moved in it."""
    flown, fallen = time * u[0], 0.5 * g * time * time
    high, low = two_sum(x[0], flown + fallen)
    return two_sum(high, low + x[1]), abs(flown) + abs(fallen)
