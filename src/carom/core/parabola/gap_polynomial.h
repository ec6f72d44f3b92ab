/* Gaps as polynomials in time: between a disc on a parabola and a fixed circle, or between the disc and a line through
   a fixed point.

   Let d be the position of the disc's centre relative to the circle's centre, u its velocity, a its acceleration, and R
   the distance of the two centres in contact. For a disc outside of the circle, the gap is

       |d + u t + a t^2/2|^2 - R^2 = (d.d - R^2) + 2 d.u t + (u.u + d.a) t^2 + u.a t^3 + a.a/4 t^4

   For a disc inside the circle, the gap is the negative of the polynomial for a disc outside. If the disc has just left
   the circle, the first two coefficients are known without rounding errors: 0, and 2 R times the speed at which it
   left. */

#pragma once

#include "carom/core/quartic/polynomial.h"
#include "carom/core/straight/pair_time.h"

/* The path of a disc's centre on a parabola, and a fixed point. Each coordinate is exactly the sum of a pair of
   floats. */
typedef struct FallPath {
    DoubleDouble x;
    DoubleDouble y;
    DoubleDouble ux;
    DoubleDouble uy;
    double ax;
    double ay;
    DoubleDouble from_x; /* coordinates of the fixed point, in metres */
    DoubleDouble from_y;
} FallPath;

typedef struct CircleGap {
    FallPath path; /* path of the disc; its fixed point is the circle's centre */
    DoubleDouble reach;
    double from;    /* the instant t = 0 of the gap, in seconds from now */
    double leaving; /* if `has_left`: speed at which the disc has left the circle */
    bool has_left;
    bool is_inside; /* whether the gap is positive inside the circle */
    /* whether the gap is exactly 0 at t = 0, although rounded coefficients may give another value */
    bool is_closed;
} CircleGap;

/* How the gap of a `LineGap` is computed from the position (x, y) and a vector f = (fx, fy). */
typedef enum LineKind {
    ACROSS, /* fy x - fx y: distance from the line along f, times the length of f; positive to the right of f */
    ALONG,  /* fx x + fy y */
} LineKind;

typedef struct LineGap {
    FallPath path;
    DoubleDouble fx;
    DoubleDouble fy;
    double from;
    double sense; /* 1 or -1, a factor of the gap */
    LineKind kind;
} LineGap;

/* ---- positions ---- */

/* Return a coordinate relative to the fixed point as a sum of three floats. The error is at most 2^-150 times the
   coordinate's terms. */
static inline TripleDouble place_parts(DoubleDouble x, DoubleDouble from) {
    DoubleDouble high = two_diff(x.high, from.high);
    DoubleDouble low = two_diff(x.low, from.low);
    DoubleDouble middle = two_sum(high.low, low.high);
    DoubleDouble sum = two_sum(high.high, middle.high);
    DoubleDouble rest = two_sum(middle.low, low.low);
    middle = two_sum(sum.low, rest.high);
    return (TripleDouble){sum.high, middle.high, middle.low + rest.low};
}

/* Return a coordinate relative to the fixed point as a pair of floats. The error is at most 2^-104 times the
   coordinate's terms. */
static inline DoubleDouble place_from(DoubleDouble x, DoubleDouble from) {
    TripleDouble parts = place_parts(x, from);
    return quick_sum(parts.high, parts.middle);
}

/* Return the sum of the magnitudes of the terms of a coordinate relative to the fixed point. */
static inline double place_size(DoubleDouble x, DoubleDouble from) {
    return fabs(x.high - from.high) + fabs(x.low - from.low);
}

/* ---- a circle ---- */

/* Return the exact degree of the gap between a disc on this path and a circle. */
static inline int degree_of_path(const FallPath *p) {
    if (p->ax != 0.0 || p->ay != 0.0)
        return 4;
    return p->ux.high != 0.0 || p->uy.high != 0.0 ? 2 : 0;
}

/* Write the coefficients of a gap to a circle in floats. `from` must be 0. Each coefficient has at most 8 roundings:
   two for each position (a difference and a sum), and one for each velocity or reach (its low part is omitted). */
