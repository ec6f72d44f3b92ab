"""Contact law of `core/wall_contact_law.h` in interval arithmetic: how friction and rolling resistance change speeds.

`limit_sticking` is a copy of the friction law of impacts in `core/impact_law.h`.

If it is undecided whether a force exceeds its limit, the interval of the limited force includes both cases. Both cases
have nearly the same result, so the interval of the limited force is narrow.
"""

from __future__ import annotations

from typing import NamedTuple

from flint import arb

from carom.solvers.certified.ball_arithmetic import ZERO


class BallFrictions(NamedTuple):
    """Friction f and rolling resistance h of `core/wall_contact_law.h`, as intervals.

    `sticks` and `blocks` are None if they are undecided.
    """

    friction: arb
    rolling: arb
    sticks: bool | None
    blocks: bool | None


def sign_of(ball: arb) -> int | None:
    """Return the sign of all numbers in an interval; None if their signs differ."""
    if ball.is_zero():
        return 0
    if ball > 0:
        return 1
    return -1 if ball < 0 else None


def clamp(x: arb, limit: arb) -> arb:
    """Return x limited to the range from ``-limit`` to `limit`."""
    return x.min(limit).max(ZERO - limit)


def limit_sticking(sticking: arb, limit: arb) -> BallFrictions:
    """Return the impulse of friction without rolling resistance: `sticking`, but at most Coulomb's `limit`."""
    return BallFrictions(clamp(sticking, limit), ZERO, sticks=_is_within(sticking, limit), blocks=False)


def share_frictions(
    s1: arb, q1: arb, limits: tuple[arb, arb], y: arb, signs: tuple[int, int] = (0, 0)
) -> BallFrictions:
    """Return the result of `share_frictions` in `core/wall_contact_law.h`, computed with intervals."""
    (slip, rim), (f_most, h_most) = signs, limits
    f = h = ZERO
    blocks: bool | None = False
    if not y.is_zero() and rim:
        h = h_most * rim
    elif not y.is_zero() and not h_most.is_zero():
        f = f_most * slip if slip else clamp(s1 - q1, f_most)
        h, blocks = clamp(q1 / y - f, h_most), _is_within(q1 / y - f, h_most)
    if slip:
        return BallFrictions(f_most * slip, h, sticks=False, blocks=blocks)
    left = (s1 - h * y) / (1 + y)
    return BallFrictions(clamp(left, f_most), h, sticks=_is_within(left, f_most), blocks=blocks)


def _is_within(x: arb, limit: arb) -> bool | None:
    if abs(x) <= limit:
        return True
    return False if abs(x) > limit else None
