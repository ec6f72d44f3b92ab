# distutils: sources = src/carom/core/frame_sampled.c
"""Python binding of the frame-sampled loop, `frame_sampled.c`: PIT for any number of discs.

The loop is compiled for straight flight, and for gravity without friction, where every frame is tested.
"""

from libc.stdint cimport uintptr_t
from libc.stdlib cimport free

import numpy as np

from carom.solvers.impact.resolution import too_far_out

from carom.core.carom_core cimport Index, Law, Record, Turning, Wall
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

    struct Clock:
        double step
        double rate

    struct Counts:
        Index frames
        Index tested
        Index pair_tests

    struct Pending:
        void *heap

    struct State:
        Disc *discs
        Wall *walls
        Law *wall_laws
        Chain *chains
        ChainEdge *edges
        Turning *turning
        Index disc_count
        Index wall_count
        Index edge_count
        bint has_chains
        bint falls
        double gx
        double gy
        bint skips
        double max_waste
        double work
        bint is_out_of_memory
        bint is_too_far
        Law law
        Clock clock
        Counts counts
        Pending pending
        Record record

    size_t carom_pit_lay_out(State *s, char *memory)
    void carom_pit_begin(State *s)
    void carom_pit_run(State *s, Index until, Index most)
    void carom_pit_write_states(const State *s, double time, double *states)


cdef class FrameLoop:
    """A PIT run of discs and walls, and the rows of its impacts: `carom.solvers.rows.RecordedImpacts` is their log.

    Args:
        start: The discs and walls, `carom.disc_arrays.DiscArrays`.
        clock: The times of the frames, `carom.solvers.pit.clock.FrameClock`.
        skips: Whether tests that can find nothing are skipped.
        max_waste: How many times the work of scheduling all discs once may be wasted before plain looping replaces
            skipping for a while; infinity for no limit.
        gravity: Uniform gravity, metres a second squared.
    """

    cdef State s
    cdef object memory

    def __cinit__(self, start, clock, bint skips, double max_waste, gravity=(0.0, 0.0)):
        s = &self.s
        chains = [wall for wall in start.walls if not isinstance(wall, tuple)]
        s.disc_count, s.wall_count = len(start.radius_m), len(start.walls)
        s.edge_count = sum(len(wall.stretches) for wall in chains)
        if s.disc_count + s.wall_count > 2**31 - 1:
            raise ValueError("more discs and walls than can be numbered")
        s.clock.step, s.clock.rate = clock.step_s, clock.rate_hz
        s.law = law_of(start, 0.0)
        s.gx, s.gy = gravity
        s.falls = s.gx != 0.0 or s.gy != 0.0
        s.skips, s.max_waste = skips and not s.falls, max_waste
        s.has_chains = bool(chains)
        s.record.has_spins, s.record.has_contacts = start.turns, s.has_chains
        s.record.resize = carom_enlarge
        self.memory = np.empty(carom_pit_lay_out(s, NULL) + 64, np.uint8)
        cdef unsigned char[::1] memory = self.memory
        carom_pit_lay_out(s, <char *>((<uintptr_t>&memory[0] + 63) // 64 * 64))
        self.write_discs(start)
        self.write_walls(start)
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

    def __dealloc__(self):
        free(self.s.pending.heap)
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
