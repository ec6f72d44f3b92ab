/* Epochs: now and then all discs are moved to the present, and time is counted from there.

   Times of 32 free flights are right to 2^-53 of that time, in which a disc moves less than its place is rounded by. A new
   epoch costs a prediction a disc, compared with two an impact. */

#pragma once

#include "carom/core/double_double.h"
#include "carom/core/grid.h"
#include "carom/core/motion.h"
#include "carom/core/prescribed.h"
#include "carom/core/state.h"

/* Clear what disc `i` met last if that was the inside of an arc and the disc has left it: it will not be at the arc. */
static inline void clear_last_arc(State *s, Index i) {
    Disc *a = &s->discs[i];
    if (NO_BODY < a->last && a->last < 0 && s->features[-1 - a->last].kind == INNER_ARC && a->time < s->clock.now)
        a->last = NO_BODY;
}

/* Move every disc to the present and count time from there; everything is predicted again. */
static inline void begin_epoch(State *s) {
    for (Index i = 0; i < s->disc_count; i++) {
        if (s->feature_count > 0)
            clear_last_arc(s, i);
        if (s->driving.count > 0)
            clear_last_of_ended_leg(s, i);
        move_to(&s->discs[i], s->clock.now);
        s->discs[i].time = 0.0;
        if (s->law.contact_duration > 0.0)
            s->last_impact[i] -= s->clock.now;
    }
    /* The epoch is a pair of floats: the second holds what the first loses by rounding. */
    DoubleDouble total = two_sum(s->clock.epoch, s->clock.now);
    s->clock.epoch = total.high;
    s->clock.epoch_rest += total.low;
    s->clock.now = 0.0;
    count_legs_from_epoch(s);
    s->counts.epochs += 1;
    s->counts.epoch_impacts = 0;
    s->counts.predicted = 0;
}

/* Return the next disc without a prediction in this epoch. */
static inline Index next_unpredicted(State *s) {
    if (s->counts.predicted == 0)
        fill_cells(s);
    s->counts.predicted += 1;
    return s->counts.predicted - 1;
}
