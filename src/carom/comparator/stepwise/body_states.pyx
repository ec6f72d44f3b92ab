"""States of a few bodies, which can be advanced from any state of a run.

The solvers accept only scenes without overlaps, but a state of a run can have overlapping bodies. So this module lets
bodies that overlap and approach each other collide at once. The core applies the impact law.
"""

import math
from typing import NamedTuple

from cpython.mem cimport PyMem_Free, PyMem_Malloc, PyMem_Realloc
from cython cimport final
from libc.math cimport fabs

from carom.core import primitives
from carom.core.wall_features import Mover

#: Contact distances are multiplied by this factor, because rounding may leave a gap at the instant of contact.
TOUCH = 1.0 + 2.0**-40

#: Number for "no feature". A feature is an edge, end or corner of a wall.
NO_FEATURE = -1

cdef double touch = TOUCH

cdef struct Disc:
    double radius
    double mass
    double inverse_mass
    double inverse_inertia_ratio
    double ax  # acceleration by gravity
    double ay
    bint moves

cdef struct Plane:  # a half-plane wall: a point and the unit normal
    bint is_known  # false for finite and moving walls, which Python code measures
    double x
    double y
    double nx
    double ny

cdef struct Motion:
    int disc
    double x
    double y
    double vx
    double vy
    double spin

cdef struct Gap:  # see `Separation`
    double size
    double nx
    double ny
    double closing


class Separation(NamedTuple):
    """Gap between two bodies, the unit normal from the first to the second, and the speed at which they approach."""

    gap: float
    normal: tuple[float, float]
    closing: float


@final
cdef class BodyNumbers:
    """Radii, masses and other numbers of the discs and half-plane walls of a `SceneBodies`, for C code."""

    cdef Disc *discs
    cdef Plane *planes
    cdef int n
    cdef bint moves_straight

    def __cinit__(self, bodies):
        cdef int i, k
        self.n, self.moves_straight = bodies.n, bodies.moves_straight
        self.discs = <Disc*>PyMem_Malloc(max(1, self.n) * sizeof(Disc))
        self.planes = <Plane*>PyMem_Malloc(max(1, len(bodies.walls)) * sizeof(Plane))
        if self.discs is NULL or self.planes is NULL:
            raise MemoryError
        for i in range(self.n):
            self.discs[i] = Disc(
                bodies.radius[i], bodies.mass[i], bodies.inverse_mass[i], bodies.inverse_inertia_ratio[i],
                bodies.pulls[i][0], bodies.pulls[i][1], bodies.is_movable(i),
            )
        for k, wall in enumerate(bodies.walls):
            self.planes[k] = Plane(False, 0.0, 0.0, 0.0, 0.0)
            if isinstance(wall, tuple) and bodies.wall_drives[k].is_stationary:
                self.planes[k] = Plane(True, wall[0], wall[1], wall[2], wall[3])

    def __dealloc__(self):
        PyMem_Free(self.discs)
        PyMem_Free(self.planes)


