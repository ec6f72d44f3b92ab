/* Time of impact of two discs in straight uniform motion, accurate to 2 units in the last place. The decision whether
   the two discs collide is exact.

   Let d be the offset of the second disc from the first, u its relative velocity, and R the sum of the radii. The discs
   touch when |d + u t| = R, that is

       a t^2 + 2 b t + c = 0,   a = u.u,   b = d.u,   c = d.d - R^2.

   The discs collide at the earlier root t = c / (-b + sqrt(D)), with D = b^2 - a c = a R^2 - (d x u)^2. A collision
   needs three conditions: the discs approach (b < 0), are apart (c > 0) and do not miss each other (D > 0). There are
   three steps, each with its own guarantee:

   1. The plain form evaluates b, c and D in double precision. The plain form decides a condition only if the b, c or D
      of the condition exceeds the bound of its rounding error.
   2. The root of a collision is refined by one step. The refinement computes |d + u t|^2 - R^2 without cancellation.
      Each operand is split into a part on a common grid, whose square is exact, and a small rest. The step also finds
      whether the error of the root is certainly below 2 units in the last place.
   3. The error-free form computes the cases that the first two steps leave undecided. The error-free form uses sums of
      exact products, scaled by powers of two. If the products nearly cancel, so that rounding their sum in steps is too
      inaccurate, exact sums are used.

   docs/theory/pic.md derives the bounds. Lengths are in metres, velocities in m/s, times in seconds. */

#pragma once

#include "carom/core/arithmetic/double_double.h"

/* Every finite float is less than 2 to the power LARGEST_EXPONENT. */
enum { LARGEST_EXPONENT = 1024 };

/* A value computed in double precision, and a bound of its rounding error. */
typedef struct Bounded {
    double value;
    double error;
} Bounded;

/* Position and velocity of the second disc relative to the first, as pairs of floats without rounding error. */
typedef struct Encounter {
    DoubleDouble x;
    DoubleDouble y;
    DoubleDouble ux;
    DoubleDouble uy;
    DoubleDouble reach; /* sum of the radii */
} Encounter;

/* ---- the plain form ---- */

/* Return b = d.u, which is negative if the discs approach. */
static inline Bounded approach(double dx, double dy, double ux, double uy) {
    double along_x = dx * ux;
    double along_y = dy * uy;
    return (Bounded){along_x + along_y, CAROM_ERROR * (fabs(along_x) + fabs(along_y)) + CAROM_NEGLIGIBLE};
}

/* Return D = (u.u) R^2 - (d x u)^2, which is negative if the discs miss each other. */
static inline Bounded discriminant(double dx, double dy, double ux, double uy, double reach) {
    double across_x = dx * uy;
    double across_y = dy * ux;
    double cross = across_x - across_y;
    double largest = (reach * reach) * (ux * ux + uy * uy);
    double across = fabs(across_x) + fabs(across_y);
    double error = (2.0 * CAROM_ERROR) * ((fabs(cross) + CAROM_ERROR * across) * across + largest) + CAROM_NEGLIGIBLE;
    return (Bounded){largest - cross * cross, error};
}

/* Return c = d.d - R^2, which is negative if the discs overlap. */
static inline Bounded separation(double dx, double dy, double reach) {
    double distance2 = dx * dx + dy * dy;
    double reach2 = reach * reach;
    return (Bounded){distance2 - reach2, CAROM_ERROR * (distance2 + reach2) + CAROM_NEGLIGIBLE};
}

/* Return whether two discs certainly do not collide within `wait` seconds. The first test uses the fact that the time
   of impact is at least c / (-2 b), with b and c from the top of this file. */
static inline bool is_passed(double dx, double dy, double ux, double uy, double reach, double wait) {
    Bounded b = approach(dx, dy, ux, uy);
    if (b.value > b.error)
        return true;
    Bounded c = separation(dx, dy, reach);
    double least = (c.value - c.error) * (1.0 - CAROM_ERROR), closing = b.error - b.value;
    if (least > 2.0 * closing * wait)
        return true;
    Bounded d = discriminant(dx, dy, ux, uy, reach);
    return d.value < -d.error || least > (closing + sqrt(greater(d.value, 0.0) + d.error)) * wait;
}

