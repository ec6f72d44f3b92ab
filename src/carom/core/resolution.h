/* Resolution of an impact's time: the uncertainty due to rounding of positions and of the clock.

   `carom.core.resolution` derives the error bound of a gap. Divided by the speed of approach, it is the error of a
   time.

   In a grazing impact the speed of approach can be arbitrarily small. There the overlap is a parabola in time with the
   curvature u^2 / R, where u is the relative speed and R the contact distance. An error of the gap moves its zero by at
   most half the width of the parabola at that depth: sqrt(2 R error) / u. The resolution is the smaller of the two
   times. */

#pragma once

#include <math.h>

#include "carom/core/arithmetic/double_double.h"
#include "carom/core/carom_core.h"
#include "carom/core/constants.h"

/* Return whether floats resolve the distance of two discs in contact. Farther from the origin an impact has no
   normal. */
static inline bool are_distinguishable(double x1, double y1, double x2, double y2, double reach) {
    return fabs(x1) + fabs(y1) + fabs(x2) + fabs(y2) <= CAROM_FARTHEST * reach;
}

/* Return the sum of the absolute values of a body's coordinates (of a wall: of its point) and its radius. */
static inline double size_of(double x, double y, double radius) {
    return fabs(x) + fabs(y) + radius;
}

/* Return the resolution of the gap between two bodies, metres, from the sum of `size_of` of both. */
static inline double gap_resolution(double sizes) {
    return 5.0 * CAROM_ULP * sizes;
}

/* Return the resolution of an impact of two discs, seconds. `sizes` is the sum of `size_of` for both discs. u is their
   relative velocity before the impact, and `speed` is its component along the normal. */
static inline double pair_resolution(double sizes, double reach, double ux, double uy, double speed) {
    double error = gap_resolution(sizes);
    /* Here the impact is far from a graze, and the first of the two times is smaller by a factor of two or more. The
       reason: error / speed <= 2^10 error / u, and graze >= sqrt(2 2^22 error^2) / u. */
    if (CAROM_LIKELY(speed >= 0x1p-10 * (fabs(ux) + fabs(uy)) && error <= 0x1p-22 * reach && speed > 0.0))
        return error / speed;
    double fast = sqrt(ux * ux + uy * uy);
    double graze = fast > 0.0 ? reach * sqrt(2.0 * (error / reach)) / fast : CAROM_INF;
    return speed > 0.0 ? lesser(error / speed, graze) : graze;
}

/* Return the resolution of an impact on a wall, seconds. */
static inline double wall_resolution(double sizes, double speed) {
    return speed > 0.0 ? gap_resolution(sizes) / speed : CAROM_INF;
}

/* Return the resolution of a time since the start. It covers the roundings of a root and of a sum with it. */
static inline double clock_resolution(double time) {
    return 2.0 * CAROM_ULP * time;
}
