"""Contact of discs with walls in certified runs: state of discs that slide, roll or rest on a wall, or bounce on it."""

from __future__ import annotations

from typing import NamedTuple

from flint import arb

from carom.model.trace import Mode
from carom.solvers.certified.ball_arithmetic import ZERO
from carom.solvers.certified.two_frictions import BallFrictions


class BallGround(NamedTuple):
    """Straight surface on which a disc slides, rolls or rests, stored as the line on which the disc's centre moves.

    The position of a disc is its distance along this line.

    Attributes:
        body: Body number of the surface.
        nx: x component of the normal, which can have any length; `ny` is the y component. The normal is exact if the
            wall's normal is exact. The vector (ny, -nx) points along the surface.
        level: Distance of the line from the origin, in the direction of the normal.
        presses: Component of gravity towards the surface.
        along: Component of gravity along the surface.
        span: Positions of the two ends of the surface; None for a half-plane, which has no ends.
        never_met: Body numbers of parts of walls that a disc on this surface can't meet.
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
        """Return the centre of a disc from its position along the surface."""
        x, y = place * self.ny + self.level * self.nx, self.level * self.ny - place * self.nx
        return x / self.length, y / self.length

    def vector_along(self, part: arb) -> tuple[arb, arb]:
        """Return the vector with the given component along the surface, and no component along the normal."""
        return part * self.ny / self.length, ZERO - part * self.nx / self.length

    def tangential_part(self, x: arb, y: arb) -> arb:
        """Return the component of a vector along the surface."""
        return (x * self.ny - y * self.nx) / self.length

    def normal_part(self, x: arb, y: arb) -> arb:
        """Return the component of a vector along the normal."""
        return (x * self.nx + y * self.ny) / self.length


class GlideState(NamedTuple):
    """State of a disc on a surface: position, speed along the surface, slip speed (of the contact point), rim speed."""

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
    """A row of `Trace.modes` with intervals instead of floats, and without the number of previous impacts."""

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
    """End of sliding, rolling or rest without an impact: seconds until the end, the instant, and the cause.

    The cause is `slip` if the disc stops slipping, `rim` if the rim speed becomes 0, and `over` if the disc's centre
    reaches the end of its surface. If the cause is `undecided`, the run can only be certified up to this time.
    """

    wait: arb
    time: arb
    slip: bool = False
    rim: bool = False
    over: bool = False
    undecided: bool = False


class Gliding(NamedTuple):
    """A disc that slides, rolls or rests on a surface: its first state, its accelerations, and the end of this motion.

    The end is None if this motion never ends. `branch` states which case of the contact law applies: the signs of
    friction and rolling resistance at their limits, and whether slip and rim speed stay 0. Two discs with equal
    branches and inertia factors have exactly equal accelerations.
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
    """Start of sliding, rolling or rest, perhaps after infinitely many bounces: time, surface, and the disc's state."""

    time: arb
    ground: BallGround
    state: GlideState


class Launch(NamedTuple):
    """Instant at which a disc flies off the end of a surface, and its later distance from the vertex at this end.

    In the time t since this instant, the squared distance grows by ``p t^2 + q t^3 + r t^4``. `powers` contains p, q
    and r.
    """

    vertex: int
    time: arb
    powers: tuple[arb, arb, arb]


class ContactStates:
    """Lasting contacts of all discs with walls in one attempt of a certified run.

    Attributes:
        gliding: The contact of each disc; None for a disc that flies freely.
        bounces: The last impact of each disc on a straight surface.
        landings: End of each disc's infinitely many bounces. None without infinitely many bounces, or if another
            event of the disc may come before their end.
        stops: Time at which the table's friction stops each disc. None if the disc is at rest or the scene has no
            table.
        launched: The instant at which each disc flew off the end of a surface; None for other discs.
        barred: Body numbers of parts of walls that each disc can't meet on its current path.
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
        """Return the time at which the motion of disc `i` next changes without an impact; None for never.

        At this time the disc's bounces end, it stops sliding, rolling or resting, or a table stops it.
        """
        gliding, landing = self.gliding[i], self.landings[i]
        if landing is not None:
            return landing.time
        return self.stops[i] if gliding is None or gliding.end is None else gliding.end.time
