/* Amount of work in PIT, measured in tests of two discs, and whether skipping tests saves work. */

#pragma once

#include "carom/core/arithmetic/double_double.h"
#include "carom/core/constants.h"
#include "carom/core/pit/state.h"

/* A build for few discs, such as that for the page, leaves out skipping and sweeps. Results are the same. */
#if defined(CAROM_PLAIN_FRAMES)
#define CAROM_SKIPS false
#else
#define CAROM_SKIPS true
#endif

/* Return the number of tests of a frame. */
static inline double plain_work(const State *s) {
    return (double)s->disc_count * (0.5 * (double)(s->disc_count - 1) + (double)s->wall_count);
}

/* Return the work of a frame without skipping: a sweep if there are cells, otherwise plain looping. */
static inline double frame_work(const State *s) {
    if (s->grid.list_count == 0)
        return plain_work(s);
    return (double)s->disc_count * (CAROM_SWEEP_WORK + (double)s->wall_count);
}

/* Return whether the next frame is looped plainly. It is if the caller requests it, or while the excess cost of
   skipping is being recovered.

   Skipping first has to schedule all discs, and computes bounds again that have expired. So it is given up only after
   it has cost more than plain looping for a while. It is tried again after a longer while. */
static inline bool loops_plainly(State *s) {
    if (!CAROM_SKIPS || !s->skips)
        return true;
    if (s->excess > s->max_waste * s->first_search)
        s->pays_back = true;
    else if (s->excess <= 0.0)
        s->pays_back = false;
    return s->pays_back;
}

/* Count work of skipping. */
static inline void spend(State *s, double work) {
    s->work -= work;
    s->excess += work;
}

/* Count frames that were not looped plainly. */
static inline void save(State *s, Index frames) {
    s->excess = greater(s->excess - (double)frames * frame_work(s), -CAROM_SAVED_FRAMES * frame_work(s));
}