/* ---- one refinement ---- */

/* Return p + t v as a sum of two floats. `t` is the time, split into two parts. */
static inline DoubleDouble advance_coordinate(DoubleDouble t, DoubleDouble p, DoubleDouble v) {
    DoubleDouble fast = split_double(v.high);
    DoubleDouble head = two_sum(p.high, t.high * fast.high);
    double rest = head.low + ((t.high * fast.low + t.low * fast.high) + (t.low * fast.low + (p.low + t.high * v.low)));
    return (DoubleDouble){head.high, rest};
}

/* Refine an approximate root, which has at least 22 correct bits, by one step. Each operand is split into a part on a
   common grid, whose square is exact, and a small rest.

   Return the earlier root, accurate to 2 units in the last place. If this accuracy is not certain, return
   CAROM_UNCERTAIN. */
static inline double refine_root(double guess, Encounter e) {
    DoubleDouble t = split_double(guess);
    double radius = e.reach.high;
    double grid = CAROM_GRID * radius;
    DoubleDouble x = advance_coordinate(t, e.x, e.ux);
    DoubleDouble y = advance_coordinate(t, e.y, e.uy);
    double px = x.high + x.low;
    double py = y.high + y.low;
    double hx = (px + grid) - grid;
    double hy = (py + grid) - grid;
    double hr = (radius + grid) - grid;
    double lx = (x.high - hx) + x.low;
    double ly = (y.high - hy) + y.low;
    double lr = (radius - hr) + e.reach.low;
    double gap =
        ((hx * hx + hy * hy) - hr * hr) + (2.0 * ((hx * lx + hy * ly) - hr * lr) + ((lx * lx + ly * ly) - lr * lr));
    double closing = -(px * e.ux.high + py * e.uy.high);
    /* In a distant graze, the closing speed can be exactly 0. The result is then CAROM_UNCERTAIN. */
    double inverse = 1.0 / (closing + (closing == 0.0 ? 1.0 : 0.0));
    double step = gap * inverse;
    double bend = ((e.ux.high * e.ux.high + e.uy.high * e.uy.high) * step) * inverse;
    double speed = fabs(e.ux.high) + fabs(e.uy.high);
    double extent = fabs(e.x.high) + fabs(e.y.high) + guess * speed;
    /* Conditional values are used instead of `&&`, so that the processor need not predict branches. */
    double root = guess + 0.5 * step * (1.0 + bend * (0.25 + 0.125 * bend));
    root = closing >= 0x1p-10 * (radius * speed) ? root : CAROM_UNCERTAIN;
    root = extent <= 0x1p34 * radius ? root : CAROM_UNCERTAIN;
    root = fabs(bend) <= 0x1p-12 ? root : CAROM_UNCERTAIN;
    root = fabs(step) <= 0x1p-22 * guess ? root : CAROM_UNCERTAIN;
    root = 0x1p-17 * (radius * (2.0 * radius + extent)) <= closing * guess ? root : CAROM_UNCERTAIN;
    root = radius >= 0x1p-440 ? root : CAROM_UNCERTAIN;
    return speed >= 0x1p-440 ? root : CAROM_UNCERTAIN;
}

static inline Encounter encounter(double x1, double y1, double vx1, double vy1, double r1, double x2, double y2,
                                  double vx2, double vy2, double r2) {
    return (Encounter){two_diff(x2, x1), two_diff(y2, y1), two_diff(vx2, vx1), two_diff(vy2, vy1), two_sum(r1, r2)};
}

/* Compute the time of impact from b and D of the plain form, and refine it once. Return the time, or CAROM_UNCERTAIN if
   its accuracy is not certain. */
static inline double refined_time(double b, double d, Encounter e) {
    Bounded c = separation(e.x.high, e.y.high, e.reach.high);
    double closing = sqrt(greater(d, 0.0)) - b;
    double root = refine_root(c.value / (closing > 0.0 ? closing : 1.0), e);
    root = b < 0.0 ? root : CAROM_UNCERTAIN;
    root = c.value > 0.0 ? root : CAROM_UNCERTAIN;
    return d > 0.0 ? root : CAROM_UNCERTAIN;
}

