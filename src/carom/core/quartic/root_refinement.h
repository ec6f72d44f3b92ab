/* Refinement and rounding of a root of a polynomial of degree 4 or less. The root is the only one in a known interval,
   its bracket. The root is refined to twice the precision of floats.

   First the root is approximated in floats. Then the polynomial is evaluated in pairs of floats, so that the correction
   by Newton's method has a relative error of about 2^-45. Bounds of the derivatives near the root give a bound of the
   error of the root. */

#pragma once

#include "carom/core/quartic/root_isolation.h"

enum {
    MOST_FLOAT_STEPS = 12,
    MOST_PAIR_STEPS = 64,
};

/* A root, `time` + `rest`, with an error of at most `error`. */
typedef struct QuarticRoot {
    double time;
    double rest;
    double error;
    double end; /* end of the bracket */
    bool is_fall;
} QuarticRoot;

/* Return an approximation of the root in a bracket, by Halley's method. If a step leaves the bracket, the bracket is
   halved instead. */
static inline double approximate_root(const Polynomial *p, const Bracket *bracket) {
    double begin = bracket->begin, end = bracket->end;
    Derivatives first = derivatives_at(p, begin), last = derivatives_at(p, end);
    /* The first approximation is the root of a parabola, which has the same value and derivatives as the polynomial at
       one end of the bracket. */
    bool is_last = fabs(last.value) < fabs(first.value);
    Derivatives at = is_last ? last : first;
    double root = sqrt(greater(at.rate * at.rate - 4.0 * at.value * at.half_bend, 0.0));
    double t = (is_last ? end : begin) - 2.0 * at.value / (at.rate + (bracket->is_fall ? -root : root));
    for (int step = 0; step < MOST_FLOAT_STEPS; step++) {
        if (!(t > begin && t < end))
            t = 0.5 * (begin + end);
        at = derivatives_at(p, t);
        if ((at.value > 0.0) == bracket->is_fall)
            begin = t;
        else
            end = t;
        double change = at.value * at.rate / (at.rate * at.rate - at.value * at.half_bend);
        t -= change;
        if (fabs(change) <= 0x1p-12 * t)
            break;
    }
    return t;
}

/* Find the root in a bracket as accurately as pairs of floats allow. Return whether a bound of the root's error was
   found. `floats` must be `p`, rounded to floats. */
static inline bool refine_quartic_root(const PairPolynomial *p, const Polynomial *floats, const Bracket *bracket,
                                       QuarticRoot *root) {
    const int n = p->degree;
    /* The ends of a bracket are rounded instants. So a root very near to an end may be the root of a neighbouring
       bracket. */
    const double least = bracket->begin * (1.0 + 0x1p-48), most = bracket->end * (1.0 - 0x1p-48);
    double begin = bracket->begin, end = bracket->end;
    double t = approximate_root(floats, bracket);
    bool is_found = false;
    for (int step = 0; step < MOST_PAIR_STEPS; step++) {
        if (!(t > begin && t < end))
            t = 0.5 * (begin + end);
        PairValue at = value_of_pairs(p, t);
        /* `rate` is the first derivative, and `rate_error` a bound of its error. `bend` is a bound of the second
           derivative between t and t + t / 2^7. */
        double rate = 0.0, size = 0.0, bend = 0.0, later = t * (1.0 + 0x1p-7);
        for (int k = n; k >= 1; k--) {
            rate = rate * t + k * p->power[k].high;
            size = size * t + k * p->size[k];
            bend = k > 1 ? bend * later + (k * (k - 1)) * (fabs(p->power[k].high) + p->size[k] * 0x1p-90) : bend;
        }
        double rate_error = 0x1p-49 * size;
        double slope = fabs(rate);
        double change = -at.value.high / rate;
        double reach = 4.0 * (fabs(change) + at.error / slope);
        /* Within `reach` of t, the derivative changes by less than a quarter. So exactly one root is between t - reach
           and t + reach. */
        double doubt = rate_error + bend * reach;
        if (doubt <= 0.25 * slope && reach <= 0x1p-8 * t && t - reach > least && t + reach < most) {
            double part = doubt / slope + 0x1p-50;
            double error = 1.5 * (at.error / slope + fabs(change) * part);
            *root = (QuarticRoot){t, change, error, bracket->end, bracket->is_fall};
            is_found = true;
            if (error <= 0x1p-64 * t)
                return true;
        }
        if (fabs(at.value.high) <= at.error)
            return is_found;
        if ((at.value.high > 0.0) == bracket->is_fall)
            begin = t;
        else
            end = t;
        double next = t + change;
        if (next == t)
            return is_found;
        t = next;
    }
    return is_found;
}

/* Write the float nearest to a root. Return whether the root's error bound proves that this float is the nearest. */
static inline bool round_quartic_root(const QuarticRoot *root, double *time) {
    DoubleDouble sum = two_sum(root->time, root->rest);
    double error = root->error + 0x1p-50 * fabs(sum.low);
    *time = sum.high;
    return sum.high + (sum.low + error) == sum.high && sum.high + (sum.low - error) == sum.high;
}

/* ---- the rounding of the exact solver ---- */

