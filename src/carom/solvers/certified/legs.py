"""Paths of driven bodies, in balls: the exact displacement on each leg."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, NamedTuple

from flint import arb, fmpq

if TYPE_CHECKING:
    from carom.model.prescribed_motion import Drive

ZERO = arb(0)


def ball(number: Fraction) -> arb:
    """Return a ball that contains a rational number. The ball is exact if the working precision is sufficient."""
    return arb(fmpq(number.numerator, number.denominator))


class BallLeg(NamedTuple):
    """A leg of a driven body, from `begin_s` to `end_s`. At time t the body's displacement is (x, y) + t (vx, vy)."""

    begin_s: float
    end_s: float
    x: arb
    y: arb
    vx: arb
    vy: arb

    def moved_at(self, time: arb) -> tuple[arb, arb]:
        """Return the displacement of the body at a time."""
        return self.x + self.vx * time, self.y + self.vy * time


def legs_of(drive: Drive) -> tuple[BallLeg, ...]:
    """Return the legs of a path. Displacements at the start of legs are exact sums of the previous legs."""
    found, x, y = [], Fraction(0), Fraction(0)  # displacement minus velocity times time
    before = (Fraction(0), Fraction(0))
    for leg in drive.legs:
        begin, (u, v) = Fraction(leg.begin_s), map(Fraction, leg.velocity)
        x, y = x + (before[0] - u) * begin, y + (before[1] - v) * begin
        before = (u, v)
        found.append(BallLeg(leg.begin_s, leg.end_s, ball(x), ball(y), arb(leg.velocity[0]), arb(leg.velocity[1])))
    return tuple(found)