@final
cdef class BodyStates:
    """Positions, velocities and spins of some discs by number, and the time since the run's start.

    Args:
        bodies: The scene's bodies.
        time_s: The time.
        discs: Numbers of the discs.
        position_m: Positions of all discs of the scene, shape ``(n, 2)``.
        velocity_m_s: Velocities of all discs, shape ``(n, 2)``.
        spin_rad_s: Spins of all discs, shape ``(n,)``; None if no disc turns.
    """

    cdef readonly object bodies
    #: For each disc and finite wall, the number of the wall's edge, end or corner that the disc meets next.
    cdef public dict met
    cdef public double time_s
    cdef BodyNumbers numbers
    cdef Motion *motions
    cdef int count

    def __cinit__(
        self,
        bodies,
        double time_s,
        discs=(),
        const double[:, :] position_m=None,
        const double[:, :] velocity_m_s=None,
        const double[:] spin_rad_s=None,
    ):
        cdef int k, i
        self.bodies, self.numbers, self.time_s, self.met = bodies, bodies.numbers, time_s, {}
        self.allocate(len(discs))
        for k in range(self.count):
            i = discs[k]
            self.motions[k] = Motion(
                i, position_m[i, 0], position_m[i, 1], velocity_m_s[i, 0], velocity_m_s[i, 1],
                0.0 if spin_rad_s is None else spin_rad_s[i],
            )

    def __dealloc__(self):
        PyMem_Free(self.motions)

    cdef int allocate(self, int count) except -1:
        """Resize the array of motions to `count` discs. Existing motions are kept."""
        motions = <Motion*>PyMem_Realloc(self.motions, max(1, count) * sizeof(Motion))
        if motions is NULL:
            raise MemoryError
        self.motions, self.count = motions, count
        return 0

    cdef Motion *find(self, int disc) except NULL:
        """Return the motion of a disc."""
        cdef int k
        for k in range(self.count):
            if self.motions[k].disc == disc:
                return &self.motions[k]
        raise KeyError(disc)

    @property
    def discs(self):
        """Numbers of the discs."""
        return [self.motions[k].disc for k in range(self.count)]

    def spin_of(self, int disc):
        """Return the spin of a disc."""
        return self.find(disc).spin

    cpdef BodyStates copy(self):
        """Return a copy of the state, without `met`."""
        cdef BodyStates other = BodyStates(self.bodies, self.time_s)
        cdef int k
        other.allocate(self.count)
        for k in range(self.count):
            other.motions[k] = self.motions[k]
        return other

    def merge_discs(self, BodyStates other):
        """Add the discs of another state."""
        cdef int k, count = self.count
        self.allocate(count + other.count)
        for k in range(other.count):
            self.motions[count + k] = other.motions[k]

    def select_discs(self, bodies):
        """Return the state of those given bodies that are discs."""
        cdef BodyStates other = BodyStates(self.bodies, self.time_s)
        for body in bodies:
            if body < self.numbers.n:
                other.allocate(other.count + 1)
                other.motions[other.count - 1] = self.find(body)[0]
        return other

    def motion_of(self, int body):
        """Return the position and velocity of a body. The position of a wall is its displacement since the start."""
        cdef Motion *motion
        if body < self.numbers.n:
            motion = self.find(body)
            return (motion.x, motion.y), (motion.vx, motion.vy)
        leg = self.bodies.wall_drives[body - self.numbers.n].leg_at(self.time_s * touch)
        return leg.moved_at(self.time_s), leg.velocity

    def build_mover(self, int disc, int body):
        """Return a disc's motion relative to a wall."""
        wall, motion = body - self.numbers.n, self.find(disc)
        place = self.bodies.to_wall_frame(wall, motion.x, motion.y, self.time_s)
        wall_velocity = self.bodies.wall_velocity(wall, self.time_s)
        return Mover.at(place, (motion.vx, motion.vy), self.numbers.discs[disc].radius, wall_velocity)

    cpdef move_freely(self, double seconds, resting=None):
        """Move all discs along their free paths. Gravity does not act between the two bodies of the pair `resting`."""
        cdef int k
        cdef Motion *motion
        if self.numbers.moves_straight:
            for k in range(self.count):
                motion = &self.motions[k]
                motion.x, motion.y = motion.x + motion.vx * seconds, motion.y + motion.vy * seconds
        else:
            for k in range(self.count):
                self.move_on_bent_path(&self.motions[k], seconds, resting)
        self.time_s += seconds

    cdef int move_on_bent_path(self, Motion *motion, double seconds, resting) except -1:
        # A scene has either gravity or slowing, so only one of them bends a path.
        bodies, disc = self.bodies, motion.disc
        cdef double flown_s = seconds, kept_fraction = 1.0, half = 0.5 * seconds * seconds, nx, ny, pull
        cdef double ax = self.numbers.discs[disc].ax, ay = self.numbers.discs[disc].ay
        if bodies.disc_drives and (drive := bodies.disc_drives.get(disc)) is not None and len(drive.legs) > 1:
            begin_s, end_s = self.time_s, self.time_s + seconds
            leg = drive.leg_at(end_s * touch)
            (bx, by), (x, y) = drive.leg_at(begin_s * touch).moved_at(begin_s), leg.moved_at(end_s)
            motion.x, motion.y = motion.x + <double>x - <double>bx, motion.y + <double>y - <double>by
            motion.vx, motion.vy = leg.velocity
            return 0
        if bodies.slows:
            speed = math.hypot(motion.vx, motion.vy)
            flown_s = bodies.slowing.compute_flown_time(seconds, speed)
            kept_fraction = bodies.slowing.compute_kept_fraction(seconds, speed)
        if resting is not None and resting[0] == disc and resting[1] >= self.numbers.n:
            _, nx, ny = bodies.measure_wall_distance(resting[1] - self.numbers.n, motion.x, motion.y, self.time_s)
            pull = min(ax * nx + ay * ny, 0.0)
            ax, ay = ax - pull * nx, ay - pull * ny
        motion.x = motion.x + motion.vx * flown_s + ax * half
        motion.y = motion.y + motion.vy * flown_s + ay * half
        motion.vx, motion.vy = motion.vx * kept_fraction + ax * seconds, motion.vy * kept_fraction + ay * seconds
        motion.spin *= kept_fraction
        return 0

    cpdef BodyStates compute_later_state(self, double seconds, resting=None):
        """Return the state some seconds later. The arguments are those of `move_freely`."""
        cdef BodyStates state = self.copy()
        state.move_freely(seconds, resting)
        return state

    def measure_separation(self, pair, int feature=NO_FEATURE):
        """Return the separation of two bodies. If `feature` is given, the normal is that of this feature of the wall."""
        gap = self.measure_gap(pair[0], pair[1], feature)
        return Separation(gap.size, (gap.nx, gap.ny), gap.closing)

    cdef Gap measure_gap(self, int i, int j, int feature=-1) except *:
        cdef Motion *one = self.find(i)
        cdef Motion *other
        cdef double dx, dy, ux, uy, distance, speed, nx, ny, wx = 0.0, wy = 0.0
        cdef Plane *plane
        if j >= self.numbers.n:
            plane = &self.numbers.planes[j - self.numbers.n]
            if plane.is_known:
                nx, ny = plane.nx, plane.ny
                distance = (one.x - plane.x) * nx + (one.y - plane.y) * ny
            else:
                wall = j - self.numbers.n
                distance, nx, ny = self.bodies.measure_wall_distance(wall, one.x, one.y, self.time_s)
                if feature != -1 and not isinstance(self.bodies.walls[wall], tuple):
                    nx, ny = self.bodies.walls[wall].features.normal(feature, self.build_mover(i, j))
                wx, wy = self.bodies.wall_velocity(wall, self.time_s)
            closing = -((one.vx - wx) * nx + (one.vy - wy) * ny)
            return Gap(distance - self.numbers.discs[i].radius, -nx, -ny, closing)
        other = self.find(j)
        dx, dy, ux, uy = other.x - one.x, other.y - one.y, other.vx - one.vx, other.vy - one.vy
        distance = math.hypot(dx, dy)
        if distance == 0.0:  # coinciding centres define no normal, so the discs count as separating
            speed = math.hypot(ux, uy)
            nx, ny = (ux / speed, uy / speed) if speed > 0.0 else (1.0, 0.0)
        else:
            nx, ny = dx / distance, dy / distance
        gap = distance - self.numbers.discs[i].radius - self.numbers.discs[j].radius
        return Gap(gap, nx, ny, -(ux * nx + uy * ny))

    cpdef bint are_overlapping(self, pair) except *:
        """Whether the bodies of a pair overlap or touch.

        A gap within the rounding of the contact distance counts as touching.
        """
        cdef int i = pair[0], j = pair[1]
        cdef Motion *one = self.find(i)
        cdef Motion *other
        cdef double reach = self.numbers.discs[i].radius * touch, dx, dy
        cdef Plane *plane
        if j >= self.numbers.n:
            plane = &self.numbers.planes[j - self.numbers.n]
            if plane.is_known:
                return (one.x - plane.x) * plane.nx + (one.y - plane.y) * plane.ny <= reach
            wall = self.bodies.walls[j - self.numbers.n]
            wide = 0.0 if isinstance(wall, tuple) else (touch - 1.0) * wall.outline.half_width
            away = self.bodies.measure_wall_distance(j - self.numbers.n, one.x, one.y, self.time_s)[0]
            return away <= reach + wide
        other = self.find(j)
        dx, dy = other.x - one.x, other.y - one.y
        reach += self.numbers.discs[j].radius * touch
        return dx * dx + dy * dy <= reach * reach

    cpdef apply_impact(self, pair, int feature=-1):
        """Apply an impact of two bodies at their present positions. `measure_separation` explains `feature`."""
        if pair[1] >= self.numbers.n:
            self.apply_wall_impact(pair, feature)
        else:
            self.apply_disc_impact(pair[0], pair[1])

    cdef int apply_wall_impact(self, pair, int feature) except -1:
        cdef int i = pair[0], wall = pair[1] - self.numbers.n
        cdef Motion *motion = self.find(i)
        cdef Disc *disc = &self.numbers.discs[i]
        cdef double wx, wy, nx, ny, before_x, before_y, along, normal_change, rim, slip, friction, turning, belt = 0.0
        bodies, gap = self.bodies, self.measure_gap(i, pair[1], feature)
        nx, ny = -gap.nx, -gap.ny
        wx, wy = bodies.wall_velocity(wall, self.time_s)
        before_x, before_y = motion.vx - wx, motion.vy - wy
        along = before_x * nx + before_y * ny
        if not along < 0.0:
            return 0
        normal_change = -(1.0 + <double>bodies.restitution_of(pair)) * along
        motion.vx, motion.vy = motion.vx + normal_change * nx, motion.vy + normal_change * ny
        contact = bodies.contact_of(pair)
        if contact.friction > 0.0 or bodies.rolling_resistance > 0.0:
            rim = disc.radius * motion.spin
            if bodies.belts is not None:
                belt = bodies.belts[wall]
            slip = before_x * ny - before_y * nx + rim + belt
            friction, turning, _ = primitives.frictional_impulses(
                *contact, bodies.rolling_resistance, slip, rim, disc.inverse_inertia_ratio, normal_change
            )
            motion.vx, motion.vy = motion.vx - friction * ny, motion.vy + friction * nx
            motion.spin -= turning * disc.inverse_inertia_ratio / disc.radius
        return 0

    cdef int apply_disc_impact(self, int i, int j) except -1:
        cdef Motion *one = self.find(i)
        cdef Motion *other = self.find(j)
        cdef Disc *first = &self.numbers.discs[i]
        cdef Disc *second = &self.numbers.discs[j]
        cdef double dx = other.x - one.x, dy = other.y - one.y, ux = other.vx - one.vx, uy = other.vy - one.vy
        cdef double turn = 0.0, impulse, distance, surface, inverse_effective_mass, px, py
        cdef double w_i = first.inverse_mass, w_j = second.inverse_mass
        cdef double y_i = first.inverse_inertia_ratio, y_j = second.inverse_inertia_ratio
        bodies = self.bodies
        impulse = primitives.normal_impulse(dx, dy, ux, uy, w_i + w_j, bodies.disc_restitution)
        if bodies.disc_contact.friction > 0.0 and impulse < 0.0:
            distance = math.hypot(dx, dy)
            surface = distance * (first.radius * one.spin + second.radius * other.spin)
            inverse_effective_mass = w_i * (1.0 + y_i) + w_j * (1.0 + y_j)
            turn = primitives.pair_tangential_impulse(
                *bodies.disc_contact, dx, dy, ux, uy, surface, inverse_effective_mass, impulse
            )
            one.spin -= turn * distance * w_i * y_i / first.radius
            other.spin -= turn * distance * w_j * y_j / second.radius
        px, py = impulse * dx + turn * dy, impulse * dy - turn * dx
        one.vx, one.vy = one.vx + w_i * px, one.vy + w_i * py
        other.vx, other.vy = other.vx - w_j * px, other.vy - w_j * py
        return 0

    cpdef double compute_energy(self) except? -1.0:
        """Return the kinetic energy of the movable discs, including rotation, in joules."""
        cdef double energy = 0.0, rim, rotation
        cdef int k
        cdef Motion *motion
        cdef Disc *disc
        for k in range(self.count):
            motion = &self.motions[k]
            disc = &self.numbers.discs[motion.disc]
            if disc.moves:
                rim = disc.radius * motion.spin
                rotation = rim * rim / disc.inverse_inertia_ratio if disc.inverse_inertia_ratio > 0.0 else 0.0
                energy += 0.5 * disc.mass * (motion.vx * motion.vx + motion.vy * motion.vy + rotation)
        return energy

    def find_greatest_speeds(self):
        """Return two speeds in metres per second: the greatest of all discs, and the greatest of all discs and rims."""
        cdef double speed = 0.0, rim_speed = 0.0
        cdef int k
        for k in range(self.count):
            speed = max(speed, <double>math.hypot(self.motions[k].vx, self.motions[k].vy))
            rim_speed = max(rim_speed, fabs(self.numbers.discs[self.motions[k].disc].radius * self.motions[k].spin))
        return speed, max(speed, rim_speed)

    def measure_difference(self, BodyStates other):
        """Return the largest differences from another state of the same discs: velocities, rim speeds and positions."""
        cdef double velocity = 0.0, spin = 0.0, place = 0.0
        cdef int k
        for k in range(self.count):
            one, two = &self.motions[k], other.find(self.motions[k].disc)
            velocity = max(velocity, <double>math.hypot(one.vx - two.vx, one.vy - two.vy))
            spin = max(spin, fabs(one.spin - two.spin) * self.numbers.discs[one.disc].radius)
            place = max(place, <double>math.hypot(one.x - two.x, one.y - two.y))
        return velocity, spin, place
