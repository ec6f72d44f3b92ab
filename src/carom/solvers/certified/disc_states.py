"""State of all discs in interval arithmetic. Every number is an interval that contains the true value.

The 64-bit floats of the scene are the exact input. The state of each disc is stored for an exact instant: a float just
before the disc's last impact. The path after the impact is extended backwards to this instant. The uncertainty of the
impact's time then has little effect on the stored position.

With gravity, states of movable discs are relative to a reference frame that falls from rest at time 0. The position of
this frame is ``g t^2 / 2``, and its velocity is ``g t``. In this frame, discs move straight, and walls accelerate.
"""

from __future__ import annotations

import math
from functools import cache

from flint import arb, ctx

from carom.core.wall_parts import Plane, Round, dot, to_exact
from carom.model.prescribed_motion import Drive
from carom.model.scene import Scene
from carom.model.trace import wall_body, wall_index
from carom.solvers.certified.ball_arithmetic import SLACK, ZERO, BallLeg, legs_of
from carom.solvers.certified.contact_state import ContactStates
from carom.solvers.certified.laws import Laws
from carom.solvers.certified.obstacles import obstacles_of

#: Position and velocity of a disc's centre: x, y, vx, vy.
State = tuple[arb, arb, arb, arb]


def find_greatest_speed(scene: Scene) -> float:
    """Return the greatest speed of discs and rims at the start, and of moving walls, in m/s; 1 if nothing moves."""
    speeds = [max(math.hypot(*disc.velocity_m_s), abs(disc.spin_rad_s) * disc.radius_m) for disc in scene.discs]
    return max(*speeds, bound_drive_speeds(scene)) or 1.0


def bound_drive_speeds(scene: Scene) -> float:
    """Return a bound of the speeds of driven bodies and conveyors; 0 if there are none."""
    arrays = scene.arrays
    drives = (*(arrays.wall_drives or ()), *arrays.disc_drives)
    speeds = [*(drive.fastest for drive in drives), *map(abs, arrays.belts_m_s or ())]
    return max(speeds, default=0.0) * (1.0 + SLACK)


def _find_gravity_sign(scene: Scene, shape: Plane | Round) -> int:
    """Return the sign of gravity's component along the normal of a straight part of a wall.

    The sign is negative if discs fall towards this part, and 0 for round parts.
    """
    if isinstance(shape, Round):
        return 0
    along = dot(to_exact(scene.gravity_m_s2), shape.normal)
    return (along > 0) - (along < 0)