/* ---- the error-free form: signs are exact ---- */

/* Return D = b^2 - a c. This formula is accurate near contact, where b and c are small. */
static inline DoubleDouble discriminant_from_gap(DoubleDouble b, DoubleDouble c, DoubleDouble a) {
    DoubleDouble square = two_prod(b.high, b.high);
    DoubleDouble product = two_prod(a.high, c.high);
    DoubleDouble d = two_diff(square.high, product.high);
    double rest = (square.low - product.low) + (2.0 * b.high * b.low - (a.high * c.low + a.low * c.high));
    return two_sum(d.high, d.low + rest);
}

/* Return D = a R^2 - (d x u)^2. This formula is accurate far from contact, where b^2 and a c nearly cancel. */
static inline DoubleDouble discriminant_from_miss(Encounter e, DoubleDouble a) {
    DoubleDouble cross = round_sum(add_pair_product(add_pair_product(empty_sum(), e.x, e.uy), negate(e.y), e.ux));
    DoubleDouble square = pair_product(cross, cross);
    DoubleDouble largest = pair_product(a, pair_product(e.reach, e.reach));
    DoubleDouble d = two_diff(largest.high, square.high);
    return two_sum(d.high, d.low + (largest.low - square.low));
}

/* Return the root c / (-b + sqrt(D)), corrected once by the remainder of the division. */
static inline double exact_root(DoubleDouble b, DoubleDouble c, DoubleDouble d) {
    DoubleDouble root = pair_root(d), closing = two_sum(root.high, -b.high);
    double low = closing.low + (root.low - b.low);
    double t = c.high / closing.high;
    DoubleDouble product = two_prod(t, closing.high);
    return t + ((((c.high - product.high) - product.low) + c.low) - t * low) / closing.high;
}

static inline int exponent_of(double a) {
    int exponent = 0;
    frexp(a, &exponent);
    return exponent;
}

static inline DoubleDouble scale_pair(DoubleDouble a, int exponent) {
    return (DoubleDouble){ldexp(a.high, exponent), ldexp(a.low, exponent)};
}

static inline DoubleDouble exact_inner_product(DoubleDouble x, DoubleDouble y, DoubleDouble ux, DoubleDouble uy) {
    double terms[16];
    write_pair_products(terms, x, ux, 1.0);
    write_pair_products(terms + 8, y, uy, 1.0);
    return exact_sum(terms, 16);
}

/* Return b = d.u, whose sign is exact. */
static inline DoubleDouble inner_product(DoubleDouble x, DoubleDouble y, DoubleDouble ux, DoubleDouble uy) {
    DoubleDouble b = round_sum(add_pair_product(add_pair_product(empty_sum(), x, ux), y, uy));
    if (fabs(b.high) <= CAROM_DOUBTFUL_SUM * (fabs(x.high * ux.high) + fabs(y.high * uy.high)))
        return exact_inner_product(x, y, ux, uy);
    return b;
}

static inline DoubleDouble exact_excess(DoubleDouble x, DoubleDouble y, DoubleDouble reach) {
    double terms[24];
    write_pair_products(terms, x, x, 1.0);
    write_pair_products(terms + 8, y, y, 1.0);
    write_pair_products(terms + 16, reach, reach, -1.0);
    return exact_sum(terms, 24);
}

/* Return c = d.d - R^2, whose sign is exact. */
static inline DoubleDouble excess(DoubleDouble x, DoubleDouble y, DoubleDouble reach) {
    DoubleDouble c = round_sum(add_square(add_square(add_square(empty_sum(), x, 1.0), y, 1.0), reach, -1.0));
    if (fabs(c.high) <= CAROM_DOUBTFUL_SUM * (reach.high * reach.high))
        return exact_excess(x, y, reach);
    return c;
}

