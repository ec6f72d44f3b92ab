"""`core/contact_law.h` in balls: slip and rim speed that friction and rolling resistance remove, or hold at 0.

`stick` is the limit between sticking and sliding in `core/impact.h`.

Forces are limited, which is a continuous function. If it is not decided on which side of a limit a force is, its ball
contains both cases.
"""

from __future__ import annotations

from typing import NamedTuple

from flint import arb

from carom.solvers.certified.legs import ZERO


class BallFrictions(NamedTuple):
    """Like `Frictions` of `core/contact_law.h`, with balls; None where it is not decided what is held."""

    friction: arb
    rolling: arb
    sticks: bool | None
    blocks: bool | None


def sign(ball: arb) -> int | None:
    """Return the sign of all numbers in a ball; None if they have more than one."""
    return 0 if ball.is_zero() else 1 if ball > 0 else -1 if ball < 0 else None


def cut(x: arb, most: arb) -> arb:
    """Return x, limited to the range from minus `most` to `most`."""
    return x.min(most).max(ZERO - most)


def stick(sticking: arb, most: arb) -> BallFrictions:
    """Return what friction alone removes: as much as sticking needs, but at most `most`, the limit of the cone."""
    return BallFrictions(cut(sticking, most), ZERO, sticks=_within(sticking, most), blocks=False)


def take(s1: arb, q1: arb, most: tuple[arb, arb], y: arb, signs: tuple[int, int] = (0, 0)) -> BallFrictions:
    """Compute `share_frictions` of `core/contact_law.h`."""
    (slip, rim), (f_most, h_most) = signs, most
    f = h = ZERO
    blocks: bool | None = False
    if not y.is_zero() and rim:
        h = h_most * rim
    elif not y.is_zero() and not h_most.is_zero():
        f = f_most * slip if slip else cut(s1 - q1, f_most)
        h, blocks = cut(q1 / y - f, h_most), _within(q1 / y - f, h_most)
    if slip:
        return BallFrictions(f_most * slip, h, sticks=False, blocks=blocks)
    left = (s1 - h * y) / (1 + y)
    return BallFrictions(cut(left, f_most), h, sticks=_within(left, f_most), blocks=blocks)


def _within(x: arb, most: arb) -> bool | None:
    if abs(x) <= most:
        return True
    return False if abs(x) > most else None
