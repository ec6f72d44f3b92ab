"""Possible impacts of two bodies, and their remaining approach."""

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
    """Two discs at `Meeting.at`: centres, relative position and velocity, and the remaining approach.

    `root` is the root of D: the closing speed at contact times the sum of the radii. `wait` is in seconds. `pull` is
    the relative acceleration if one disc falls and the other does not; else None.
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
        """Return the tangential relative speed of the discs at contact, times their distance."""
        if self.pull is None:  # the cross product u x d does not change along straight paths
            return self.ux * self.dy - self.uy * self.dx
        x, y = self.offset()
        return (self.ux + self.pull[0] * self.wait) * y - (self.uy + self.pull[1] * self.wait) * x


class WallApproach(NamedTuple):
    """A disc that falls onto a wall. `root` is its speed at contact times the normal's length, `wait` is in seconds."""

    root: arb
    wait: arb


class RoundApproach(NamedTuple):
    """A disc that meets a vertex or an arc. (px, py) is the disc's centre at contact, from the obstacle's centre.

    `root` is the closing speed times the reach. `wait` is in seconds.
    """

    law: RoundLaw
    px: arb
    py: arb
    root: arb
    wait: arb


class Seam(NamedTuple):
    """An impact at a smooth joint of two obstacles, computed for both."""

    one: Meeting
    other: Meeting


class Meeting(NamedTuple):
    """A possible impact of two bodies on their present paths.

    Attributes:
        first: Number of a disc.
        second: A disc with a higher number, or an obstacle as `wall_body` of its number. For the end of a mode the
            second body is the same disc.
        at: Float64 lower bound of the time from which the impact was solved, seconds.
        time: Ball that contains the time of impact; if undecided, the earliest possible time.
        latest: Float64 upper bound of `time`.
        decided: Whether the impact is certain.
        resting: Whether the reason why the impact is undecided is possible contact of the bodies, and not a graze.
        turning: Whether the impact is undecided because a driven body may start another leg before.
        proven: Whether the contact is certain, and only the order of impacts is undecided.
        near: Geometry of two discs, of a disc and a wall with gravity along its normal, or of a finite wall.
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
        """Obstacles that the disc may touch at the impact: one or, at a seam, two."""
        near = self.near
        return frozenset({near.one.second, near.other.second} if isinstance(near, Seam) else {self.second})

    def holds(self, other: Meeting) -> bool:
        """Whether this meeting is at a seam, and `other` is with the other obstacle of the seam."""
        return isinstance(self.near, Seam) and self.first == other.first and other.obstacles <= self.obstacles


def undecided(
    first: int, second: int, at: float, time: arb, *, resting: bool, proven: bool = False, turning: bool = False
) -> Meeting:
    """Return a meeting that is not certain and happens at `time` at the earliest."""
    return Meeting(first, second, at, time, float_above(time), False, resting, proven, turning)


def contacts_ahead(
    bodies: BallBodies, i: int, second: int, at: float, powers: Sequence[arb], leg: BallLeg | None
) -> Iterator[tuple[arb, Meeting]]:
    """Yield the waits after which a gap falls through zero during the bodies' present motion, and the meetings then.

    The gap is given by powers of time from `at` on. A meeting is undecided if the fall is not certain, or not certainly
    after the start of both paths.
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
