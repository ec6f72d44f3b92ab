"""Time of impact of a disc and a wall under uniform gravity.

The gap between rim and wall is ``w + s t + a t^2/2`` with the gap now, the speed along the wall's normal (negative
towards the wall) and gravity's part along it. The three are error-free pairs, as in `carom.physics.wall_time`. An
impact is the earliest root at which the gap closes. Which root that is, and whether there is one, follows from the
signs of the three and of the discriminant ``D = s^2 - 2 a w``; nothing is compared with a small number.

Two discs that both fall need no form of their own: gravity leaves their relative motion straight.
"""

from __future__ import annotations

import math

from carom.physics.double_double import Pair, pair_product, two_sum
from carom.physics.pair_time import discriminant_from_gap, exact_root
from carom.physics.wall_time import quotient


def descent_time(gap: Pair, speed: Pair, pull: Pair) -> float:
    """Return the seconds until a gap (metres) of this rate of change and this acceleration closes.

    0 where the bodies touch and approach, or touch, do not move apart and are pulled together (resting contact);
    infinity where the gap never closes. One that is 0 at one instant and opens again (``D = 0``) is no impact. Right to
    4 ulp while ``s^2`` and ``a w`` lie between 1e-250 and 1e290, unless the path's apex is nearer to the wall than
    2^-80 of its height: the root itself is then as ill-conditioned as ``sqrt(D)``.
    """
    w, s, a = gap[0], speed[0], pull[0]
    if w <= 0.0:
        if s < 0.0:
            return 0.0
        if not a < 0.0:
            return math.inf
        if s == 0.0:
            return 0.0
        if w == 0.0:
            return return_time(speed, pull)
    elif a == 0.0:
        return quotient(gap, speed) if s < 0.0 else math.inf
    elif a > 0.0 and not s < 0.0:
        return math.inf
    twice = (2.0 * gap[0], 2.0 * gap[1])
    d = discriminant_from_gap(speed, twice, pull)
    if not d[0] > 0.0:
        # Pushed back before it gets there; or, in the wall by a rounding, pulled down before it has come out.
        return math.inf if a > 0.0 else quotient(speed, pull)
    root = math.sqrt(d[0])
    if w > 0.0 and not s > 0.0:
        return exact_root(speed, twice, d, root)
    square, square_rest = pair_product((root, 0.0), (root, 0.0))
    high, low = two_sum(s, root)
    rest = (((d[0] - square) - square_rest) + d[1]) / (2.0 * root)
    return quotient((high, low + (speed[1] + rest)), pull)


def return_time(speed: Pair, pull: Pair) -> float:
    """Return the seconds that a body which leaves a wall at `speed` > 0 takes to come back, by `pull` < 0."""
    return quotient((2.0 * speed[0], 2.0 * speed[1]), pull)
