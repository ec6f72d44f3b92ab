"""The moving state of discs that fall: parabolas between impacts, and what a wall does to them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.physics.double_double import two_diff, two_sum
from carom.physics.feature_time_falling import first_feature_falling
from carom.physics.features import Face
from carom.physics.pair_time import excess, pair_time
from carom.physics.pair_time_falling import encounter_time
from carom.physics.wall_time import wall_gap, wall_speed
from carom.physics.wall_time_falling import descent_time, return_time
from carom.solvers.impact.resolution import gap_resolution, size_of
from carom.solvers.plain.bodies import Bodies
from carom.solvers.plain.finite_walls import bend_of, gap_of, gap_resolution_m
from carom.solvers.plain.instants import NEVER, START, Instant, after, between
from carom.trace import wall_body

if TYPE_CHECKING:
    from carom.solvers.run import Start
    from carom.trace import ImpactRecord

__all__ = ["FallingBodies"]


class FallingBodies(Bodies):
    """Positions and velocities under gravity; position and velocity of a disc are those of its own instant.

    From one bounce to the next on the same wall, nothing else between, a disc comes back with the very speed along the
    normal that it left with: `docs/gravity.md` says why a ball on a slope would never come to rest otherwise.
    """

    def __init__(self, start: Start) -> None:
        super().__init__(start)
        self.gravity = start.gravity_m_s2
        # Of a finite wall it goes by the place.
        nowhere = (math.nan, math.nan)
        self.pull = [
            wall_speed(*self.gravity, *wall[2:]) if isinstance(wall, tuple) else nowhere for wall in self.walls
        ]
        self.instant = [START] * len(self)
        # Speed along the normal after the last impact, where that was on a wall or an immovable disc.
        self.leaving = [0.0] * len(self)

    def state_at(self, i: int, instant: Instant) -> tuple[float, float, float, float]:
        """Position and velocity of disc `i` at an instant, on its present parabola."""
        if self.inverse_mass[i] == 0.0:
            return self.x[i], self.y[i], 0.0, 0.0
        if instant == self.instant[i]:
            return self.x[i], self.y[i], self.vx[i], self.vy[i]
        dt = between(self.instant[i], instant)
        gx, gy = self.gravity
        return (
            self.x[i] + dt * (self.vx[i] + 0.5 * gx * dt),
            self.y[i] + dt * (self.vy[i] + 0.5 * gy * dt),
            self.vx[i] + gx * dt,
            self.vy[i] + gy * dt,
        )

    def bring_to(self, i: int, instant: Instant) -> None:
        """Bring disc `i` to an instant along its parabola."""
        if self.inverse_mass[i] > 0.0:
            self.x[i], self.y[i], self.vx[i], self.vy[i] = self.state_at(i, instant)
            self.instant[i] = instant
            self.time[i] = instant[0]

    def move_to(self, i: int, time_s: float) -> None:
        """Bring disc `i` to `time_s` along its parabola."""
        self.bring_to(i, (time_s, 0.0))

    def next_pair_impact(self, i: int, j: int) -> Instant:
        """Instant of the next impact of two discs on their present paths; infinity for never.

        Two movable ones fall alike, so their relative motion is straight, and it is that of scenes without gravity.
        """
        if self.inverse_mass[i] == 0.0 or self.inverse_mass[j] == 0.0:
            return self._next_impact_on_fixed(*((j, i) if self.inverse_mass[i] == 0.0 else (i, j)))
        if self._has_just_met(i, j) and self._has_just_met(j, i):
            return NEVER
        start = max(self.instant[i], self.instant[j])
        first, second = self.state_at(i, start), self.state_at(j, start)
        wait = pair_time(*first, self.radius[i], *second, self.radius[j])
        return after(start, wait)

    def are_parting(self, first: int, second: int) -> bool:
        """As without gravity of two movable discs, which fall alike; a fall onto what does not fall comes back."""
        falls_alike = second >= 0 and self.inverse_mass[first] > 0.0 and self.inverse_mass[second] > 0.0
        return falls_alike and super().are_parting(first, second)

    def earliest_on_fixed(self, i: int, j: int) -> Instant | None:
        """Instant before which a movable and an immovable disc can't meet; None for two of a kind.

        The quartic costs much, and mostly the disc has met somebody else before its turn comes. A speed of v + g t at
        most covers the gap no earlier than ``v t + g t^2/2`` does; what both may be off by rounding is taken off.
        """
        if (self.inverse_mass[i] == 0.0) == (self.inverse_mass[j] == 0.0):
            return None
        i, fixed = (j, i) if self.inverse_mass[i] == 0.0 else (i, j)
        if self.last_partner[i] == fixed:
            return self.instant[i]
        reach = self.radius[i] + self.radius[fixed]
        gap = math.hypot(self.x[i] - self.x[fixed], self.y[i] - self.y[fixed]) - reach
        gap -= self._resolution_m(i, self.x[fixed], self.y[fixed], self.radius[fixed])
        if not gap > 0.0:
            return self.instant[i]
        speed, pull = math.hypot(self.vx[i], self.vy[i]), math.hypot(*self.gravity)
        wait = 2.0 * gap / (speed + math.sqrt(speed * speed + 2.0 * pull * gap))
        return after(self.instant[i], 0.99 * wait)

    def _next_impact_on_fixed(self, i: int, fixed: int) -> Instant:
        """Instant of the next impact of disc `i` on an immovable disc."""
        if self.inverse_mass[i] == 0.0:
            return NEVER
        disc = (*self.state_at(i, self.instant[i]), self.radius[i])
        leaving = self.leaving[i] if self.last_partner[i] == fixed else None
        wait = encounter_time(disc, (self.x[fixed], self.y[fixed], self.radius[fixed]), self.gravity, leaving)
        return after(self.instant[i], wait)

    def next_wall_impact(self, i: int, k: int) -> Instant:
        """Instant of the next impact of disc `i` on wall `k` on its present path; infinity for never."""
        if self.inverse_mass[i] == 0.0:
            return NEVER
        wall = self.walls[k]
        if not isinstance(wall, tuple):
            last = self.last_feature(i, k)
            wait, part = first_feature_falling(
                self.mover(i), self._finite(k).features, self.gravity, last, self.leaving[i]
            )
            if part is not None:
                self._expected[i, k] = (part, False)
        elif self.last_partner[i] == wall_body(k):
            wait = return_time((self.leaving[i], 0.0), self.pull[k]) if self.pull[k][0] < 0.0 else math.inf
        else:
            gap = wall_gap(self.x[i], self.y[i], self.radius[i], *wall)
            wait = descent_time(gap, wall_speed(self.vx[i], self.vy[i], *wall[2:]), self.pull[k])
        return after(self.instant[i], wait)

    def returns_to(self, i: int, k: int) -> bool:
        """Whether disc `i` comes back to what it has left, where that is flat: with the speed that it left with."""
        if self.last_partner[i] != wall_body(k):
            return False
        last = self.last_feature(i, k)
        return self.finite[k] is None or (isinstance(last, Face) and self._expected[i, k][0].feature is last)

    def contact_with_wall(self, i: int, k: int, again: bool) -> tuple[float, float, float]:
        """Speed at which disc `i`, brought there, meets wall `k`; acceleration and resolution of their gap.

        `again` is what `returns_to` has said of it.
        """
        wall = self.walls[k]
        if not isinstance(wall, tuple):
            return self._contact_with_finite(i, k, again)
        qx, qy, nx, ny = wall
        approach = self.leaving[i] if again else -float(wall_speed(self.vx[i], self.vy[i], nx, ny)[0])
        return approach, float(self.pull[k][0]), self._resolution_m(i, qx, qy, 0.0)

    def _contact_with_finite(self, i: int, k: int, again: bool) -> tuple[float, float, float]:
        disc, feature = self.mover(i), self._expected[i, k][0].feature
        self.last_hit[i] = self._hit(i, k)
        nx, ny = self.normal(i, k)
        approach = self.leaving[i] if again else -float(wall_speed(self.vx[i], self.vy[i], nx, ny)[0])
        across = self.vx[i] * ny - self.vy[i] * nx
        pull = self.gravity[0] * nx + self.gravity[1] * ny + across * across * bend_of(feature, disc)
        return approach, pull, gap_resolution_m(disc, feature)

    def _resolution_m(self, i: int, x: float, y: float, radius: float) -> float:
        """Return how well the gap between disc `i` and a body is known, metres."""
        return gap_resolution(size_of(self.x[i], self.y[i], self.radius[i]) + size_of(x, y, radius))

    def contact_with_fixed(self, i: int, fixed: int) -> tuple[float, float, float]:
        """Speed at which disc `i`, brought there, meets an immovable one; acceleration and resolution of their gap."""
        dx, dy = self.x[i] - self.x[fixed], self.y[i] - self.y[fixed]
        distance = math.hypot(dx, dy)
        opening = (dx * self.vx[i] + dy * self.vy[i]) / distance
        across = (dx * self.vy[i] - dy * self.vx[i]) / distance
        pull = (dx * self.gravity[0] + dy * self.gravity[1]) / distance + across * across / distance
        return -opening, pull, self._resolution_m(i, self.x[fixed], self.y[fixed], self.radius[fixed])

    def leave_fixed(self, i: int, fixed: int, record: ImpactRecord) -> None:
        """Set disc `i`, which has just hit an immovable one, on its rim, and keep the speed at which it leaves."""
        dx, dy = self.x[i] - self.x[fixed], self.y[i] - self.y[fixed]
        distance = math.hypot(dx, dy)
        # From the difference of squares: that of two distances would be rounded as these are, however large.
        reach = two_sum(self.radius[i], self.radius[fixed])
        beyond = excess(two_diff(self.x[i], self.x[fixed]), two_diff(self.y[i], self.y[fixed]), reach)[0]
        part = beyond / ((distance + reach[0]) * distance)
        self.x[i] -= part * dx
        self.y[i] -= part * dy
        before = record.velocity_first_before if record.first == i else record.velocity_second_before
        self.leaving[i] = self.restitution * max(0.0, -(dx * before[0] + dy * before[1]) / distance)

    def bounce(self, i: int, k: int, approach: float) -> ImpactRecord:
        """Give disc `i`, brought to its impact on wall `k`, its velocity after it, and set it on the wall.

        At the impact the gap is 0. What rounding makes of it is taken off, so that it can't add up over many bounces.
        """
        wall, (nx, ny) = self.walls[k], self.normal(i, k)
        before, spin, restitution = (self.vx[i], self.vy[i]), self.spin[i], self.restitution_of_wall(k)
        if isinstance(wall, tuple):
            gap = float(wall_gap(self.x[i], self.y[i], self.radius[i], *wall)[0])
        else:
            gap = gap_of(self.mover(i), self._expected[i, k][0].feature)
        self.x[i] -= gap * nx
        self.y[i] -= gap * ny
        if approach > 0.0:  # rounding can turn the weakest of grazes into a separation: an impact never pulls
            self.leave_wall(i, k, restitution * approach)
            if self.contact_of_wall(k).friction > 0.0:
                self.slide_on_wall(i, k, before, (1.0 + restitution) * approach)
        self.last_partner[i] = wall_body(k)
        return self.wall_record(i, k, before, spin)

    def leave_wall(self, i: int, k: int, speed: float) -> None:
        """Let disc `i` leave wall `k`, on which it is, at a speed along the normal: 0 for one that rests there."""
        nx, ny = self.normal(i, k)
        change = speed - float(wall_speed(self.vx[i], self.vy[i], nx, ny)[0])
        self.vx[i] += change * nx
        self.vy[i] += change * ny
        self.leaving[i] = speed
