# distutils: sources = src/carom/core/frame_sampled.c
"""Python binding of the frame-sampled loop, `frame_sampled.c`: PIT for any number of discs and all kinds of motion."""

from libc.stdint cimport uintptr_t
from libc.stdlib cimport free

import numpy as np

from carom.solvers.endings import too_far_out

from carom.core.carom_core cimport Index, Law, Record, Surface, Turning, Wall
from carom.core.laws cimport law_of, write_wall_laws
from carom.core.record_rows cimport ambiguous_rows, carom_enlarge, free_record, release_rows

cdef extern from "carom/core/pit_state.h" nogil:
    struct Disc:
        double x
        double y
        double vx
        double vy
        double radius
        double inverse_mass

    struct ChainEdge:
        double ax
        double ay
        double bx
        double by
        double bulge
        double cx
        double cy
        double radius
        bint is_arc
        bint is_whole

    struct Chain:
        ChainEdge *edges
        Index edge_count
        double half_width
        double size

    enum MotionKind:
        STRAIGHT
        FALLING
        SLOWING

    enum:
        NO_PATH

    struct Leg:
        double begin
        double end
        double moved_x
        double moved_y
        double vx
        double vy

    struct Path:
        Index body
        const Leg *legs
        Index leg_count
        Index leg
        double x
        double y
        double fastest

    struct WallMotion:
        int path
        double moved_x
        double moved_y
        Surface surface

    struct Damping:
        double rate

    struct Clock:
        double step
        double rate

    struct Counts:
        Index frames
        Index tested
        Index pair_tests

    struct Pending:
        void *heap

    struct Touching:
        void *bodies

    struct State:
        Disc *discs
        Wall *walls
        Law *wall_laws
        Chain *chains
        ChainEdge *edges
        Turning *turning
        Path *paths
        Leg *legs
        int *disc_paths
        WallMotion *wall_motions
        Index disc_count
        Index wall_count
        Index edge_count
        Index path_count
        Index leg_count
        bint has_chains
        bint has_driven_discs
        bint has_wall_motions
        bint has_touched
        MotionKind motion
        double gx
        double gy
        double rolling_resistance
        double deceleration
        Damping damping
        double now
        bint skips
        double max_waste
        double work
        bint is_out_of_memory
        bint is_too_far
        Law law
        Clock clock
        Counts counts
        Pending pending
        Touching touching
        Record record

    size_t carom_pit_lay_out(State *s, char *memory)
    void carom_pit_begin(State *s)
    void carom_pit_run(State *s, Index until, Index most)
    void carom_pit_write_states(const State *s, double time, double *states)


def driven_bodies(start):
    """Return the bodies that are driven, walls as negative numbers, with their paths."""
    walls = [(-1 - k, drive) for k, drive in enumerate(start.wall_drives or ()) if not drive.stands]
    return [*walls, *zip(start.driven_discs, start.disc_drives, strict=True)]


