/* Binding of the frame-sampled loop, and of damped times, for JavaScript.

   This file includes the loop, so that the loop and the damped times share one compiled copy of the exponential
   functions. */

#include "carom/core/damping.h"
#include "carom/core/pit/frame_loop.c"
#include "carom/core/wasm/input.h"

static State state;

/* ---- damping ---- */

CAROM_EXPORT("kept") double kept(double rate, double time) {
    return remaining_velocity(rate, time);
}

CAROM_EXPORT("undamped") double undamped(double rate, double time) {
    return undamped_time(rate, time);
}

CAROM_EXPORT("damped") double damped(double rate, double time) {
    return damped_time(rate, time);
}

CAROM_EXPORT("latest_undamped") double latest_undamped(double rate, double time) {
    return latest_undamped_time(rate, time);
}

/* ---- a run ---- */

/* Begin a run with the current input. Return false if there is not enough memory. */
CAROM_EXPORT("begin_pit") bool begin_pit(void) {
    RunInput input = run_input();
    size_t size = carom_pit_set_up(&state, &input);
    void *memory = size == 0 ? NULL : carom_resize(NULL, 0, size);
    if (memory == NULL)
        return false;
    carom_pit_begin(&state, &input, memory);
    return true;
}

/* Compute all frames before frame `until`, and write `carom_results`. Return false if there is not enough memory. */
CAROM_EXPORT("advance_pit") bool advance_pit(Index until) {
    while (state.counts.frames < until && !state.is_out_of_memory && !state.is_too_far) {
        state.work = 0x1p30;
        carom_pit_run(&state, until, INT32_MAX);
    }
    write_record(&state.record);
    carom_results[IS_TOO_FAR] = state.is_too_far;
    return !state.is_out_of_memory;
}

/* Return x, y, vx and vy of each disc at a time that is not before the last frame. If discs spin, the spins
   come after the states. */
CAROM_EXPORT("states_pit") double *states_pit(double time) {
    double *states = carom_resize(NULL, 0, (size_t)state.disc_count * 5 * sizeof(double));
    if (states != NULL) {
        carom_pit_write_states(&state, time, states);
        for (Index i = 0; i < state.disc_count && state.record.has_spins; i++)
            states[4 * state.disc_count + i] = state.turning[i].spin;
    }
    return states;
}
