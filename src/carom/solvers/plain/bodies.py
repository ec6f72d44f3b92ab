"""Moving state of a scene's discs, and what an impact does to it, for the definition of PIT."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from carom.core import primitives
from carom.disc_arrays import STANDS, DiscArrays
from carom.physics.rough_impact import ContactFriction
from carom.solvers.impact.resolution import are_told_apart, too_far_out
from carom.solvers.pit.nearest_edge import Hit, find_hit
from carom.solvers.plain.instants import Instant
from carom.trace import NO_EDGE, ImpactRecord, wall_body, wall_index

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from carom.driving import Course
    from carom.solvers.run import Start

Vector = tuple[float, float]


class Bodies:
    """Positions and velocities of all discs, as plain floats: for a few discs these beat arrays.

    Every disc has its own clock: its position is that at `time[i]`, and it moves on in a straight line from there. The
    clock of an immovable disc stays at 0; so does that of a driven disc, which is moved along its path from its start.
    A driven wall is where `walls` says at time 0: discs are seen from it.
    """

    def __init__(self, start: Start | DiscArrays) -> None:
        if not isinstance(start, DiscArrays):
            start = start.arrays
        floats: tuple[list[float], ...] = tuple(
            array.tolist()
            for array in (*start.position_m.T, *start.velocity_m_s.T, start.radius_m, 1.0 / start.mass_kg)
        )
        self.x, self.y, self.vx, self.vy, self.radius, self.inverse_mass = floats
        self.time = [0.0] * len(start)
        self.last_partner: list[int | None] = [None] * len(start)
        self.walls = start.walls
        #: Path of each driven wall, None for one that does not move.
        self.drive = [None if drive.stands else drive for drive in start.wall_drives or ()] or [None] * len(start.walls)
        self.belts = start.belts_m_s
        #: That of each driven disc, and where it was at the start.
        self.driven = dict(zip(start.driven_discs, start.disc_drives, strict=True))
        self._driven_from = {i: (self.x[i], self.y[i]) for i in self.driven}
        #: Whether a driven body goes on to another leg.
        self.has_legs = any(len(path.legs) > 1 for path in (*self.drive, *self.driven.values()) if path is not None)
        self.gravity = (0.0, 0.0)
        self.materials = start.wall_materials
        self.restitution = start.restitution
        self.wall_restitution = start.wall_restitution
        self.contact = ContactFriction(start.friction, start.tangential_restitution)
        self.wall_contact = ContactFriction(start.wall_friction, start.wall_tangential_restitution)
        self.turns = start.turns
        self.spin: list[float] = start.spins.tolist()
        #: How easily each disc turns: 1/k, 0 for one that does not.
        self.inverse_inertia_ratio: list[float] = (1.0 / start.inertia).tolist()
        #: What each disc met last of a finite wall.
        self.last_hit: list[Hit | None] = [None] * len(start)

    def forget_ended_leg(self, i: int, time_s: float) -> None:
        """Let disc `i` meet a driven body again that it has met last, where that is on another leg by then."""
        partner = self.last_partner[i] if self.has_legs else None
        if partner is not None and self.legs_ahead(partner, self.time[i])[0].end_s <= time_s:
            self.last_partner[i] = None

    def __len__(self) -> int:
        return len(self.x)

    def move_to(self, i: int, time_s: float) -> None:
        """Bring disc `i` to `time_s` along its straight path."""
        if self.inverse_mass[i] == 0.0:
            if i in self.driven:
                self.x[i], self.y[i], self.vx[i], self.vy[i] = self.driven_at(i, time_s)
            return
        dt = time_s - self.time[i]
        self.x[i] += self.vx[i] * dt
        self.y[i] += self.vy[i] * dt
        self.time[i] = time_s

    def state_at(self, i: int, instant: Instant) -> tuple[float, float, float, float]:
        """Position and velocity of disc `i` at an instant, on its present path."""
        if i in self.driven:
            return self.driven_at(i, instant[0])
        wait, vx, vy = instant[0] - self.time[i], self.vx[i], self.vy[i]
        return self.x[i] + vx * wait, self.y[i] + vy * wait, vx, vy

    def driven_at(self, i: int, time_s: float) -> tuple[float, float, float, float]:
        """Position and velocity at a time of disc `i`, which no impact moves: one that is driven, or stands."""
        if i not in self.driven:
            return self.x[i], self.y[i], 0.0, 0.0
        return self._driven_on(i, self.driven[i].leg_at(time_s), time_s)

    def _driven_on(self, i: int, leg: Course, time_s: float) -> tuple[float, float, float, float]:
        (x, y), (moved_x, moved_y) = self._driven_from[i], leg.moved_at(time_s)
        return x + moved_x, y + moved_y, *leg.velocity

    def seen_from(self, i: int, k: int) -> tuple[float, float, float, float]:
        """Position and velocity of disc `i`, at its own clock, as seen from wall `k`, which stands where it began."""
        if (drive := self.drive[k]) is None:
            return self.x[i], self.y[i], self.vx[i], self.vy[i]
        return self._seen_on(i, drive.leg_at(self.time[i]), self.time[i])

    def _seen_on(self, i: int, leg: Course, time_s: float) -> tuple[float, float, float, float]:
        """Position and velocity of disc `i` at a time as seen from a wall on a leg of its path."""
        x, y, vx, vy = self.state_at(i, (time_s, 0.0))
        (moved_x, moved_y), (u, v) = leg.moved_at(time_s), leg.velocity
        return x - moved_x, y - moved_y, vx - u, vy - v

    def velocity_of_wall(self, k: int, time_s: float) -> Vector:
        """Return the velocity of wall `k` at a time since the epoch."""
        return (0.0, 0.0) if (drive := self.drive[k]) is None else drive.velocity_at(time_s)

    def legs_ahead(self, body: int, time_s: float) -> tuple[Course, ...]:
        """Return the legs of a body's path, since the epoch, from the one on which it is at a time on.

        A body (a wall is negative) that is not driven has one leg. The last has no end.
        """
        drive = self.drive[wall_index(body)] if body < 0 else self.driven.get(body)
        return STANDS.legs if drive is None else drive.legs_from(time_s)

    def find(self, i: int, k: int) -> None:
        """Note what of wall `k` disc `i` has met: what is nearest, as PIT finds it."""
        if not isinstance(wall := self.walls[k], tuple):
            self.last_hit[i] = find_hit(wall, *self.seen_from(i, k)[:2])

    def normal(self, i: int, k: int) -> Vector:
        """Return the unit vector from wall `k` to disc `i`, which it meets, or met last."""
        wall = self.walls[k]
        if isinstance(wall, tuple):
            return wall[2], wall[3]
        hit = self.last_hit[i]
        if hit is None:
            raise TypeError(f"disc {i} has met no finite wall")
        return hit.normal

    def restitution_of_wall(self, k: int) -> float:
        """Return the coefficient of restitution of any disc and wall `k`."""
        return self.wall_restitution if self.materials is None else self.materials[k].restitution

    def slip(self, i: int, k: int, velocity: Vector) -> float:
        """Return how fast the rim of disc `i` slips on wall `k`, to the right of its normal.

        `velocity` is that of the disc as seen from the wall, whose surface may run.
        """
        nx, ny = self.normal(i, k)
        slip = velocity[0] * ny - velocity[1] * nx + self.radius[i] * self.spin[i]
        return slip + self.belts[k] if self.belts is not None and self.belts[k] else slip

    def contact_of_wall(self, k: int) -> ContactFriction:
        """Return the friction between any disc and wall `k`."""
        if self.materials is None:
            return self.wall_contact
        return self.wall_contact._replace(friction=self.materials[k].friction)

    def rubs_on(self, k: int) -> bool:
        """Whether an impact on wall `k` changes more than the speed along its normal."""
        return self.contact_of_wall(k).friction > 0.0

    def pair_approaches_and_overlaps(self, i: int, j: int) -> bool:
        """Whether discs `i` and `j`, both at one time, approach and touch or overlap: the test of PIT.

        The distance is computed as `collide_pair` computes it. `math.hypot` would be a little nearer to it, but other
        languages, and other versions of Python, round it in other ways.
        """
        if self.inverse_mass[i] == 0.0 and self.inverse_mass[j] == 0.0:
            return False
        dx, dy = self.x[j] - self.x[i], self.y[j] - self.y[i]
        approaching = dx * (self.vx[j] - self.vx[i]) + dy * (self.vy[j] - self.vy[i]) < 0.0
        return approaching and math.sqrt(dx * dx + dy * dy) <= self.radius[i] + self.radius[j]

    def wall_approaches_and_overlaps(self, i: int, k: int) -> bool:
        """Whether disc `i` approaches wall `k` and touches or overlaps it."""
        wall = self.walls[k]
        if self.inverse_mass[i] == 0.0 and (self.drive[k] is not None or i in self.driven):
            return False
        x, y, vx, vy = self.seen_from(i, k)
        if isinstance(wall, tuple):
            px, py, nx, ny = wall
            approaching = vx * nx + vy * ny < 0.0
            return approaching and (x - px) * nx + (y - py) * ny <= self.radius[i]
        foot = wall.nearest(x, y)
        dx, dy, reach = x - foot.x, y - foot.y, wall.half_width + self.radius[i]
        return vx * dx + vy * dy < 0.0 and dx * dx + dy * dy <= reach * reach

    def collide_pair(self, i: int, j: int, *, elastic: bool = False) -> ImpactRecord:
        """Give discs `i` and `j` (both at one time, approaching) their velocities after the impact.

        The normal is the line of centres as it stands: overlapped, where the impact is found late. Friction acts at
        full radius from each centre.

        Raises:
            InputError: They are so far out that floats do not tell their centres apart.
        """
        e = 1.0 if elastic else self.restitution
        if not are_told_apart(self.x[i], self.y[i], self.x[j], self.y[j], self.radius[i] + self.radius[j]):
            raise too_far_out()
        dx, dy = self.x[j] - self.x[i], self.y[j] - self.y[i]
        before_i, before_j, spins = self._velocity(i), self._velocity(j), (self.spin[i], self.spin[j])
        time_s = max(self.time[i], self.time[j])  # an immovable disc's clock stands still
        w_i, w_j = self.inverse_mass[i], self.inverse_mass[j]
        ux, uy = self.vx[j] - self.vx[i], self.vy[j] - self.vy[i]
        g = primitives.normal_impulse(dx, dy, ux, uy, w_i + w_j, e)
        self.vx[i] += g * w_i * dx
        self.vy[i] += g * w_i * dy
        self.vx[j] -= g * w_j * dx
        self.vy[j] -= g * w_j * dy
        distance = math.sqrt(dx * dx + dy * dy)
        if self.contact.friction > 0.0 and not elastic:
            surface = distance * (self.radius[i] * self.spin[i] + self.radius[j] * self.spin[j])
            inverse_effective_mass = w_i * (1.0 + self.inverse_inertia_ratio[i]) + w_j * (
                1.0 + self.inverse_inertia_ratio[j]
            )
            h = primitives.pair_tangential_impulse(*self.contact, dx, dy, ux, uy, surface, inverse_effective_mass, g)
            self.vx[i] += h * w_i * dy
            self.vy[i] -= h * w_i * dx
            self.vx[j] -= h * w_j * dy
            self.vy[j] += h * w_j * dx
            self.spin[i] -= h * distance * w_i * self.inverse_inertia_ratio[i] / self.radius[i]
            self.spin[j] -= h * distance * w_j * self.inverse_inertia_ratio[j] / self.radius[j]
        normal = (dx / distance, dy / distance)
        velocities = (before_i, before_j, self._velocity(i), self._velocity(j))
        return ImpactRecord(time_s, i, j, normal, *velocities, self._spins(spins, (self.spin[i], self.spin[j])))

    def collide_wall(self, i: int, k: int, *, elastic: bool = False) -> ImpactRecord:
        """Give disc `i` its velocity after its impact on wall `k`, which it approaches; as `collide_pair` does."""
        e = 1.0 if elastic else self.restitution_of_wall(k)
        nx, ny = self.normal(i, k)
        before = self._velocity(i)
        ux, uy = before
        if self.drive[k] is not None:
            u, v = self.velocity_of_wall(k, self.time[i])
            ux, uy = ux - u, uy - v
        along = ux * nx + uy * ny
        if along < 0.0:  # rounding can turn the weakest of grazes into a separation: an impact never pulls
            self.vx[i] -= (1.0 + e) * along * nx
            self.vy[i] -= (1.0 + e) * along * ny
        spin = self.spin[i]
        if self.rubs_on(k) and along < 0.0 and not elastic:
            self.slide_on_wall(i, k, (ux, uy), -((1.0 + e) * along))
        return self.wall_record(i, k, before, spin)

    def slide_on_wall(self, i: int, k: int, before: Vector, pressed: float) -> None:
        """Let the friction of wall `k` act on disc `i`, which was given a speed off it.

        `before` is the velocity with which it came, as seen from the wall.
        """
        nx, ny = self.normal(i, k)
        slip = self.slip(i, k, before)
        h = primitives.tangential_impulse(*self.contact_of_wall(k), slip, 1.0 + self.inverse_inertia_ratio[i], pressed)
        self.vx[i] -= h * ny
        self.vy[i] += h * nx
        self.spin[i] -= h * self.inverse_inertia_ratio[i] / self.radius[i]

    def wall_record(self, i: int, k: int, before: Vector, spin: float) -> ImpactRecord:
        """Return the record of an impact on wall `k` carried out just now, given what disc `i` was like before."""
        nx, ny = self.normal(i, k)
        hit = None if isinstance(self.walls[k], tuple) else self.last_hit[i]
        drive = self.velocity_of_wall(k, self.time[i])
        velocities = (before, drive, self._velocity(i), drive)
        spins = self._spins((spin, 0.0), (self.spin[i], 0.0))
        edge = NO_EDGE if hit is None else hit.edge
        return ImpactRecord(self.time[i], i, wall_body(k), (-nx, -ny), *velocities, spins, edge)

    def spins(self) -> NDArray[np.float64] | None:
        """Spins, radians a second, shape ``(n,)``; None in a scene in which nothing turns."""
        return np.array(self.spin) if self.turns else None

    def positions_at(self, time_s: float) -> NDArray[np.float64]:
        """Centres at `time_s` on the present paths, metres, shape ``(n, 2)``."""
        return self.all_at((time_s, 0.0))[0]

    def velocities_at(self, time_s: float) -> NDArray[np.float64]:
        """Velocities at `time_s` on the present paths, metres a second, shape ``(n, 2)``."""
        return self.all_at((time_s, 0.0))[1]

    def all_at(self, instant: Instant) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Positions and velocities of all discs at an instant, shape ``(n, 2)`` each."""
        states = np.array([self.state_at(i, instant) for i in range(len(self))])
        return states[:, :2].copy(), states[:, 2:].copy()

    def _spins(self, before: Vector, after: Vector) -> tuple[float, float, float, float] | None:
        return (*before, *after) if self.turns else None

    def _velocity(self, i: int) -> Vector:
        return (self.vx[i], self.vy[i])
