"""PIT compiled: any number of discs; under gravity without friction, and each frame is looked at. To be read after `layout.pxd`.

`run` is the loop. It skips the frames at which no disc is due, and looks at the others; or it loops plainly, where that
is asked for or costs less.
"""

from libc.stdlib cimport calloc, free

import numpy as np

from carom.solvers.impact.resolution import too_far_out

from carom.constants cimport INF
from carom.solvers.impact.ambiguity cimport forget
from carom.solvers.impact.law cimport law_of, write_wall_laws
from carom.solvers.impact.record cimport ambiguous_rows, free_record, taken_rows
from carom.solvers.impact.structs cimport NOBODY, Index, Law, Recent, Turning, Wall
from carom.solvers.pit.bounds cimport MOST_FRAMES
from carom.solvers.pit.grid cimport settle
from carom.solvers.pit.layout cimport MOST_LEVELS, NOWHERE, Disc, Level, Normal, State
from carom.solvers.pit.look cimport fall, look, loops_plainly, skip, test_all
from carom.solvers.pit.stretches cimport Finite, Stretch

#: Up to this many discs, all count as near each other. Measured: looking through nine cells costs as much.
_FEW_DISCS = 36
#: Chains for cells, at least: so that most cells have one of their own.
_CHAINS_PER_DISC = 2
#: Leeway of a level, in parts of the mean distance of its discs and of their largest radius: the more, the seldomer a
#: disc must be put into its cell anew, and the more discs are near it. Measured at packings .05 to .6.
_LEEWAY, _LEAST_LEEWAY = 0.2, 0.25


cdef void run(State *s, Index until, Index most) noexcept nogil:
    """Pass frames before number `until`, until work or memory is used up or there have been `most` impacts."""
    while s.counts.frames < until and s.work > 0.0 and not s.no_memory and not s.too_far:
        if s.row > 0:
            test_all(s)
        elif s.record.taken + s.record.count >= most:
            return
        elif loops_plainly(s):
            test_all(s)
        elif not skip(s, until):
            look(s)


#: Called through a pointer: within the method of a Python class GCC takes the loop for code that seldom runs.
ctypedef void (*Loop)(State *, Index, Index) noexcept nogil
cdef Loop loop = run


cdef void *memory(Index count, size_t size) except NULL:
    """Return that many rows, all zero."""
    rows = calloc(max(count, 1), size)
    if rows == NULL:
        raise MemoryError("no memory for the discs of a PIT run")
    return rows


