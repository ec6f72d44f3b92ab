/* Three forms of a polynomial in time of degree 4 or less: its coefficients are floats, pairs of floats, or exact sums
   of products.

   The polynomial is a gap between two bodies, in m^2 for circles, and t is in seconds. In this folder, "power k" is the
   coefficient of t^k. Power 0 is stored first. The float form is computed first. The functions of a `Gap` compute the
   other forms when they are needed.

   - `Polynomial`: each coefficient has an error of at most CAROM_ERROR times its `size`. The `size` is the sum of the
     magnitudes of its terms.
   - `PairPolynomial`: each coefficient is a pair of floats, with an error of at most CAROM_QUARTIC_PAIR_ERROR times its
     `size`. If the terms of a coefficient nearly cancel, `size` may be smaller than the sum of their magnitudes.
   - `Products`: each coefficient is an exact sum of products of two input numbers. */

#pragma once

#include "carom/core/arithmetic/double_double.h"

enum {
    QUARTIC_POWERS = 5,
    /* largest number of products in one coefficient: two squares of sums of four parts (4 * 4 products each), and one
       square of a sum of two parts (2 * 2 products) */
    MOST_PRODUCTS = 36,
};

typedef struct Polynomial {
    int degree; /* degree of the exact polynomial */
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

/* Coefficient k of the polynomial is the sum of the first `count[k]` products in row k of `products`. */
typedef struct Products {
    /* instant from which the gap counts time: solvers must expand the polynomial in powers of t - from */
    double from;
    bool is_closed; /* whether solvers must replace the constant coefficient by 0 after this expansion */
    int count[QUARTIC_POWERS];
    Product products[QUARTIC_POWERS][MOST_PRODUCTS];
} Products;

/* Functions that compute a polynomial in pairs of floats and as products. */
typedef struct Gap {
    void (*write_pairs)(const void *source, PairPolynomial *p);
    void (*write_products)(const void *source, Products *products);
    const void *source;
} Gap;

/* The caller's function `solve` computes exact results for numbers of any size. `solve` must not be NULL.

   The instants at which the gap closes are numbered from 0. `solve` returns instant number `index`, in seconds after
   `from`, or infinity if the gap closes less often. In Python, `find_closings` of `carom/core/exact_quartic.py`
   computes these instants. For the index QUARTIC_SIGN, `solve` ignores `is_closed` and returns the sign of the
   polynomial at `from`: -1, 0 or 1. */
typedef struct ExactQuartic {
    double (*solve)(void *context, const Products *gap, int index);
    void *context;
} ExactQuartic;

enum { QUARTIC_SIGN = -1 };

/* ---- products ---- */

/* Add `factor` times the sum of `a` times the sum of `b` to a coefficient of the polynomial, as single products.
   `factor` is a power of two or its negative. Products that are 0 are omitted. */
static inline void add_products(Products *products, int power, const double *a, int a_count, const double *b,
                                int b_count, double factor) {
    for (int i = 0; i < a_count; i++) {
        for (int j = 0; j < b_count; j++) {
            if (a[i] != 0.0 && b[j] != 0.0)
                products->products[power][products->count[power]++] = (Product){factor * a[i], b[j]};
        }
    }
}

/* ---- changes ---- */

/* Convert a polynomial in t to a polynomial in t - from. */
static inline void shift_origin(PairPolynomial *p, double from) {
    for (int lowest = 0; lowest < p->degree; lowest++) {
        for (int k = p->degree - 1; k >= lowest; k--) {
            p->power[k] = pair_sum(p->power[k], times_double(p->power[k + 1], from));
            p->size[k] += p->size[k + 1] * from;
        }
    }
}

/* Divide a polynomial by t^count. The lowest `count` coefficients must be 0. */
static inline void drop_powers(PairPolynomial *p, int count) {
    p->degree -= count;
    for (int k = 0; k <= p->degree; k++) {
        p->power[k] = p->power[k + count];
        p->size[k] = p->size[k + count];
    }
}

/* Round the coefficients of a polynomial from pairs to floats. */
static inline Polynomial round_polynomial(const PairPolynomial *p) {
    Polynomial rounded = {.degree = p->degree};
    for (int k = 0; k <= p->degree; k++) {
        rounded.power[k] = p->power[k].high;
        rounded.size[k] = p->size[k];
    }
    return rounded;
}

/* ---- values ---- */

/* A value, and a bound of its error. */
typedef struct PairValue {
    DoubleDouble value;
    double error;
} PairValue;

/* Return the value of a polynomial at an instant t >= 0. */
static inline PairValue value_of_pairs(const PairPolynomial *p, double t) {
    DoubleDouble value = p->power[p->degree];
    double size = p->size[p->degree];
    for (int k = p->degree - 1; k >= 0; k--) {
        value = pair_sum(times_double(value, t), p->power[k]);
        size = size * t + p->size[k];
    }
    return (PairValue){value, 2.0 * CAROM_QUARTIC_PAIR_ERROR * size};
}

typedef struct Derivatives {
    double value;
    double rate;
    double half_bend; /* half of the second derivative */
} Derivatives;

/* Return the value and the derivatives of a polynomial at an instant, in floats. */
static inline Derivatives derivatives_at(const Polynomial *p, double t) {
    Derivatives at = {p->power[p->degree], 0.0, 0.0};
    for (int k = p->degree - 1; k >= 0; k--) {
        at.half_bend = at.half_bend * t + at.rate;
        at.rate = at.rate * t + at.value;
        at.value = at.value * t + p->power[k];
    }
    return at;
}
