/* Falls of a gap between two bodies: the instants at which the gap, a polynomial in time of degree 4 or less, becomes
   negative.

   Roots are found in three stages. Each stage accepts only results that its error bounds prove.

   1. With coefficients in floats, find intervals with one root each. For most gaps that never close, this stage
      proves that there is no root.
   2. With coefficients in pairs of floats, find the intervals that floats cannot find, for example near a graze. Refine
      every root until its nearest float is certain.
   3. Call the caller's exact solver for cases that remain undecided: double roots, and gaps whose terms are too large
      or too small for floats.

   Results are bit-identical to those of the exact solver, `find_falls` in `carom/core/exact_quartic.py`, as
   root_refinement.h explains. A root at which the gap only touches 0 is a graze without overlap, and not a fall. A gap
   that is 0 now and becomes negative has a fall now. A gap that is negative now must become positive before it can
   fall. */

#pragma once

#include "carom/core/quartic/root_isolation.h"
#include "carom/core/quartic/root_refinement.h"

enum {
    MOST_FALLS = 2, /* largest number of falls at t > 0 of a polynomial of degree 4 */
    UNKNOWN_SIGN = 2,
    /* largest number of successive intervals; the error bound of a polynomial in pairs of floats includes a shift of
       its origin for each interval */
    MOST_INTERVALS = 8,
};

/* State of a search for the falls of a gap. `next_fall` returns the falls one by one, in order. */
typedef struct Falls {
    const ExactQuartic *exact;
    const Gap *gap;
    Polynomial floats; /* the gap in floats, divided by the highest possible power of t */
    PairPolynomial pairs;
    int dropped; /* exponent of the power of t by which the gap is divided */
    int start;   /* sign of the gap just after t = 0; 0 if no fall remains, for example if the gap stays 0 */
    bool has_pairs;
    bool falls_now; /* whether the gap is 0 now and becomes negative */
    bool is_closed; /* whether the gap is exactly 0 now, although its rounded coefficients may give another value */
    bool needs_exact;
    bool has_times;
    int index; /* number of the next fall that `next_fall` returns, from 0 */
    int count; /* number of entries in `times` */
    double times[MOST_FALLS];
} Falls;

static inline void need_pairs(Falls *falls) {
    if (!falls->has_pairs) {
        falls->gap->write_pairs(falls->gap->source, &falls->pairs);
        drop_powers(&falls->pairs, falls->dropped);
        falls->has_pairs = true;
    }
}

/* Call the exact solver with the index of a fall, or with QUARTIC_SIGN. */
static CAROM_NOINLINE double solve_exactly(const Falls *falls, int index) {
    Products products;
    products.from = 0.0;
    products.is_closed = falls->is_closed;
    for (int k = 0; k < QUARTIC_POWERS; k++)
        products.count[k] = 0;
    falls->gap->write_products(falls->gap->source, &products);
    return falls->exact->solve(falls->exact->context, &products, index);
}

/* ---- the stages ---- */

/* Return whether all coefficients except that of t^0 certainly have the sign `start` or are 0. If the result is true,
   the polynomial has no root t > 0. `error` is the bound of a coefficient's error divided by its `size`. */
static inline bool keeps_sign(const Polynomial *p, int start, double error) {
    bool keeps = true;
    for (int k = 1; k <= p->degree; k++)
        keeps &= start * p->power[k] - error * p->size[k] >= 0.0;
    return keeps;
}

/* With coefficients in pairs of floats, find one interval for each of the first `most` roots t > 0. Return the number
   of intervals or QUARTIC_UNDECIDED.

   The first interval that is searched is from 0 to `end`. Each further interval begins at the end of the previous one.
   For each interval, the polynomial is converted to count time from the beginning of the interval. */