class BallBodies:
    """Positions and velocities of all discs as intervals, with the current precision of python-flint.

    Attributes:
        obstacles: Half-planes, and the faces, vertices and arcs of other walls (`carom.solvers.certified.obstacles`).
            If all walls are half-planes, the obstacles are the walls.
        laws: Constants of impacts, computed with the current precision.
        time: Instant for which the state of each disc is stored: an exact 64-bit float, in seconds.
        x: x coordinate of each centre at this instant. `y` is the other coordinate, and `vx` and `vy` are the velocity.
            With gravity, these coordinates are relative to a reference frame that falls from rest at time 0.
        falls: Whether the scene has gravity.
        pulls: Sign of gravity's component along the normal of each straight obstacle; 0 for other obstacles.
        fastest_drive: A bound of the speeds of driven bodies, in m/s.
        turns: Whether spins are stored: see `carom.DiscArrays.turns`.
        spin: Spin of each disc, in rad/s.
        inverse_inertia_ratio: 1 / k for each disc, whose moment of inertia is ``k m R^2``; 0 for a disc that can't
            turn.
        inverse_mass: 1 / m for each disc of mass m; 0 for a disc that impacts do not move.
        met: For each disc, the time of its last impact with each obstacle (key: the obstacle's body number), and of its
            last impact with a disc (key: 0).
        last_met: For each disc, an upper bound of the times of its past impacts; 0 before the first impact.
        partner: Body that each disc met last; None before the disc's first impact.
        acceleration: Acceleration of each disc in contact, relative to the walls; None for a disc in flight.
        spin_rate: Rate at which contact changes each disc's spin, in rad/s^2.
        contacts: Lasting contacts of discs with walls.
        are_orthogonal: Function that returns whether two straight obstacles are exactly orthogonal.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.obstacles = obstacles_of(scene)
        self.materials = scene.arrays.materials
        discs = scene.discs
        self.x, self.y = ([arb(disc.position_m[k]) for disc in discs] for k in (0, 1))
        self.vx, self.vy = ([arb(disc.velocity_m_s[k]) for disc in discs] for k in (0, 1))
        self.time = [0.0] * len(discs)
        self.movable = [not disc.immovable for disc in discs]
        self.turns, self.has_friction = scene.arrays.turns, scene.arrays.has_friction
        self.spin = [arb(disc.spin_rad_s) for disc in discs]
        self.inverse_inertia_ratio = [
            ZERO if math.isinf(disc.inertia_factor) else 1 / arb(disc.inertia_factor) for disc in discs
        ]
        self.inverse_mass = [ZERO if disc.immovable else 1 / arb(disc.mass_kg) for disc in discs]
        self.met: list[dict[int, arb]] = [{} for _ in discs]
        self.last_met = [0.0] * len(discs)
        self.partner: list[int | None] = [None] * len(discs)
        self.acceleration: list[tuple[arb, arb] | None] = [None] * len(discs)
        self.spin_rate = [ZERO] * len(discs)
        self.contacts = ContactStates(len(discs))
        self.falls = scene.gravity_m_s2 != (0.0, 0.0)
        self.gravity = (arb(scene.gravity_m_s2[0]), arb(scene.gravity_m_s2[1]))
        self.pulls = [_find_gravity_sign(scene, obstacle.shape) for obstacle in self.obstacles]
        drives = {wall_body(k): drive for k, drive in enumerate(scene.arrays.wall_drives or ())}
        drives |= dict(zip(scene.arrays.driven_discs, scene.arrays.disc_drives, strict=True))
        self._drives: dict[int, Drive] = {body: drive for body, drive in drives.items() if not drive.is_stationary}
        self.fastest_drive = bound_drive_speeds(scene)
        self._legs: dict[int, tuple[BallLeg, ...]] = {}
        for disc in scene.arrays.driven_discs:
            if legs := self.legs(disc):
                self.vx[disc], self.vy[disc] = legs[0].vx, legs[0].vy
        self._speed = arb(find_greatest_speed(scene))
        self.laws = Laws(scene, self.obstacles)
        self.are_orthogonal = cache(self._are_orthogonal)

    def __len__(self) -> int:
        return len(self.x)

    def lower_precision(self, bits: int) -> None:
        """Lower the precision to `bits`, and discard constants that were computed with the higher precision."""
        ctx.prec = bits
        self._legs.clear()
        self.laws = Laws(self.scene, self.obstacles)

    def state_bits(self, i: int) -> int:
        """Return the number of accurate bits in the state of disc `i`.

        Errors of velocities are relative to the scene's greatest speed. Errors of positions are relative to the sum of
        the radius and the absolute values of the centre's coordinates.
        """
        radius = arb(self.scene.discs[i].radius_m)
        x, y = self.centre(i, self.time[i]) if self.falls else (self.x[i], self.y[i])
        size = x.mid().max(ZERO - x.mid()) + y.mid().max(ZERO - y.mid()) + radius
        spread = (x - x.mid()) + (y - y.mid())
        spread_v = (self.vx[i] - self.vx[i].mid()) + (self.vy[i] - self.vy[i].mid())
        known = min((size + spread).rel_accuracy_bits(), (self._speed + spread_v).rel_accuracy_bits())
        if self.has_friction:
            rim = radius * self.spin[i]
            known = min(known, (self._speed + (rim - rim.mid())).rel_accuracy_bits())
        return max(0, min(int(ctx.prec), known))

    def worst_accuracy_bits(self) -> int:
        """Return the accuracy of the least accurate velocity, in bits."""
        return min(self._compute_accuracy_bits(i) for i in range(len(self)))

    def best_accuracy_bits(self) -> int:
        """Return the greatest accuracy of an inexact velocity, in bits; the precision if all velocities are exact."""
        inexact = [i for i in range(len(self)) if not (self.vx[i].is_exact() and self.vy[i].is_exact())]
        return max((self._compute_accuracy_bits(i) for i in inexact), default=int(ctx.prec))

    def _compute_accuracy_bits(self, i: int) -> int:
        """Return the accuracy of the velocity of disc `i`, in bits. For an exact velocity, return the precision."""
        bits = [v.rel_accuracy_bits() for v in (self.vx[i], self.vy[i]) if not v.is_zero()]
        return max(0, min(int(ctx.prec), max(bits, default=int(ctx.prec))))

    def are_at_start(self, *bodies: int) -> bool:
        """Return whether none of the given discs has had an impact, so that they are on their initial paths."""
        return all(body < 0 or self.partner[body] is None for body in bodies)

    def have_just_met(self, i: int, j: int) -> bool:
        """Return whether the last impact of discs `i` and `j` was with each other, so that they move apart."""
        return (not self.movable[i] or self.partner[i] == j) and (not self.movable[j] or self.partner[j] == i)

    def path_start(self, i: int, body: int) -> float:
        """Return the earliest instant at which the stored paths of disc `i` and of another body are both valid."""
        return self.time[i] if body < 0 else max(self.time[i], self.time[body])

    def find_last_impact(self, i: int, second: int) -> arb:
        """Return the time of disc `i`'s last impact that affects its next impact with `second`; 0 if there is none.

        Without friction, an impact on one of two orthogonal walls changes neither the disc's distance from the other
        wall nor the disc's speed towards the other wall.
        """
        latest = ZERO
        for key, time in self.met[i].items():
            if not (second < 0 and key < 0 and self.are_orthogonal(key, second)):
                latest = latest.max(time)
        return latest

    def find_last_impact_of_either(self, i: int, second: int, instant_s: float) -> arb | None:
        """Return the time of the last impact that affects the next impact of two bodies.

        Return None if this time is before `instant_s`.
        """
        times = [
            self.find_last_impact(disc, second)
            for disc in (i, second)
            if disc >= 0 and not instant_s > self.last_met[disc]
        ]
        return times[0].max(times[-1]) if times else None

    def _are_orthogonal(self, one: int, other: int) -> bool:
        """Return whether two straight obstacles are exactly orthogonal and without friction.

        If the result is true, an impact on one obstacle does not change impacts on the other obstacle.
        """
        a, b = (self.obstacles[wall_index(body)].shape for body in (one, other))
        if isinstance(a, Round) or isinstance(b, Round) or self.scene.arrays.has_wall_friction:
            return False
        return dot(a.normal, b.normal) == 0

    def trace_body(self, body: int) -> int:
        """Return the number by which traces refer to a body. An obstacle has the number of its wall."""
        return body if body >= 0 else wall_body(self.obstacles[wall_index(body)].wall)

    def legs(self, body: int) -> tuple[BallLeg, ...]:
        """Return the parts of a body's prescribed motion; empty for a body without a prescribed motion."""
        key = self.trace_body(body)
        if key not in self._drives:
            return ()
        if key not in self._legs:
            self._legs[key] = legs_of(self._drives[key])
        return self._legs[key]

    def is_driven(self, k: int) -> bool:
        """Return whether the k-th obstacle has a prescribed motion."""
        return bool(self.legs(wall_body(k)))

    def legs_after(self, body: int, instant_s: float) -> tuple[BallLeg | None, ...]:
        """Return the parts of a prescribed motion from an instant on; ``(None,)`` for a body without such a motion."""
        return tuple(leg for leg in self.legs(body) if leg.end_s > instant_s) or (None,)

    def bound_wait(self, instant_s: float, leg: BallLeg | None, *discs: int) -> arb:
        """Return an upper bound of the time from `instant_s` until `leg` ends or a disc changes its acceleration."""
        ends = [end.upper() - instant_s for i in discs if (end := self.contacts.end_of(i)) is not None]
        wait = min(ends, default=arb("inf"))
        return wait if leg is None else wait.min(arb(leg.end_s) - instant_s)

    def is_curved(self, body: int) -> bool:
        """Return whether a body's path is not straight in the reference frame that falls with gravity."""
        fixed = body < 0 or not self.movable[body]
        if body >= 0 and self.acceleration[body] is not None:
            return True
        return fixed and (self.falls or len(self.legs(body)) > 1)

    def state_in_frame(self, i: int, instant_s: float) -> State:
        """Return position and velocity of disc `i`, relative to the reference frame that falls with gravity."""
        leg = None if self.movable[i] else self.legs_after(i, instant_s)[0]
        return *self.centre_in_frame(i, instant_s), *((self.vx[i], self.vy[i]) if leg is None else (leg.vx, leg.vy))

    def relative_state(self, i: int, instant_s: float, leg: BallLeg | None) -> State:
        """Return position and velocity of disc `i`, relative to a body with the constant velocity of `leg`."""
        return self.subtract_leg(
            leg, instant_s, *self.centre(i, instant_s), *self.velocity(i, arb(instant_s), instant_s)
        )

    def subtract_leg(self, leg: BallLeg | None, instant_s: float, x: arb, y: arb, vx: arb, vy: arb) -> State:
        """Return position and velocity, relative to a body with the constant velocity of `leg`."""
        if leg is None:
            return x, y, vx, vy
        moved_x, moved_y = leg.moved_at(arb(instant_s))
        return x - moved_x, y - moved_y, vx - leg.vx, vy - leg.vy

    def centre_in_frame(self, i: int, instant_s: float) -> tuple[arb, arb]:
        """Return the centre of disc `i` at the exact instant `instant_s`, relative to the falling frame."""
        if not self.movable[i] and (leg := self.legs_after(i, instant_s)[0]) is not None:
            x, y = leg.moved_at(arb(instant_s))
            return self.x[i] + x, self.y[i] + y
        if not self.movable[i] or (instant_s == self.time[i] and self.acceleration[i] is None):
            return self.x[i], self.y[i]
        if self.acceleration[i] is not None:
            (x, y), half_square = self.centre_at(i, arb(instant_s)), arb(instant_s) * arb(instant_s) / 2
            return x - self.gravity[0] * half_square, y - self.gravity[1] * half_square
        dt = arb(instant_s) - self.time[i]
        return self.x[i] + self.vx[i] * dt, self.y[i] + self.vy[i] * dt

    def centre_at(self, i: int, time: arb) -> tuple[arb, arb]:
        """Return the centre of disc `i` at a time, relative to the walls. The disc must not be driven."""
        if not self.movable[i]:
            return self.x[i], self.y[i]
        dt, pull = time - self.time[i], self.acceleration[i]
        # The state of a disc in flight is relative to a frame that falls with gravity. The state of a disc in contact
        # is relative to the walls.
        (ax, ay), half_square = (self.gravity, time * time / 2) if pull is None else (pull, dt * dt / 2)
        return (
            self.x[i] + self.vx[i] * dt + ax * half_square,
            self.y[i] + self.vy[i] * dt + ay * half_square,
        )

    def acceleration_of(self, i: int) -> tuple[arb, arb]:
        """Return the acceleration of disc `i` relative to the walls."""
        acceleration = self.acceleration[i]
        if acceleration is not None:
            return acceleration
        return self.gravity if self.movable[i] else (ZERO, ZERO)

    def centre(self, i: int, instant_s: float) -> tuple[arb, arb]:
        """Return the centre of disc `i` at the exact instant `instant_s`, relative to the walls."""
        if self.acceleration[i] is not None:
            return self.centre_at(i, arb(instant_s))
        x, y = self.centre_in_frame(i, instant_s)
        if not (self.falls and self.movable[i]):
            return x, y
        half_square = arb(instant_s) * arb(instant_s) / 2
        return x + self.gravity[0] * half_square, y + self.gravity[1] * half_square

    def velocity(self, i: int, time: arb, instant_s: float) -> tuple[arb, arb]:
        """Return the velocity of disc `i` at `time`, relative to the walls.

        For a driven disc, return the velocity at `instant_s`.
        """
        if not self.movable[i] and (leg := self.legs_after(i, instant_s)[0]) is not None:
            return leg.vx, leg.vy
        if (acceleration := self.acceleration[i]) is not None:
            dt = time - self.time[i]
            return self.vx[i] + acceleration[0] * dt, self.vy[i] + acceleration[1] * dt
        if not (self.falls and self.movable[i]):
            return self.vx[i], self.vy[i]
        return self.vx[i] + self.gravity[0] * time, self.vy[i] + self.gravity[1] * time

    def spin_at(self, i: int, time: arb) -> arb:
        """Return the spin of disc `i` at a time after its last impact."""
        return self.spin[i] + self.spin_rate[i] * (time - self.time[i])

    def bound_acceleration(self) -> arb:
        """Return a bound of the accelerations of discs and rims by gravity, a table, and contact with walls."""
        gx, gy = self.gravity
        friction = arb(max((material.friction for material in self.materials), default=0.0))
        turns = max([arb(1), *self.inverse_inertia_ratio], key=float)
        table = arb(self.scene.table_deceleration_m_s2)
        resists = friction + arb(self.scene.wall_rolling_resistance)
        return table + (gx * gx + gy * gy).sqrt() * (1 + 2 * resists * turns)

    def rim_speed(self, i: int) -> arb:
        """Return the rim speed (spin times radius) of disc `i`; counterclockwise is positive."""
        return arb(self.scene.discs[i].radius_m) * self.spin[i]

    def apply_spin_impulse(self, i: int, impulse: arb) -> None:
        """Reduce the spin of disc `i` by an impulse along its rim. The argument is the impulse divided by the mass."""
        self.spin[i] = self.spin[i] - impulse * self.inverse_inertia_ratio[i] / arb(self.scene.discs[i].radius_m)

    def record_impact(self, i: int, other: int, instant_s: float, time: arb, latest: float) -> None:
        """Record an impact of disc `i` with another body at `time`, which is at most `latest`.

        From now on, the state of the disc is stored for the instant `instant_s`.
        """
        self.time[i] = instant_s
        self.last_met[i] = max(self.last_met[i], latest)
        self.partner[i] = other
        self.met[i][min(other, 0)] = time
