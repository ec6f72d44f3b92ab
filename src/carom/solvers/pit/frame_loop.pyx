"""PIT compiled: any number of discs, without gravity. To be read after `layout.pxd`.

`run` is the loop. It skips the frames at which no disc is due, and looks at the others; or it loops plainly, where that
is asked for or costs less.
"""

from libc.stdlib cimport calloc, free
from libc.string cimport memcpy

import numpy as np

from carom.solvers.event_driven.layout cimport INF, NOBODY, Impact, Index, Recent, Wall
from carom.solvers.event_driven.record cimport forget
from carom.solvers.pit.bounds cimport MOST_FRAMES
from carom.solvers.pit.grid cimport chain_count, choose_levels, settle
from carom.solvers.pit.layout cimport NOWHERE, Disc, State
from carom.solvers.pit.look cimport look, loops_plainly, skip, test_all


cdef void run(State *s, Index until, Index most) noexcept nogil:
    """Pass frames before number `until`, until work or memory is used up or there have been `most` impacts."""
    while s.counts.frames < until and s.work > 0.0 and not s.no_memory:
        if s.row > 0:
            test_all(s)
        elif s.record.count >= most:
            return
        elif loops_plainly(s):
            test_all(s)
        elif not skip(s, until):
            look(s)


#: Called through a pointer: within the method of a Python class GCC takes the loop for code that seldom runs.
ctypedef void (*Loop)(State *, Index, Index) noexcept nogil
cdef Loop loop = run


cdef void *memory(Index count, size_t size) except NULL:
    """Return room for so many rows, all zero."""
    room = calloc(count if count > 0 else 1, size)
    if room == NULL:
        raise MemoryError("no memory for the discs of a PIT run")
    return room


cdef class FrameLoop:
    """PIT on discs and walls.

    Args:
        start: The discs and walls, `carom.disc_arrays.DiscArrays`.
        step_s: Frame k stands at ``k * step_s / rate_hz``, seconds.
        rate_hz: See `step_s`.
        skips: Whether tests that can find nothing are left out.
        patience: How many times the work of looking around all discs once may be wasted before plain looping takes over
            for a while; infinity for as often as it likes.
    """

    cdef State s

    def __cinit__(self, start, double step_s, double rate_hz, bint skips, double patience):
        s = &self.s
        cdef Index i
        cdef const double[:, :] position = start.position_m, velocity = start.velocity_m_s
        cdef const double[:] radius = start.radius_m, mass = start.mass_kg
        s.disc_count, s.wall_count = position.shape[0], len(start.walls)
        if s.disc_count + s.wall_count > 2**31 - 1:
            raise ValueError("more discs and walls than can be numbered")
        s.clock.step, s.clock.rate = step_s, rate_hz
        s.horizon = MOST_FRAMES * step_s / rate_hz
        s.law.restitution, s.law.wall_restitution = start.restitution, start.wall_restitution
        s.skips, s.patience = skips, patience
        s.discs = <Disc *>memory(s.disc_count, sizeof(Disc))
        s.walls = <Wall *>memory(s.wall_count, sizeof(Wall))
        s.due = <double *>memory(s.disc_count, sizeof(double))
        s.looking = <int *>memory(s.disc_count + 1, sizeof(int))
        s.record.recent = <Recent *>memory(s.disc_count, sizeof(Recent))
        for i in range(s.disc_count):
            a = &s.discs[i]
            a.x, a.y, a.vx, a.vy = position[i, 0], position[i, 1], velocity[i, 0], velocity[i, 1]
            a.radius, a.inverse_mass = radius[i], 1.0 / mass[i]
            a.cell = NOWHERE
            s.due[i] = INF if a.inverse_mass == 0.0 else 0.0
            forget(&s.record.recent[i])
        for i, wall in enumerate(start.walls):
            s.walls[i].x, s.walls[i].y, s.walls[i].nx, s.walls[i].ny = wall
        if skips:
            self.fill_grid()

    cdef fill_grid(self):
        s = &self.s
        cdef Index i
        s.grid.chains = chain_count(s.disc_count)
        s.grid.first = <int *>memory(s.grid.chains, sizeof(int))
        for i in range(s.grid.chains):
            s.grid.first[i] = NOBODY
        choose_levels(s)
        for i in range(s.disc_count):
            settle(s, i)

    def __dealloc__(self):
        free(self.s.discs)
        free(self.s.walls)
        free(self.s.due)
        free(self.s.looking)
        free(self.s.grid.first)
        free(self.s.turns.heap)
        free(self.s.record.recent)
        free(self.s.record.rows)
        free(self.s.record.ambiguous)

    def run(self, Index until, Index most, double work):
        """Pass the frames before number `until`, or as many as take so much work.

        Args:
            until: Number of a frame.
            most: Number of impacts, counted from the start, from which on no other frame is begun.
            work: In tests of two discs by plain looping.
        """
        self.s.work = work
        with nogil:
            loop(&self.s, until, most)
        if self.s.no_memory:
            raise MemoryError(f"no memory for more than {self.s.record.count} recorded impacts")

    @property
    def frames(self):
        """Frames passed."""
        return self.s.counts.frames

    @property
    def frames_looked_at(self):
        """Frames at which anything was tested."""
        return self.s.counts.looked_at

    @property
    def pair_tests(self):
        """Pairs of discs, and of a disc and a wall, that were tested or found to need no test for a while."""
        return self.s.counts.pair_tests

    @property
    def recorded(self):
        """Number of impacts so far."""
        return self.s.record.count

    def copy_impacts(self, Index first, char[::1] room):
        """Copy impacts from row `first` on into the bytes of rows of `IMPACT_DTYPE`, as many as have room."""
        cdef size_t size = room.shape[0]
        if first < 0 or size > (self.s.record.count - first) * sizeof(Impact):
            raise IndexError(f"no such impacts: {self.s.record.count} have been recorded")
        if size > 0:
            memcpy(&room[0], &self.s.record.rows[first], size)

    def ambiguous(self):
        """Return the rows that share a movable disc with an earlier impact of the same frame."""
        cdef Index k
        return tuple([self.s.record.ambiguous[k] for k in range(self.s.record.ambiguous_count)])

    def positions(self, double time):
        """Return where the discs are at a time not before the last frame passed, shape ``(n, 2)``."""
        places = np.empty((self.s.disc_count, 2))
        cdef double[:, ::1] place = places
        cdef Index i
        for i in range(self.s.disc_count):
            a = &self.s.discs[i]
            place[i, 0] = a.x + a.vx * (time - self.s.now)
            place[i, 1] = a.y + a.vy * (time - self.s.now)
        return places

    def velocities(self):
        """Return the velocities now, shape ``(n, 2)``."""
        speeds = np.empty((self.s.disc_count, 2))
        cdef double[:, ::1] speed = speeds
        cdef Index i
        for i in range(self.s.disc_count):
            speed[i, 0], speed[i, 1] = self.s.discs[i].vx, self.s.discs[i].vy
        return speeds
