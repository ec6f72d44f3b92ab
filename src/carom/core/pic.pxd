"""Declarations of `pic/state.h` and `two_discs.h` for the binding."""

from libc.stdint cimport int64_t

from carom.core.carom_core cimport Impact, Index, Law, Recent, Record, Turning, c_bool
from carom.core.run_input cimport RunInput

cdef extern from "carom/core/pic/state.h" nogil:
    enum Ending:
        DONE
        NO_MEMORY

    struct Disc:
        double x
        double y
        double vx
        double vy
        double time
        double radius
        double inverse_mass
        int impacts
        int last

    struct ToAndFro:
        pass

    struct Clock:
        double now
        double now_low
        double epoch
        double epoch_rest
        double reported

    struct Counts:
        Index impacts
        Index wall_impacts
        Index predictions
        Index stale
        Index crossings
        Index beyond
        Index choices
        Index epochs
        Index too_far

    struct Crush:
        Index disc
        Index between[2]
        double time

    struct Parabola:
        pass

    struct ModeRow:
        pass

    struct ContactEnd:
        Index disc
        Index other
        int obstacle
        int held_by
        bint after_bounces

    struct TouchedBodies:
        pass

    struct Accelerated:
        Parabola *paths
        ModeRow *modes
        Index mode_count
        Index mode_capacity
        ContactEnd end

    struct State:
        Disc *discs
        double *last_impact
        Turning *turning
        Index disc_count
        Index gliding
        Clock clock
        Law law
        Counts counts
        Record record
        ToAndFro *to_and_fro
        TouchedBodies *touched
        Accelerated accelerated
        Crush crush

    size_t carom_set_up(State *s, const RunInput *input)
    bint carom_begin(State *s, const RunInput *input, void *memory)
    Ending carom_advance(State *s, double until, Index impacts, Index events)
    void carom_record(State *s, Recent *recent, double begin, double end)
    void carom_resume(State *s)
    void carom_states(const State *s, double time, double time_low, double *states)
    void carom_spins(const State *s, double time, double time_low, double *spins)
    void carom_impact_counts(const State *s, int64_t *counts)
    Index carom_gliding_wall(const State *s)
    size_t carom_allocated(const State *s)
    void carom_release(State *s)

cdef extern from "carom/core/pic/two_discs.h" nogil:
    struct FreeDisc:
        double x
        double y
        double vx
        double vy
        double radius
        double inverse_mass

    struct TwoDiscsResult:
        Impact impact
        double position[4]
        double velocity[4]
        bint has_impact

    bint solve_two_discs_in_c "solve_two_discs"(
        FreeDisc first, FreeDisc second, double restitution, double end, TwoDiscsResult *result
    )