/* The exact solver isolates all roots t > 0 in intervals whose ends are binary fractions. The solver begins with (0, 1]
   and doubles the end until the interval contains the next root. Then the solver halves the interval until it contains
   no other root. The result of these halvings is the isolating interval. Further halvings, until the ends agree to 55
   bits, give the result: the rounded middle. For the first root, the result is the nearest float. The search for a
   later root begins at the end of the previous isolating interval, so the result may be a neighbour of the nearest
   float. The functions below find the same result from roots that are known to twice the precision of floats. */

/* Return -1 if a root is certainly before an instant, 1 if it is certainly after the instant, and 0 if neither is
   certain. */
static inline int compare_root(const QuarticRoot *root, double t) {
    double away = root->time - t;
    double difference = away + root->rest;
    double bound = root->error + 0x1p-50 * (fabs(away) + fabs(root->rest));
    return difference > bound ? 1 : difference < -bound ? -1 : 0;
}

/* Halve an interval around a root as the exact solver does, and write the rounded middle of the last part. Return
   whether the bound of the root's error proves the result. */
static inline bool round_by_halving(double low, double high, const QuarticRoot *root, double *time) {
    DoubleDouble width = two_diff(high, low);
    int halvings;
    /* Halving stops when 2^55 times the width is at most the end of the interval. */
    double ratio = frexp(width.high * 0x1p55 / root->time, &halvings);
    if (width.low != 0.0 || fabs(ratio - 0.5) < 0x1p-40 || ratio > 1.0 - 0x1p-40)
        return false;
    halvings = halvings < 0 ? 0 : halvings;
    double part = ldexp(width.high, -halvings);
    /* The distance of the middle from the root is at most half of `part`. */
    QuarticRoot blurred = *root;
    blurred.error += 0.5000001 * part;
    if (round_quartic_root(&blurred, time))
        return true;
    DoubleDouble offset = two_diff(root->time, low);
    offset = two_sum(offset.high, offset.low + root->rest);
    double first = offset.high / part;
    if (!(first >= 0.0 && first < 0x1p60))
        return false;
    int64_t index = (int64_t)first;
    DoubleDouble product = two_prod((double)index, part);
    double over = ((offset.high - product.high) - product.low + offset.low) / part;
    double floor_over = (double)(int64_t)over;
    floor_over -= floor_over > over;
    double inside = over - floor_over;
    double doubt = 2.0 * root->error / part + 0x1p-20;
    if (!(inside > doubt && inside < 1.0 - doubt))
        return false;
    /* The middle is low + (2 index + 1) part / 2. The terms below are exact. */
    int64_t odd = 2 * (index + (int64_t)floor_over) + 1;
    double odd_high = (double)(odd & ~(int64_t)0x3ffffff), odd_low = (double)(odd & 0x3ffffff);
    DoubleDouble high_product = two_prod(odd_high, 0.5 * part), low_product = two_prod(odd_low, 0.5 * part);
    double terms[5] = {low, high_product.high, high_product.low, low_product.high, low_product.low};
    *time = exact_sum(terms, 5).high;
    return true;
}

/* Write the times of the falls among the roots (roots at which the polynomial becomes negative), rounded as the exact
   solver rounds them. All given roots must be above 0. Return the number of falls or QUARTIC_UNDECIDED. */
static inline int round_falls(const QuarticRoot *roots, int count, double *times) {
    double low = 0.0, high = 1.0;
    int falls = 0;
    for (int i = 0; i < count; i++) {
        while (compare_root(&roots[i], high) > 0)
            high *= 2.0;
        for (;;) {
            for (int j = i; j < count; j++) {
                if (compare_root(&roots[j], high) == 0)
                    return QUARTIC_UNDECIDED;
            }
            if (i + 1 == count || compare_root(&roots[i + 1], high) > 0)
                break;
            DoubleDouble sum = two_sum(low, high);
            double middle = 0.5 * sum.high;
            if (sum.low != 0.0 || compare_root(&roots[i], middle) == 0)
                return QUARTIC_UNDECIDED;
            if (compare_root(&roots[i], middle) < 0)
                high = middle;
            else
                low = middle;
        }
        if (roots[i].is_fall && !round_by_halving(low, high, &roots[i], &times[falls++]))
            return QUARTIC_UNDECIDED;
        low = high;
        high = 2.0 * high;
    }
    return falls;
}

/* Return whether a polynomial is certainly not 0 at an instant. */
static inline bool is_certainly_nonzero(const PairPolynomial *p, const Polynomial *floats, double t) {
    double size = p->size[p->degree];
    for (int k = p->degree - 1; k >= 0; k--)
        size = size * t + p->size[k];
    if (fabs(derivatives_at(floats, t).value) > 4.0 * CAROM_ERROR * size)
        return true;
    PairValue at = value_of_pairs(p, t);
    return fabs(at.value.high) > at.error;
}

/* Return whether the exact solver isolates the first root with intervals whose ends are no roots. The exact solver
   treats an end that is a root differently. */
static inline bool is_grid_clear(const PairPolynomial *p, const Polynomial *floats, const QuarticRoot *first) {
    double low = 0.0, high = 1.0;
    while (compare_root(first, high) >= 0)
        high *= 2.0;
    bool is_new = true;
    while (high > first->end) {
        if (is_new && !is_certainly_nonzero(p, floats, high))
            return false;
        double middle = 0.5 * (low + high);
        int order = compare_root(first, middle);
        if (order == 0) /* the root is so near to `middle` that it is rounded to `middle` */
            return true;
        is_new = order < 0;
        if (is_new)
            high = middle;
        else
            low = middle;
    }
    return true;
}