cdef class FrameLoop:
    """A PIT run of discs and walls, and the rows of its impacts: `carom.solvers.rows.RecordedImpacts` is their log.

    Args:
        start: Where the run begins, `carom.solvers.run.Start`.
        clock: The times of the frames, `carom.solvers.pit.clock.FrameClock`.
        skips: Whether tests that can find nothing are skipped.
        max_waste: How many times the work of scheduling all discs once may be wasted before plain looping replaces
            skipping for a while; infinity for no limit.
        damping_per_s: Rate at which the motion of the discs is damped. Positions and velocities are then those of the
            undamped motion at an undamped time; recorded impacts are damped.
    """

    cdef State s
    cdef object memory

    def __cinit__(self, start, clock, bint skips, double max_waste, double damping_per_s=0.0):
        s = &self.s
        arrays = start.arrays
        chains = [wall for wall in arrays.walls if not isinstance(wall, tuple)]
        drives = driven_bodies(arrays)
        s.disc_count, s.wall_count = len(arrays.radius_m), len(arrays.walls)
        s.edge_count = sum(len(wall.stretches) for wall in chains)
        s.path_count, s.leg_count = len(drives), sum(len(drive.legs) for _, drive in drives)
        if s.disc_count + s.wall_count > 2**31 - 1:
            raise ValueError("more discs and walls than can be numbered")
        s.clock.step, s.clock.rate = clock.step_s, clock.rate_hz
        s.law = law_of(arrays, 0.0)
        s.gx, s.gy = start.gravity_m_s2
        s.rolling_resistance, s.deceleration = start.wall_rolling_resistance, start.table_deceleration_m_s2
        s.damping.rate = damping_per_s
        s.motion = SLOWING if s.deceleration > 0.0 else FALLING if s.gx != 0.0 or s.gy != 0.0 else STRAIGHT
        s.skips, s.max_waste = skips, max_waste
        s.has_chains = bool(chains)
        s.has_driven_discs = bool(arrays.driven_discs)
        s.has_wall_motions = arrays.wall_drives is not None or arrays.belts_m_s is not None
        s.has_touched = 0.0 in (s.law.restitution, *(material.restitution for material in arrays.materials))
        s.record.has_spins, s.record.has_contacts = arrays.turns, s.has_chains
        s.record.resize = carom_enlarge
        self.memory = np.empty(carom_pit_lay_out(s, NULL) + 64, np.uint8)
        cdef unsigned char[::1] memory = self.memory
        carom_pit_lay_out(s, <char *>((<uintptr_t>&memory[0] + 63) // 64 * 64))
        self.write_discs(arrays)
        self.write_walls(arrays)
        self.write_paths(arrays, drives)
        carom_pit_begin(s)

    cdef write_discs(self, start):
        """Write the rows of the discs."""
        s = &self.s
        cdef Index i
        cdef const double[:, :] position = start.position_m, velocity = start.velocity_m_s
        cdef const double[:] radius = start.radius_m, inverse_mass = 1.0 / start.mass_kg
        for i in range(s.disc_count):
            a = &s.discs[i]
            a.x, a.y, a.vx, a.vy = position[i, 0], position[i, 1], velocity[i, 0], velocity[i, 1]
            a.radius, a.inverse_mass = radius[i], inverse_mass[i]
        if s.record.has_spins:
            for i, (spin, inertia) in enumerate(zip(start.spins, start.inertia)):
                s.turning[i] = Turning(spin, 1.0 / <double>inertia)

    cdef write_walls(self, start):
        """Write the rows of the walls, and the law of each."""
        s = &self.s
        cdef Index k
        cdef Index edge = 0
        write_wall_laws(s.wall_laws, &s.law, start)
        for k, wall in enumerate(start.walls):
            if isinstance(wall, tuple):
                s.walls[k].x, s.walls[k].y, s.walls[k].nx, s.walls[k].ny = wall
                continue
            s.chains[k] = Chain(&s.edges[edge], len(wall.stretches), wall.half_width, sum(map(abs, wall.lengths)))
            for stretch in wall.stretches:
                (ax, ay), (bx, by), bulge = stretch.edge
                cx, cy = stretch.centre or (0.0, 0.0)
                is_arc = stretch.centre is not None
                s.edges[edge] = ChainEdge(ax, ay, bx, by, bulge, cx, cy, stretch.radius, is_arc, stretch.whole)
                edge += 1

    cdef write_paths(self, start, drives):
        """Write the paths of driven bodies, and how walls and their surfaces move."""
        s = &self.s
        cdef Index i, k
        cdef Index leg = 0
        for i in range(s.disc_count if s.has_driven_discs else 0):
            s.disc_paths[i] = NO_PATH
        for k in range(s.wall_count if s.has_wall_motions else 0):
            s.wall_motions[k] = WallMotion(NO_PATH, 0.0, 0.0, Surface(0.0, 0.0, start.belt_of_wall(k)))
        for i, (body, drive) in enumerate(drives):
            path = &s.paths[i]
            path.body, path.legs, path.leg_count, path.fastest = body, &s.legs[leg], len(drive.legs), drive.fastest
            for begin, end, moved, velocity in drive.legs:
                s.legs[leg] = Leg(begin, end, moved[0], moved[1], velocity[0], velocity[1])
                leg += 1
            if path.body >= 0:
                path.x, path.y = s.discs[path.body].x, s.discs[path.body].y
                s.disc_paths[path.body] = <int>i
            else:
                motion = &s.wall_motions[-1 - path.body]
                motion.path = <int>i
                motion.surface.vx, motion.surface.vy = path.legs[0].vx, path.legs[0].vy

    def __dealloc__(self):
        free(self.s.pending.heap)
        free(self.s.touching.bodies)
        free_record(&self.s.record)

    def run(self, Index until, Index most, double work):
        """Pass the frames before number `until`, or as many as take so much work.

        Args:
            until: Number of a frame.
            most: Number of impacts, counted from the start, from which on no other frame is begun.
            work: In tests of two discs by plain looping.

        Raises:
            InputError: Discs have met so far out that floats do not resolve the distance of their centres.
        """
        self.s.work = work
        with nogil:
            carom_pit_run(&self.s, until, most)
        if self.s.is_out_of_memory:
            raise MemoryError(f"no memory for more than {self.recorded} recorded impacts")
        if self.s.is_too_far:
            raise too_far_out()

    @property
    def frames(self):
        """Frames passed."""
        return self.s.counts.frames

    @property
    def counts(self):
        """Work so far, by name; a test that a bound makes unnecessary counts as made where the bound is computed."""
        c = &self.s.counts
        looked_at = {"frames_looked_at": c.tested, "frames_skipped": c.frames - c.tested}
        return {"frames": c.frames, **looked_at, "pair_tests": c.pair_tests}

    @property
    def recorded(self):
        """Number of impacts recorded so far."""
        return self.s.record.released + self.s.record.count

    def take_impacts(self):
        """Return what `release_rows` does, see record_rows.pxd."""
        return release_rows(&self.s.record)

    def take_modes(self):
        """Return None: PIT has no contact that lasts."""
        return None

    def ambiguous(self):
        """Return the rows that share a movable disc with an earlier impact of the same frame."""
        return ambiguous_rows(&self.s.record)

    def positions(self, double time):
        """Return the centres at a time not before the last frame, metres, shape ``(n, 2)``."""
        return self.states(time)[:, :2].copy()

    def velocities(self, double time):
        """Return the velocities at such a time, metres a second, shape ``(n, 2)``."""
        return self.states(time)[:, 2:].copy()

    def present_spins(self):
        """Return the spins, radians a second, shape ``(n,)``; None if no disc spins."""
        cdef Index i
        spins = [self.s.turning[i].spin for i in range(self.s.disc_count)]
        return np.array(spins) if self.s.record.has_spins else None

    cdef states(self, double time):
        """Return x, y, vx, vy of each disc at a time."""
        states = np.empty((self.s.disc_count, 4))
        cdef double[:, ::1] rows = states
        carom_pit_write_states(&self.s, time, &rows[0, 0])
        return states
