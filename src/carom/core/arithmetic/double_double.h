/* Double-double arithmetic: numbers as exact sums of two floats ("pairs"). The file also has sums of three floats,
   error-free sums and products, and instants (times, each of which is a pair of floats).

   Every operation must be rounded correctly, as IEEE 754 requires. Compilers must neither fuse nor reorder operations.
   The error bounds in this file are valid if nothing overflows or underflows.

   Sources: T. J. Dekker, "A floating-point technique for extending the available precision", Numer. Math. 18 (1971). D.
   E. Knuth, TAOCP vol. 2, 4.2.2 (two_sum). T. Ogita, S. M. Rump, S. Oishi, "Accurate sum and dot product", SIAM J. Sci.
   Comput. 26 (2005) (sums in three parts: SumK with K = 3). J. R. Shewchuk, "Adaptive precision floating-point
   arithmetic", Discrete Comput. Geom. 18 (1997) (exact_sum: grow-expansion with zero elimination). */

#pragma once

#include "carom/core/constants.h"

/* A pair: a number that is the exact sum of two floats. */
typedef struct DoubleDouble {
    double high;
    double low;
} DoubleDouble;

/* A number that is the sum of three floats. */
typedef struct TripleDouble {
    double high;
    double middle;
    double low;
} TripleDouble;

/* Number of terms of the longest exact sum, which is the discriminant for two discs (`exact_discriminant` in
   pair_time.h). */
enum { MOST_TERMS = 768 };

/* Return the smaller of two numbers. Compilers translate this function to one machine instruction, but call a library
   function for `fmin`. The arguments must not be NaN. */
static inline double lesser(double a, double b) {
    return a < b ? a : b;
}

static inline double greater(double a, double b) {
    return a > b ? a : b;
}

/* Split a number into two parts of at most 26 bits each, whose sum is exactly the number. */
static inline DoubleDouble split_double(double a) {
    double scaled = CAROM_SPLITTER * a;
    double high = scaled - (scaled - a);
    return (DoubleDouble){high, a - high};
}

/* Return the rounded sum and its rounding error. */
static inline DoubleDouble two_sum(double a, double b) {
    double total = a + b;
    double part = total - a;
    return (DoubleDouble){total, (a - (total - part)) + (b - part)};
}

/* Return the rounded difference and its rounding error. */
static inline DoubleDouble two_diff(double a, double b) {
    double total = a - b;
    double part = total - a;
    return (DoubleDouble){total, (a - (total - part)) - (b + part)};
}

/* Return the rounded product and its rounding error. */
static inline DoubleDouble two_prod(double a, double b) {
    double product = a * b;
    DoubleDouble x = split_double(a);
    DoubleDouble y = split_double(b);
    double error = ((x.high * y.high - product) + x.high * y.low + x.low * y.high) + x.low * y.low;
    return (DoubleDouble){product, error};
}

/* ---- pairs ---- */

static inline DoubleDouble negate(DoubleDouble a) {
    return (DoubleDouble){-a.high, -a.low};
}

/* Return the rounded sum and its rounding error. The magnitude of `larger` must be at least that of `smaller`. */
static inline DoubleDouble quick_sum(double larger, double smaller) {
    double total = larger + smaller;
    return (DoubleDouble){total, smaller - (total - larger)};
}

/* Return the sum of two pairs, with a relative error of at most 2^-104. */
static inline DoubleDouble pair_sum(DoubleDouble a, DoubleDouble b) {
    DoubleDouble high = two_sum(a.high, b.high);
    DoubleDouble low = two_sum(a.low, b.low);
    high = quick_sum(high.high, high.low + low.high);
    return quick_sum(high.high, high.low + low.low);
}

/* Return the product of two pairs, with a relative error of at most 2^-103. */
static inline DoubleDouble pair_product(DoubleDouble a, DoubleDouble b) {
    DoubleDouble p = two_prod(a.high, b.high);
    return two_sum(p.high, p.low + (a.high * b.low + a.low * b.high));
}

/* Return the product of a pair and a float, with a relative error of at most 2^-104. */
static inline DoubleDouble times_double(DoubleDouble a, double b) {
    DoubleDouble p = two_prod(a.high, b);
    return quick_sum(p.high, p.low + a.low * b);
}

/* Return the product of a pair and `power`, which is a power of two or the negative of a power of two. */
static inline DoubleDouble times_power_of_two(DoubleDouble a, double power) {
    return (DoubleDouble){a.high * power, a.low * power};
}

static inline DoubleDouble pair_quotient(DoubleDouble a, DoubleDouble b) {
    double first = a.high / b.high;
    DoubleDouble product = two_prod(first, b.high);
    return two_sum(first, (((a.high - product.high) - product.low) + (a.low - first * b.low)) / b.high);
}

/* Return the square root of a pair: the root of the pair's high part, and an approximate correction. */
static inline DoubleDouble pair_root(DoubleDouble a) {
    double root = sqrt(a.high);
    DoubleDouble square = two_prod(root, root);
    return (DoubleDouble){root, (((a.high - square.high) - square.low) + a.low) / (2.0 * root)};
}

/* ---- longer sums ---- */

static inline TripleDouble empty_sum(void) {
    return (TripleDouble){0.0, 0.0, 0.0};
}

