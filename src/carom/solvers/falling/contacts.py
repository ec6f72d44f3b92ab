"""Which discs are in contact with a wall that gravity presses them to, how they move there, and when that changes.

In contact a disc moves on a parabola as well, with an acceleration along the wall: so all that is solved of discs in
flight is solved of these. What the law makes 0 is set to 0 and not computed: the gap and the speed along the normal of
a disc in contact, and the slip of one that rolls.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from carom.physics.contact_law import Press, left_of_slip, rates, take, zero_after
from carom.physics.features import Face
from carom.physics.wall_time import wall_speed
from carom.solvers.falling.grounds import grounds_of
from carom.solvers.plain.instants import NEVER, Instant, after
from carom.trace import Mode, ModeRecord, wall_body

if TYPE_CHECKING:
    from collections.abc import Iterator

    from carom.solvers.falling.bodies import FallingBodies
    from carom.solvers.falling.grounds import Ground


class _Zero(NamedTuple):
    """What is 0 where a mode ends."""

    slip: bool
    rim: bool


class Contacts:
    """The modes of all discs of a run.

    Attributes:
        grounds: What each disc is in contact with; None for nothing.
        modes: How each moves.
        ends: When each mode ends by itself: as a slip does that friction takes, or where the wall ends.
    """

    def __init__(self, bodies: FallingBodies) -> None:
        self.grounds: list[Ground | None] = [None] * len(bodies)
        self.modes = [Mode.FLIGHT] * len(bodies)
        self.ends: list[Instant] = [NEVER] * len(bodies)
        self._zero = [_Zero(slip=True, rim=False)] * len(bodies)
        self._over = [NEVER] * len(bodies)  # when each comes to the end of its face
        self._bodies = bodies

    def begin(self) -> Iterator[tuple[int, ModeRecord]]:
        """Begin the contact of each disc that lies on a half-plane or a face, as far as its numbers tell."""
        bodies = self._bodies
        for i in range(len(bodies)):
            for ground in grounds_of(bodies, i) if bodies.inverse_mass[i] > 0.0 else ():
                pull, gap_m = -self._press(i, ground).normal_m_s2, self._gap_resolution_m(i, ground)
                approach = self._approach(i, ground)
                # A disc on the other side of a face is behind it by more than its own diameter.
                touches = -bodies.radius[i] < ground.gap_of(bodies, i) <= gap_m
                if self.grounds[i] is None and touches and pull < 0.0 and approach * approach <= -2.0 * pull * gap_m:
                    yield i, self.land(i, ground, approach)

    def land(self, i: int, ground: Ground, approach: float) -> ModeRecord:
        """Begin the contact of disc `i`, brought there: nothing is left of its bounces."""
        bodies = self._bodies
        slip, rim, restitution = self._slip(i, ground), self._rim(i), bodies.restitution_of_wall(ground.wall)
        press = self._press(i, ground)
        sticks = bodies.sticks[i] and bodies.last_partner[i] == wall_body(ground.wall)
        # What an impact has given back of a slip is left; what infinitely many leave of it, `left_of_slip` says.
        sticks = sticks and bodies.contact_of_wall(ground.wall).restitution == 0.0
        # What the bounces left take of a slip that they do not end, contact takes in the time that they would last.
        by = 0.0
        if press.rolling_resistance and approach > 0.0 and restitution < 1.0:
            speed = slip - rim
            left, left_of_rim = _left_of_both(press, 0.0 if sticks else slip, rim, approach, restitution)
            if left == 0.0:
                by, slip, rim = speed + left_of_rim, 0.0, left_of_rim
            elif left_of_rim == 0.0:
                slip, rim = speed, 0.0
        elif sticks:  # what is left of the slip is rounding
            slip = 0.0
        elif approach > 0.0 and restitution < 1.0 and left_of_slip(press, slip, approach, restitution) == 0.0:
            by, slip = slip / (1.0 + press.inverse_inertia_ratio), 0.0
        if by:  # by friction, from the disc and from its rim
            self._push_along(i, ground, by)
        bodies.last_partner[i] = None
        return self._settle(i, ground, slip, rim)

    def _push_along(self, i: int, ground: Ground, by: float) -> None:
        """Take so much off the speed of disc `i` along its wall; what it has across is as it was."""
        bodies, (nx, ny) = self._bodies, ground.normal
        bodies.vx[i] -= by * ny
        bodies.vy[i] += by * nx

    def end_mode(self, i: int) -> ModeRecord | None:
        """Let disc `i`, brought there, go on after the end of its mode: its slip, or its spin, is 0, or both are.

        None where it has come to the end of its face, and does not fly off: how it goes on from there is not solved.
        """
        bodies, ground = self._bodies, self._ground(i)
        bodies.last_partner[i] = None  # a path of its own: what it has met before it may meet again
        if self._over[i] <= bodies.instant[i]:
            return self._leave_at_end(i, ground)
        zero = self._zero[i]
        return self._settle(i, ground, 0.0 if zero.slip else self._slip(i, ground), 0.0 if zero.rim else self._rim(i))

    def after_impact(self, i: int) -> ModeRecord | None:
        """Let disc `i`, struck just now, go on where it is in contact: it stays so, or leaves its wall.

        Return None where that changes nothing of how it moves but its velocity.

        It stays where its speed along the normal makes a hop that is lower than the gap is known to. One that is driven
        into its wall is not in contact either: it is in flight, and meets the wall at once.
        """
        bodies, ground = self._bodies, self.grounds[i]
        bodies.never_met[i] = ()
        if ground is None:
            return None
        approach, gap_m = self._approach(i, ground), self._gap_resolution_m(i, ground)
        if approach * approach <= 2.0 * self._press(i, ground).normal_m_s2 * gap_m:
            moved = (self.modes[i], bodies.acceleration[i], bodies.spin_rate[i])
            settled = self._settle(i, ground, self._slip(i, ground), self._rim(i))
            return None if moved == (self.modes[i], bodies.acceleration[i], bodies.spin_rate[i]) else settled
        self._set_on(i, ground)
        return self._take_off(i, ground)

    def _leave_at_end(self, i: int, ground: Ground) -> ModeRecord | None:
        bodies, vertex = self._bodies, ground.set_at_end(self._bodies, i)
        if vertex is None or not ground.flies_over(bodies, i, vertex):
            return None
        record = self._take_off(i, ground)
        # Its rim is on the vertex, and moves along it; the face it never comes back to on this path.
        bodies.touch_vertex(i, ground.wall, vertex)
        flat = [one for one in ground.never_met if isinstance(one, Face) or one.sector is None]
        bodies.never_met[i] = tuple(one for one in flat if one != vertex)
        return record

    def _take_off(self, i: int, ground: Ground) -> ModeRecord:
        bodies, before = self._bodies, self.modes[i]
        self.grounds[i] = None
        self.modes[i], self.ends[i] = Mode.FLIGHT, NEVER
        bodies.acceleration[i], bodies.spin_rate[i] = bodies.gravity, 0.0
        return self._record(i, ground.wall, before)

    def _ground(self, i: int) -> Ground:
        ground = self.grounds[i]
        if ground is None:
            raise TypeError(f"disc {i} is in contact with no wall")
        return ground

    def _press(self, i: int, ground: Ground) -> Press:
        bodies, (nx, ny) = self._bodies, ground.normal
        friction, gravity = bodies.contact_of_wall(ground.wall).friction, bodies.gravity
        along = float(wall_speed(*gravity, ny, -nx)[0])
        normal, ratio = -float(wall_speed(*gravity, nx, ny)[0]), bodies.inverse_inertia_ratio[i]
        return Press(normal, along, friction, ratio, bodies.rolling_resistance if ratio else 0.0)

    def _approach(self, i: int, ground: Ground) -> float:
        return -float(wall_speed(self._bodies.vx[i], self._bodies.vy[i], *ground.normal)[0])

    def _gap_resolution_m(self, i: int, ground: Ground) -> float:
        qx, qy, _, _ = ground.plane
        return self._bodies.resolution_m(i, qx, qy, 0.0)

    def _slip(self, i: int, ground: Ground) -> float:
        bodies, (nx, ny) = self._bodies, ground.normal
        return bodies.vx[i] * ny - bodies.vy[i] * nx + bodies.radius[i] * bodies.spin[i]

    def _rim(self, i: int) -> float:
        return self._bodies.radius[i] * self._bodies.spin[i]

    def _set_on(self, i: int, ground: Ground) -> None:
        """Take off what rounding has made of the gap of disc `i` to its ground."""
        bodies, (nx, ny) = self._bodies, ground.normal
        gap = ground.gap_of(bodies, i)
        bodies.x[i] -= gap * nx
        bodies.y[i] -= gap * ny

    def _settle(self, i: int, ground: Ground, slip: float, rim: float) -> ModeRecord:
        """Let disc `i` move on in contact, with a slip and a speed of its rim."""
        bodies, before = self._bodies, self.modes[i]
        nx, ny = ground.normal
        self._set_on(i, ground)
        press, speed = self._press(i, ground), bodies.vx[i] * ny - bodies.vy[i] * nx
        resists = press.rolling_resistance > 0.0
        if resists and slip == 0.0:  # of two numbers that the law makes one
            speed = speed if rim else 0.0
            rim = 0.0 - speed
        along, turns, sticks, blocks = rates(press, slip, rim)
        if sticks:
            speed = speed if press.inverse_inertia_ratio else 0.0
            bodies.spin[i] = 0.0 - speed / bodies.radius[i]
        elif resists and rim == 0.0:
            bodies.spin[i] = 0.0
        bodies.vx[i], bodies.vy[i] = speed * ny, 0.0 - speed * nx
        bodies.acceleration[i] = (along * ny, 0.0 - along * nx)
        bodies.spin_rate[i] = turns / bodies.radius[i]
        bodies.never_met[i] = ground.never_met
        self.grounds[i] = ground
        self.modes[i] = _mode(speed, along, sticks=sticks, blocks=blocks)
        # Of one that rolls both pass 0 at once, and that changes nothing without rolling resistance.
        waits = (zero_after(slip, along + turns), zero_after(rim, turns) if resists else math.inf)
        self._zero[i] = _Zero(*(wait == min(waits) or (sticks and resists) for wait in waits))
        zero, self._over[i] = (
            after(bodies.instant[i], wait) for wait in (min(waits), ground.ends_after(bodies, i, speed, along))
        )
        self.ends[i] = min(zero, self._over[i])
        if zero <= self._over[i]:
            self._over[i] = NEVER
        return self._record(i, ground.wall, before)

    def _record(self, i: int, k: int, before: Mode) -> ModeRecord:
        bodies = self._bodies
        place, velocity = (bodies.x[i], bodies.y[i]), (bodies.vx[i], bodies.vy[i])
        moves = (place, velocity, bodies.acceleration[i], bodies.spin[i], bodies.spin_rate[i])
        return ModeRecord(bodies.instant[i][0], 0, i, wall_body(k), before, self.modes[i], *moves)


def _left_of_both(press: Press, slip: float, rim: float, approach: float, restitution: float) -> tuple[float, float]:
    """Return what is left of slip and rim's speed after infinitely many bounces, which the clock can't tell apart.

    All their impulses are taken as one, ``(1 + e) w / (1 - e)``, and all that their hops add to it: so the law of
    impact gives an end that rest and rolling are ends of too. What that leaves out is as small as these bounces are.
    """
    y, left = press.inverse_inertia_ratio, approach / (1.0 - restitution)
    pressed, fallen = (1.0 + restitution) * left, 2.0 * restitution * left / press.normal_m_s2
    most = (press.friction * pressed, press.rolling_resistance * pressed)
    s1 = slip + press.along_m_s2 * fallen
    by = take(s1, rim, most, y)
    slip = 0.0 if by.sticks else s1 - by.friction * (1.0 + y) - by.rolling * y
    return slip, 0.0 if by.blocks else rim - (by.friction + by.rolling) * y


def _mode(speed: float, along: float, *, sticks: bool, blocks: bool) -> Mode:
    if sticks:
        return Mode.ROLL if speed or along else Mode.REST
    return Mode.BLOCK if blocks else Mode.SLIDE
