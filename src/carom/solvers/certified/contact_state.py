"""Contact state of discs in certified runs, and the transitions into and out of contact."""

from __future__ import annotations

from typing import NamedTuple

from flint import arb

from carom.model.trace import Mode
from carom.solvers.certified.legs import ZERO
from carom.solvers.certified.two_frictions import BallFrictions


class BallGround(NamedTuple):
    """Ground of a disc in contact: the line on which its centre moves. Positions p are measured along it.

    Attributes:
        body: Body number of the obstacle.
        nx: x component of the normal, like `ny`. The normal has any length above 0, and is exact if the wall's normal
            is. (ny, -nx) is along the ground.
        level: The line's distance from the origin along the normal.
        presses: Component of gravity into the ground.
        along: Component of gravity along the ground.
        span: Positions of the ends of a face.
        never_met: Body numbers of the obstacles that a disc on a face never meets there.
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

    def at(self, place: arb) -> tuple[arb, arb]:
        """Return the centre of a disc at a position along the ground."""
        x, y = place * self.ny + self.level * self.nx, self.level * self.ny - place * self.nx
        return x / self.length, y / self.length

    def going(self, part: arb) -> tuple[arb, arb]:
        """Return the vector with a given length along the ground."""
        return part * self.ny / self.length, ZERO - part * self.nx / self.length

    def along_it(self, x: arb, y: arb) -> arb:
        """Return the component of a vector along the ground."""
        return (x * self.ny - y * self.nx) / self.length

    def off_it(self, x: arb, y: arb) -> arb:
        """Return the component of a vector along the normal."""
        return (x * self.nx + y * self.ny) / self.length


class GlideState(NamedTuple):
    """A disc on its ground: position, speed along the ground, slip, and speed of the rim."""

    place: arb
    speed: arb
    slip: arb
    rim: arb


class Bounce(NamedTuple):
    """The last impact of a disc: its time, the body, the speed after it, and whether friction held slip and spin."""

    time: arb
    body: int
    leaves: arb
    taken: BallFrictions


class BallMode(NamedTuple):
    """A row of `Trace.modes` in balls, without the number of impacts before it."""

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

    The slip becomes 0 (`slip`), the rim speed becomes 0 (`rim`), or the centre is over the end of its face (`over`).
    """

    wait: arb
    time: arb
    slip: bool = False
    rim: bool = False
    over: bool = False


class Gliding(NamedTuple):
    """A disc in contact: start, ground, mode, rates of change of its speed and its rim's, and end (None for never).

    `branch` is the branch of the contact law: the signs of friction and rolling resistance at their limits, and whether
    slip and rim speed are held. Discs of one inertia factor on one branch have exactly the same rates.
    """

    since: arb
    ground: BallGround
    mode: Mode
    begun: GlideState
    rate: arb
    rim_rate: arb
    branch: tuple[int, int, bool, bool]
    end: End | None = None

    def after(self, wait: arb) -> GlideState:
        """Return the state after a wait."""
        place, speed, slip, rim = self.begun
        return GlideState(
            place + wait * (speed + self.rate * wait / 2),
            speed + self.rate * wait,
            slip + (self.rate + self.rim_rate) * wait,
            rim + self.rim_rate * wait,
        )


class Landing(NamedTuple):
    """The end of a disc's bounces: time, ground, and state."""

    time: arb
    ground: BallGround
    state: GlideState


class Launch(NamedTuple):
    """A disc that leaves the end of a face: the vertex, the time, and its squared gap by powers of t, from t^2 on."""

    vertex: int
    time: arb
    powers: tuple[arb, arb, arb]


class ContactStates:
    """The contacts of all discs of an attempt.

    Attributes:
        gliding: The contact of each disc; None for a disc in flight.
        bounces: The last impact of each disc on a straight obstacle.
        landings: Ends of bounces that are known to precede all other events of the disc.
        stops: When each disc stops on a table; None for a disc at rest, or without a table.
        launched: How each disc that left the end of a face did so; None for other discs.
        barred: Body numbers of obstacles that each disc certainly does not meet during its present motion.
    """

    def __init__(self, discs: int) -> None:
        self.gliding: list[Gliding | None] = [None] * discs
        self.bounces: list[Bounce | None] = [None] * discs
        self.landings: list[Landing | None] = [None] * discs
        self.stops: list[arb | None] = [None] * discs
        self.launched: list[Launch | None] = [None] * discs
        self.barred: list[frozenset[int]] = [frozenset()] * discs

    def forget(self, i: int) -> None:
        """Delete the contact state of disc `i`."""
        self.gliding[i] = self.bounces[i] = self.landings[i] = self.stops[i] = self.launched[i] = None
        self.barred[i] = frozenset()

    def end_of(self, i: int) -> arb | None:
        """Return when the present mode of disc `i` ends without an impact; None for never."""
        gliding, landing = self.gliding[i], self.landings[i]
        if landing is not None:
            return landing.time
        return self.stops[i] if gliding is None or gliding.end is None else gliding.end.time

    def until(self, at: float, *discs: int) -> arb:
        """Return an upper bound of the time from an instant until the mode of one of the discs ends."""
        ends = [end.upper() - at for i in discs if (end := self.end_of(i)) is not None]
        return min(ends, default=arb("inf"))

    def launch(self, i: int, body: int) -> Launch | None:
        """Return how disc `i` left the end of a face, if an obstacle is the vertex around which its rim moved."""
        launch = self.launched[i]
        return launch if launch is not None and launch.vertex == body else None
