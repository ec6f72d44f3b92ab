"""Which discs are in contact with a wall that gravity presses them to, how they move there, and when that changes.

In contact a disc moves on a parabola as well, with an acceleration along the wall: so all that is solved of discs in
flight is solved of these. What the law makes 0 is set to 0 and not computed: the gap and the speed along the normal of
a disc in contact, and the slip of one that rolls.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from carom.physics.contact_law import Press, held, left_of_slip, rates, zero_after
from carom.physics.wall_time import wall_gap, wall_speed
from carom.solvers.plain.instants import NEVER, Instant, after
from carom.trace import Mode, ModeRecord, wall_body

if TYPE_CHECKING:
    from collections.abc import Iterator

    from carom.solvers.falling.bodies import FallingBodies

__all__ = ["Contacts"]


class _Zero(NamedTuple):
    """What is 0 where a mode ends."""

    slip: bool
    rim: bool


class Contacts:
    """The modes of all discs of a run.

    Attributes:
        walls: The wall that each disc is in contact with; None for none.
        modes: How each moves.
        ends: When each mode ends by itself, as a slip does that friction takes.
    """

    def __init__(self, bodies: FallingBodies) -> None:
        self.walls: list[int | None] = [None] * len(bodies)
        self.modes = [Mode.FLIGHT] * len(bodies)
        self.ends: list[Instant] = [NEVER] * len(bodies)
        self._zero = [_Zero(slip=True, rim=False)] * len(bodies)
        self._bodies = bodies

    def begin(self) -> Iterator[tuple[int, ModeRecord]]:
        """Begin the contact of each disc that lies on a half-plane, as far as its numbers tell."""
        bodies = self._bodies
        for i in range(len(bodies)):
            for k, wall in enumerate(bodies.walls):
                if bodies.inverse_mass[i] == 0.0 or not isinstance(wall, tuple) or self.walls[i] is not None:
                    continue
                if bodies.is_driven(k):
                    continue
                approach, pull, gap_m = bodies.contact_with_wall(i, k, again=False)
                gap = float(wall_gap(bodies.x[i], bodies.y[i], bodies.radius[i], *wall)[0])
                if pull < 0.0 and gap <= gap_m and approach * approach <= -2.0 * pull * gap_m:
                    yield i, self.land(i, k, approach)

    def land(self, i: int, k: int, approach: float) -> ModeRecord:
        """Begin the contact of disc `i`, brought there, with half-plane `k`: nothing is left of its bounces."""
        bodies = self._bodies
        slip, rim, restitution = self._slip(i, k), self._rim(i), bodies.restitution_of_wall(k)
        press = self._press(i, k)
        gripped = bodies.gripped[i] and bodies.last_partner[i] == wall_body(k)
        if press.rolling_resistance and approach > 0.0 and restitution < 1.0:
            slip, rim = _left_of_both(press, 0.0 if gripped else slip, rim, approach, restitution)
        elif gripped:
            slip = 0.0
        elif approach > 0.0 and restitution < 1.0:
            slip = left_of_slip(press, slip, approach, restitution)
        bodies.last_partner[i] = None
        return self._settle(i, k, slip, rim)

    def end_mode(self, i: int) -> ModeRecord:
        """Let disc `i`, brought there, go on after the end of its mode: its slip, or its spin, is 0, or both are."""
        k = self.walls[i]
        if k is None:
            raise TypeError(f"disc {i} is in contact with no wall")
        self._bodies.last_partner[i] = None  # a path of its own: what it has met before it may meet again
        zero = self._zero[i]
        return self._settle(i, k, 0.0 if zero.slip else self._slip(i, k), 0.0 if zero.rim else self._rim(i))

    def after_impact(self, i: int) -> ModeRecord | None:
        """Let disc `i`, struck just now, go on where it is in contact: it stays so, or leaves its wall.

        Return None where that changes nothing of how it moves but its velocity.

        It stays where its speed along the normal makes a hop that is lower than the gap is known to. One that is driven
        into its wall is not in contact either: it is in flight, and meets the wall at once.
        """
        bodies, k = self._bodies, self.walls[i]
        if k is None:
            return None
        wall = bodies.walls[k]
        approach, _, gap_m = bodies.contact_with_wall(i, k, again=False)
        if approach * approach <= 2.0 * self._press(i, k).normal_m_s2 * gap_m:
            moved = (self.modes[i], bodies.acceleration[i], bodies.spin_rate[i])
            settled = self._settle(i, k, self._slip(i, k), self._rim(i))
            return None if moved == (self.modes[i], bodies.acceleration[i], bodies.spin_rate[i]) else settled
        before, self.walls[i] = self.modes[i], None
        self.modes[i], self.ends[i] = Mode.FLIGHT, NEVER
        bodies.acceleration[i], bodies.spin_rate[i] = bodies.gravity, 0.0
        self._set_on(i, wall)
        return self._record(i, k, before)

    def _press(self, i: int, k: int) -> Press:
        bodies = self._bodies
        nx, ny = bodies.normal(i, k)
        friction, gravity = bodies.contact_of_wall(k).friction, bodies.gravity
        along = float(wall_speed(*gravity, ny, -nx)[0])
        normal, ratio = -float(wall_speed(*gravity, nx, ny)[0]), bodies.inverse_inertia_ratio[i]
        return Press(normal, along, friction, ratio, bodies.rolling_resistance if ratio else 0.0)

    def _slip(self, i: int, k: int) -> float:
        bodies = self._bodies
        nx, ny = bodies.normal(i, k)
        return bodies.vx[i] * ny - bodies.vy[i] * nx + bodies.radius[i] * bodies.spin[i]

    def _rim(self, i: int) -> float:
        return self._bodies.radius[i] * self._bodies.spin[i]

    def _set_on(self, i: int, wall: object) -> None:
        """Take off what rounding has made of the gap of disc `i` to a half-plane."""
        bodies = self._bodies
        if not isinstance(wall, tuple):
            raise TypeError("contact is solved on half-planes alone")
        gap = float(wall_gap(bodies.x[i], bodies.y[i], bodies.radius[i], *wall)[0])
        bodies.x[i] -= gap * wall[2]
        bodies.y[i] -= gap * wall[3]

    def _settle(self, i: int, k: int, slip: float, rim: float) -> ModeRecord:
        """Let disc `i` move on in contact with half-plane `k`, with a slip and a speed of its rim."""
        bodies, before = self._bodies, self.modes[i]
        nx, ny = bodies.normal(i, k)
        self._set_on(i, bodies.walls[k])
        press, speed = self._press(i, k), bodies.vx[i] * ny - bodies.vy[i] * nx
        resists = press.rolling_resistance > 0.0
        if resists and slip == 0.0:  # of two numbers that the law makes one
            speed = speed if rim else 0.0
            rim = 0.0 - speed
        along, turns, holds, rim_holds = rates(press, slip, rim)
        if holds:
            speed = speed if press.inverse_inertia_ratio else 0.0
            bodies.spin[i] = 0.0 - speed / bodies.radius[i]
        elif resists and rim == 0.0:
            bodies.spin[i] = 0.0
        bodies.vx[i], bodies.vy[i] = speed * ny, 0.0 - speed * nx
        bodies.acceleration[i] = (along * ny, 0.0 - along * nx)
        bodies.spin_rate[i] = turns / bodies.radius[i]
        self.walls[i] = k
        self.modes[i] = _mode(speed, along, holds=holds, rim_holds=rim_holds)
        # Of one that rolls both pass 0 at once, and that changes nothing without rolling resistance.
        waits = (zero_after(slip, along + turns), zero_after(rim, turns) if resists else math.inf)
        self._zero[i] = _Zero(*(wait == min(waits) or (holds and resists) for wait in waits))
        self.ends[i] = after(bodies.instant[i], min(waits))
        return self._record(i, k, before)

    def _record(self, i: int, k: int, before: Mode) -> ModeRecord:
        bodies = self._bodies
        place, velocity = (bodies.x[i], bodies.y[i]), (bodies.vx[i], bodies.vy[i])
        moves = (place, velocity, bodies.acceleration[i], bodies.spin[i], bodies.spin_rate[i])
        return ModeRecord(bodies.instant[i][0], 0, i, wall_body(k), before, self.modes[i], *moves)


def _left_of_both(press: Press, slip: float, rim: float, approach: float, restitution: float) -> tuple[float, float]:
    """Return what is left of slip and rim's speed after infinitely many bounces, which the clock can't tell apart.

    All their impulses are taken as one, ``(1 + e) w / (1 - e)``, and all that their hops add beside it: so the law of
    impact gives an end that rest and rolling are ends of too. What that leaves out is as small as these bounces are.
    """
    y, left = press.inverse_inertia_ratio, approach / (1.0 - restitution)
    pressed, fallen = (1.0 + restitution) * left, 2.0 * restitution * left / press.normal_m_s2
    most = (press.friction * pressed, press.rolling_resistance * pressed)
    s1 = slip + press.along_m_s2 * fallen
    by = held(s1, rim, most, y)
    slip = 0.0 if by.slip else s1 - by.friction * (1.0 + y) - by.rolling * y
    return slip, 0.0 if by.rim else rim - (by.friction + by.rolling) * y


def _mode(speed: float, along: float, *, holds: bool, rim_holds: bool) -> Mode:
    if holds:
        return Mode.ROLL if speed or along else Mode.REST
    return Mode.BLOCK if rim_holds else Mode.SLIDE