static inline void write_circle_floats(const CircleGap *gap, Polynomial *p) {
    const FallPath *path = &gap->path;
    double x = (path->x.high - path->from_x.high) + (path->x.low - path->from_x.low);
    double y = (path->y.high - path->from_y.high) + (path->y.low - path->from_y.low);
    double x_size = place_size(path->x, path->from_x), y_size = place_size(path->y, path->from_y);
    double ux = path->ux.high, uy = path->uy.high, ax = path->ax, ay = path->ay, reach = gap->reach.high;
    double sign = gap->is_inside ? -1.0 : 1.0;
    p->degree = degree_of_path(path);
    p->power[0] = sign * ((x * x + y * y) - reach * reach);
    p->size[0] = (x_size * x_size + y_size * y_size) + reach * reach;
    p->power[1] = sign * (2.0 * (x * ux + y * uy));
    p->size[1] = 2.0 * (x_size * fabs(ux) + y_size * fabs(uy));
    p->power[2] = sign * ((ux * ux + uy * uy) + (x * ax + y * ay));
    p->size[2] = (ux * ux + uy * uy) + (x_size * fabs(ax) + y_size * fabs(ay));
    p->power[3] = sign * (ux * ax + uy * ay);
    p->size[3] = fabs(ux * ax) + fabs(uy * ay);
    p->size[4] = 0.25 * (ax * ax + ay * ay);
    p->power[4] = sign * p->size[4];
    if (gap->has_left) {
        p->power[1] = 2.0 * (reach * gap->leaving);
        p->size[1] = fabs(p->power[1]);
    }
}

/* Add the square of a coordinate to a sum, with an error of at most 2^-145 times the square's terms. */
static inline TripleDouble add_place_square(TripleDouble total, TripleDouble x) {
    total = add_product(total, x.high, x.high);
    total = add_product(total, 2.0 * x.high, x.middle);
    total = add_product(total, x.middle, x.middle);
    return add_term(total, 2.0 * x.high * x.low);
}

/* Write coefficient 0 more precisely, because its terms nearly cancel near contact. The error of the result is relative
   to the coefficient itself, and not to its terms. */
static inline void write_excess(const CircleGap *gap, PairPolynomial *p) {
    const FallPath *path = &gap->path;
    TripleDouble total = add_square(empty_sum(), gap->reach, -1.0);
    total = add_place_square(total, place_parts(path->x, path->from_x));
    total = add_place_square(total, place_parts(path->y, path->from_y));
    p->power[0] = times_power_of_two(round_sum(total), gap->is_inside ? -1.0 : 1.0);
    p->size[0] = fabs(p->power[0].high) + 0x1p-44 * p->size[0];
}

/* Add the product of a coordinate and a component of the velocity to a sum. The error is at most 2^-145 times the
   product's terms. */
static inline TripleDouble add_place_product(TripleDouble total, TripleDouble x, DoubleDouble u) {
    total = add_pair_product(total, (DoubleDouble){x.high, x.middle}, u);
    return add_term(total, x.low * u.high);
}

/* Write coefficient 1 more precisely, because its terms nearly cancel if a disc moves along a circle. The error of the
   result is relative to the coefficient itself, and not to its terms. */
static inline void write_opening(const CircleGap *gap, PairPolynomial *p) {
    const FallPath *path = &gap->path;
    TripleDouble total = add_place_product(empty_sum(), place_parts(path->x, path->from_x), path->ux);
    total = add_place_product(total, place_parts(path->y, path->from_y), path->uy);
    p->power[1] = times_power_of_two(round_sum(total), gap->is_inside ? -2.0 : 2.0);
    p->size[1] = fabs(p->power[1].high) + 0x1p-44 * p->size[1];
}