cdef class FrameLoop:
    """PIT on discs and walls, and the rows of its impacts: `carom.solvers.rows.RecordedImpacts` is their log.

    Args:
        start: The discs and walls, `carom.disc_arrays.DiscArrays`.
        clock: When the frames are, `carom.solvers.pit.clock.FrameClock`.
        skips: Whether tests that can find nothing are left out.
        most_waste: How many times the work of looking around all discs once may be wasted before plain looping takes over
            for a while; infinity for as often as it likes.
        gravity: Uniform gravity, metres a second squared.
    """

    cdef State s

    def __cinit__(self, start, clock, bint skips, double most_waste, gravity=(0.0, 0.0)):
        s = &self.s
        cdef Index i
        cdef const double[:, :] position = start.position_m, velocity = start.velocity_m_s
        cdef const double[:] radius = start.radius_m, mass = start.mass_kg
        s.disc_count, s.wall_count = position.shape[0], len(start.walls)
        if s.disc_count + s.wall_count > 2**31 - 1:
            raise ValueError("more discs and walls than can be numbered")
        s.clock.step, s.clock.rate = clock.step_s, clock.rate_hz
        s.horizon = MOST_FRAMES * clock.frame_s
        s.law = law_of(start, 0.0)
        s.record.turns = start.turns
        s.gx, s.gy = gravity
        s.falls = s.gx != 0.0 or s.gy != 0.0
        s.skips, s.most_waste = skips and not s.falls, most_waste
        s.discs = <Disc *>memory(s.disc_count, sizeof(Disc))
        s.walls = <Wall *>memory(s.wall_count, sizeof(Wall))
        s.due = <double *>memory(s.disc_count, sizeof(double))
        s.looking = <int *>memory(s.disc_count + 1, sizeof(int))
        s.record.recent = <Recent *>memory(s.disc_count, sizeof(Recent))
        for i in range(s.disc_count):
            a = &s.discs[i]
            a.x, a.y, a.vx, a.vy = position[i, 0], position[i, 1], velocity[i, 0], velocity[i, 1]
            a.radius, a.inverse_mass = radius[i], 1.0 / mass[i]
            a.cell, a.last = NOWHERE, NOBODY
            s.due[i] = INF if a.inverse_mass == 0.0 else 0.0
            forget(&s.record.recent[i])
        if s.record.turns:
            s.turning = <Turning *>memory(s.disc_count, sizeof(Turning))
            for i, (spin, inertia) in enumerate(zip(start.spins, start.inertia)):
                s.turning[i] = Turning(spin, 1.0 / <double>inertia)
        self.take_walls(start)
        if s.skips and s.disc_count > _FEW_DISCS:
            self.lay_out(start)

    cdef take_walls(self, start):
        """Take over the walls of a start, and the law on each."""
        s = &self.s
        cdef Index i, k
        s.wall_laws = <Law *>memory(s.wall_count, sizeof(Law))
        if not start.has_half_planes:
            s.finite = <Finite *>memory(s.wall_count, sizeof(Finite))
            s.normals = <Normal *>memory(s.disc_count, sizeof(Normal))
            s.record.locates = True
        write_wall_laws(s.wall_laws, &s.law, start)
        for i, wall in enumerate(start.walls):
            if isinstance(wall, tuple):
                s.walls[i].x, s.walls[i].y, s.walls[i].nx, s.walls[i].ny = wall
                continue
            found = &s.finite[i]
            found.first = <Stretch *>memory(len(wall.stretches), sizeof(Stretch))
            found.count, found.half_width = len(wall.stretches), wall.half_width
            found.size = sum(map(abs, wall.lengths))
            for k, stretch in enumerate(wall.stretches):
                (ax, ay), (bx, by), bulge = stretch.edge
                cx, cy = stretch.centre or (0.0, 0.0)
                bent = stretch.centre is not None
                found.first[k] = Stretch(ax, ay, bx, by, bulge, cx, cy, stretch.radius, bent, stretch.whole)

    cdef lay_out(self, start):
        """Choose levels of cells, and put every disc into its own."""
        s = &self.s
        cdef Index i
        s.grid.chains = 1 << (_CHAINS_PER_DISC * s.disc_count - 1).bit_length()
        s.grid.first = <int *>memory(s.grid.chains, sizeof(int))
        for i in range(s.grid.chains):
            s.grid.first[i] = NOBODY
        width, height = np.ptp(start.position_m, axis=0)
        fraction, power = np.frexp(start.radius_m / start.radius_m.max())
        halvings = np.minimum(1 - power - (fraction > 0.5), MOST_LEVELS - 1)
        _, levels, counts = np.unique(halvings, return_inverse=True, return_counts=True)
        s.grid.level_count = len(counts)
        for i, count in enumerate(counts):
            radius = start.radius_m[levels == i].max()
            leeway = max(_LEEWAY * np.sqrt(width / count * height), _LEAST_LEEWAY * radius)
            s.grid.levels[i] = Level(2.0 * (radius + leeway), leeway, radius + leeway)
        for i in range(s.disc_count):
            s.discs[i].level = levels[i]
            settle(s, i)

    def __dealloc__(self):
        cdef Index i
        for i in range(self.s.wall_count if self.s.finite != NULL else 0):
            free(self.s.finite[i].first)
        free(self.s.finite)
        free(self.s.normals)
        free(self.s.wall_laws)
        free(self.s.discs)
        free(self.s.walls)
        free(self.s.turning)
        free(self.s.due)
        free(self.s.looking)
        free(self.s.grid.first)
        free(self.s.pending.heap)
        free(self.s.record.recent)
        free_record(&self.s.record)

    def run(self, Index until, Index most, double work):
        """Pass the frames before number `until`, or as many as take so much work.

        Args:
            until: Number of a frame.
            most: Number of impacts, counted from the start, from which on no other frame is begun.
            work: In tests of two discs by plain looping.

        Raises:
            InputError: Discs have met so far out that floats do not tell their centres apart.
        """
        self.s.work = work
        with nogil:
            loop(&self.s, until, most)
        if self.s.no_memory:
            raise MemoryError(f"no memory for more than {self.recorded} recorded impacts")
        if self.s.too_far:
            raise too_far_out()

    @property
    def frames(self):
        """Frames passed."""
        return self.s.counts.frames

    @property
    def counts(self):
        """Work so far, by name; a test that a bound has made needless counts as made where the bound was found."""
        c = &self.s.counts
        looked_at = {"frames_looked_at": c.looked_at, "frames_skipped": c.frames - c.looked_at}
        return {"frames": c.frames, **looked_at, "pair_tests": c.pair_tests}

    @property
    def recorded(self):
        """Number of impacts recorded so far."""
        return self.s.record.taken + self.s.record.count

    def take_impacts(self):
        """Return what `taken_rows` does, see record.pxd."""
        return taken_rows(&self.s.record)

    def ambiguous(self):
        """Return the rows that share a movable disc with an earlier impact of the same frame."""
        return ambiguous_rows(&self.s.record)

    def positions(self, double time):
        """Return where the discs are at a time not before the last frame passed, metres, shape ``(n, 2)``."""
        return self.states(time)[:, :2].copy()

    def velocities(self, double time):
        """Return the velocities at such a time, metres a second, shape ``(n, 2)``."""
        return self.states(time)[:, 2:].copy()

    def present_spins(self):
        """Return the spins, radians a second, shape ``(n,)``; None if no disc spins."""
        cdef Index i
        return np.array([self.s.turning[i].spin for i in range(self.s.disc_count)]) if self.s.record.turns else None

    cdef states(self, double time):
        """Return x, y, vx, vy of each disc at a time."""
        s = &self.s
        states = np.empty((s.disc_count, 4))
        cdef double[:, ::1] state = states
        cdef Index i
        step = time - s.now
        for i in range(s.disc_count):
            a = &s.discs[i]
            state[i, 0], state[i, 1], state[i, 2], state[i, 3] = a.x, a.y, a.vx, a.vy
            if not s.falls:
                state[i, 0] += a.vx * step
                state[i, 1] += a.vy * step
            elif step != 0.0 and a.inverse_mass != 0.0:
                fall(s, &state[i, 0], &state[i, 2], step)
        return states