/* Return D = (u.u) R^2 - (d x u)^2, whose sign is exact. */
static inline DoubleDouble exact_discriminant(Encounter e) {
    double a[16];
    double cross[16];
    double reach2[8];
    double terms[MOST_TERMS];
    write_pair_products(a, e.ux, e.ux, 1.0);
    write_pair_products(a + 8, e.uy, e.uy, 1.0);
    write_pair_products(cross, e.x, e.uy, 1.0);
    write_pair_products(cross + 8, e.y, e.ux, -1.0);
    write_pair_products(reach2, e.reach, e.reach, 1.0);
    int a_count = write_parts(a, a, 16), reach_count = write_parts(reach2, reach2, 8);
    int cross_count = write_parts(cross, cross, 16);
    int count = write_products(terms, a, a_count, reach2, reach_count, 1.0);
    count += write_products(terms + count, cross, cross_count, cross, cross_count, -1.0);
    return exact_sum(terms, count);
}

/* Return D, by the formula that is accurate for the given a, b and c: b^2 - a c or a R^2 - (d x u)^2. If the discs are
   apart (c > 0), the sign of D is exact, because this sign decides whether the discs collide. */
static inline DoubleDouble accurate_discriminant(Encounter e, DoubleDouble b, DoubleDouble c, DoubleDouble a) {
    double largest = a.high * (e.reach.high * e.reach.high), terms = b.high * b.high;
    bool is_near = c.high < 0.0 || terms < largest;
    DoubleDouble d = is_near ? discriminant_from_gap(b, c, a) : discriminant_from_miss(e, a);
    bool is_doubtful = fabs(d.high) <= CAROM_DOUBTFUL_DISCRIMINANT * (is_near ? terms : largest);
    return c.high > 0.0 && is_doubtful ? exact_discriminant(e) : d;
}

/* Return the time of impact of two discs, computed by the error-free form for numbers of any size. */
static inline double exact_pair_time(Encounter e) {
    double ux = e.ux.high;
    double uy = e.uy.high;
    double fastest = greater(fabs(ux), fabs(uy));
    if (fastest == 0.0)
        return CAROM_INF;
    int length = exponent_of(greater(greater(fabs(e.x.high), fabs(e.y.high)), e.reach.high));
    int pace = exponent_of(fastest);
    e.x = scale_pair(e.x, -length);
    e.y = scale_pair(e.y, -length);
    e.reach = scale_pair(e.reach, -length);
    e.ux = scale_pair(e.ux, -pace);
    e.uy = scale_pair(e.uy, -pace);
    DoubleDouble b = inner_product(e.x, e.y, e.ux, e.uy);
    /* If one component of the velocity is less than 2^-1022 times the other, scaling can make the smaller component 0,
       and then b = 0. The sign of b without scaling is still correct. */
    if (!(b.high < 0.0) && !(b.high == 0.0 && e.x.high * ux + e.y.high * uy < 0.0))
        return CAROM_INF;
    DoubleDouble c = excess(e.x, e.y, e.reach);
    if (c.high <= 0.0)
        return 0.0;
    DoubleDouble a = round_sum(add_square(add_square(empty_sum(), e.ux, 1.0), e.uy, 1.0));
    DoubleDouble d = accurate_discriminant(e, b, c, a);
    if (!(d.high > 0.0))
        return CAROM_INF;
    double root = exact_root(b, c, d);
    return exponent_of(root) + length - pace > LARGEST_EXPONENT ? CAROM_INF : ldexp(root, length - pace);
}

/* ---- the time ---- */

/* Return the seconds until two discs collide, from their relative position and velocity.

   The result is 0 if the discs approach while they touch or overlap, and infinity if they never collide. If the discs
   only graze each other without any overlap (D = 0), they exchange no momentum, so the graze is not an impact. */
static inline double meeting_time(Encounter e) {
    Bounded b = approach(e.x.high, e.y.high, e.ux.high, e.uy.high);
    if (b.value > b.error)
        return CAROM_INF;
    Bounded d = discriminant(e.x.high, e.y.high, e.ux.high, e.uy.high, e.reach.high);
    if (d.value < -d.error)
        return CAROM_INF;
    double time = refined_time(b.value, d.value, e);
    if (CAROM_UNLIKELY(time < 0.0))
        return exact_pair_time(e);
    return time;
}

/* Return the result of `meeting_time` for two discs, from their positions and velocities at one time. */
static inline double pair_time(double x1, double y1, double vx1, double vy1, double r1, double x2, double y2,
                               double vx2, double vy2, double r2) {
    return meeting_time(encounter(x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2));
}