static inline int isolate_roots_of_pairs(const PairPolynomial *p, int start, double end, int most,
                                         Bracket *brackets) {
    PairPolynomial rest = *p;
    double from = 0.0;
    int found = 0;
    for (int step = 0; step < MOST_INTERVALS; step++) {
        Polynomial floats = round_polynomial(&rest);
        if (keeps_sign(&floats, start, CAROM_QUARTIC_PAIR_ERROR))
            return found;
        double width = step == 0 ? end : time_scale(&floats, start);
        if (!(width >= CAROM_LEAST_SCALE && width <= CAROM_MOST_SCALE && rest.size[0] >= CAROM_LEAST_SIZE))
            return QUARTIC_UNDECIDED;
        int count = isolate_roots_of_part(&rest, start, from, width, most - found, brackets + found);
        if (count == QUARTIC_UNDECIDED)
            return QUARTIC_UNDECIDED;
        found += count;
        if (found == most)
            return found;
        shift_origin(&rest, width);
        if (fabs(rest.power[0].high) <= CAROM_QUARTIC_PAIR_ERROR * rest.size[0])
            return QUARTIC_UNDECIDED;
        start = rest.power[0].high > 0.0 ? 1 : -1;
        from += width;
    }
    return QUARTIC_UNDECIDED;
}

/* Find intervals, each with exactly one root. Floats are used first, and pairs of floats if floats fail. If there is a
   root, `falls->pairs` is set, even if floats were sufficient. */
static inline int isolate_in_stages(Falls *falls, int most, Bracket *brackets) {
    double scale = time_scale(&falls->floats, falls->start), doubt;
    int count = isolate_roots(&falls->floats, falls->start, scale, most, brackets, &doubt);
    if (count == 0)
        return 0;
    need_pairs(falls);
    falls->floats = round_polynomial(&falls->pairs);
    if (count == QUARTIC_UNDECIDED) {
        double end = sharpen_turn(&falls->pairs, &falls->floats, doubt);
        if (!(end >= CAROM_LEAST_SCALE && end <= CAROM_MOST_SCALE))
            end = time_scale(&falls->floats, falls->start);
        count = isolate_roots_of_pairs(&falls->pairs, falls->start, end, most, brackets);
    }
    return count;
}

/* Find the first fall of a gap that is positive at t = 0. Return the fall's time, infinity if there is no fall, or
   CAROM_UNCERTAIN if the first two stages do not decide. */
static inline double find_first_fall(Falls *falls) {
    Bracket bracket;
    QuarticRoot root;
    double time;
    int found = isolate_in_stages(falls, 1, &bracket);
    if (found <= 0)
        return found == 0 ? CAROM_INF : CAROM_UNCERTAIN;
    if (!refine_quartic_root(&falls->pairs, &falls->floats, &bracket, &root) || !round_quartic_root(&root, &time) ||
        !is_grid_clear(&falls->pairs, &falls->floats, &root))
        return CAROM_UNCERTAIN;
    return time;
}

/* Find all falls at t > 0. Return the number of falls, or QUARTIC_UNDECIDED if the first two stages do not decide. */
static inline int find_all_falls(Falls *falls, double *times) {
    Bracket brackets[QUARTIC_POWERS];
    QuarticRoot roots[QUARTIC_POWERS];
    int count = isolate_in_stages(falls, QUARTIC_POWERS, brackets);
    if (count == 1 && !brackets[0].is_fall)
        return 0;
    for (int i = 0; i < count; i++) {
        if (!refine_quartic_root(&falls->pairs, &falls->floats, &brackets[i], &roots[i]))
            return QUARTIC_UNDECIDED;
    }
    if (count <= 0)
        return count;
    return round_falls(roots, count, times);
}

/* ---- falls in their order ---- */

/* Return the exact sign of coefficient k, from an exact sum of products. If a product exceeds the range of floats, or
   if the gap does not count time from now, return UNKNOWN_SIGN. */
static CAROM_NOINLINE int exact_sign_of_power(const Falls *falls, int k) {
    Products products = {.from = 0.0};
    double terms[2 * MOST_PRODUCTS];
    falls->gap->write_products(falls->gap->source, &products);
    if (products.from != 0.0)
        return UNKNOWN_SIGN;
    for (int i = 0; i < products.count[k]; i++) {
        DoubleDouble product = two_prod(products.products[k][i].a, products.products[k][i].b);
        if (!(fabs(product.high) >= CAROM_NEGLIGIBLE && fabs(product.high) <= 1.0 / CAROM_NEGLIGIBLE))
            return UNKNOWN_SIGN;
        terms[2 * i] = product.high;
        terms[2 * i + 1] = product.low;
    }
    double sum = exact_sum(terms, 2 * products.count[k]).high;
    return (sum > 0.0) - (sum < 0.0);
}