static inline TripleDouble add_term(TripleDouble total, double term) {
    DoubleDouble high = two_sum(total.high, term);
    DoubleDouble middle = two_sum(total.middle, high.low);
    return (TripleDouble){high.high, middle.high, total.low + middle.low};
}

static inline TripleDouble add_product(TripleDouble total, double a, double b) {
    DoubleDouble p = two_prod(a, b);
    return add_term(add_term(total, p.high), p.low);
}

static inline TripleDouble add_pair_product(TripleDouble total, DoubleDouble p, DoubleDouble q) {
    total = add_product(total, p.high, q.high);
    total = add_product(total, p.high, q.low);
    total = add_product(total, p.low, q.high);
    return add_product(total, p.low, q.low);
}

/* Add the square of a pair to a sum if `sign` is 1, or subtract the square if `sign` is -1. */
static inline TripleDouble add_square(TripleDouble total, DoubleDouble p, double sign) {
    total = add_product(total, p.high, sign * p.high);
    total = add_product(total, 2.0 * p.high, sign * p.low);
    return add_product(total, p.low, sign * p.low);
}

/* Round a sum to a pair. The high part of the pair is the float nearest to the sum. */
static inline DoubleDouble round_sum(TripleDouble total) {
    DoubleDouble top = two_sum(total.high, total.middle);
    return two_sum(top.high, top.low + total.low);
}

/* Write terms whose exact sum is a product of three factors: `sign`, the sum of `p`, and the sum of `q`. The sign is 1
   or -1. Return the number of terms. */
static inline int write_products(double *terms, const double *p, int p_count, const double *q, int q_count,
                                 double sign) {
    int count = 0;
    for (int i = 0; i < p_count; i++) {
        for (int j = 0; j < q_count; j++) {
            DoubleDouble product = two_prod(sign * p[i], q[j]);
            terms[count] = product.high;
            terms[count + 1] = product.low;
            count += 2;
        }
    }
    return count;
}

/* Write 8 terms whose exact sum is the product of two pairs, multiplied by `sign` (1 or -1). Return the number of
   terms. */
static inline int write_pair_products(double *terms, DoubleDouble p, DoubleDouble q, double sign) {
    double a[2] = {p.high, p.low};
    double b[2] = {q.high, q.low};
    return write_products(terms, a, 2, b, 2, sign);
}

/* Write parts that have the same exact sum as the terms. The bits of different parts do not overlap, and the smallest
   part is first. Return the number of parts, which is at most the number of terms. The arrays `parts` and `terms` may
   be the same. */
static inline int write_parts(double *parts, const double *terms, int count) {
    int size = 0;
    for (int i = 0; i < count; i++) {
        DoubleDouble total = {terms[i], 0.0};
        int kept = 0;
        for (int k = 0; k < size; k++) {
            total = two_sum(total.high, parts[k]);
            if (total.low != 0.0) {
                parts[kept] = total.low;
                kept += 1;
            }
        }
        if (total.high != 0.0) {
            parts[kept] = total.high;
            kept += 1;
        }
        size = kept;
    }
    return size;
}

/* Return the sum of at most MOST_TERMS terms. The sign of the result is exact. */
static inline DoubleDouble exact_sum(const double *terms, int count) {
    double parts[MOST_TERMS];
    DoubleDouble sum = {0.0, 0.0};
    for (int k = write_parts(parts, terms, count) - 1; k >= 0; k--) {
        /* the largest parts determine `high`; the others are added to `low` */
        DoubleDouble total = two_sum(sum.high, parts[k]);
        sum = (DoubleDouble){total.high, sum.low + total.low};
    }
    return two_sum(sum.high, sum.low);
}

/* Return the length of a vector of any size, rounded to the nearest float. The length is the root of an error-free sum
   of squares, corrected once. */
static inline double nearest_length(double x, double y) {
    double largest = greater(fabs(x), fabs(y));
    if (!(largest > 0.0 && largest < CAROM_INF))
        return largest;
    int exponent;
    frexp(largest, &exponent);
    x = ldexp(x, -exponent);
    y = ldexp(y, -exponent);
    DoubleDouble xx = two_prod(x, x), yy = two_prod(y, y);
    DoubleDouble sum = two_sum(xx.high, yy.high);
    sum = two_sum(sum.high, sum.low + (xx.low + yy.low));
    DoubleDouble root = pair_root(sum);
    return ldexp(root.high + root.low, exponent);
}

/* ---- instants ---- */

/* An instant is a pair, because a single float would be too coarse to locate a disc after 1e5 bounces. The high part of
   an instant is the float nearest to the instant. So the high parts of two instants are compared first, and then the
   low parts. */
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

/* Return the instant that is `wait` seconds after `begin`. If `wait` is infinite or the sum overflows, return NEVER. */
static inline Instant instant_after(Instant begin, double wait) {
    DoubleDouble sum = two_sum(begin.high, wait);
    return sum.high < CAROM_INF ? two_sum(sum.high, begin.low + sum.low) : NEVER;
}

/* Return the seconds from one instant to another. */
static inline double seconds_between(Instant earlier, Instant later) {
    return (later.high - earlier.high) + (later.low - earlier.low);
}
