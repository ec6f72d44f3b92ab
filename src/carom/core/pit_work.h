/* Work of PIT, counted in tests of two discs: whether skipping tests pays. */

#pragma once

#include "carom/core/constants.h"
#include "carom/core/double_double.h"
#include "carom/core/pit_state.h"

/* A build for few discs, as that for the page, leaves out skipping and sweeps: results are the same. */
#if defined(CAROM_PLAIN_FRAMES)
#define CAROM_SKIPS false
#else
#define CAROM_SKIPS true
#endif

/* Return the number of tests of a frame. */
static inline double plain_work(const State *s) {
    return (double)s->disc_count * (0.5 * (double)(s->disc_count - 1) + (double)s->wall_count);
}

/* Return the work of a frame without skipping: that of plain looping, or of a sweep if there are cells. */
static inline double frame_work(const State *s) {
    if (s->grid.list_count == 0)
        return plain_work(s);
    return (double)s->disc_count * (CAROM_SWEEP_WORK + (double)s->wall_count);
}

/* Decide whether the next frame is looped plainly: if asked for, or while the cost of skipping is earned back.

   To skip, all discs must be scheduled first, and bounds that have run out meanwhile are computed again. So skipping
   that costs more than plain looping is given up only after a while, and is tried again after a longer one. */
static inline bool loops_plainly(State *s) {
    if (!CAROM_SKIPS || !s->skips)
        return true;
    if (s->excess > s->max_waste * s->first_search)
        s->pays_back = true;
    else if (s->excess <= 0.0)
        s->pays_back = false;
    return s->pays_back;
}

/* Account for work of skipping. */
static inline void spend(State *s, double work) {
    s->work -= work;
    s->excess += work;
}

/* Account for frames that were not looped plainly. */
static inline void save(State *s, Index frames) {
    s->excess = greater(s->excess - (double)frames * frame_work(s), -CAROM_SAVED_FRAMES * frame_work(s));
}