static inline void write_circle_pairs(const void *source, PairPolynomial *p) {
    const CircleGap *gap = source;
    const FallPath *path = &gap->path;
    DoubleDouble x = place_from(path->x, path->from_x), y = place_from(path->y, path->from_y);
    DoubleDouble ux = path->ux, uy = path->uy;
    double ax = path->ax, ay = path->ay;
    double sign = gap->is_inside ? -1.0 : 1.0;
    Polynomial floats;
    write_circle_floats(gap, &floats);
    p->degree = floats.degree;
    for (int k = 0; k < QUARTIC_POWERS; k++)
        p->size[k] = floats.size[k];
    DoubleDouble reach2 = pair_product(gap->reach, gap->reach);
    DoubleDouble distance2 = pair_sum(pair_product(x, x), pair_product(y, y));
    DoubleDouble opening = pair_sum(pair_product(x, ux), pair_product(y, uy));
    DoubleDouble speed2 = pair_sum(pair_product(ux, ux), pair_product(uy, uy));
    DoubleDouble pull = pair_sum(times_double(x, ax), times_double(y, ay));
    p->power[0] = times_power_of_two(pair_sum(distance2, negate(reach2)), sign);
    p->power[1] = times_power_of_two(opening, 2.0 * sign);
    p->power[2] = times_power_of_two(pair_sum(speed2, pull), sign);
    p->power[3] = times_power_of_two(pair_sum(times_double(ux, ax), times_double(uy, ay)), sign);
    p->power[4] = times_power_of_two(pair_sum(two_prod(ax, ax), two_prod(ay, ay)), 0.25 * sign);
    if (fabs(p->power[0].high) < 0x1p-10 * p->size[0])
        write_excess(gap, p);
    if (gap->has_left)
        p->power[1] = times_double(gap->reach, 2.0 * gap->leaving);
    else if (fabs(p->power[1].high) < 0x1p-10 * p->size[1])
        write_opening(gap, p);
    if (gap->is_closed) {
        p->power[0] = (DoubleDouble){0.0, 0.0};
        p->size[0] = 0.0;
    }
    if (gap->from > 0.0)
        shift_origin(p, gap->from);
}

/* Add `factor` times the squared distance of the disc's centre from the fixed point, as exact products. `factor` is a
   power of two or its negative. */
static inline void add_path_products(Products *products, const FallPath *path, double factor) {
    const double x[4] = {path->x.high, path->x.low, -path->from_x.high, -path->from_x.low};
    const double y[4] = {path->y.high, path->y.low, -path->from_y.high, -path->from_y.low};
    const double ux[2] = {path->ux.high, path->ux.low}, uy[2] = {path->uy.high, path->uy.low};
    const double *ax = &path->ax, *ay = &path->ay;
    add_products(products, 0, x, 4, x, 4, factor);
    add_products(products, 0, y, 4, y, 4, factor);
    add_products(products, 1, x, 4, ux, 2, 2.0 * factor);
    add_products(products, 1, y, 4, uy, 2, 2.0 * factor);
    add_products(products, 2, ux, 2, ux, 2, factor);
    add_products(products, 2, uy, 2, uy, 2, factor);
    add_products(products, 2, x, 4, ax, 1, factor);
    add_products(products, 2, y, 4, ay, 1, factor);
    add_products(products, 3, ux, 2, ax, 1, factor);
    add_products(products, 3, uy, 2, ay, 1, factor);
    add_products(products, 4, ax, 1, ax, 1, 0.25 * factor);
    add_products(products, 4, ay, 1, ay, 1, 0.25 * factor);
}

static inline void write_circle_products(const void *source, Products *products) {
    const CircleGap *gap = source;
    const double reach[2] = {gap->reach.high, gap->reach.low};
    const double sign = gap->is_inside ? -1.0 : 1.0;
    add_path_products(products, &gap->path, sign);
    add_products(products, 0, reach, 2, reach, 2, -sign);
    if (gap->is_closed)
        products->count[0] = 0;
    if (gap->has_left) {
        products->count[1] = 0;
        add_products(products, 1, reach, 2, &gap->leaving, 1, 2.0);
    }
    products->from = gap->from;
}

/* ---- a line ---- */

/* Write the coefficients of a gap to a line in floats. `from` must be 0. Return whether the degree of the gap is
   certainly 2. */
