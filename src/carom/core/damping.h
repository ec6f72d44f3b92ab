/* Discs that slow down, because of linear damping or on a table that decelerates them.

   Linear damping v' = -c v is equivalent to a change of the time variable, which docs/theory/damping.md derives. In the
   time t, a damped disc moves as far as an undamped disc moves in the undamped time s = (1 - e^(-c t)) / c. The damped
   disc then has e^(-c t) = 1 - c s times the velocity of the undamped disc. The damping rate c is 0 or more, in 1/s.
   Times are in seconds. */

#pragma once

#include <float.h>
#include <string.h>

#include "carom/core/arithmetic/exponentials.h"
#include "carom/core/carom_core.h"

/* Return the factor by which damping multiplies a velocity during a time. For a negative time, the factor is greater
   than 1 and may be infinite. */
static inline double remaining_velocity(double rate, double time) {
    return nearest_exp(-rate * time);
}

/* Return the time in which an undamped disc moves as far as a damped disc in `time`. */
static inline double undamped_time(double rate, double time) {
    if (!(fabs(rate * time) >= CAROM_DAMPING_LEAST)) { /* NaN stays NaN */
        return time;
    }
    double change = nearest_expm1(-rate * time);
    return change == CAROM_INF ? -CAROM_INF : -change / rate;
}

/* Return the time in which a damped disc moves as far as an undamped disc in `undamped`; infinity for never. `anchor`
   stores a logarithm from an earlier call, which makes calls with successive times fast. */
static inline double damped_time_from(LogAnchor *anchor, double rate, double undamped) {
    double way = rate * undamped;
    if (!(fabs(way) >= CAROM_DAMPING_LEAST)) { /* NaN stays NaN */
        return undamped;
    }
    return way >= 1.0 ? CAROM_INF : -nearest_log1p_from(anchor, -way) / rate;
}

static inline double damped_time(double rate, double undamped) {
    LogAnchor anchor = first_anchor();
    return damped_time_from(&anchor, rate, undamped);
}

/* Return the next float after a time of 0 or more if `step` is 1, or the float before this time if `step` is -1. The
   result is at most infinity and at least 0. */
static inline double neighbouring_time(double time, int step) {
    if (step > 0 ? time == CAROM_INF : time == 0.0) {
        return time;
    }
    uint64_t bits;
    memcpy(&bits, &time, sizeof bits);
    bits = step > 0 ? bits + 1 : bits - 1;
    memcpy(&time, &bits, sizeof bits);
    return time;
}

/* Return the greatest undamped time t >= 0 with `damped_time(t)` <= `time`. `time` must be 0 or more.

   An event of the undamped run at the returned time or earlier is never later than `time` in the damped run. The search
   begins at `undamped_time`. `damped_time` and `undamped_time` round, so the start of the search differs from the
   result by at most a few floats. */
static inline double latest_undamped_time(double rate, double time) {
    /* If `time` is infinite, use the largest float. An event that never happens has the damped time infinity, and must
       not count as an event before `time`. */
    if (time > DBL_MAX) {
        time = DBL_MAX;
    }
    double found = undamped_time(rate, time);
    if (found < 0.0) {
        found = 0.0;
    } else if (found > DBL_MAX) {
        found = DBL_MAX;
    }
    for (;;) {
        double later = neighbouring_time(found, 1);
        if (later == found || !(damped_time(rate, later) <= time)) {
            break;
        }
        found = later;
    }
    while (damped_time(rate, found) > time) {
        found = neighbouring_time(found, -1);
    }
    return found;
}

/* ---- a table ---- */

typedef struct Slowing { /* deceleration of a disc on a table */
    double ax;           /* acceleration, in m/s^2 */
    double ay;
    Instant stops; /* instant at which the disc stops; NEVER if it is at rest */
} Slowing;

/* Return how a table slows a disc that has the velocity (vx, vy) at the instant `now`. */
static inline Slowing slowing_by(double deceleration, double vx, double vy, Instant now) {
    double speed = nearest_length(vx, vy);
    if (speed == 0.0)
        return (Slowing){0.0, 0.0, NEVER};
    /* the acceleration is multiplied by a unit vector, because `a / speed` could be infinite for a tiny speed */
    double a = -deceleration;
    return (Slowing){a * (vx / speed), a * (vy / speed), instant_after(now, speed / deceleration)};
}

/* ---- recorded impacts ---- */

/* Apply damping to an impact of an undamped run: multiply its velocities by `kept` = 1 - c s. */
static inline void slow_impact(Impact *row, double kept) {
    for (int axis = 0; axis < 2; axis++) {
        row->first_before[axis] *= kept;
        row->second_before[axis] *= kept;
        row->first_after[axis] *= kept;
        row->second_after[axis] *= kept;
    }
}

static inline void slow_spin(Spins *row, double kept) {
    row->first_before *= kept;
    row->second_before *= kept;
    row->first_after *= kept;
    row->second_after *= kept;
}

/* Convert impacts of an undamped run to those of the damped run. */
static inline void slow_impacts(double rate, Impact *impacts, Index count) {
    LogAnchor anchor = first_anchor();
    for (Index k = 0; k < count; k++) {
        Impact *row = &impacts[k];
        slow_impact(row, 1.0 - rate * row->time);
        row->time = damped_time_from(&anchor, rate, row->time);
    }
}

/* Convert spins before and after impacts of an undamped run to those of the damped run. */
static inline void slow_spins(double rate, const Impact *undamped, Spins *spins, Index count) {
    for (Index k = 0; k < count; k++)
        slow_spin(&spins[k], 1.0 - rate * undamped[k].time);
}
