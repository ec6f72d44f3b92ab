"""States of a few bodies, which can be advanced from any state of a run.

The solvers accept only scenes without overlaps, but a window can start in a state with overlapping bodies. So this
module lets bodies that overlap and approach each other collide at once. The core computes the times of impacts and
applies the impact law.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

from carom.comparator.stepwise.scene_bodies import NO_FEATURE, TOUCH, FiniteWall, Pair, SceneBodies
from carom.core import primitives
from carom.core.wall_features import Mover
from carom.model.prescribed_motion import Drive


class Separation(NamedTuple):
    """Gap between two bodies, the unit normal from the first to the second, and the speed at which they approach."""

    gap: float
    normal: tuple[float, float]
    closing: float


class BodyStates:
    """Positions, velocities and spins of some discs by number, and the time since the run's start."""

    __slots__ = ("bodies", "met", "spin", "time_s", "velocity", "xy")

    def __init__(
        self,
        bodies: SceneBodies,
        xy: dict[int, tuple[float, float]],
        velocity: dict[int, tuple[float, float]],
        spin: dict[int, float],
        time_s: float,
    ) -> None:
        self.bodies, self.xy, self.velocity, self.spin, self.time_s = bodies, xy, velocity, spin, time_s
        #: For each disc and finite wall, the number of the wall's edge, end or corner that the disc meets next.
        self.met: dict[Pair, int] = {}

    def copy(self) -> BodyStates:
        """Return a copy of the state."""
        return BodyStates(self.bodies, self.xy.copy(), self.velocity.copy(), self.spin.copy(), self.time_s)

    def merge_discs(self, other: BodyStates) -> None:
        """Add the discs of another state."""
        self.xy |= other.xy
        self.velocity |= other.velocity
        self.spin |= other.spin

    def select_discs(self, bodies: Iterable[int]) -> BodyStates:
        """Return the state of the given bodies, without walls."""
        discs = [body for body in bodies if body < self.bodies.n]
        xy, velocity = ({disc: rows[disc] for disc in discs} for rows in (self.xy, self.velocity))
        return BodyStates(self.bodies, xy, velocity, {disc: self.spin[disc] for disc in discs}, self.time_s)

    def motion_of(self, body: int) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the position and velocity of a body. The position of a wall is its displacement since the start."""
        if body < self.bodies.n:
            return self.xy[body], self.velocity[body]
        wall, time_s = body - self.bodies.n, self.time_s
        leg = self.bodies.wall_drives[wall].leg_at(time_s * TOUCH)
        return leg.moved_at(time_s), leg.velocity

    def _build_mover(self, disc: int, body: int) -> Mover:
        """Return a disc's motion relative to a wall."""
        wall = body - self.bodies.n
        place = self.bodies.to_wall_frame(wall, *self.xy[disc], self.time_s)
        return Mover.at(
            place, self.velocity[disc], self.bodies.radius[disc], self.bodies.wall_velocity(wall, self.time_s)
        )

    def move_freely(self, seconds: float, resting: Pair | None = None) -> None:
        """Move all discs along their free paths. Gravity does not act between the two bodies of the pair `resting`."""
        bodies, half = self.bodies, 0.5 * seconds * seconds
        if bodies.moves_straight:
            for disc, (x, y) in self.xy.items():
                vx, vy = self.velocity[disc]
                self.xy[disc] = (x + vx * seconds, y + vy * seconds)
            self.time_s += seconds
            return
        # A scene has either gravity or slowing, so only one of them bends a path.
        for disc, (x, y) in self.xy.items():
            if bodies.disc_drives and (drive := bodies.disc_drives.get(disc)) is not None and len(drive.legs) > 1:
                self._advance_driven(disc, drive, seconds)
                continue
            vx, vy = self.velocity[disc]
            flown_s, kept_fraction = seconds, 1.0
            if bodies.slows:
                speed = math.hypot(vx, vy)
                flown_s = bodies.slowing.compute_flown_time(seconds, speed)
                kept_fraction = bodies.slowing.compute_kept_fraction(seconds, speed)
            ax, ay = bodies.pulls[disc]
            if resting is not None and resting[0] == disc and resting[1] >= bodies.n:
                _, nx, ny = bodies.measure_wall_distance(resting[1] - bodies.n, x, y, self.time_s)
                pull = min(ax * nx + ay * ny, 0.0)
                ax, ay = ax - pull * nx, ay - pull * ny
            self.xy[disc] = (x + vx * flown_s + ax * half, y + vy * flown_s + ay * half)
            self.velocity[disc] = (vx * kept_fraction + ax * seconds, vy * kept_fraction + ay * seconds)
            self.spin[disc] *= kept_fraction
        self.time_s += seconds

    def compute_later_state(self, seconds: float, resting: Pair | None = None) -> BodyStates:
        """Return the state some seconds later. The arguments are those of `move_freely`."""
        state = self.copy()
        state.move_freely(seconds, resting)
        return state

    def _advance_driven(self, disc: int, drive: Drive, seconds: float) -> None:
        begin_s, end_s = self.time_s, self.time_s + seconds
        leg = drive.leg_at(end_s * TOUCH)
        place_before, place_after = drive.leg_at(begin_s * TOUCH).moved_at(begin_s), leg.moved_at(end_s)
        x, y = self.xy[disc]
        self.xy[disc] = (x + place_after[0] - place_before[0], y + place_after[1] - place_before[1])
        self.velocity[disc] = leg.velocity

    def measure_separation(self, pair: Pair, feature: int = NO_FEATURE) -> Separation:
        """Return the separation of two bodies.

        `feature` is the number of the wall's edge, end or corner to measure to.
        """
        (i, j), bodies = pair, self.bodies
        (x, y), (vx, vy) = self.xy[i], self.velocity[i]
        if j >= bodies.n:
            away, nx, ny = bodies.measure_wall_distance(j - bodies.n, x, y, self.time_s)
            wall = bodies.walls[j - bodies.n]
            if feature != NO_FEATURE and isinstance(wall, FiniteWall):
                nx, ny = wall.features.normal(feature, self._build_mover(i, j))
            wx, wy = bodies.wall_velocity(j - bodies.n, self.time_s)
            return Separation(away - bodies.radius[i], (-nx, -ny), -((vx - wx) * nx + (vy - wy) * ny))
        dx, dy = self.xy[j][0] - x, self.xy[j][1] - y
        distance = math.hypot(dx, dy)
        ux, uy = self.velocity[j][0] - vx, self.velocity[j][1] - vy
        if distance == 0.0:  # coinciding centres define no normal, so the discs count as separating
            speed = math.hypot(ux, uy)
            normal = (ux / speed, uy / speed) if speed > 0.0 else (1.0, 0.0)
        else:
            normal = (dx / distance, dy / distance)
        closing = -(ux * normal[0] + uy * normal[1])
        return Separation(distance - bodies.radius[i] - bodies.radius[j], normal, closing)

    def are_overlapping(self, pair: Pair) -> bool:
        """Whether the bodies of a pair overlap or touch.

        A gap within the rounding of the contact distance counts as touching.
        """
        (i, j), bodies = pair, self.bodies
        x, y = self.xy[i]
        reach = bodies.radius[i] * TOUCH
        if j >= bodies.n:
            wall = bodies.walls[j - bodies.n]
            wide = 0.0 if isinstance(wall, tuple) else (TOUCH - 1.0) * wall.outline.half_width
            return bodies.measure_wall_distance(j - bodies.n, x, y, self.time_s)[0] <= reach + wide
        ox, oy = self.xy[j]
        reach += bodies.radius[j] * TOUCH
        return (ox - x) ** 2 + (oy - y) ** 2 <= reach * reach

    def compute_wait(self, pair: Pair, last: int = NO_FEATURE) -> float:
        """Return the seconds until two bodies meet; infinity if they never meet, 0 if they overlap and approach.

        `last` is the number of the finite wall's edge, end or corner that the disc has just met.
        """
        if self.bodies.slowing.table_m_s2:
            return self._compute_wait_on_table(pair, last, None)
        wait = self.bodies.slowing.damping.to_damped(self.compute_undamped_wait(pair, last))
        later = self.bodies.list_later_legs(pair, self.time_s)
        return wait if not later or self.time_s + wait < later[0].begin_s else self.compute_later_wait(pair)

    def compute_later_wait(self, pair: Pair) -> float:
        """Return the seconds until two bodies meet after the next change in the prescribed motion of one of them."""
        for leg in self.bodies.list_later_legs(pair, self.time_s):
            state_on_leg = self.compute_later_state(leg.begin_s - self.time_s)
            wait = state_on_leg.compute_undamped_wait(pair, NO_FEATURE)
            if state_on_leg.time_s + wait < leg.end_s:
                self.met |= {pair: state_on_leg.met[pair]} if pair in state_on_leg.met else {}
                return state_on_leg.time_s + wait - self.time_s
        return math.inf

    def compute_wait_again(self, pair: Pair) -> float:
        """Return the seconds until two bodies that have just met meet again without a third body.

        This can happen if one of them has a prescribed motion that changes its velocity. It can also happen on a table,
        which slows each body in its own direction of motion.
        """
        if not self.bodies.slowing.table_m_s2:
            return self.compute_later_wait(pair)
        return self._compute_wait_on_table(pair, NO_FEATURE, max(0.0, -self.measure_separation(pair).closing))

    def _compute_wait_on_table(self, pair: Pair, last: int, leaving: float | None) -> float:
        """Return the result of `compute_wait` for a scene with a table.

        `leaving` is the speed at which the bodies separate.
        """
        (i, j), bodies, state, passed = pair, self.bodies, self.select_discs(pair), 0.0
        speeds = [math.hypot(*velocity) for velocity in state.velocity.values()]
        longest_m = sum(speed * speed for speed in speeds) / (2.0 * bodies.slowing.table_m_s2)
        # If the gap is larger, the two bodies stop before they meet. The factor 0.99 allows for rounding.
        if 0.99 * self.measure_separation(pair).gap > longest_m:
            return math.inf
        while True:
            stops = min(bodies.slowing.compute_stop_time(math.hypot(*state.velocity[disc])) for disc in state.xy)
            (x, y), (vx, vy) = state.xy[i], state.velocity[i]
            pull = bodies.compute_table_acceleration(i, state.velocity[i])
            if j < bodies.n:
                (ox, oy), (ux, uy) = state.xy[j], state.velocity[j]
                other = bodies.compute_table_acceleration(j, state.velocity[j])
                one = (x - ox, y - oy, vx - ux, vy - uy, bodies.radius[i])
                relative = (pull[0] - other[0], pull[1] - other[1])
                wait = primitives.disc_fall_time(*one, 0.0, 0.0, bodies.radius[j], *relative, leaving)
            elif isinstance(wall := bodies.walls[j - bodies.n], tuple):
                wait = primitives.wall_fall_time(x, y, vx, vy, bodies.radius[i], wall, *pull)
            else:
                disc = Mover.at((x, y), (vx, vy), bodies.radius[i])
                wait = self._compute_fall_wait(pair, wall, disc, pull, last)
            if wait <= stops:
                return passed + wait
            if stops == math.inf:
                return math.inf
            state.move_freely(stops)
            passed, leaving, last = passed + stops, None, NO_FEATURE

    def compute_undamped_wait(self, pair: Pair, last: int) -> float:
        """Return the result of `compute_wait` without damping, as if driven bodies kept their velocity."""
        (i, j), bodies = pair, self.bodies
        (x, y), (vx, vy), radius = self.xy[i], self.velocity[i], bodies.radius[i]
        if j >= bodies.n:
            wall = bodies.walls[j - bodies.n]
            if not isinstance(wall, tuple):
                return self._compute_finite_wall_wait(pair, wall, last)
            x, y = bodies.to_wall_frame(j - bodies.n, x, y, self.time_s)
            wx, wy = bodies.wall_velocity(j - bodies.n, self.time_s)
            vx, vy = vx - wx, vy - wy
            if not bodies.is_pulled(i):
                return primitives.wall_time(x, y, vx, vy, radius, wall)
            return primitives.wall_fall_time(x, y, vx, vy, radius, wall, *bodies.gravity)
        (ox, oy), (ux, uy) = self.xy[j], self.velocity[j]
        if bodies.is_pulled(i) == bodies.is_pulled(j):  # gravity moves both equally
            return primitives.pair_time(x, y, vx, vy, radius, ox, oy, ux, uy, bodies.radius[j])
        if bodies.is_pulled(i):
            return primitives.disc_fall_time(x, y, vx - ux, vy - uy, radius, ox, oy, bodies.radius[j], *bodies.gravity)
        return primitives.disc_fall_time(ox, oy, ux - vx, uy - vy, bodies.radius[j], x, y, radius, *bodies.gravity)

    def _compute_finite_wall_wait(self, pair: Pair, wall: FiniteWall, last: int) -> float:
        disc = self._build_mover(*pair)
        if self.bodies.is_pulled(pair[0]):
            return self._compute_fall_wait(pair, wall, disc, self.bodies.gravity, last)
        wait, feature, _ = wall.features.first_touch(disc, last)
        if feature != NO_FEATURE:
            self.met[pair] = feature
        return wait

    def _compute_fall_wait(
        self, pair: Pair, wall: FiniteWall, disc: Mover, acceleration: tuple[float, float], last: int
    ) -> float:
        leaving = 0.0
        if last != NO_FEATURE:
            nx, ny = wall.features.normal(last, disc)
            leaving = max(0.0, disc.ux[0] * nx + disc.uy[0] * ny)
        wait, feature = wall.features.first_fall(disc, *acceleration, last, leaving)
        if feature != NO_FEATURE:
            self.met[pair] = feature
        return wait

    def apply_impact(self, pair: Pair, feature: int = NO_FEATURE) -> None:
        """Apply an impact of two bodies at their present positions. `feature` is as in `measure_separation`."""
        (i, j), bodies = pair, self.bodies
        (x, y), (vx, vy) = self.xy[i], self.velocity[i]
        w_i = bodies.inverse_mass[i]
        if j >= bodies.n:
            _, (mx, my), _ = self.measure_separation(pair, feature)
            nx, ny = -mx, -my
            contact = bodies.contact_of(pair)
            wx, wy = bodies.wall_velocity(j - bodies.n, self.time_s)
            before = (vx - wx, vy - wy)
            along = before[0] * nx + before[1] * ny
            if not along < 0.0:
                return
            normal_change = -(1.0 + bodies.restitution_of(pair)) * along
            vx, vy = vx + normal_change * nx, vy + normal_change * ny
            if contact.friction > 0.0 or bodies.rolling_resistance > 0.0:
                rim, y = bodies.radius[i] * self.spin[i], bodies.inverse_inertia_ratio[i]
                belt = 0.0 if bodies.belts is None else bodies.belts[j - bodies.n]
                slip = before[0] * ny - before[1] * nx + rim + belt
                friction, turning, _ = primitives.frictional_impulses(
                    *contact, bodies.rolling_resistance, slip, rim, y, normal_change
                )
                vx, vy = vx - friction * ny, vy + friction * nx
                self.spin[i] -= turning * y / bodies.radius[i]
            self.velocity[i] = (vx, vy)
            return
        dx, dy = self.xy[j][0] - x, self.xy[j][1] - y
        ux, uy = self.velocity[j]
        w_j = bodies.inverse_mass[j]
        impulse = primitives.normal_impulse(dx, dy, ux - vx, uy - vy, w_i + w_j, bodies.disc_restitution)
        turn = 0.0
        if bodies.disc_contact.friction > 0.0 and impulse < 0.0:
            distance = math.hypot(dx, dy)
            surface = distance * (bodies.radius[i] * self.spin[i] + bodies.radius[j] * self.spin[j])
            y_i, y_j = bodies.inverse_inertia_ratio[i], bodies.inverse_inertia_ratio[j]
            inverse_effective_mass = w_i * (1.0 + y_i) + w_j * (1.0 + y_j)
            turn = primitives.pair_tangential_impulse(
                *bodies.disc_contact, dx, dy, ux - vx, uy - vy, surface, inverse_effective_mass, impulse
            )
            self.spin[i] -= turn * distance * w_i * y_i / bodies.radius[i]
            self.spin[j] -= turn * distance * w_j * y_j / bodies.radius[j]
        px, py = impulse * dx + turn * dy, impulse * dy - turn * dx
        self.velocity[i] = (vx + w_i * px, vy + w_i * py)
        self.velocity[j] = (ux - w_j * px, uy - w_j * py)

    def compute_energy(self) -> float:
        """Return the kinetic energy of the movable discs, including rotation, in joules."""
        bodies, energy = self.bodies, 0.0
        for disc, (vx, vy) in self.velocity.items():
            if bodies.is_movable(disc):
                rim, inverse = bodies.radius[disc] * self.spin[disc], bodies.inverse_inertia_ratio[disc]
                rotation = rim * rim / inverse if inverse > 0.0 else 0.0
                energy += 0.5 * bodies.mass[disc] * (vx * vx + vy * vy + rotation)
        return energy

    def find_greatest_speeds(self) -> tuple[float, float]:
        """Return the greatest speed of any disc, and the greatest speed of any disc or rim, in metres per second."""
        speed = max(math.hypot(*velocity) for velocity in self.velocity.values())
        return speed, max(speed, *(abs(self.bodies.radius[disc] * spin) for disc, spin in self.spin.items()))