static inline bool write_line_floats(const LineGap *gap, Polynomial *p) {
    const FallPath *path = &gap->path;
    double fx = gap->sense * (gap->kind == ACROSS ? gap->fy.high : gap->fx.high);
    double fy = gap->sense * (gap->kind == ACROSS ? -gap->fx.high : gap->fy.high);
    double x = (path->x.high - path->from_x.high) + (path->x.low - path->from_x.low);
    double y = (path->y.high - path->from_y.high) + (path->y.low - path->from_y.low);
    double x_size = place_size(path->x, path->from_x), y_size = place_size(path->y, path->from_y);
    p->degree = 2;
    p->power[0] = fx * x + fy * y;
    p->size[0] = fabs(fx) * x_size + fabs(fy) * y_size;
    p->power[1] = fx * path->ux.high + fy * path->uy.high;
    p->size[1] = fabs(fx * path->ux.high) + fabs(fy * path->uy.high);
    p->power[2] = 0.5 * (fx * path->ax + fy * path->ay);
    p->size[2] = 0.5 * (fabs(fx * path->ax) + fabs(fy * path->ay));
    return fabs(p->power[2]) > CAROM_ERROR * p->size[2] && p->size[2] >= CAROM_LEAST_SIZE;
}

static inline void write_line_pairs(const void *source, PairPolynomial *p) {
    const LineGap *gap = source;
    const FallPath *path = &gap->path;
    const bool is_across = gap->kind == ACROSS;
    DoubleDouble fx = times_power_of_two(is_across ? gap->fy : gap->fx, gap->sense);
    DoubleDouble fy = is_across ? times_power_of_two(gap->fx, -gap->sense) : times_power_of_two(gap->fy, gap->sense);
    double x_size = place_size(path->x, path->from_x), y_size = place_size(path->y, path->from_y);
    double fx_size = fabs(fx.high), fy_size = fabs(fy.high);
    TripleDouble place = add_place_product(empty_sum(), place_parts(path->x, path->from_x), fx);
    place = add_place_product(place, place_parts(path->y, path->from_y), fy);
    p->power[0] = round_sum(place);
    p->size[0] = fabs(p->power[0].high) + 0x1p-44 * (fx_size * x_size + fy_size * y_size);
    /* The signs of coefficients 1 and 2 are exact. */
    DoubleDouble ax = {path->ax, 0.0}, ay = {path->ay, 0.0};
    p->power[1] = inner_product(fx, fy, path->ux, path->uy);
    p->size[1] = fx_size * fabs(path->ux.high) + fy_size * fabs(path->uy.high);
    p->power[2] = times_power_of_two(inner_product(fx, fy, ax, ay), 0.5);
    p->size[2] = 0.5 * (fx_size * fabs(path->ax) + fy_size * fabs(path->ay));
    p->degree = p->power[2].high != 0.0 ? 2 : p->power[1].high != 0.0 ? 1 : 0;
    if (gap->from > 0.0)
        shift_origin(p, gap->from);
}

static inline void write_line_products(const void *source, Products *products) {
    const LineGap *gap = source;
    const FallPath *path = &gap->path;
    const bool is_across = gap->kind == ACROSS;
    const double x[4] = {path->x.high, path->x.low, -path->from_x.high, -path->from_x.low};
    const double y[4] = {path->y.high, path->y.low, -path->from_y.high, -path->from_y.low};
    const double ux[2] = {path->ux.high, path->ux.low}, uy[2] = {path->uy.high, path->uy.low};
    const double fx[2] = {gap->fx.high, gap->fx.low}, fy[2] = {gap->fy.high, gap->fy.low};
    const double *for_x = is_across ? fy : fx, *for_y = is_across ? fx : fy;
    const double x_sense = gap->sense, y_sense = is_across ? -gap->sense : gap->sense;
    add_products(products, 0, for_x, 2, x, 4, x_sense);
    add_products(products, 0, for_y, 2, y, 4, y_sense);
    add_products(products, 1, for_x, 2, ux, 2, x_sense);
    add_products(products, 1, for_y, 2, uy, 2, y_sense);
    add_products(products, 2, for_x, 2, &path->ax, 1, 0.5 * x_sense);
    add_products(products, 2, for_y, 2, &path->ay, 1, 0.5 * y_sense);
    products->from = gap->from;
}
