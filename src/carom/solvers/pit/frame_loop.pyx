"""PIT compiled: any number of discs, without gravity. To be read after `layout.pxd`.

`run` is the loop. It skips the frames at which no disc is due, and looks at the others; or it loops plainly, where that
is asked for or costs less.
"""

from libc.stdlib cimport calloc, free
from libc.string cimport memcpy

import numpy as np

from carom.solvers.pit.bounds cimport MOST_FRAMES
from carom.solvers.pit.grid cimport chain_count, choose_levels, settle
from carom.solvers.pit.layout cimport (
    DONE, INF, LIMIT, NOBODY, NOWHERE, NO_MEMORY, PAUSE, Disc, Ending, Impact, Index, State, Struck, Turn, Wall,
)
from carom.solvers.pit.look cimport is_too_dear, look, test_all
from carom.solvers.pit.motion cimport frame_time, skip_frames

from carom.trace import IMPACT_DTYPE

#: What `FrameLoop.run` returns is a number of these.
ENDINGS = ("done", "limit", "pause")

cdef Ending run(State *s, Index until, Index most) noexcept nogil:
    """Pass the frames before number `until`; stop between two once there have been `most` impacts."""
    while s.counts.frames < until:
        if s.work <= 0.0:
            return PAUSE
        if s.row == 0 and s.record.count >= most:
            return LIMIT
        if s.row > 0 or not s.skips or is_too_dear(s):
            test_all(s)
        elif s.counts.frames == 0 or skip_frames(s, until) == 0:
            look(s)
        if s.no_memory:
            return NO_MEMORY
    return DONE


#: Called through a pointer: within the method of a Python class GCC takes the loop for code that seldom runs.
ctypedef Ending (*Loop)(State *, Index, Index) noexcept nogil
cdef Loop loop = run


cdef void *memory(Index count, size_t size) except NULL:
    """Return room for so many rows, all zero."""
    room = calloc(count if count > 0 else 1, size)
    if room == NULL:
        raise MemoryError("no memory for the discs of a PIT run")
    return room


cdef class FrameLoop:
    """PIT on the discs and walls of a scene.

    Args:
        scene: The scene, without gravity.
        step_s: Frame k stands at ``k * step_s / rate_hz``, seconds.
        rate_hz: See `step_s`.
        skips: Whether tests that can find nothing are left out.
    """

    cdef State s

    def __cinit__(self, scene, double step_s, double rate_hz, bint skips):
        s = &self.s
        cdef Index i
        n, walls = len(scene.discs), len(scene.walls)
        if n + walls > 2**31 - 1:
            raise ValueError("more bodies than numbers for them")
        s.disc_count, s.wall_count = n, walls
        s.clock.step, s.clock.rate = step_s, rate_hz
        s.horizon = MOST_FRAMES * step_s / rate_hz
        s.law.restitution, s.law.wall_restitution = scene.restitution, scene.wall_restitution
        s.skips = skips
        s.discs = <Disc *>memory(n, sizeof(Disc))
        s.walls = <Wall *>memory(walls, sizeof(Wall))
        s.due = <double *>memory(n, sizeof(double))
        s.looking = <int *>memory(n + 1, sizeof(int))
        s.record.struck = <Struck *>memory(n, sizeof(Struck))
        for i, disc in enumerate(scene.discs):
            a = &s.discs[i]
            a.x, a.y = disc.position_m
            a.vx, a.vy = disc.velocity_m_s
            a.radius, a.inverse_mass = disc.radius_m, 1.0 / <double>disc.mass_kg
            a.next, a.cell = NOBODY, NOWHERE
            s.due[i] = INF if a.inverse_mass == 0.0 else 0.0
            s.record.struck[i].time = -1.0
        for i, wall in enumerate(scene.walls):
            s.walls[i].x, s.walls[i].y = wall.point_m
            s.walls[i].nx, s.walls[i].ny = wall.normal
        if skips:
            self.lay_out_grid()

    cdef lay_out_grid(self):
        s = &self.s
        cdef Index i
        s.grid.chains = chain_count(s.disc_count)
        s.grid.first = <int *>memory(s.grid.chains, sizeof(int))
        choose_levels(s)
        for i in range(s.grid.chains):
            s.grid.first[i] = NOBODY
        for i in range(s.disc_count):
            settle(s, i)

    def __dealloc__(self):
        free(self.s.discs)
        free(self.s.walls)
        free(self.s.due)
        free(self.s.looking)
        free(self.s.grid.first)
        free(self.s.turns.heap)
        free(self.s.record.struck)
        free(self.s.record.rows)
        free(self.s.record.ambiguous)

    def run(self, Index until, Index most, double work):
        """Pass the frames before number `until`, or as many as take so much work; return a number of `ENDINGS`.

        Args:
            until: Number of a frame.
            most: Number of impacts, counted from the start, from which on no other frame is begun.
            work: Tests of two discs by plain looping that would cost as much.
        """
        cdef Ending ending
        self.s.work = work
        with nogil:
            ending = loop(&self.s, until, most)
        if ending == NO_MEMORY:
            raise MemoryError(f"no memory for more than {self.s.record.count} recorded impacts")
        return ending

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
        """Pairs of discs, and of a disc and a wall, that were tested or found to need no test yet."""
        return self.s.counts.pair_tests

    @property
    def impact_count(self):
        """Impacts so far."""
        return self.s.record.count

    def impacts(self, Index first=0):
        """Return the impacts from row `first` on, as an array of `IMPACT_DTYPE` of its own."""
        cdef Index count = self.s.record.count - first
        rows = np.empty(max(count, 0), IMPACT_DTYPE)
        cdef char[::1] room
        if count > 0:
            room = rows.view(np.int8)
            memcpy(&room[0], &self.s.record.rows[first], count * sizeof(Impact))
        return rows

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


#: Bytes of the records, to be compared with their NumPy forms.
SIZES = {"Disc": sizeof(Disc), "Impact": sizeof(Impact), "Turn": sizeof(Turn)}
