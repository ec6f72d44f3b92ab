/* Instants as pairs of floats. After 1e5 bounces one float is too coarse to locate a disc.

   A pair is normalised: its high part is the float nearest to the sum. So instants are compared by their high parts
   first, then by their low parts. */

#pragma once

#include <stdbool.h>

#include "carom/core/arithmetic/double_double.h"
#include "carom/core/constants.h"

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

/* Return the instant some seconds after another one. It is NEVER for infinitely many seconds, or if the sum
   overflows. */
static inline Instant instant_after(Instant begin, double wait) {
    DoubleDouble sum = two_sum(begin.high, wait);
    return sum.high < CAROM_INF ? two_sum(sum.high, begin.low + sum.low) : NEVER;
}

/* Return the seconds from one instant to another. */
static inline double seconds_between(Instant earlier, Instant later) {
    return (later.high - earlier.high) + (later.low - earlier.low);
}
