"""The states of a few bodies on plain floats, set going from anywhere in a run.

The solvers begin with discs that are apart. A window begins wherever the run is, in overlap too, where what overlaps
and closes meets at once. The times of impact and the law are those of `carom.physics`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from carom.comparator.local_truth.law import TOUCH, Law, Pair
from carom.disc_arrays import HalfPlane
from carom.driving import Drive
from carom.physics.contact_law import frictional_impulses
from carom.physics.feature_time import normal_at
from carom.physics.feature_time_falling import first_feature_falling
from carom.physics.features import Feature, Mover
from carom.physics.friction import pair_tangential_impulse
from carom.physics.impact_law import normal_impulse
from carom.physics.pair_time import pair_time
from carom.physics.pair_time_falling import encounter_time
from carom.physics.wall_time import wall_gap, wall_speed, wall_time
from carom.physics.wall_time_falling import descent_time
from carom.solvers.plain.finite_walls import FiniteWall


class Separation(NamedTuple):
    """How two bodies are to each other: gap, unit normal from first to second, and the speed at which they close."""

    gap: float
    normal: tuple[float, float]
    closing: float


class BodyStates:
    """Position, velocity and spin of some discs, by number, at a time since the run's start."""

    __slots__ = ("law", "met", "spin", "time_s", "velocity", "xy")

    def __init__(
        self,
        law: Law,
        xy: dict[int, tuple[float, float]],
        velocity: dict[int, tuple[float, float]],
        spin: dict[int, float],
        time_s: float,
    ) -> None:
        self.law, self.xy, self.velocity, self.spin, self.time_s = law, xy, velocity, spin, time_s
        #: What of each finite wall was found to be met next.
        self.met: dict[Pair, Feature] = {}

    def copy(self) -> BodyStates:
        """Return a state of its own."""
        return BodyStates(self.law, dict(self.xy), dict(self.velocity), dict(self.spin), self.time_s)

    def take(self, other: BodyStates) -> None:
        """Take in the discs of another."""
        self.xy |= other.xy
        self.velocity |= other.velocity
        self.spin |= other.spin

    def only(self, disc: int) -> BodyStates:
        """Return the state of one of them."""
        alone = {disc: self.xy[disc]}, {disc: self.velocity[disc]}, {disc: self.spin[disc]}
        return BodyStates(self.law, *alone, self.time_s)

    def of_body(self, body: int) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the position and velocity of a body: of a wall how far it has moved."""
        if body < self.law.n:
            return self.xy[body], self.velocity[body]
        wall, time_s = body - self.law.n, self.time_s
        leg = self.law.wall_drives[wall].leg_at(time_s * TOUCH)
        return leg.moved_at(time_s), leg.velocity

    def _mover(self, disc: int, body: int) -> Mover:
        """Return a disc as a wall sees it."""
        wall = body - self.law.n
        place = self.law.seen_from(wall, *self.xy[disc], self.time_s)
        return Mover.at(place, self.velocity[disc], self.law.radius[disc], self.law.wall_velocity(wall, self.time_s))

    def fly(self, seconds: float, resting: Pair | None = None) -> None:
        """Move all discs along their free paths; what rests on a wall is not pulled into it."""
        law, half = self.law, 0.5 * seconds * seconds
        # There is no gravity where something slows discs down, so that only one of them bends a path in time.
        for disc, (x, y) in self.xy.items():
            if law.disc_drives and (drive := law.disc_drives.get(disc)) is not None and len(drive.legs) > 1:
                self._drive_on(disc, drive, seconds)
                continue
            vx, vy = self.velocity[disc]
            flown, kept = seconds, 1.0
            if law.slows:
                speed = math.hypot(vx, vy)
                flown, kept = law.slowing.flown(seconds, speed), law.slowing.kept(seconds, speed)
            ax, ay = law.pulls[disc]
            if resting is not None and resting[0] == disc and resting[1] >= law.n:
                _, nx, ny = law.side_of(resting[1] - law.n, x, y, self.time_s)
                pull = min(ax * nx + ay * ny, 0.0)
                ax, ay = ax - pull * nx, ay - pull * ny
            self.xy[disc] = (x + vx * flown + ax * half, y + vy * flown + ay * half)
            self.velocity[disc] = (vx * kept + ax * seconds, vy * kept + ay * seconds)
            self.spin[disc] *= kept
        self.time_s += seconds

    def _drive_on(self, disc: int, drive: Drive, seconds: float) -> None:
        begin_s, end_s = self.time_s, self.time_s + seconds
        leg = drive.leg_at(end_s * TOUCH)
        was, now = drive.leg_at(begin_s * TOUCH).moved_at(begin_s), leg.moved_at(end_s)
        x, y = self.xy[disc]
        self.xy[disc], self.velocity[disc] = (x + now[0] - was[0], y + now[1] - was[1]), leg.velocity

    def contact(self, pair: Pair, feature: Feature | None = None) -> Separation:
        """Return how the two bodies of a pair are to each other; of a finite wall, with `feature`, at what of it."""
        (i, j), law = pair, self.law
        (x, y), (vx, vy) = self.xy[i], self.velocity[i]
        if j >= law.n:
            away, nx, ny = law.side_of(j - law.n, x, y, self.time_s)
            if feature is not None:
                nx, ny = normal_at(feature, self._mover(i, j))
            wx, wy = law.wall_velocity(j - law.n, self.time_s)
            return Separation(away - law.radius[i], (-nx, -ny), -((vx - wx) * nx + (vy - wy) * ny))
        dx, dy = self.xy[j][0] - x, self.xy[j][1] - y
        distance = math.hypot(dx, dy)
        ux, uy = self.velocity[j][0] - vx, self.velocity[j][1] - vy
        if distance == 0.0:  # of centres that coincide no line is given; from there on they part
            distance, speed = 0.0, math.hypot(ux, uy)
            normal = (ux / speed, uy / speed) if speed > 0.0 else (1.0, 0.0)
        else:
            normal = (dx / distance, dy / distance)
        closing = -(ux * normal[0] + uy * normal[1])
        return Separation(distance - law.radius[i] - law.radius[j], normal, closing)

    def overlaps(self, pair: Pair) -> bool:
        """Whether the bodies of a pair overlap, or touch: found at the very instant, rounding may leave a gap."""
        (i, j), law = pair, self.law
        x, y = self.xy[i]
        reach = law.radius[i] * TOUCH
        if j >= law.n:
            wall = law.walls[j - law.n]
            wide = 0.0 if isinstance(wall, tuple) else (TOUCH - 1.0) * wall.outline.half_width
            return law.side_of(j - law.n, x, y, self.time_s)[0] <= reach + wide
        ox, oy = self.xy[j]
        reach += law.radius[j] * TOUCH
        return (ox - x) ** 2 + (oy - y) ** 2 <= reach * reach

    def wait(self, pair: Pair, last: Feature | None = None) -> float:
        """Return the seconds until the bodies of a pair meet, infinity for never; 0 where they overlap and close.

        `last` is what the disc has just met of a finite wall.
        """
        if self.law.slowing.table_m_s2:
            return self._wait_on_table(pair, last, None)
        wait = self.law.slowing.damping.damped(self.undamped_wait(pair, last))
        later = self.law.later_legs(pair, self.time_s)
        return wait if not later or self.time_s + wait < later[0].begin_s else self.wait_later(pair)

    def wait_later(self, pair: Pair) -> float:
        """Return the seconds until they meet on a leg that a driven one of them has yet to begin."""
        for leg in self.law.later_legs(pair, self.time_s):
            there = self.copy()
            there.fly(leg.begin_s - self.time_s)
            wait = there.undamped_wait(pair, None)
            if there.time_s + wait < leg.end_s:
                self.met |= {pair: there.met[pair]} if pair in there.met else {}
                return there.time_s + wait - self.time_s
        return math.inf

    def wait_again(self, pair: Pair) -> float:
        """Return the seconds until two that have just met meet once more before a third turns one of them.

        That may be on a leg of a driven one; and on a table, which slows each down in a direction of its own.
        """
        if not self.law.slowing.table_m_s2:
            return self.wait_later(pair)
        return self._wait_on_table(pair, None, max(0.0, -self.contact(pair).closing))

    def _wait_on_table(self, pair: Pair, last: Feature | None, leaving: float | None) -> float:
        """Return what `wait` does, from one stop to the next; `leaving` is how fast two part that have just met."""
        (i, j), law, there, passed = pair, self.law, self.of_pair(pair), 0.0
        speeds = [math.hypot(*velocity) for velocity in there.velocity.values()]
        # Both stop before. A hundredth is far more than either side is rounded by: whatever is nearer is solved for.
        if 0.99 * self.contact(pair).gap > sum(speed * speed for speed in speeds) / (2.0 * law.slowing.table_m_s2):
            return math.inf
        while True:
            stops = min(law.slowing.stops_s(math.hypot(*there.velocity[disc])) for disc in there.xy)
            (x, y), (vx, vy) = there.xy[i], there.velocity[i]
            pull = law.slowed(i, there.velocity[i])
            if j < law.n:
                (ox, oy), (ux, uy), other = there.xy[j], there.velocity[j], law.slowed(j, there.velocity[j])
                one = (x - ox, y - oy, vx - ux, vy - uy, law.radius[i])
                wait = encounter_time(one, (0.0, 0.0, law.radius[j]), (pull[0] - other[0], pull[1] - other[1]), leaving)
            elif isinstance(wall := law.walls[j - law.n], tuple):
                wait = self._wall_wait(i, wall, there, pull)
            else:
                disc = Mover.at((x, y), (vx, vy), law.radius[i])
                wait, part = first_feature_falling(disc, wall.features, pull, last, self._leaving(disc, last))
                if part is not None:
                    self.met[pair] = part.feature
            if wait <= stops:
                return passed + wait
            if stops == math.inf:
                return math.inf
            there.fly(stops)
            passed, leaving, last = passed + stops, None, None

    def of_pair(self, pair: Pair) -> BodyStates:
        """Return the state of the discs of a pair alone."""
        alone = self.only(pair[0])
        if pair[1] < self.law.n:
            alone.take(self.only(pair[1]))
        return alone

    def _wall_wait(self, i: int, wall: HalfPlane, there: BodyStates, pull: tuple[float, float]) -> float:
        (x, y), (vx, vy), normal = there.xy[i], there.velocity[i], wall[2:]
        gap, speed = wall_gap(x, y, self.law.radius[i], *wall), wall_speed(vx, vy, *normal)
        return descent_time(gap, speed, wall_speed(*pull, *normal))

    def undamped_wait(self, pair: Pair, last: Feature | None) -> float:
        """Return what `wait` does, without damping, and as if a driven body of the pair went on as it does now."""
        (i, j), law = pair, self.law
        (x, y), (vx, vy), radius = self.xy[i], self.velocity[i], law.radius[i]
        if j >= law.n:
            wall = law.walls[j - law.n]
            if not isinstance(wall, tuple):
                return self._finite_wait(pair, wall, last)
            x, y = law.seen_from(j - law.n, x, y, self.time_s)
            wx, wy = law.wall_velocity(j - law.n, self.time_s)
            vx, vy = vx - wx, vy - wy
            if not law.falls(i):
                return wall_time(x, y, vx, vy, radius, *wall)
            normal = wall[2:]
            return descent_time(
                wall_gap(x, y, radius, *wall), wall_speed(vx, vy, *normal), wall_speed(*law.gravity, *normal)
            )
        (ox, oy), (ux, uy) = self.xy[j], self.velocity[j]
        if law.falls(i) == law.falls(j):  # gravity moves both alike
            return pair_time(x, y, vx, vy, radius, ox, oy, ux, uy, law.radius[j])
        if law.falls(i):
            return encounter_time((x, y, vx - ux, vy - uy, radius), (ox, oy, law.radius[j]), law.gravity)
        return encounter_time((ox, oy, ux - vx, uy - vy, law.radius[j]), (x, y, radius), law.gravity)

    def _finite_wait(self, pair: Pair, wall: FiniteWall, last: Feature | None) -> float:
        i, law = pair[0], self.law
        disc = self._mover(*pair)
        if law.falls(i):
            wait, part = first_feature_falling(disc, wall.features, law.gravity, last, self._leaving(disc, last))
        else:
            wait, part, _ = wall.next_time(disc, last)
        if part is not None:
            self.met[pair] = part.feature
        return wait

    def _leaving(self, disc: Mover, last: Feature | None) -> float:
        if last is None:
            return 0.0
        nx, ny = normal_at(last, disc)
        return max(0.0, disc.ux[0] * nx + disc.uy[0] * ny)

    def strike(self, pair: Pair, feature: Feature | None = None) -> None:
        """Give the bodies of a pair, where they are, their velocities after an impact; `feature` as of `contact`."""
        (i, j), law = pair, self.law
        (x, y), (vx, vy) = self.xy[i], self.velocity[i]
        w_i = law.inverse_mass[i]
        if j >= law.n:
            _, (mx, my), _ = self.contact(pair, feature)
            nx, ny = -mx, -my
            contact = law.contact_of(pair)
            wx, wy = law.wall_velocity(j - law.n, self.time_s)
            before = (vx - wx, vy - wy)
            along = before[0] * nx + before[1] * ny
            if not along < 0.0:
                return
            pressed = -(1.0 + law.restitution(pair)) * along
            vx, vy = vx + pressed * nx, vy + pressed * ny
            if contact.friction > 0.0 or law.rolling_resistance > 0.0:
                rim, y = law.radius[i] * self.spin[i], law.inverse_inertia_ratio[i]
                slip = before[0] * ny - before[1] * nx + rim + (0.0 if law.belts is None else law.belts[j - law.n])
                by = frictional_impulses(contact, law.rolling_resistance, slip, rim, y, pressed)
                vx, vy = vx - by.friction * ny, vy + by.friction * nx
                self.spin[i] -= (by.friction + by.rolling) * y / law.radius[i]
            self.velocity[i] = (vx, vy)
            return
        dx, dy = self.xy[j][0] - x, self.xy[j][1] - y
        ux, uy = self.velocity[j]
        w_j = law.inverse_mass[j]
        impulse = normal_impulse(dx, dy, ux - vx, uy - vy, w_i + w_j, law.disc_restitution)
        turn = 0.0
        if law.disc_contact.friction > 0.0 and impulse < 0.0:
            distance = math.hypot(dx, dy)
            surface = distance * (law.radius[i] * self.spin[i] + law.radius[j] * self.spin[j])
            inverse_effective_mass = w_i * (1.0 + law.inverse_inertia_ratio[i]) + w_j * (
                1.0 + law.inverse_inertia_ratio[j]
            )
            turn = pair_tangential_impulse(
                law.disc_contact, dx, dy, ux - vx, uy - vy, surface, inverse_effective_mass, impulse
            )
            self.spin[i] -= turn * distance * w_i * law.inverse_inertia_ratio[i] / law.radius[i]
            self.spin[j] -= turn * distance * w_j * law.inverse_inertia_ratio[j] / law.radius[j]
        px, py = impulse * dx + turn * dy, impulse * dy - turn * dx
        self.velocity[i] = (vx + w_i * px, vy + w_i * py)
        self.velocity[j] = (ux - w_j * px, uy - w_j * py)

    def energy(self) -> float:
        """Return the kinetic energy of the discs that move, that of turning with it, joules."""
        law = self.law
        return sum(
            0.5 * law.mass[disc] * (vx * vx + vy * vy + self._turning(disc))
            for disc, (vx, vy) in self.velocity.items()
            if law.movable(disc)
        )

    def _turning(self, disc: int) -> float:
        law = self.law
        rim = law.radius[disc] * self.spin[disc]
        return rim * rim / law.inverse_inertia_ratio[disc] if law.inverse_inertia_ratio[disc] > 0.0 else 0.0

    def fastest(self) -> tuple[float, float]:
        """Return the greatest speed of a disc, and the greatest of a disc or of a rim, metres a second."""
        speed = max(math.hypot(*velocity) for velocity in self.velocity.values())
        return speed, max(speed, *(abs(self.law.radius[disc] * spin) for disc, spin in self.spin.items()))