/* Return the exact sign of coefficient k, or UNKNOWN_SIGN. */
static inline int sign_of_power(Falls *falls, int k) {
    double value = falls->floats.power[k], size = falls->floats.size[k];
    if (size >= CAROM_LEAST_SIZE && fabs(value) > CAROM_ERROR * size)
        return value > 0.0 ? 1 : -1;
    need_pairs(falls);
    value = falls->pairs.power[k].high;
    size = falls->pairs.size[k];
    if (size >= CAROM_LEAST_SIZE && fabs(value) > CAROM_QUARTIC_PAIR_ERROR * size)
        return value > 0.0 ? 1 : -1;
    return exact_sign_of_power(falls, k);
}

/* Return the exact sign of a gap now. */
static inline int sign_of_gap(Falls *falls) {
    int sign = sign_of_power(falls, 0);
    return sign == UNKNOWN_SIGN ? (int)solve_exactly(falls, QUARTIC_SIGN) : sign;
}

/* Prepare a search for the falls of a gap. After this call, the caller must set `falls->floats`, or both
   `falls->floats` and `falls->pairs`. */
static inline void begin_falls(Falls *falls, const ExactQuartic *exact, const Gap *gap) {
    falls->exact = exact;
    falls->gap = gap;
    falls->dropped = falls->index = 0;
    falls->has_pairs = falls->falls_now = falls->is_closed = falls->has_times = false;
}

/* Set the sign of the gap just after t = 0. `sign_now` is the sign of the gap at t = 0. */
static inline void set_start(Falls *falls, int sign_now) {
    Polynomial *p = &falls->floats;
    int first = 0;
    falls->start = sign_now;
    while (falls->start == 0 && first < p->degree)
        falls->start = sign_of_power(falls, ++first);
    if (first > 0) {
        falls->dropped = first;
        falls->falls_now = falls->start == -1;
        p->degree -= first;
        for (int k = 0; k <= p->degree; k++) {
            p->power[k] = p->power[k + first];
            p->size[k] = p->size[k + first];
        }
        if (falls->has_pairs)
            drop_powers(&falls->pairs, first);
    }
    bool is_in_range = p->size[0] >= CAROM_LEAST_SIZE && fabs(p->power[p->degree]) >= CAROM_NEGLIGIBLE;
    falls->needs_exact = falls->start == UNKNOWN_SIGN || (falls->start != 0 && !is_in_range);
}

/* Return the seconds until the next fall; infinity for none. */
static inline double next_fall(Falls *falls) {
    int index = falls->index++;
    if (falls->start == 0)
        return CAROM_INF;
    if (falls->needs_exact)
        return solve_exactly(falls, index);
    if (falls->falls_now && index == 0)
        return 0.0;
    const int number = index - falls->falls_now;
    /* the gap alternately becomes negative and positive */
    const int most = (falls->floats.degree + (falls->start > 0)) / 2;
    if (number >= most || keeps_sign(&falls->floats, falls->start, CAROM_ERROR))
        return CAROM_INF;
    if (falls->start > 0 && index == 0) {
        double time = find_first_fall(falls);
        falls->needs_exact = time == CAROM_UNCERTAIN;
        falls->start = time == CAROM_INF ? 0 : falls->start;
        return falls->needs_exact ? solve_exactly(falls, index) : time;
    }
    if (!falls->has_times) {
        falls->count = find_all_falls(falls, falls->times);
        falls->has_times = true;
        falls->needs_exact = falls->count == QUARTIC_UNDECIDED;
        if (falls->needs_exact)
            return solve_exactly(falls, index);
    }
    return number < falls->count ? falls->times[number] : CAROM_INF;
}
