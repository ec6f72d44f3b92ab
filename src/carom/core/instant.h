/* Instants as pairs of floats: after 1e5 bounces a clock of one float is too coarse to place a disc.

   A pair is normalised: its high part is the nearest float. So two instants compare by high parts, then by low parts. */

#pragma once

#include <stdbool.h>

#include "carom/core/constants.h"
#include "carom/core/double_double.h"

typedef DoubleDouble Instant; /* seconds since the start */

static const Instant NEVER = {CAROM_INF, 0.0};

static inline bool is_before(Instant a, Instant b) {
    return a.high < b.high || (a.high == b.high && a.low < b.low);
}

static inline bool is_same_instant(Instant a, Instant b) {
    return a.high == b.high && a.low == b.low;
}

static inline Instant earlier_of(Instant a, Instant b) {
    return is_before(b, a) ? b : a;
}

static inline Instant later_of(Instant a, Instant b) {
    return is_before(a, b) ? b : a;
}

/* Return the instant some seconds after another; NEVER after infinitely many, and if the sum overflows. */
static inline Instant instant_after(Instant begin, double wait) {
    DoubleDouble sum = two_sum(begin.high, wait);
    return sum.high < CAROM_INF ? two_sum(sum.high, begin.low + sum.low) : NEVER;
}

/* Return the seconds from one instant to another. */
static inline double seconds_between(Instant earlier, Instant later) {
    return (later.high - earlier.high) + (later.low - earlier.low);
}
