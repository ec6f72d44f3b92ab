"""The moving state of discs that fall: parabolas between impacts, and what a wall does to them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.physics.contact_law import frictional_impulses
from carom.physics.double_double import two_diff, two_sum
from carom.physics.feature_time import normal_at
from carom.physics.feature_time_falling import first_feature_falling
from carom.physics.features import Face, Mover
from carom.physics.pair_time import excess, pair_time
from carom.physics.pair_time_falling import encounter_time
from carom.physics.wall_time import wall_gap, wall_speed
from carom.physics.wall_time_falling import descent_time, return_time
from carom.solvers.impact.resolution import gap_resolution, size_of
from carom.solvers.plain.bodies import Bodies
from carom.solvers.plain.finite_walls import Hit, bend_of, gap_of, gap_resolution_m
from carom.solvers.plain.instants import NEVER, START, Instant, after, between
from carom.trace import NO_EDGE, wall_body

if TYPE_CHECKING:
    from carom.driving import Course
    from carom.physics.double_double import Pair
    from carom.physics.features import Arc, Feature
    from carom.solvers.run import Start
    from carom.trace import ImpactRecord


class FallingBodies(Bodies):
    """Positions and velocities under gravity; position and velocity of a disc are those of its own instant.

    From one bounce to the next on the same wall, nothing else between, a disc comes back with the very speed along the
    normal that it left with: `docs/gravity.md` says why a ball on a slope would never come to rest otherwise.
    """

    def __init__(self, start: Start) -> None:
        super().__init__(start)
        self.gravity = start.gravity_m_s2
        self.rolling_resistance = start.wall_rolling_resistance
        # Of a finite wall it goes by the place.
        nowhere = (math.nan, math.nan)
        self.pull = [
            wall_speed(*self.gravity, *wall[2:]) if isinstance(wall, tuple) else nowhere for wall in self.walls
        ]
        # Gravity, or what is left of it where a disc slides, rolls or rests.
        self.acceleration = [self.gravity if mass else (0.0, 0.0) for mass in self.inverse_mass]
        self.spin_rate = [0.0] * len(self)
        self.instant = [START] * len(self)
        # Speed along the normal after the last impact.
        self.leaving = [0.0] * len(self)
        # What of the wall that it is in contact with, or has left over an end, a disc does not meet on its path.
        self.never_met: list[tuple[Feature, ...]] = [()] * len(self)
        # Whether friction has taken all of the slip at the last bounce on a wall.
        self.sticks = [False] * len(self)

    def state_at(self, i: int, instant: Instant) -> tuple[float, float, float, float]:
        """Position and velocity of disc `i` at an instant, on its present parabola."""
        if self.inverse_mass[i] == 0.0:
            return self.driven_at(i, instant[0])
        if instant == self.instant[i]:
            return self.x[i], self.y[i], self.vx[i], self.vy[i]
        dt = between(self.instant[i], instant)
        gx, gy = self.acceleration[i]
        return (
            self.x[i] + dt * (self.vx[i] + 0.5 * gx * dt),
            self.y[i] + dt * (self.vy[i] + 0.5 * gy * dt),
            self.vx[i] + gx * dt,
            self.vy[i] + gy * dt,
        )

    def spin_at(self, i: int, instant: Instant) -> float:
        """Spin of disc `i` at an instant; only in contact does it change."""
        rate = self.spin_rate[i]
        return self.spin[i] + rate * between(self.instant[i], instant) if rate else self.spin[i]

    def bring_to(self, i: int, instant: Instant) -> None:
        """Bring disc `i` to an instant along its parabola."""
        if self.inverse_mass[i] == 0.0:
            self.x[i], self.y[i], self.vx[i], self.vy[i] = self.state_at(i, instant)
        else:
            self.spin[i] = self.spin_at(i, instant)
            self.x[i], self.y[i], self.vx[i], self.vy[i] = self.state_at(i, instant)
            self.instant[i] = instant
            self.time[i] = instant[0]

    def move_to(self, i: int, time_s: float) -> None:
        """Bring disc `i` to `time_s` along its parabola."""
        self.bring_to(i, (time_s, 0.0))

    def next_pair_impact(self, i: int, j: int) -> Instant:
        """Instant of the next impact of two discs on their present paths; infinity for never.

        Two that fall alike move straight as seen from each other, as in scenes without gravity; where one slides, rolls
        or rests, they move on a parabola.
        """
        if self.inverse_mass[i] == 0.0 or self.inverse_mass[j] == 0.0:
            return self._next_impact_on_fixed(*((j, i) if self.inverse_mass[i] == 0.0 else (i, j)))
        alike, just_met = self.acceleration[i] == self.acceleration[j], self.have_just_met(i, j)
        if just_met and alike:
            return NEVER
        start = max(self.instant[i], self.instant[j])
        first, second = self.state_at(i, start), self.state_at(j, start)
        if not alike:
            wait = encounter_time(
                (*(a - b for a, b in zip(first, second, strict=True)), self.radius[i]),
                (0.0, 0.0, self.radius[j]),
                self.relative_acceleration(i, j),
                self.leaving[i] if just_met else None,
            )
            return after(start, wait)
        wait = pair_time(*first, self.radius[i], *second, self.radius[j])
        return after(start, wait)

    def have_just_met(self, i: int, j: int) -> bool:
        """Whether both discs are on the paths that their impact gave them."""
        return self._has_just_met(i, j) and self._has_just_met(j, i)

    def relative_acceleration(self, i: int, j: int) -> tuple[float, float]:
        """Acceleration of disc `i` as seen from disc `j`."""
        (ax, ay), (bx, by) = self.acceleration[i], self.acceleration[j]
        return (ax - bx, ay - by)

    def are_parting(self, first: int, second: int) -> bool:
        """As without gravity of two movable discs, which fall alike; a fall onto what does not fall comes back."""
        falls_alike = second >= 0 and self.inverse_mass[first] > 0.0 and self.inverse_mass[second] > 0.0
        return falls_alike and super().are_parting(first, second)

    def earliest_of_pair(self, i: int, j: int) -> Instant | None:
        """Instant before which two discs that do not fall alike can't meet; None for two that do.

        The quartic costs much, and mostly the disc has met somebody else before its turn comes. A speed of v + g t at
        most covers the gap no earlier than ``v t + g t^2/2`` does; what both may be off by rounding is taken off.
        """
        fixed = [disc for disc in (i, j) if self.inverse_mass[disc] == 0.0]
        if len(fixed) == 2 or (not fixed and self.acceleration[i] == self.acceleration[j]):
            return None
        start = max(self.instant[disc] for disc in (i, j) if disc not in fixed)
        if (i not in fixed and self.last_partner[i] == j) or (j not in fixed and self.last_partner[j] == i):
            return start
        (x, y, vx, vy), (fx, fy, fvx, fvy) = self.state_at(i, start), self.state_at(j, start)
        gap = math.hypot(x - fx, y - fy) - (self.radius[i] + self.radius[j])
        gap -= gap_resolution(size_of(x, y, self.radius[i]) + size_of(fx, fy, self.radius[j]))
        if not gap > 0.0:
            return start
        pull = math.hypot(*self.relative_acceleration(i, j))
        speed = math.hypot(vx - fvx, vy - fvy)
        if (path := self.driven.get(j if j in self.driven else i)) is not None and len(path.legs) > 1:
            speed = math.hypot(vx, vy) + math.hypot(fvx, fvy) + path.fastest
        if speed == 0.0 == pull:  # it rests
            return NEVER
        wait = 2.0 * gap / (speed + math.sqrt(speed * speed + 2.0 * pull * gap))
        return after(start, 0.99 * wait)

    def _next_impact_on_fixed(self, i: int, fixed: int) -> Instant:
        """Instant of the next impact of disc `i` on one that no impact moves."""
        if self.inverse_mass[i] == 0.0:
            return NEVER
        for number, leg in enumerate(self.legs_ahead(fixed, self.time[i])):
            begin = self.instant[i] if number == 0 else (leg.begin_s, 0.0)
            x, y, vx, vy = self.state_at(i, begin)
            at_x, at_y, drive_x, drive_y = (
                self._driven_on(fixed, leg, begin[0]) if fixed in self.driven else self.state_at(fixed, begin)
            )
            disc = (x, y, vx - drive_x, vy - drive_y, self.radius[i])
            leaving = self.leaving[i] if number == 0 and self.last_partner[i] == fixed else None
            wait = encounter_time(disc, (at_x, at_y, self.radius[fixed]), self.acceleration[i], leaving)
            if (met := after(begin, wait))[0] < leg.end_s:
                return met
        return NEVER

    def next_wall_impact(self, i: int, k: int) -> Instant:
        """Instant of the next impact of disc `i` on wall `k` on its present path; infinity for never."""
        if self.inverse_mass[i] == 0.0:
            return NEVER
        for number, leg in enumerate(self.legs_ahead(wall_body(k), self.time[i])):
            begin = self.instant[i] if number == 0 else (leg.begin_s, 0.0)
            wait = self._wait_for_wall(i, k, leg, begin[0], just_left=number == 0)
            if (met := after(begin, wait))[0] < leg.end_s:
                return met
        return NEVER

    def _wait_for_wall(self, i: int, k: int, leg: Course, begin_s: float, *, just_left: bool) -> float:
        wall, left = self.walls[k], just_left and self.last_partner[i] == wall_body(k)
        if isinstance(wall, tuple) and left:
            pull = self._pull(i, k)
            return return_time((self.leaving[i], 0.0), pull) if pull[0] < 0.0 else math.inf
        x, y, vx, vy = self.seen_from(i, k) if just_left else self._seen_on(i, leg, begin_s)
        if isinstance(wall, tuple):
            gap = wall_gap(x, y, self.radius[i], *wall)
            return descent_time(gap, wall_speed(vx, vy, *wall[2:]), self._pull(i, k))
        disc, last = Mover.at((x, y), (vx, vy), self.radius[i]), self.last_feature(i, k) if left else None
        never = self.never_met[i]
        features = [part for part in self._finite(k).features if part.feature not in never]
        leaving = self.leaving[i] if left else 0.0
        wait, part = first_feature_falling(disc, features, self.acceleration[i], last, leaving)
        if part is not None:
            self._expected[i, k] = (part, False)
        return wait

    def _pull(self, i: int, k: int) -> Pair:
        """Acceleration of disc `i` along the normal of half-plane `k`, as an error-free pair."""
        nx, ny = self.normal(i, k)
        falls = self.acceleration[i] is self.gravity
        return self.pull[k] if falls else wall_speed(*self.acceleration[i], nx, ny)

    def returns_to(self, i: int, k: int, time_s: float) -> bool:
        """Whether disc `i` comes back then to what it has left, where that is flat: with the speed that it left with.

        Of a driven wall it does not where the wall is on another leg of its path by then.
        """
        if self.last_partner[i] != wall_body(k) or self.legs_ahead(wall_body(k), self.time[i])[0].end_s <= time_s:
            return False
        last = self.last_feature(i, k)
        return self.finite[k] is None or (isinstance(last, Face) and self._expected[i, k][0].feature is last)

    def contact_with_wall(self, i: int, k: int, again: bool) -> tuple[float, float, float]:
        """Speed at which disc `i`, brought there, meets wall `k`; acceleration and resolution of their gap.

        `again` is what `returns_to` has said of it.
        """
        wall = self.walls[k]
        if not isinstance(wall, tuple):
            self.last_hit[i] = self._hit(i, k)
        (nx, ny), (_, _, vx, vy) = self.normal(i, k), self.seen_from(i, k)
        approach = self.leaving[i] if again else -float(wall_speed(vx, vy, nx, ny)[0])
        if isinstance(wall, tuple):
            return approach, float(self._pull(i, k)[0]), self.resolution_m(i, *wall[:2], 0.0)
        disc, feature, across = self.mover(i, k), self._expected[i, k][0].feature, vx * ny - vy * nx
        ax, ay = self.acceleration[i]
        pull = ax * nx + ay * ny + across * across * bend_of(feature, disc)
        return approach, pull, gap_resolution_m(size_of(self.x[i], self.y[i], self.radius[i]), feature)

    def resolution_m(self, i: int, x: float, y: float, radius: float) -> float:
        """Return how well the gap between disc `i` and a body is known, metres."""
        return gap_resolution(size_of(self.x[i], self.y[i], self.radius[i]) + size_of(x, y, radius))

    def contact_with_disc(self, i: int, j: int) -> tuple[float, float, float]:
        """Speed at which disc `i` meets disc `j`, both brought there; acceleration and resolution of their gap."""
        dx, dy = self.x[i] - self.x[j], self.y[i] - self.y[j]
        ux, uy = self.vx[i] - self.vx[j], self.vy[i] - self.vy[j]
        ax, ay = self.relative_acceleration(i, j)
        distance = math.hypot(dx, dy)
        opening = (dx * ux + dy * uy) / distance
        across = (dx * uy - dy * ux) / distance
        pull = (dx * ax + dy * ay) / distance + across * across / distance
        return -opening, pull, self.resolution_m(i, self.x[j], self.y[j], self.radius[j])

    def leave_fixed(self, i: int, fixed: int) -> None:
        """Set disc `i`, which has just hit an immovable one, on its rim."""
        dx, dy = self.x[i] - self.x[fixed], self.y[i] - self.y[fixed]
        distance = math.hypot(dx, dy)
        # From the difference of squares: that of two distances would be rounded as these are, however large.
        reach = two_sum(self.radius[i], self.radius[fixed])
        beyond = excess(two_diff(self.x[i], self.x[fixed]), two_diff(self.y[i], self.y[fixed]), reach)[0]
        part = beyond / ((distance + reach[0]) * distance)
        self.x[i] -= part * dx
        self.y[i] -= part * dy

    def part(self, i: int, j: int, approach: float) -> None:
        """Note the speed at which discs `i` and `j` leave each other, who have met at one of `approach`."""
        self.last_partner[i], self.last_partner[j] = j, i
        self.leaving[i] = self.leaving[j] = self.restitution * max(0.0, approach)

    def bounce(self, i: int, k: int, approach: float) -> ImpactRecord:
        """Give disc `i`, brought to its impact on wall `k`, its velocity after it, and set it on the wall.

        At the impact the gap is 0. What rounding makes of it is taken off, so that it can't add up over many bounces.
        """
        wall, (nx, ny) = self.walls[k], self.normal(i, k)
        before, spin, restitution = (self.vx[i], self.vy[i]), self.spin[i], self.restitution_of_wall(k)
        x, y, vx, vy = self.seen_from(i, k)
        if isinstance(wall, tuple):
            gap = float(wall_gap(x, y, self.radius[i], *wall)[0])
        else:
            gap = gap_of(self.mover(i, k), self._expected[i, k][0].feature)
        self.x[i] -= gap * nx
        self.y[i] -= gap * ny
        self.sticks[i] = False
        if approach > 0.0:  # rounding can turn the weakest of grazes into a separation: an impact never pulls
            self.leave_wall(i, k, restitution * approach)
            if self.rubs_on(k):
                self.slide_on_wall(i, k, (vx, vy), (1.0 + restitution) * approach)
        self.last_partner[i] = wall_body(k)
        return self.wall_record(i, k, before, spin)

    def rubs_on(self, k: int) -> bool:
        """Whether an impact on wall `k` changes more than the speed along its normal."""
        return super().rubs_on(k) or self.rolling_resistance > 0.0

    def slide_on_wall(self, i: int, k: int, before: tuple[float, float], pressed: float) -> None:
        """Let the friction of a wall act, as without gravity, and its rolling resistance.

        Note whether friction has taken all of the slip; where rolling resistance has taken all of the spin, it is 0.
        """
        (nx, ny), y = self.normal(i, k), self.inverse_inertia_ratio[i]
        rim, slip = self.radius[i] * self.spin[i], self.slip(i, k, before)
        by = frictional_impulses(self.contact_of_wall(k), self.rolling_resistance, slip, rim, y, pressed)
        self.sticks[i] = by.sticks
        self.vx[i] -= by.friction * ny
        self.vy[i] += by.friction * nx
        self.spin[i] = 0.0 if by.blocks else self.spin[i] - (by.friction + by.rolling) * y / self.radius[i]

    def touch_vertex(self, i: int, k: int, vertex: Arc) -> None:
        """Note that disc `i` leaves a vertex of wall `k`, along which its rim moves: the gap and its rate are 0."""
        self.last_partner[i], self.leaving[i] = wall_body(k), 0.0
        self.last_hit[i] = Hit(vertex, normal_at(vertex, self.mover(i, k)), NO_EDGE)

    def leave_wall(self, i: int, k: int, speed: float) -> None:
        """Let disc `i` leave wall `k`, on which it is, at a speed along the normal: 0 for one that rests there."""
        nx, ny = self.normal(i, k)
        _, _, vx, vy = self.seen_from(i, k)
        change = speed - float(wall_speed(vx, vy, nx, ny)[0])
        self.vx[i] += change * nx
        self.vy[i] += change * ny
        self.leaving[i] = speed
