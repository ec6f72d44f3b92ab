# distutils: sources = src/carom/core/pic/event_loop.c
"""Python binding of `event_loop.c`: PIC from event to event for any number of discs, and PIC for two discs alone."""

from cpython.bytes cimport PyBytes_FromStringAndSize
from libc.stdint cimport int64_t, uintptr_t
from libc.stdlib cimport free
from libc.string cimport memcpy

from carom.core.resolution import too_far_out

from carom.core.exact_quartic cimport exact_solver
from carom.core.record_rows cimport ambiguous_rows, free_record, memory_as_array, release_rows
from carom.core.run_input cimport RunInput, floats, input_of

import numpy as np

cdef Disc _disc
DISC_DTYPE = np.asarray(<Disc[:1]>&_disc).dtype


cdef c_bool is_order_free(void *context, int one, int other, c_bool elastic) noexcept with gil:
    """Call Python to decide whether two simultaneous impacts on two features have the same result in both orders."""
    return (<object>context)(one, other, elastic)


cdef class Kernel:
    """A PIC run of discs and walls. `carom.solvers.rows.RecordedImpacts` collects the run's impacts.

    Args:
        start: The discs and walls, `carom.model.disc_arrays.DiscArrays`.
        obstacles: Obstacles and driven bodies, `carom.solvers.event_driven.obstacles.Obstacles`. None if nothing is
            driven and all walls are half-planes with the coefficients of the law.
        until: End of the run, in seconds since the start. A disc that is crushed after the end does not stop the run.
            `run` may be called with a later end.
        acceleration: The scene, `carom.solvers.run.Start`, if it has gravity or a table that slows discs, else None.
            For such a scene, `obstacles` must contain grounds (surfaces on which discs can slide, roll or rest).
        contact_duration: Duration of a contact in the TC model, in seconds; 0 if the model is not used.
        standstill: Largest number of impacts at one instant. After more impacts the run ends, because time stands
            still.
        cell_factor: Factor that multiplies the width of a cell; infinity makes a single cell.
        all_pairs: Whether to use the all-pairs loop, see `all_pairs.h`. The all-pairs loop does not change results.

    Raises:
        ValueError: There are too many discs or obstacles.
    """

    cdef State s
    cdef object memory
    cdef object recent_memory
    cdef object is_order_free

    def __cinit__(
        self, start, obstacles, double until, acceleration, double contact_duration, Index standstill,
        double cell_factor, bint all_pairs
    ):
        kept = []
        cdef RunInput given = input_of(start, acceleration, kept)
        if obstacles is None:
            given.walls = floats(kept, start.walls)
        else:
            given.features, given.feature_count = floats(kept, obstacles.rows), len(obstacles.rows)
            given.materials = floats(kept, start.materials)
            given.driven, given.driven_count = floats(kept, obstacles.driven), len(obstacles.driven)
            given.legs, given.leg_count = floats(kept, obstacles.legs), len(obstacles.legs)
        if acceleration is not None:
            grounds, never_met = obstacles.grounds
            given.grounds = floats(kept, grounds)
            given.never_lists, given.never_length = floats(kept, never_met), len(never_met)
            given.exact = exact_solver()
        given.law.contact_duration, given.until = contact_duration, until
        given.cell_factor, given.standstill, given.solves_all_pairs = cell_factor, standstill, all_pairs
        self.is_order_free = None if obstacles is None else obstacles.is_order_free
        given.corners.is_order_free, given.corners.context = is_order_free, <void *>self.is_order_free
        cdef size_t size = carom_set_up(&self.s, &given)
        if size == 0:
            raise ValueError("more discs or obstacles than can be numbered")
        # All rows are in one array. Operating systems use large memory pages for large arrays, and the processor then
        # translates fewer addresses.
        self.memory = np.empty(size + 64, np.uint8)
        cdef unsigned char[::1] memory = self.memory
        if not carom_begin(&self.s, &given, <void *>((<uintptr_t>&memory[0] + 63) // 64 * 64)):
            raise MemoryError("no memory for the obstacles of the cells")

    def __dealloc__(self):
        free_record(&self.s.record)
        free(self.s.accelerated.modes)
        carom_release(&self.s)

    def run(self, double until, Index impacts, Index events):
        """Advance the run, and return its `Ending` (pic/state.h).

        Args:
            until: Apply impacts up to and including this time, in seconds since the start.
            impacts: Largest number of impacts, counted from the start.
            events: Approximate number of events after which the call returns.

        Raises:
            InputError: Two discs have met too far from the origin to compute the normal of their impact.
        """
        cdef Ending ending
        with nogil:
            ending = carom_advance(&self.s, until, impacts, events)
        if ending == NO_MEMORY:
            raise MemoryError("no memory for more recorded impacts: record a window of them, or none")
        if self.s.counts.too_far > 0:
            raise too_far_out()
        return ending

    def run_steps(
        self, Index first, double step, Index impacts, Index events,
        double[:, :, :] position, double[:, :, :] velocity, double[:, :] spin,
    ):
        """Advance step by step, and write the state at the end of each step, until a step has a recorded impact.

        Step k ends at ``k * step``. `impacts` and `events` are limits of each step, as in `run`.

        Returns:
            The number of states written, and the `Ending` of the last step. The state after a step is written only if
            the step ends with `DONE`.
        """
        cdef Index k, recorded = self.recorded, n = self.s.disc_count
        cdef double[:, ::1] states = np.empty((n, 4))
        cdef double[::1] spins = np.empty(n)
        cdef double time
        for k in range(position.shape[0]):
            time = <double> (first + k) * step
            ending = self.run(time, impacts, events)
            if ending != DONE:
                return k, ending
            if self.s.accelerated.paths == NULL:
                time = (time - self.s.clock.epoch) - self.s.clock.epoch_rest
            carom_states(&self.s, time, 0.0, &states[0, 0])
            position[k], velocity[k] = states[:, :2], states[:, 2:]
            if self.s.record.has_spins:
                carom_spins(&self.s, time, 0.0, &spins[0])
                spin[k] = spins
            if self.recorded > recorded:
                return k + 1, DONE
        return position.shape[0], DONE

    def record(self, double begin, double end):
        """From now on, record impacts whose reported times are from `begin` to `end`, in seconds since the start."""
        self.recent_memory = np.empty(self.s.disc_count * sizeof(Recent), np.uint8)
        cdef unsigned char[::1] recent = self.recent_memory
        carom_record(&self.s, <Recent *>&recent[0], begin, end)

    def take_impacts(self):
        """Return the impacts recorded since the last call: see `release_rows` in record_rows.pxd."""
        return release_rows(&self.s.record)

    def take_modes(self):
        """Return the changes of mode recorded since the last call, as bytes; None if there are none."""
        run = &self.s.accelerated
        if run.mode_count == 0:
            return None
        modes = memory_as_array(run.modes, run.mode_count * sizeof(ModeRow))
        run.modes = NULL
        run.mode_count = run.mode_capacity = 0
        return modes

    def ambiguous(self):
        """Return the numbers of the ambiguous impacts, counted from the run's first recorded impact."""
        return ambiguous_rows(&self.s.record)

    @property
    def recorded(self):
        """Number of impacts recorded so far."""
        return self.s.record.released + self.s.record.count

    cdef rows(self, void *begin, size_t size):
        """Return a view of one of the run's arrays, with `size` bytes per disc; an empty view if `begin` is NULL."""
        if begin == NULL:
            return np.empty(0, np.uint8)
        cdef const unsigned char[::1] memory = self.memory
        cdef size_t start = <const unsigned char *>begin - &memory[0]
        return self.memory[start:start + self.s.disc_count * size]

    cdef dict continued(self):
        """Return views of the arrays from which a run can continue, by name, as bytes. Predictions are not included."""
        s = &self.s
        has_last_impacts = s.law.contact_duration > 0.0
        return {
            "discs": self.rows(s.discs, sizeof(Disc)),
            "last_impacts": self.rows(s.last_impact if has_last_impacts else NULL, sizeof(double)),
            "turning": self.rows(s.turning, sizeof(Turning)),
            "paths": self.rows(s.accelerated.paths, sizeof(Parabola)),
            "touched": self.rows(s.touched, sizeof(TouchedBodies)),
            "to_and_fro": self.rows(s.to_and_fro, sizeof(ToAndFro)),
        }

    @property
    def discs(self):
        """A view of the rows of all discs, with the fields of `Disc` in pic/state.h."""
        return self.rows(self.s.discs, sizeof(Disc)).view(DISC_DTYPE)

    @property
    def counts(self):
        """Numbers of operations so far, by name: see `Counts` in pic/state.h."""
        return self.s.counts

    @property
    def clock(self):
        """Times of the run, by name: see `Clock` in pic/state.h."""
        return self.s.clock

    def states(self, double time, double time_low):
        """Return x, y, vx and vy of each disc, shape ``(n, 4)``, at the time `time` + `time_low`.

        The time counts from the last reset of the run's clock (the start of the epoch).
        """
        states = np.empty((self.s.disc_count, 4))
        cdef double[:, ::1] rows = states
        carom_states(&self.s, time, time_low, &rows[0, 0])
        return states

    def spins_at(self, double time, double time_low):
        """Return the spins of all discs at the time `time` + `time_low`, as in `states`; None if no disc spins."""
        if not self.s.record.has_spins:
            return None
        spins = np.empty(self.s.disc_count)
        cdef double[::1] rows = spins
        carom_spins(&self.s, time, time_low, &rows[0])
        return spins

    @property
    def impact_counts(self):
        """Number of impacts of each disc so far."""
        counts = np.empty(self.s.disc_count, np.int64)
        cdef int64_t[::1] rows = counts
        carom_impact_counts(&self.s, &rows[0])
        return counts

    @property
    def contact_end(self):
        """The contact that ended the run: see `ContactEnd` in accelerated_state.h."""
        return self.s.accelerated.end

    @property
    def gliding(self):
        """The numbers of the gliding disc and of the wall along which it glides, if the run has ended with `GLIDES`."""
        return self.s.gliding, carom_gliding_wall(&self.s)

    @property
    def crush(self):
        """The `Crush` (pic/state.h) of a run that has ended with `CRUSHED`. `time` counts from the start."""
        return self.s.crush

    @property
    def nbytes(self):
        """Size of the run's memory without recorded impacts, in bytes."""
        return self.memory.nbytes + carom_allocated(&self.s)

    def state(self):
        """Return a copy of all data that the run needs to continue, by name."""
        rows = {name: rows.copy() for name, rows in self.continued().items()}
        recent = self.recent_memory.copy() if self.s.record.is_wanted else None
        counts = PyBytes_FromStringAndSize(<char *>&self.s.counts, sizeof(Counts))
        return {**rows, "recent": recent, "clock": self.s.clock, "counts": counts}

    def resume(self, state):
        """Continue a run from a result of `state`. The discs, the walls and the contact duration must be equal to those
        of the earlier run."""
        for name, rows in self.continued().items():
            rows[:] = state[name]
        if self.s.record.is_wanted and state["recent"] is not None:
            self.recent_memory[:] = state["recent"]
        self.s.clock = state["clock"]
        memcpy(&self.s.counts, <const char *>state["counts"], sizeof(Counts))
        carom_resume(&self.s)


cdef FreeDisc free_disc(model) except *:
    x, y = model.position_m
    vx, vy = model.velocity_m_s
    return FreeDisc(x, y, vx, vy, model.radius_m, 1.0 / <double> model.mass_kg)


def solve_two_discs(first, second, double restitution, double end):
    """Solve a scene of two discs without walls.

    Returns:
        The row of the impact as bytes, empty if there is no impact; and the positions and velocities at the end as
        bytes, shape ``(2, 2, 2)``. None if a number is not of ordinary size (`carom.support.limits`), or if the discs
        meet too far from the origin; the caller then uses the event loop.
    """
    cdef TwoDiscsResult result
    if not solve_two_discs_in_c(free_disc(first), free_disc(second), restitution, end, &result):
        return None
    impacts = PyBytes_FromStringAndSize(<char *>&result.impact, sizeof(Impact) * result.has_impact)
    return impacts, PyBytes_FromStringAndSize(<char *>result.position, 8 * sizeof(double))
