"""Contact state of discs in certified runs, and the transitions into and out of contact."""

from __future__ import annotations

from typing import NamedTuple

from flint import arb

from carom.model.trace import Mode
from carom.solvers.certified.ball_arithmetic import ZERO
from carom.solvers.certified.two_frictions import BallFrictions


class BallGround(NamedTuple):
    """Ground of a disc in contact: the line on which the disc's centre moves. Positions are measured along this line.

    Attributes:
        body: Body number of the obstacle.
        nx: x component of the normal; `ny` is the y component. The normal can have any length, and is exact if the
            wall's normal is exact. (ny, -nx) is the direction along the ground.
        level: The line's distance from the origin along the normal.
        presses: Component of gravity towards the ground.
        along: Component of gravity along the ground.
        span: Positions of the ends of a face.
        never_met: Body numbers of obstacles that a disc cannot meet while it is on this face.
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
        """Return the centre of a disc at a position along the ground."""
        x, y = place * self.ny + self.level * self.nx, self.level * self.ny - place * self.nx
        return x / self.length, y / self.length

    def vector_along(self, part: arb) -> tuple[arb, arb]:
        """Return the vector with a given length along the ground."""
        return part * self.ny / self.length, ZERO - part * self.nx / self.length

    def tangential_part(self, x: arb, y: arb) -> arb:
        """Return the component of a vector along the ground."""
        return (x * self.ny - y * self.nx) / self.length

    def normal_part(self, x: arb, y: arb) -> arb:
        """Return the component of a vector along the normal."""
        return (x * self.nx + y * self.ny) / self.length


class GlideState(NamedTuple):
    """State of a disc on its ground: position, speed along the ground, slip, and speed of the rim."""

    place: arb
    speed: arb
    slip: arb
    rim: arb


class Bounce(NamedTuple):
    """Last impact of a disc: time, body, speed after the impact, and whether friction stopped slip and spin."""

    time: arb
    body: int
    leaves: arb
    taken: BallFrictions


class BallMode(NamedTuple):
    """A row of `Trace.modes` in balls, without the count of previous impacts."""

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
    """End of a mode without an impact: the wait until the end, the time, and the cause.

    The cause is that the slip becomes 0 (`slip`), that the rim speed becomes 0 (`rim`), or that the centre is over the
    end of its face (`over`). If the cause is `undecided`, the run can be certified up to the time of the end.
    """

    wait: arb
    time: arb
    slip: bool = False
    rim: bool = False
    over: bool = False
    undecided: bool = False


class Gliding(NamedTuple):
    """A disc in contact: start, ground, mode, rates of change of speed and rim speed, and end (None for never).

    `branch` is the branch of the contact law: the signs of friction and rolling resistance at their limits, and whether
    slip and rim speed stay 0. Discs with equal inertia factors on the same branch have exactly the same rates.
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
        """Return the state `wait` seconds after the start of the mode."""
        place, speed, slip, rim = self.begun
        return GlideState(
            place + wait * (speed + self.rate * wait / 2),
            speed + self.rate * wait,
            slip + (self.rate + self.rim_rate) * wait,
            rim + self.rim_rate * wait,
        )


class Landing(NamedTuple):
    """End of a disc's infinitely many bounces: time, ground, and state."""

    time: arb
    ground: BallGround
    state: GlideState


class Launch(NamedTuple):
    """Launch of a disc from the end of a face: vertex, time, and coefficients of the squared gap of disc and vertex.

    The coefficients are those of t^2, t^3 and t^4, where t is the time since the launch. The coefficients of 1 and t
    are 0.
    """

    vertex: int
    time: arb
    powers: tuple[arb, arb, arb]


class ContactStates:
    """Contact states of all discs in one attempt of a run.

    Attributes:
        gliding: The contact of each disc; None for a disc in flight.
        bounces: The last impact of each disc on a straight obstacle.
        landings: End of each disc's bounces, if this end certainly comes before all other events of the disc; else
            None.
        stops: Time at which the table's friction stops each disc; None for a disc at rest, or without table friction.
        launched: The launch of each disc that has left the end of a face; None for other discs.
        barred: Body numbers of obstacles that each disc cannot meet during its present motion.
    """

    def __init__(self, discs: int) -> None:
        self.gliding: list[Gliding | None] = [None] * discs
        self.bounces: list[Bounce | None] = [None] * discs
        self.landings: list[Landing | None] = [None] * discs
        self.stops: list[arb | None] = [None] * discs
        self.launched: list[Launch | None] = [None] * discs
        self.barred: list[frozenset[int]] = [frozenset()] * discs

    def clear(self, i: int) -> None:
        """Delete the contact state of disc `i`."""
        self.gliding[i] = self.bounces[i] = self.landings[i] = self.stops[i] = self.launched[i] = None
        self.barred[i] = frozenset()

    def end_of(self, i: int) -> arb | None:
        """Return the time at which the present mode of disc `i` ends without an impact; None for never."""
        gliding, landing = self.gliding[i], self.landings[i]
        if landing is not None:
            return landing.time
        return self.stops[i] if gliding is None or gliding.end is None else gliding.end.time

    def bound_wait(self, instant_s: float, *discs: int) -> arb:
        """Return an upper bound of the time from `instant_s` until the mode of one of the discs ends."""
        ends = [end.upper() - instant_s for i in discs if (end := self.end_of(i)) is not None]
        return min(ends, default=arb("inf"))

    def launch_from(self, i: int, body: int) -> Launch | None:
        """Return the launch of disc `i` from the end of a face, if this end is the vertex `body`; else None."""
        launch = self.launched[i]
        return launch if launch is not None and launch.vertex == body else None
