/* Scales of time of a polynomial of degree 4 or less: where to halve intervals first.

   These are approximations. Nothing that is decided depends on them, only the work that it takes. */

#pragma once

#include <math.h>

#include "carom/core/double_double.h"
#include "carom/core/quartic_forms.h"

enum {
    TURN_STEPS = 2,
    SHARPEN_STEPS = 4,
};

static inline double approximate_cube_root(double a) {
    double root = sqrt(sqrt(a)); /* a^(1/4 + 1/16 + 1/64) */
    double next = sqrt(sqrt(root));
    return root * next * sqrt(sqrt(next));
}

/* Return about the largest root t > 0 of the derivative, or 0 for none. */
static inline double last_turn(const Polynomial *p) {
    const int n = p->degree;
    if (n < 2)
        return 0.0;
    double inverse = 1.0 / (n * p->power[n]);
    double c[QUARTIC_POWERS - 1]; /* of the derivative, whose highest power is 1 */
    for (int k = 0; k < n - 1; k++)
        c[k] = (k + 1) * p->power[k + 1] * inverse;
    if (n == 2)
        return c[0] < 0.0 ? -c[0] : 0.0;
    double t;
    if (n == 3) {
        double d = 0.25 * c[1] * c[1] - c[0];
        return d > 0.0 ? sqrt(d) - 0.5 * c[1] : 0.0;
    }
    if (c[0] < 0.0 && c[1] > 0.0) {
        t = -c[0] / c[1];
    } else {
        t = greater(-c[2], sqrt(greater(-c[1], 0.0)));
        if (c[0] < 0.0)
            t = greater(t, approximate_cube_root(-c[0]));
    }
    for (int step = 0; step < TURN_STEPS && t > 0.0; step++) {
        double value = ((t + c[2]) * t + c[1]) * t + c[0];
        double rate = (3.0 * t + 2.0 * c[2]) * t + c[1];
        double next = t - value / rate;
        t = next > 0.25 * t && next < 4.0 * t ? next : value > 0.0 ? 0.5 * t : 2.0 * t;
    }
    return t;
}

/* Return about the first instant at which another power has the magnitude of power 0; infinity for none. */
static inline double first_balance(const Polynomial *p) {
    double largest = 0.0; /* of the inverse */
    for (int k = 1; k <= p->degree; k++) {
        double part = fabs(p->power[k] / p->power[0]);
        part = k == 1 ? part : k == 3 ? approximate_cube_root(part) : sqrt(k == 4 ? sqrt(part) : part);
        largest = greater(largest, part);
    }
    return 1.0 / largest;
}

/* Return about the last instant at which a power of the other sign has the magnitude of the highest one; 0 for none. */
static inline double last_balance(const Polynomial *p) {
    double largest = 0.0;
    for (int k = 0; k < p->degree; k++) {
        int degree = p->degree - k;
        double part = greater(-p->power[k] / p->power[p->degree], 0.0);
        part = degree == 1 ? part : degree == 3 ? approximate_cube_root(part) : sqrt(degree == 4 ? sqrt(part) : part);
        largest = greater(largest, part);
    }
    return largest;
}

/* Return the root of the derivative near an instant, to the last place, or the instant itself if there is none. */
static inline double sharpen_turn(const PairPolynomial *p, const Polynomial *floats, double near_turn) {
    const int n = p->degree;
    double t = near_turn;
    for (int step = 0; step < SHARPEN_STEPS; step++) {
        DoubleDouble rate = times_double(p->power[n], n);
        for (int k = n - 1; k >= 1; k--)
            rate = sum_pairs(times_double(rate, t), times_double(p->power[k], k));
        double change = rate.high / (2.0 * derivatives_at(floats, t).half_bend);
        if (!(fabs(change) <= 0.25 * near_turn))
            return near_turn;
        t -= change;
        if (fabs(change) <= 0x1p-30 * t)
            break;
    }
    return t;
}

/* Return about the instant that separates the roots best: of a gap that opens again, when it is least. */
static inline double time_scale(const Polynomial *p, int start) {
    double turn = (p->power[p->degree] > 0.0) == (start > 0) ? last_turn(p) : 0.0;
    if (!(turn > 0.0))
        return 1.5 * last_balance(p);
    if (fabs(p->power[1]) * turn < 0x1p-6 * fabs(p->power[0]))
        return greater(turn, first_balance(p)); /* before that, no power matters */
    return turn;
}
