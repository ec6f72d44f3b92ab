/* Clock of a run: reported times, limits of a call of the loop, and epochs.

   From time to time all discs are moved to the present, and time is counted from 0 again. A time has a relative error
   of 2^-53. If an epoch lasts about 32 free flights of a disc, the error of the time moves the disc by less than the
   rounding error of its position. A new epoch costs one prediction per disc, which is little compared with two
   predictions per impact. */

#pragma once

#include "carom/core/pic/grid.h"

/* ---- reported times ---- */

/* Convert a time since the present epoch to a time since the start. The result is never less than the last reported
   time, although rounding could make it so. */
static inline double reported_time(const Clock *clock, double time) {
    double since_start = clock->epoch + (clock->epoch_rest + time);
    return since_start > clock->reported ? since_start : clock->reported;
}

/* Advance the clock to a time. If the time is earlier than the clock's time, the clock does not change. */
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

/* If an event at the instant `at` is beyond a limit of this call of the loop, return the `Ending`, otherwise NOT_ENDED.
   Set `is_wanted` to whether the event must be recorded, and reserve memory for its row. */
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

/* If the last body that disc `i` hit is the inside of an arc, and the disc has moved since, clear `Disc.last`. A path
   that begins with an impact on the arc has a special formula, but after the new epoch begins, the path begins
   elsewhere. */
static inline void clear_last_arc(State *s, Index i) {
    Disc *a = &s->discs[i];
    if (NO_BODY < a->last && a->last < 0 && s->features[-1 - a->last].kind == INNER_ARC && a->time < s->clock.now)
        a->last = NO_BODY;
}

/* Return whether all discs have moved in this epoch by no more than rounding errors: for each impact of the epoch, one
   unit in the last place of the disc's coordinates. */
static inline bool has_stood_still(const State *s) {
    double roundings = CAROM_ULP * (double)s->counts.epoch_impacts;
    for (Index i = 0; i < s->disc_count; i++) {
        const Disc *a = &s->discs[i];
        if ((fabs(a->vx) + fabs(a->vy)) * s->clock.now > roundings * size_of(a->x, a->y, a->radius))
            return false;
    }
    return true;
}

/* Count the impacts of successive epochs in which no disc has moved. If there are more than `State.standstill`, make
   the run end with `STANDSTILL`.

   Discs that are crushed between walls collide at shorter and shorter intervals. Soon after the start of an epoch, the
   clock's time is small and resolves smaller differences than the time since the start of the run. So each impact seems
   to be later than the previous one, and the count of impacts at one instant does not grow. */
static inline void count_still_impacts(State *s) {
    s->counts.still_impacts = has_stood_still(s) ? s->counts.still_impacts + s->counts.epoch_impacts : 0;
    if (s->counts.still_impacts > s->standstill)
        s->counts.at_instant = s->standstill + 1;
}

/* Begin a new epoch: move every disc to the present, and count time from the present on. All predictions are made
   again. */
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
    /* The start of the epoch is stored as a pair of floats. The second float is the rounding error of the first. */
    DoubleDouble total = two_sum(s->clock.epoch, s->clock.now);
    s->clock.epoch = total.high;
    s->clock.epoch_rest += total.low;
    s->clock.now = 0.0;
    count_legs_from_epoch(s);
    s->counts.epochs += 1;
    s->counts.epoch_impacts = 0;
    s->counts.predicted = 0;
}

/* Return the next disc that has no prediction in this epoch, and count it as predicted. */
static inline Index next_unpredicted(State *s) {
    if (s->counts.predicted == 0)
        fill_cells(s);
    s->counts.predicted += 1;
    return s->counts.predicted - 1;
}
