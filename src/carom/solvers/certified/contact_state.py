"""States of discs in lasting contact with a wall in certified runs, and of discs that begin or end such a contact."""

from __future__ import annotations

from typing import NamedTuple

from flint import arb

from carom.model.trace import Mode
from carom.solvers.certified.ball_arithmetic import ZERO
from carom.solvers.certified.two_frictions import BallFrictions


class BallGround(NamedTuple):
    """Surface on which a disc slides, rolls or rests, stored as the line on which the disc's centre moves.

    Positions are measured along this line.

    Attributes:
        body: Body number of the wall's surface.
        nx: x component of the normal; `ny` is the y component. The normal can have any length, and is exact if the
            wall's normal is exact. (ny, -nx) points along the surface.
        level: The line's distance from the origin along the normal.
        presses: Component of gravity towards the surface.
        along: Component of gravity along the surface.
        span: Positions of the two ends of the surface; None for a half-plane, which has no ends.
        never_met: Body numbers of parts of walls that a disc can't meet while it is on this surface.
    """

    body: int
    nx: arb
    ny: arb
    length: arb
    level: arb
    presses: arb
    along: arb
    span: tuple[arb, arb] | None
    never_met: frozenset[int]

    def centre_at(self, place: arb) -> tuple[arb, arb]:
        """Return the centre of a disc at a given position on the surface."""
        x, y = place * self.ny + self.level * self.nx, self.level * self.ny - place * self.nx
        return x / self.length, y / self.length

    def vector_along(self, part: arb) -> tuple[arb, arb]:
        """Return a vector of given length along the surface."""
        return part * self.ny / self.length, ZERO - part * self.nx / self.length

    def tangential_part(self, x: arb, y: arb) -> arb:
        """Return the component of a vector along the surface."""
        return (x * self.ny - y * self.nx) / self.length

    def normal_part(self, x: arb, y: arb) -> arb:
        """Return the component of a vector along the normal."""
        return (x * self.nx + y * self.ny) / self.length


class GlideState(NamedTuple):
    """State of a disc on a surface: its position, its speed along the surface, its slip speed and its rim speed."""

    place: arb
    speed: arb
    slip: arb
    rim: arb


class Bounce(NamedTuple):
    """Last impact of a disc: its time and body, the speed after it, and whether friction stopped slip and spin."""

    time: arb
    body: int
    leaves: arb
    taken: BallFrictions


class BallMode(NamedTuple):
    """A row of `Trace.modes` with intervals as numbers, without the count of previous impacts."""

    time: arb
    disc: int
    wall: int
    before: Mode
    after: Mode
    place: tuple[arb, arb]
    velocity: tuple[arb, arb]
    acceleration: tuple[arb, arb]
    spin: arb
    spin_rate: arb


class End(NamedTuple):
    """End of sliding, rolling or rest without an impact: the time until the end, the instant, and the cause.

    If the cause is `slip`, the disc stops slipping. If it is `rim`, the rim speed becomes 0. If it is `over`, the
    disc's centre reaches the end of its surface. If it is `undecided`, the cause is unknown, and the run can only be
    certified up to this time.
    """

    wait: arb
    time: arb
    slip: bool = False
    rim: bool = False
    over: bool = False
    undecided: bool = False


class Gliding(NamedTuple):
    """A disc that slides, rolls or rests on a surface: its first state, accelerations, and end (None for never).

    `branch` states how the contact law was applied: the signs of friction and rolling resistance at their limits, and
    whether slip and rim speed stay 0. If two discs have equal branches and inertia factors, their accelerations are
    exactly equal.
    """

    since: arb
    ground: BallGround
    mode: Mode
    begun: GlideState
    rate: arb
    rim_rate: arb
    branch: tuple[int, int, bool, bool]
    end: End | None = None

    def state_after(self, wait: arb) -> GlideState:
        """Return the state `wait` seconds after the disc began to slide, roll or rest."""
        place, speed, slip, rim = self.begun
        return GlideState(
            place + wait * (speed + self.rate * wait / 2),
            speed + self.rate * wait,
            slip + (self.rate + self.rim_rate) * wait,
            rim + self.rim_rate * wait,
        )


class Landing(NamedTuple):
    """End of a disc's infinitely many bounces: the time, the surface, and the disc's state."""

    time: arb
    ground: BallGround
    state: GlideState


class Launch(NamedTuple):
    """Instant at which a disc flies off the end of a surface.

    `powers` describes its squared gap to the vertex at this end.

    The numbers are the coefficients of t^2, t^3 and t^4, where t is the time since then. The coefficients of 1 and t
    are 0.
    """

    vertex: int
    time: arb
    powers: tuple[arb, arb, arb]


class ContactStates:
    """Lasting contacts of all discs with walls, in one attempt of a certified run.

    Attributes:
        gliding: The contact of each disc; None for a disc that flies freely.
        bounces: The last impact of each disc on a straight surface.
        landings: End of each disc's infinitely many bounces, if this end certainly comes before all other events of the
            disc; else None.
        stops: Time at which the table's friction stops each disc; None for a disc at rest, or without table friction.
        launched: The launch of each disc that has flown off the end of a surface; None for other discs.
        barred: Body numbers of parts of walls that each disc can't meet during its present motion.
    """

    def __init__(self, discs: int) -> None:
        self.gliding: list[Gliding | None] = [None] * discs
        self.bounces: list[Bounce | None] = [None] * discs
        self.landings: list[Landing | None] = [None] * discs
        self.stops: list[arb | None] = [None] * discs
        self.launched: list[Launch | None] = [None] * discs
        self.barred: list[frozenset[int]] = [frozenset()] * discs

    def clear(self, i: int) -> None:
        """Delete all stored data on the contact of disc `i`."""
        self.gliding[i] = self.bounces[i] = self.landings[i] = self.stops[i] = self.launched[i] = None
        self.barred[i] = frozenset()

    def end_of(self, i: int) -> arb | None:
        """Return the time at which disc `i` stops sliding, rolling or resting without an impact; None for never."""
        gliding, landing = self.gliding[i], self.landings[i]
        if landing is not None:
            return landing.time
        return self.stops[i] if gliding is None or gliding.end is None else gliding.end.time

    def bound_wait(self, instant_s: float, *discs: int) -> arb:
        """Return an upper bound of the time from `instant_s` until the acceleration of one of the discs changes."""
        ends = [end.upper() - instant_s for i in discs if (end := self.end_of(i)) is not None]
        return min(ends, default=arb("inf"))

    def launch_from(self, i: int, body: int) -> Launch | None:
        """Return the launch of disc `i`, if it has flown off the end of a surface at the vertex `body`; else None."""
        launch = self.launched[i]
        return launch if launch is not None and launch.vertex == body else None
