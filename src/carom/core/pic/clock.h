/* Clock of a run: reported times, limits of a call of the event loop, and epochs (parts of a run).

   When an epoch begins, all discs are moved to the present, and time is counted from 0 again. A time has a relative
   rounding error of 2^-53. If an epoch lasts about 32 free flights of a disc, this error moves the disc by less than
   the rounding error of its position. A new epoch costs little: one prediction per disc, while each impact already
   needs two predictions. */

#pragma once

#include "carom/core/pic/grid.h"

/* ---- reported times ---- */

/* Convert a time since the present epoch to a time since the start of the run. If rounding makes the result less than
   the last reported time, return the last reported time. */
static inline double reported_time(const Clock *clock, double time) {
    double since_start = clock->epoch + (clock->epoch_rest + time);
    return since_start > clock->reported ? since_start : clock->reported;
}

/* Advance the clock to a time, unless the clock's time is later. */
static inline void set_clock(State *s, double time) {
    if (time > s->clock.now) {
        s->clock.now = time;
        s->counts.at_instant = 0;
    }
    s->clock.reported = reported_time(&s->clock, s->clock.now);
}

static inline void count_impact(State *s, double time) {
    set_clock(s, time);
    s->counts.impacts += 1;
    s->counts.epoch_impacts += 1;
    s->counts.at_instant += 1;
}

/* If an event at the instant `at` is beyond a limit of this call of the loop, return the `Ending` of the call.
   If the event is within all limits, return NOT_ENDED. Set `is_wanted` to whether the event must be recorded, and
   reserve memory for the record. */
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

/* Clear `Disc.last` if disc `i` hit the inside of an arc last and has moved since. For a path that begins with an
   impact on an arc there is a special formula, but in the new epoch the path begins elsewhere. */
static inline void clear_last_arc(State *s, Index i) {
    Disc *a = &s->discs[i];
    if (NO_BODY < a->last && a->last < 0 && s->features[-1 - a->last].kind == INNER_ARC && a->time < s->clock.now)
        a->last = NO_BODY;
}

/* Return whether no disc has moved in this epoch by more than rounding errors. For each impact of the epoch, the limit
   is one unit in the last place of the disc's coordinates. */
static inline bool has_stood_still(const State *s) {
    double roundings = CAROM_ULP * (double)s->counts.epoch_impacts;
    for (Index i = 0; i < s->disc_count; i++) {
        const Disc *a = &s->discs[i];
        if ((fabs(a->vx) + fabs(a->vy)) * s->clock.now > roundings * size_of(a->x, a->y, a->radius))
            return false;
    }
    return true;
}

/* Count the impacts of successive epochs in which no disc has moved. If the count of impacts exceeds
   `State.standstill`, end the run with `STANDSTILL`.

   Discs that are crushed between walls collide at shorter and shorter intervals. Just after an epoch begins, times are
   small, so they resolve smaller differences than times since the start of the run. So the clock seems to advance at
   each impact, and `Counts.at_instant` does not grow. */
static inline void count_still_impacts(State *s) {
    s->counts.still_impacts = has_stood_still(s) ? s->counts.still_impacts + s->counts.epoch_impacts : 0;
    if (s->counts.still_impacts > s->standstill)
        s->counts.at_instant = s->standstill + 1;
}

/* Begin a new epoch (part of the run): move every disc to the present, and count time from now on. All predictions are
   computed again. */
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
    /* The start of the epoch is stored as a pair of floats. The second float of the pair is the rounding error of the
       first float. */
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
