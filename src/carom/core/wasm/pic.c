/* Binding of the event-driven loop for JavaScript. This file includes the loop. */

#include "carom/core/pic/event_loop.c"
#include "carom/core/wasm/input.h"

/* ---- functions of JavaScript ---- */

#define CAROM_IMPORT(name) __attribute__((import_module("carom"), import_name(name)))

CAROM_IMPORT("is_order_free") int js_is_order_free(int one, int other, int elastic);
CAROM_IMPORT("solve_quartic")
double js_solve_quartic(double from, int is_closed, const int *counts, const Product *products, int index);

static bool is_order_free(void *context, int one, int other, bool elastic) {
    (void)context;
    return js_is_order_free(one, other, elastic);
}

static double solve_quartic(void *context, const Products *gap, int index) {
    (void)context;
    return js_solve_quartic(gap->from, gap->is_closed, gap->count, &gap->products[0][0], index);
}

/* ---- a run ---- */

static State state;

/* Begin a run with the current input, and record all impacts. Return false if there is not enough memory. */
CAROM_EXPORT("begin_pic") bool begin_pic(void) {
    RunInput input = run_input();
    input.exact = (ExactQuartic){solve_quartic, NULL};
    input.corners = (Corners){is_order_free, NULL};
    size_t size = carom_set_up(&state, &input);
    void *memory = size == 0 ? NULL : carom_resize(NULL, 0, size);
    Recent *recent = carom_resize(NULL, 0, (size_t)input.disc_count * sizeof(Recent));
    if (memory == NULL || recent == NULL || !carom_begin(&state, &input, memory))
        return false;
    carom_record(&state, recent, -CAROM_INF, CAROM_INF);
    return true;
}

/* Advance the run as `carom_advance` does, and write `carom_results`. */
CAROM_EXPORT("advance_pic") void advance_pic(double until, Index impacts) {
    Ending ending = PAUSE;
    while (ending == PAUSE)
        ending = carom_advance(&state, until, impacts, INT32_MAX);
    write_record(&state.record);
    carom_results[MODES] = (double)(uintptr_t)state.accelerated.modes;
    carom_results[MODE_COUNT] = (double)state.accelerated.mode_count;
    carom_results[ENDING] = ending;
    carom_results[REPORTED] = state.clock.reported;
    carom_results[NOW] = state.clock.now;
    carom_results[NOW_LOW] = state.clock.now_low;
    carom_results[EPOCH] = state.clock.epoch;
    carom_results[EPOCH_REST] = state.clock.epoch_rest;
    carom_results[IS_TOO_FAR] = state.counts.too_far > 0;
}

/* Return x, y, vx and vy of each disc at a time since the current epoch began. If discs spin, the spins
   come after the states. */
CAROM_EXPORT("states_pic") double *states_pic(double time, double time_low) {
    double *states = carom_resize(NULL, 0, (size_t)state.disc_count * 5 * sizeof(double));
    if (states != NULL) {
        carom_states(&state, time, time_low, states);
        if (state.record.has_spins)
            carom_spins(&state, time, time_low, states + 4 * state.disc_count);
    }
    return states;
}
