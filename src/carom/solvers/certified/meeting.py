"""Possible impacts of two bodies, with the relative motion of the bodies just before the impact."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from flint import arb

from carom.solvers.certified.ball_arithmetic import BallLeg, float_above
from carom.solvers.certified.disc_states import BallBodies
from carom.solvers.certified.laws import RoundLaw
from carom.solvers.certified.sign_changes import find_falls


class PairApproach(NamedTuple):
    """Centres, relative position and relative velocity of two discs at the instant `Meeting.at` before their impact.

    `root` is the closing speed at contact times the sum of the radii. `wait` is the time until contact, in seconds.
    `pull` is the relative acceleration, or None if both discs have the same acceleration.
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
        """Return the tangential relative speed of the discs at contact, times the distance of their centres."""
        if self.pull is None:  # the cross product u x d is constant on straight paths
            return self.ux * self.dy - self.uy * self.dx
        x, y = self.offset()
        return (self.ux + self.pull[0] * self.wait) * y - (self.uy + self.pull[1] * self.wait) * x


class WallApproach(NamedTuple):
    """A disc that falls onto a wall.

    `root` is the disc's speed at contact times the normal's length. `wait` is the time until contact, in seconds.
    """

    root: arb
    wait: arb


class RoundApproach(NamedTuple):
    """A disc that meets a vertex or an arc.

    (px, py) is the vector from the centre of the vertex or arc to the disc's centre at contact. `root` is the closing
    speed at contact times the length of this vector. `wait` is the time until contact, in seconds.
    """

    law: RoundLaw
    px: arb
    py: arb
    root: arb
    wait: arb


class Seam(NamedTuple):
    """An impact near the smooth joint of two edges of a wall: a possible impact on each of the two edges."""

    one: Meeting
    other: Meeting


class Meeting(NamedTuple):
    """A possible impact of two bodies on their current paths.

    Attributes:
        first: Number of a disc.
        second: A disc with a higher number, or the body number of a part of a wall. If `second` equals `first`, the
            event is not an impact, but the change of motion that `ContactStates.end_of` describes.
        at: Lower bound of the time, as a 64-bit float in seconds. The new paths after the impact are stored for this
            instant.
        time: Interval that contains the time of impact. For an uncertain impact, the earliest possible time.
        latest: Upper bound of `time`, as a 64-bit float.
        decided: Whether the impact is certain.
        resting: Whether the impact is undecided because the bodies may already be in contact. If `resting`
            is False, the bodies may only graze each other.
        turning: Whether the impact is undecided because a driven body may change its velocity before the impact.
        proven: Whether the bodies certainly touch, so that only the order of impacts is undecided.
        near: Relative motion just before the impact; None for a straight obstacle that the disc approaches at constant
            speed.
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
        """Parts of walls that the disc may touch at the impact: two at a smooth joint of edges, else one."""
        near = self.near
        return frozenset({near.one.second, near.other.second} if isinstance(near, Seam) else {self.second})

    def holds(self, other: Meeting) -> bool:
        """Whether this impact is at the smooth joint of two edges, and `other` is an impact on one of these edges."""
        return isinstance(self.near, Seam) and self.first == other.first and other.obstacles <= self.obstacles


def build_undecided(
    first: int, second: int, instant_s: float, time: arb, *, resting: bool, proven: bool = False, turning: bool = False
) -> Meeting:
    """Return an impact that is not certain. `time` is its earliest possible time."""
    return Meeting(first, second, instant_s, time, float_above(time), False, resting, proven, turning)


def find_contacts(
    bodies: BallBodies, i: int, second: int, instant_s: float, powers: Sequence[arb], leg: BallLeg | None
) -> Iterator[tuple[arb, Meeting]]:
    """Yield each time after `instant_s` at which a gap changes from positive to negative, and the impact at this time.

    `powers` are the coefficients of the gap as a polynomial of the time since `instant_s`. An impact is undecided if
    the sign change is uncertain, or may come before the start of a path.
    """
    begin, discs = bodies.find_last_impact_of_either(i, second, instant_s), [body for body in (i, second) if body >= 0]
    for wait, certain in find_falls(powers, bodies.bound_wait(instant_s, leg, *discs)):
        time = arb(instant_s) + wait
        if time < (arb(instant_s) if begin is None else begin):
            continue
        if certain and (begin is None or time > begin):
            yield wait, Meeting(i, second, instant_s, time, float_above(time))
        else:
            earliest = arb(instant_s) + wait.lower().max(arb(0))
            yield wait, build_undecided(i, second, instant_s, earliest, resting=certain or not powers[0] > 0)
