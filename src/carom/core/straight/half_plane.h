/* Time of impact of a disc on the line of a half-plane, in straight uniform motion.

   Points p on the free side of the wall have (p - q).n >= 0, with a point q and a unit normal n. Both are used exactly
   as given in floats. The disc's rim has the gap (p - q).n - r, which closes at the speed -v.n. The time of impact is
   gap over speed. Offset, radius and products are error-free pairs: near contact, plain floats have errors of up to
   1e14 units in the last place. The time is accurate to 2 units in the last place, for lengths and speeds between
   1e-250 and 1e290. Lengths are in metres, velocities in metres per second, times in seconds. */

#pragma once

#include "carom/core/straight/pair_time.h"

/* Add `a` times a component of a normal to a sum. Most walls are parallel to an axis; products with 0 and 1 are
   exact. */
static inline TripleDouble add_along(TripleDouble total, double a, double component) {
    if (component == 0.0)
        return total;
    if (fabs(component) == 1.0)
        return add_term(total, a * component);
    return add_product(total, a, component);
}

/* Return the distance of a disc's rim from a wall, negative inside the wall. */
static inline DoubleDouble wall_gap(double x, double y, double radius, double qx, double qy, double nx, double ny) {
    DoubleDouble dx = two_diff(x, qx);
    DoubleDouble dy = two_diff(y, qy);
    TripleDouble total = add_along(add_along(empty_sum(), dx.high, nx), dx.low, nx);
    total = add_along(add_along(total, dy.high, ny), dy.low, ny);
    return round_sum(add_term(total, -radius));
}

/* Return the velocity along a wall's normal, negative towards the wall. */
static inline DoubleDouble wall_speed(double vx, double vy, double nx, double ny) {
    return round_sum(add_along(add_along(empty_sum(), vx, nx), vy, ny));
}

/* Return the root of `gap + speed * t`, with one correction by its residual. */
static inline double linear_root(DoubleDouble gap, DoubleDouble speed) {
    double t = -gap.high / speed.high;
    DoubleDouble product = two_prod(t, speed.high);
    return t - (((gap.high + product.high) + product.low) + (gap.low + t * speed.low)) / speed.high;
}

/* Return the seconds until a disc touches a wall: 0 if it touches or overlaps the wall and approaches, infinity for
   never. */
static inline double wall_time(double x, double y, double vx, double vy, double radius, double qx, double qy, double nx,
                               double ny) {
    Bounded toward = approach(vx, vy, nx, ny);
    if (toward.value > toward.error)
        return CAROM_INF;
    DoubleDouble speed = wall_speed(vx, vy, nx, ny);
    if (!(speed.high < 0.0))
        return CAROM_INF;
    DoubleDouble gap = wall_gap(x, y, radius, qx, qy, nx, ny);
    if (gap.high <= 0.0)
        return 0.0;
    return linear_root(gap, speed);
}
