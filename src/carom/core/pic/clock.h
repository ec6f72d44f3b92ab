/* Clock of a run: reported times, limits of a call of the loop, and epochs.

   From time to time all discs are moved to the present, and time is counted from 0 again. A time has a relative error
   of 2^-53. If an epoch lasts about 32 free flights, a disc moves less in this error of the time than the rounding
   error of its position. A new epoch costs one prediction per disc, and each impact of the epoch costs two. */

#pragma once

#include "carom/core/pic/grid.h"

/* ---- reported times ---- */

/* Convert a time since the epoch to a time since the start. The result is never less than a time reported before. */
static inline double reported_time(const Clock *clock, double time) {
    double since_start = clock->epoch + (clock->epoch_rest + time);
    return since_start > clock->reported ? since_start : clock->reported;
}

/* Advance the clock to a time; it never goes back. */
static inline void set_clock(State *s, double time) {
    if (time > s->clock.now) {
        s->clock.now = time;
        s->counts.at_instant = 0;
    }
    s->clock.reported = reported_time(&s->clock, s->clock.now);
}

/* Set the clock to the time of an impact, and count the impact. */
static inline void count_impact(State *s, double time) {
    set_clock(s, time);
    s->counts.impacts += 1;
    s->counts.epoch_impacts += 1;
    s->counts.at_instant += 1;
}

/* Return the ending if a limit of a call of the loop excludes an event at an instant, otherwise NOT_ENDED. If the event
   is to be recorded (`is_wanted`), there is room for its row. */
static inline Ending check_limits(State *s, Instant at, double until, Index impacts, bool *is_wanted) {
    double reported = reported_time(&s->clock, at.high);
    if (reported > until || (reported == until && at.low > 0.0))
        return DONE;
    if (s->counts.impacts >= impacts)
        return LIMIT;
    *is_wanted = is_recorded(&s->record, reported);
    return CAROM_UNLIKELY(*is_wanted) && !reserve_row(&s->record) ? NO_MEMORY : NOT_ENDED;
}

/* ---- epochs ---- */

/* Forget the last body of disc `i` if that was the inside of an arc which the disc has left. When the new epoch begins,
   the disc is no longer at the arc. */
static inline void clear_last_arc(State *s, Index i) {
    Disc *a = &s->discs[i];
    if (NO_BODY < a->last && a->last < 0 && s->features[-1 - a->last].kind == INNER_ARC && a->time < s->clock.now)
        a->last = NO_BODY;
}

/* Return whether no disc has moved in this epoch by more than one rounding of its coordinates per impact of the
   epoch. */
static inline bool has_stood_still(const State *s) {
    double roundings = CAROM_ULP * (double)s->counts.epoch_impacts;
    for (Index i = 0; i < s->disc_count; i++) {
        const Disc *a = &s->discs[i];
        if ((fabs(a->vx) + fabs(a->vy)) * s->clock.now > roundings * size_of(a->x, a->y, a->radius))
            return false;
    }
    return true;
}

/* Count the impacts of epochs in which no disc has moved. If there are too many, the run stands still.

   Discs that are crushed between walls collide faster and faster. Soon after the start of an epoch, the clock resolves
   differences of time that the reported time does not resolve. So each impact seems to be later than the last one. */
static inline void count_still_impacts(State *s) {
    s->counts.still_impacts = has_stood_still(s) ? s->counts.still_impacts + s->counts.epoch_impacts : 0;
    if (s->counts.still_impacts > s->standstill)
        s->counts.at_instant = s->standstill + 1;
}

/* Move every disc to the present and count time from now on. All predictions are made again. */
static inline void begin_epoch(State *s) {
    count_still_impacts(s);
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
    /* The epoch is a pair of floats. The second float is the rounding error of the first. */
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
