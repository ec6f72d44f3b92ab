# distutils: sources = src/carom/core/pit/frame_loop.c
"""Python binding of `frame_loop.c`: PIT from frame to frame, for any number of discs and all kinds of motion."""

from libc.stdint cimport uintptr_t
from libc.stdlib cimport free

import numpy as np

from carom.core.input_rows import build_chain_rows, build_driven_rows
from carom.core.resolution import too_far_out

from carom.core.carom_core cimport Index, Record, Turning
from carom.core.record_rows cimport ambiguous_rows, free_record, release_rows
from carom.core.run_input cimport RunInput, floats, input_of

cdef extern from "carom/core/pit/state.h" nogil:
    struct Counts:
        Index frames
        Index tested
        Index pair_tests

    struct Pending:
        void *heap

    struct Touching:
        void *bodies

    struct State:
        Turning *turning
        Index disc_count
        double work
        bint is_out_of_memory
        bint is_too_far
        Counts counts
        Pending pending
        Touching touching
        Record record

    size_t carom_pit_set_up(State *s, const RunInput *input)
    void carom_pit_begin(State *s, const RunInput *input, void *memory)
    void carom_pit_run(State *s, Index until, Index most)
    void carom_pit_write_states(const State *s, double time, double *states)


cdef class FrameLoop:
    """A PIT run of discs and walls. `carom.solvers.rows.RecordedImpacts` collects the run's impacts.

    Args:
        start: State at the start of the run, `carom.solvers.run.Start`.
        clock: Times of the frames, `carom.solvers.pit.clock.FrameClock`.
        skips: Whether to skip tests that can't find an impact.
        max_waste: Largest waste: the work that skipping has cost, minus the work that it has saved. Above this limit,
            all tests are made at each frame until the waste is 0 again. The unit is the work of computing once for all
            discs when they must be tested again. Infinity means no limit.
        damping_per_s: Rate of damping. With damping, the methods of this class have undamped times as arguments and
            return undamped velocities (see damping.h). Recorded impacts have damped times and velocities.
    """

    cdef State s
    cdef object memory

    def __cinit__(self, start, clock, bint skips, double max_waste, double damping_per_s=0.0):
        arrays, kept = start.arrays, []
        cdef RunInput given = input_of(arrays, start, kept)
        chains, edges = build_chain_rows(arrays.walls)
        driven, legs = build_driven_rows(arrays)
        given.materials, given.chains = floats(kept, arrays.materials), floats(kept, chains)
        given.edges, given.edge_count = floats(kept, edges), len(edges)
        given.driven, given.driven_count = floats(kept, driven), len(driven)
        given.legs, given.leg_count = floats(kept, legs), len(legs)
        given.step, given.rate, given.damping = clock.step_s, clock.rate_hz, damping_per_s
        given.skips, given.max_waste = skips, max_waste
        cdef size_t size = carom_pit_set_up(&self.s, &given)
        if size == 0:
            raise ValueError("more discs and walls than can be numbered")
        self.memory = np.empty(size + 64, np.uint8)
        cdef unsigned char[::1] memory = self.memory
        carom_pit_begin(&self.s, &given, <void *>((<uintptr_t>&memory[0] + 63) // 64 * 64))

    def __dealloc__(self):
        free(self.s.pending.heap)
        free(self.s.touching.bodies)
        free_record(&self.s.record)

    def run(self, Index until, Index most, double work):
        """Compute the frames before frame `until`, or fewer if the limit `work` is reached.

        Args:
            until: Number of the frame.
            most: After this number of impacts, counted from the start of the run, no further frame is computed.
            work: Largest amount of work, in tests of two discs.

        Raises:
            InputError: Two discs have met too far from the origin to compute the normal of their impact.
        """
        self.s.work = work
        with nogil:
            carom_pit_run(&self.s, until, most)
        if self.s.is_out_of_memory:
            raise MemoryError(f"no memory for more than {self.recorded} recorded impacts")
        if self.s.is_too_far:
            raise too_far_out()

    def run_frames(
        self, double step, double rate, Index most, double work,
        double[:, :, :] position, double[:, :, :] velocity, double[:, :] spin,
    ):
        """Compute frames until a frame has an impact. After each frame, write the state at the time of the next frame.

        Frame k is at ``k * step / rate``. Return the number of states written. The run must have no damping.
        """
        cdef Index k, i, until, recorded = self.recorded, n = self.s.disc_count
        cdef double[:, ::1] states = np.empty((n, 4))
        for k in range(position.shape[0]):
            until = self.s.counts.frames + 1
            while self.s.counts.frames < until:
                self.run(until, most, work)
            carom_pit_write_states(&self.s, <double> until * step / rate, &states[0, 0])
            position[k], velocity[k] = states[:, :2], states[:, 2:]
            if self.s.record.has_spins:
                for i in range(n):
                    spin[k, i] = self.s.turning[i].spin
            if self.recorded > recorded:
                return k + 1
        return position.shape[0]

    @property
    def frames(self):
        """Number of frames computed or skipped so far."""
        return self.s.counts.frames

    @property
    def counts(self):
        """Numbers of operations so far, by name. Computing a bound that makes tests unnecessary counts as one test."""
        c = &self.s.counts
        looked_at = {"frames_looked_at": c.tested, "frames_skipped": c.frames - c.tested}
        return {"frames": c.frames, **looked_at, "pair_tests": c.pair_tests}

    @property
    def recorded(self):
        """Number of impacts recorded so far."""
        return self.s.record.released + self.s.record.count

    def take_impacts(self):
        """Return the impacts recorded since the last call: see `release_rows` in record_rows.pxd."""
        return release_rows(&self.s.record)

    def take_modes(self):
        """Return None, because PIT has no lasting contact."""
        return None

    def ambiguous(self):
        """Return the numbers of impacts that share a movable disc with an earlier impact of the same frame."""
        return ambiguous_rows(&self.s.record)

    def present_spins(self):
        """Return the spins, in rad/s, shape ``(n,)``; None if no disc spins."""
        cdef Index i
        spins = [self.s.turning[i].spin for i in range(self.s.disc_count)]
        return np.array(spins) if self.s.record.has_spins else None

    def states(self, double time):
        """Return x, y, vx, vy of each disc. The time must not be before the last frame."""
        states = np.empty((self.s.disc_count, 4))
        cdef double[:, ::1] rows = states
        carom_pit_write_states(&self.s, time, &rows[0, 0])
        return states
