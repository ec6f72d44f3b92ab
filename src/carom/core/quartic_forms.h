/* Three forms of a polynomial in time of degree 4 or less: in floats, in pairs, and exact; each with its error bound.

   The polynomial is a gap between two bodies, in m^2, and t is in seconds. Powers are listed lowest first. The float
   form is computed first. The other two are written on demand, by the functions of a `Gap`:

   - `Polynomial`: each power has an error of at most QUARTIC_ERROR times its `size`, the sum of the magnitudes of the
     terms that it is a sum of.
   - `PairPolynomial`: the same in double-double, with QUARTIC_PAIR_ERROR.
   - `Products`: the input numbers, such that each power is exactly a sum of products of two of them. */

#ifndef CAROM_QUARTIC_FORMS_H
#define CAROM_QUARTIC_FORMS_H

#include <math.h>
#include <stdbool.h>

#include "carom/core/double_double.h"

enum {
    QUARTIC_POWERS = 5,
    MOST_PRODUCTS = 36, /* of one power: the squares of two sums of four parts and of one of two */
};

/* 8 roundings: those of the terms of a power, of their sum and of `size` together are at most 8. */
#define QUARTIC_ERROR 0x1p-50
/* The same for pairs: 2^-106 for each of at most 40 operations, each of which has an error of at most 3 times that. */
#define QUARTIC_PAIR_ERROR 0x1p-98

typedef struct Polynomial {
    int degree; /* exact: this power is not 0, and all above are */
    double power[QUARTIC_POWERS];
    double size[QUARTIC_POWERS];
} Polynomial;

typedef struct PairPolynomial {
    int degree;
    DoubleDouble power[QUARTIC_POWERS];
    double size[QUARTIC_POWERS];
} PairPolynomial;

typedef struct Product {
    double a;
    double b;
} Product;

/* Power k of the polynomial is the sum of the first `count[k]` products of row k. The gap asked for is

       the polynomial in (t - from), and if `is_closed`, its value at `from` is then replaced by 0. */
typedef struct Products {
    double from;
    bool is_closed;
    int count[QUARTIC_POWERS];
    Product products[QUARTIC_POWERS][MOST_PRODUCTS];
} Products;

/* Source of the other two forms of a polynomial. */
typedef struct Gap {
    void (*write_pairs)(const void *source, PairPolynomial *p);
    void (*write_products)(const void *source, Products *products);
    const void *source;
} Gap;

/* Solver of what pairs leave undecided: the caller's, exact for numbers of any size. Must not be NULL.

   Returns the instant number `index`, counted from 0, at which the gap closes, in seconds after `from`; infinity if
   there are no more. These are the instants of `find_closings` in `carom/physics/exact_quartic.py`. With index
   QUARTIC_SIGN it returns the sign of the gap at `from` instead: -1, 0 or 1. */
typedef struct ExactQuartic {
    double (*solve)(void *context, const Products *gap, int index);
    void *context;
} ExactQuartic;

enum { QUARTIC_SIGN = -1 };

/* ---- products ---- */

/* Add the product of two sums times a power of two, which may be negative, to a power. Zeros are left out. */
static inline void add_products(Products *products, int power, const double *a, int a_count, const double *b,
                                int b_count, double factor) {
    for (int i = 0; i < a_count; i++) {
        for (int j = 0; j < b_count; j++) {
            if (a[i] != 0.0 && b[j] != 0.0)
                products->products[power][products->count[power]++] = (Product){factor * a[i], b[j]};
        }
    }
}

/* ---- pairs ---- */

/* Return a sum whose high part is at least as large as the low one in magnitude. */
static inline DoubleDouble quick_sum(double large, double small) {
    double total = large + small;
    return (DoubleDouble){total, small - (total - large)};
}

/* Return the sum of two pairs, with a relative error of at most 2^-104. */
static inline DoubleDouble sum_pairs(DoubleDouble a, DoubleDouble b) {
    DoubleDouble high = two_sum(a.high, b.high);
    DoubleDouble low = two_sum(a.low, b.low);
    high = quick_sum(high.high, high.low + low.high);
    return quick_sum(high.high, high.low + low.low);
}

/* Return the product of a pair and a float, with a relative error of at most 2^-104. */
static inline DoubleDouble times_double(DoubleDouble a, double b) {
    DoubleDouble p = two_prod(a.high, b);
    return quick_sum(p.high, p.low + a.low * b);
}

static inline DoubleDouble times_power_of_two(DoubleDouble a, double power) {
    return (DoubleDouble){a.high * power, a.low * power};
}

/* Return the polynomial in the time from an instant on. */
static inline void shift_origin(PairPolynomial *p, double from) {
    for (int lowest = 0; lowest < p->degree; lowest++) {
        for (int k = p->degree - 1; k >= lowest; k--) {
            p->power[k] = sum_pairs(p->power[k], times_double(p->power[k + 1], from));
            p->size[k] += p->size[k + 1] * from;
        }
    }
}

/* Divide a polynomial whose lowest powers are 0 by as many powers of t. */
static inline void drop_powers(PairPolynomial *p, int count) {
    p->degree -= count;
    for (int k = 0; k <= p->degree; k++) {
        p->power[k] = p->power[k + count];
        p->size[k] = p->size[k + count];
    }
}

/* Return the float form of a polynomial of pairs. */
static inline Polynomial round_polynomial(const PairPolynomial *p) {
    Polynomial rounded = {.degree = p->degree};
    for (int k = 0; k <= p->degree; k++) {
        rounded.power[k] = p->power[k].high;
        rounded.size[k] = p->size[k];
    }
    return rounded;
}

/* ---- values ---- */

/* A value, and a bound on its error. */
typedef struct PairValue {
    DoubleDouble value;
    double error;
} PairValue;

/* Return the value of a polynomial at an instant t >= 0. */
static inline PairValue value_of_pairs(const PairPolynomial *p, double t) {
    DoubleDouble value = p->power[p->degree];
    double size = p->size[p->degree];
    for (int k = p->degree - 1; k >= 0; k--) {
        value = sum_pairs(times_double(value, t), p->power[k]);
        size = size * t + p->size[k];
    }
    return (PairValue){value, 2.0 * QUARTIC_PAIR_ERROR * size};
}

/* Return the value of the float form at an instant t >= 0. */
static inline double value_of_floats(const Polynomial *p, double t) {
    double value = p->power[p->degree];
    for (int k = p->degree - 1; k >= 0; k--)
        value = value * t + p->power[k];
    return value;
}

typedef struct Derivatives {
    double value;
    double rate;
    double half_bend; /* half of the second derivative */
} Derivatives;

/* Return value and derivatives of the float form at an instant. */
static inline Derivatives derivatives_at(const Polynomial *p, double t) {
    Derivatives at = {p->power[p->degree], 0.0, 0.0};
    for (int k = p->degree - 1; k >= 0; k--) {
        at.half_bend = at.half_bend * t + at.rate;
        at.rate = at.rate * t + at.value;
        at.value = at.value * t + p->power[k];
    }
    return at;
}

#endif
