"""A possible impact of two bodies, and what is left of their way to it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from flint import arb

from carom.solvers.certified.floats import float_above
from carom.solvers.certified.sign_changes import falls_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from carom.solvers.certified.ball_bodies import BallBodies, RoundLaw
    from carom.solvers.certified.legs import BallLeg


class PairApproach(NamedTuple):
    """Two discs at `Meeting.at`: centres, relative position and velocity; and what is left of their way.

    `root`, that of D, is the speed at which they close at contact, times the sum of their radii; `wait` is in seconds.
    `pull` is their relative acceleration, of a disc that falls and one that does not; else None.
    """

    xi: arb
    yi: arb
    xj: arb
    yj: arb
    dx: arb
    dy: arb
    ux: arb
    uy: arb
    root: arb
    wait: arb
    pull: tuple[arb, arb] | None = None

    def offset(self) -> tuple[arb, arb]:
        """Return the relative position at contact."""
        x, y = self.dx + self.ux * self.wait, self.dy + self.uy * self.wait
        if self.pull is None:
            return x, y
        half_square = self.wait * self.wait / 2
        return x + self.pull[0] * half_square, y + self.pull[1] * half_square

    def slip(self) -> arb:
        """Return how fast they move past each other at contact, times their distance."""
        if self.pull is None:  # u x d does not change along straight paths
            return self.ux * self.dy - self.uy * self.dx
        x, y = self.offset()
        return (self.ux + self.pull[0] * self.wait) * y - (self.uy + self.pull[1] * self.wait) * x


class WallApproach(NamedTuple):
    """A disc that falls on a wall: `root` is its speed at contact times the normal's length, `wait` is in seconds."""

    root: arb
    wait: arb


class RoundApproach(NamedTuple):
    """A disc that meets a vertex or an arc: (px, py) is where its centre is then, as seen from the centre of that.

    `root` is the speed at which they close, times the reach; `wait` is in seconds.
    """

    law: RoundLaw
    px: arb
    py: arb
    root: arb
    wait: arb


class Seam(NamedTuple):
    """An impact on one of two obstacles that go over into each other where it is: each as if it were on that one."""

    one: Meeting
    other: Meeting


class Meeting(NamedTuple):
    """A possible impact of two bodies on their present paths.

    Attributes:
        first: Disc.
        second: Disc, of a higher number, or obstacle, as `wall_body` of its number; the same disc, where how it moves
            ends by itself.
        at: Float64 instant from which it was solved, seconds; the impact is not before it.
        time: Ball that holds the time of impact; where undecided, that of the earliest it could be.
        latest: Float64 no less than anything in `time`.
        decided: Whether the impact is certain.
        resting: Whether it is undecided because the bodies may be in contact already, rather than for a graze.
        turning: Whether it is undecided because a driven body may begin another leg before.
        proven: Whether the contact is certain, and it is only the order of impacts that has no answer.
        near: What is known of two discs, of a disc and a wall that gravity has a part along, or of a finite wall.
    """

    first: int
    second: int
    at: float
    time: arb
    latest: float
    decided: bool = True
    resting: bool = False
    proven: bool = False
    turning: bool = False
    near: PairApproach | WallApproach | RoundApproach | Seam | None = None

    @property
    def obstacles(self) -> frozenset[int]:
        """What the disc may be touching then: one obstacle or, at a seam, two."""
        near = self.near
        return frozenset({near.one.second, near.other.second} if isinstance(near, Seam) else {self.second})

    def holds(self, other: Meeting) -> bool:
        """Whether another is of what this one is at a seam."""
        return isinstance(self.near, Seam) and self.first == other.first and other.obstacles <= self.obstacles


def undecided(
    first: int, second: int, at: float, time: arb, *, resting: bool, proven: bool = False, turning: bool = False
) -> Meeting:
    """Return a meeting that is not certain, `time` at the earliest."""
    return Meeting(first, second, at, time, float_above(time), False, resting, proven, turning)


def contacts_ahead(
    bodies: BallBodies, i: int, second: int, at: float, powers: Sequence[arb], leg: BallLeg | None
) -> Iterator[tuple[arb, Meeting]]:
    """Yield after what waits a gap falls through zero, while both bodies move as they do, and the meetings there.

    The gap is given by powers of time from `at` on. A meeting is undecided where that fall, or that it comes after both
    paths have begun, is not certain.
    """
    begin, discs = bodies.began(i, second, at), [body for body in (i, second) if body >= 0]
    for wait, certain in falls_of(powers, bodies.until(at, leg, *discs)):
        time = arb(at) + wait
        if time < (arb(at) if begin is None else begin):
            continue
        if certain and (begin is None or time > begin):
            yield wait, Meeting(i, second, at, time, float_above(time))
        else:
            earliest = arb(at) + wait.lower().max(arb(0))
            yield wait, undecided(i, second, at, earliest, resting=certain or not powers[0] > 0)
