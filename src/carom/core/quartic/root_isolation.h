/* Isolation of roots of a polynomial of degree 4 or less: finds intervals, called brackets, each of which provably
   contains exactly one root t > 0.

   The half line t >= 0 is mapped to 0 <= s <= 1 by t = c s / (1 - s), so that s = 1/2 is the instant c. The polynomial,
   of degree n, is multiplied by (1 - s)^n. The result is a polynomial in s with Bernstein coefficients b. By Descartes'
   rule, the polynomial has no root in the interval if all b have one sign, and exactly one root if the signs of b
   change once. In other cases, the interval is halved by de Casteljau's algorithm, which computes means of neighbouring
   coefficients. The sign of a coefficient is certain only if its magnitude exceeds its error bound. If an uncertain
   sign prevents a decision, the result is QUARTIC_UNDECIDED. The result is correct for any c. If c is near a minimum of
   the polynomial, few halvings are needed. The search in pairs of floats uses a series of finite intervals instead of
   the half line (falls.h). So this search also succeeds for roots that differ by many orders of magnitude.

   Source: R. T. Farouki, "The Bernstein polynomial basis: a centennial retrospective", Comput. Aided Geom. Des. 29
   (2012), sections 4.3 and 5.2. */

#pragma once

#include "carom/core/quartic/polynomial.h"

enum {
    QUARTIC_UNDECIDED = -1,
    /* largest number of halvings for one polynomial; CAROM_BERNSTEIN_ERROR includes the errors of this many halvings */
    MOST_HALVINGS = 52,
    MOST_PAIR_HALVINGS = 120,
    MOST_WAITING = MOST_HALVINGS / 2, /* largest number of intervals on the stack of intervals to be searched */
    MOST_PAIRS_WAITING = MOST_PAIR_HALVINGS / 2,
};

/* An interval that contains exactly one root. */
typedef struct Bracket {
    double begin;
    double end;
    bool is_fall; /* whether the polynomial becomes negative at the root */
} Bracket;

/* BINOMIAL_RATIO[n][k][j] is choose(k, j) / choose(n, j). */
static const double BINOMIAL_RATIO[QUARTIC_POWERS][QUARTIC_POWERS][QUARTIC_POWERS] = {
    {{1.0}},
    {{1.0}, {1.0, 1.0}},
    {{1.0}, {1.0, 0.5}, {1.0, 1.0, 1.0}},
    {{1.0}, {1.0, 1.0 / 3.0}, {1.0, 2.0 / 3.0, 1.0 / 3.0}, {1.0, 1.0, 1.0, 1.0}},
    {{1.0}, {1.0, 0.25}, {1.0, 0.5, 1.0 / 6.0}, {1.0, 0.75, 0.5, 0.25}, {1.0, 1.0, 1.0, 1.0, 1.0}},
};

/* Return the instant t that corresponds to s. */
static inline double instant_of(double scale, double s) {
    return s < 1.0 ? scale * s / (1.0 - s) : CAROM_INF;
}

typedef enum SignChanges {
    NO_CHANGE,
    ONE_CHANGE,
    SEVERAL_CHANGES, /* several changes, or an unknown number because signs are uncertain */
} SignChanges;

/* Return how many times the sign changes along the Bernstein coefficients b of an interval, whose errors are at most
   `error`. `first` and `last` are the signs of the first and the last coefficient, or 0 if they are not known. */
static CAROM_ALWAYS_INLINE SignChanges count_sign_changes(const double *b, int degree, double error, int first,
                                                          int last) {
    const unsigned all = (2u << degree) - 1u;
    /* bit k of `positive` or `negative` is set if coefficient k certainly has this sign */
    unsigned positive = 0, negative = 0;
    for (int k = 0; k <= degree; k++) {
        positive |= (unsigned)(b[k] > error) << k;
        negative |= (unsigned)(b[k] < -error) << k;
    }
    positive |= (unsigned)(first > 0) | ((unsigned)(last > 0) << degree);
    negative |= (unsigned)(first < 0) | ((unsigned)(last < 0) << degree);
    if (positive == all || negative == all)
        return NO_CHANGE;
    /* There is exactly one change if the first coefficients have one sign, and the rest have the other sign. One
       coefficient at the change may be uncertain, because either of its signs leaves one change. */
    unsigned low = positive & 1u ? positive : negative, not_high = all & ~(positive & 1u ? negative : positive);
    bool is_one = (low & (low + 1u)) == 0u && (not_high == low || not_high == 2u * low + 1u) && low != 0u;
    return is_one && not_high != all ? ONE_CHANGE : SEVERAL_CHANGES;
}

/* ---- in floats ---- */

typedef struct BernsteinPiece {
    double b[QUARTIC_POWERS];
    double begin; /* start and end of the interval, as values of s */
    double end;
} BernsteinPiece;

/* Write the Bernstein coefficients of the whole interval 0 <= s <= 1. Each coefficient is a sum of terms. Return the
   largest sum of the magnitudes of a coefficient's terms. Error bounds are relative to the returned sum. */
static CAROM_ALWAYS_INLINE double write_bernstein(const Polynomial *p, const int n, double scale, double *b) {
    double power = 1.0, largest = 0.0;
    for (int k = 0; k <= n; k++) {
        b[k] = p->power[k] * power * BINOMIAL_RATIO[n][k][k];
        largest = greater(largest, p->size[k] * power * BINOMIAL_RATIO[n][k][k]);
        power *= scale;
    }
    return largest;
}

/* Halve an interval. `piece` becomes its first half. */
static CAROM_ALWAYS_INLINE void halve_piece(BernsteinPiece *piece, BernsteinPiece *second, const int degree) {
    double first[QUARTIC_POWERS];
    first[0] = piece->b[0];
    for (int round = 1; round <= degree; round++) {
        for (int k = 0; k <= degree - round; k++)
            piece->b[k] = 0.5 * (piece->b[k] + piece->b[k + 1]);
        first[round] = piece->b[0];
    }
    for (int k = 0; k <= degree; k++) {
        second->b[k] = piece->b[k];
        piece->b[k] = first[k];
    }
    second->end = piece->end;
    second->begin = piece->end = 0.5 * (piece->begin + piece->end);
}

/* Return the result of `isolate_roots` for a polynomial of degree n. */
static CAROM_ALWAYS_INLINE int isolate_roots_of_degree(const Polynomial *p, const int n, int start, double scale,
                                                       int most, Bracket *brackets, double *doubt) {
    *doubt = scale;
    if (!(scale >= CAROM_LEAST_SCALE && scale <= CAROM_MOST_SCALE && p->size[0] >= CAROM_LEAST_SIZE))
        return QUARTIC_UNDECIDED;
    BernsteinPiece piece = {.begin = 0.0, .end = 1.0}, rest[MOST_WAITING];
    double error = CAROM_BERNSTEIN_ERROR * write_bernstein(p, n, scale, piece.b);
    if (!(error < CAROM_INF))
        return QUARTIC_UNDECIDED;
    const int last = p->power[n] > 0.0 ? 1 : -1;
    int rest_count = 0, found = 0;
    for (int halvings = 0; halvings <= MOST_HALVINGS;) {
        const int first_sign = piece.begin == 0.0 ? start : piece.b[0] > 0.0 ? 1 : -1;
        SignChanges changes = count_sign_changes(piece.b, n, error, first_sign, piece.end == 1.0 ? last : 0);
        if (changes == SEVERAL_CHANGES || (changes == ONE_CHANGE && piece.end == 1.0)) {
            if (rest_count == MOST_WAITING || halvings == MOST_HALVINGS)
                break;
            halve_piece(&piece, &rest[rest_count], n);
            if (fabs(piece.b[n]) <= error)
                break;
            rest_count += 1;
            halvings += 1;
            continue;
        }
        if (changes == ONE_CHANGE) {
            brackets[found] = (Bracket){instant_of(scale, piece.begin), instant_of(scale, piece.end), first_sign > 0};
            found += 1;
        }
        if (found == most || rest_count == 0)
            return found;
        piece = rest[--rest_count];
    }
    *doubt = instant_of(scale, piece.end < 1.0 ? piece.end : 0.5 * (piece.begin + piece.end));
    return QUARTIC_UNDECIDED;
}

/* Find brackets of the first `most` roots t > 0, in ascending order. Return the number of brackets or
   QUARTIC_UNDECIDED.

   `start` is the exact sign of the polynomial at 0, and `scale` is the instant c of the comment at the top of this
   file. If an uncertain sign prevents a result, `doubt` is set to about the instant at which the polynomial is nearly
   0. */
static inline int isolate_roots(const Polynomial *p, int start, double scale, int most, Bracket *brackets,
                                double *doubt) {
    if (p->degree == 4) /* the constant 4 lets the compiler unroll all loops */
        return isolate_roots_of_degree(p, 4, start, scale, most, brackets, doubt);
    return isolate_roots_of_degree(p, p->degree, start, scale, most, brackets, doubt);
}

/* ---- in pairs ---- */

typedef struct BernsteinPairPiece {
    DoubleDouble b[QUARTIC_POWERS];
    double begin; /* start and end of the interval, as fractions of the whole interval */
    double end;
} BernsteinPairPiece;

/* Write the Bernstein coefficients of the interval from 0 to `width`, multiplied by 12. Each result is a sum of terms.
   Return the largest sum of the magnitudes of a result's terms. Error bounds are relative to the returned sum. */
static inline double write_pair_bernstein(const PairPolynomial *p, double width, DoubleDouble *b) {
    const int n = p->degree;
    DoubleDouble term[QUARTIC_POWERS];
    double size[QUARTIC_POWERS], scale = 1.0, largest = 0.0;
    for (int k = 0; k <= n; k++) {
        term[k] = p->power[k];
        for (int j = 0; j < k; j++)
            term[k] = times_double(term[k], width);
        size[k] = p->size[k] * scale;
        scale *= width;
    }
    for (int j = 0; j <= n; j++) {
        double total = 0.0;
        b[j] = (DoubleDouble){0.0, 0.0};
        for (int k = 0; k <= j; k++) {
            double part = (double)(int)(12.0 * BINOMIAL_RATIO[n][j][k] + 0.5); /* exact, since `part` is whole */
            b[j] = pair_sum(b[j], times_double(term[k], part));
            total += size[k] * part;
        }
        largest = greater(largest, total);
    }
    return largest;
}

/* Halve an interval. `piece` becomes its first half. */
static inline void halve_pair_piece(BernsteinPairPiece *piece, BernsteinPairPiece *second, int degree) {
    DoubleDouble first[QUARTIC_POWERS];
    first[0] = piece->b[0];
    for (int round = 1; round <= degree; round++) {
        for (int k = 0; k <= degree - round; k++)
            piece->b[k] = times_power_of_two(pair_sum(piece->b[k], piece->b[k + 1]), 0.5);
        first[round] = piece->b[0];
    }
    for (int k = 0; k <= degree; k++) {
        second->b[k] = piece->b[k];
        piece->b[k] = first[k];
    }
    second->end = piece->end;
    second->begin = piece->end = 0.5 * (piece->begin + piece->end);
}

/* Find brackets of the first `most` roots between 0 and `width`, in ascending order. Return the number of brackets or
   QUARTIC_UNDECIDED. `from` is added to the ends of the brackets. */
static inline int isolate_roots_of_part(const PairPolynomial *p, int start, double from, double width, int most,
                                        Bracket *brackets) {
    const int n = p->degree;
    BernsteinPairPiece piece = {.begin = 0.0, .end = 1.0}, rest[MOST_PAIRS_WAITING];
    double error = CAROM_BERNSTEIN_PAIR_ERROR * write_pair_bernstein(p, width, piece.b), b[QUARTIC_POWERS];
    if (!(error < CAROM_INF))
        return QUARTIC_UNDECIDED;
    int rest_count = 0, found = 0;
    for (int halvings = 0; halvings <= MOST_PAIR_HALVINGS;) {
        for (int k = 0; k <= n; k++)
            b[k] = piece.b[k].high;
        const int first_sign = piece.begin == 0.0 ? start : b[0] > 0.0 ? 1 : -1;
        SignChanges changes = count_sign_changes(b, n, error, first_sign, 0);
        if (changes == SEVERAL_CHANGES) {
            if (rest_count == MOST_PAIRS_WAITING || halvings == MOST_PAIR_HALVINGS)
                break;
            halve_pair_piece(&piece, &rest[rest_count], n);
            if (fabs(piece.b[n].high) <= error)
                break;
            rest_count += 1;
            halvings += 1;
            continue;
        }
        if (changes == ONE_CHANGE) {
            brackets[found] = (Bracket){from + width * piece.begin, from + width * piece.end, first_sign > 0};
            found += 1;
        }
        if (found == most || rest_count == 0)
            return found;
        piece = rest[--rest_count];
    }
    return QUARTIC_UNDECIDED;
}

/* ---- where to halve first ---- */

enum {
    TURN_STEPS = 2,
    SHARPEN_STEPS = 4,
};

static inline double approximate_cube_root(double a) {
    double root = sqrt(sqrt(a)); /* the result is a^(1/4 + 1/16 + 1/64), which is about a^(1/3) */
    double next = sqrt(sqrt(root));
    return root * next * sqrt(sqrt(next));
}

/* Return an approximation of the largest root t > 0 of the derivative, or 0 if there is none. */
static inline double last_turn(const Polynomial *p) {
    const int n = p->degree;
    if (n < 2)
        return 0.0;
    double inverse = 1.0 / (n * p->power[n]);
    double c[QUARTIC_POWERS - 1]; /* coefficients of the derivative, scaled so that the highest is 1 */
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

/* Return approximately the first instant at which any other term is as large as the constant term; infinity if there is
   none. */
static inline double first_balance(const Polynomial *p) {
    double largest = 0.0; /* inverse of the first instant at which a term is as large as the constant term */
    for (int k = 1; k <= p->degree; k++) {
        double part = fabs(p->power[k] / p->power[0]);
        part = k == 1 ? part : k == 3 ? approximate_cube_root(part) : sqrt(k == 4 ? sqrt(part) : part);
        largest = greater(largest, part);
    }
    return 1.0 / largest;
}

/* Return approximately the last instant at which a term of opposite sign is as large as the term of the highest power;
   0 if there is none. */
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

/* Return the root of the polynomial's derivative near an instant, accurate to the last place. If no root is found near
   the instant, return the instant. */
static inline double sharpen_turn(const PairPolynomial *p, const Polynomial *floats, double near_turn) {
    const int n = p->degree;
    double t = near_turn;
    for (int step = 0; step < SHARPEN_STEPS; step++) {
        DoubleDouble rate = times_double(p->power[n], n);
        for (int k = n - 1; k >= 1; k--)
            rate = pair_sum(times_double(rate, t), times_double(p->power[k], k));
        double change = rate.high / (2.0 * derivatives_at(floats, t).half_bend);
        if (!(fabs(change) <= 0.25 * near_turn))
            return near_turn;
        t -= change;
        if (fabs(change) <= 0x1p-30 * t)
            break;
    }
    return t;
}

/* Return an instant c between the roots, with which few halvings are needed. For a gap that becomes smaller and opens
   again, c is about the time of the smallest gap. */
static inline double time_scale(const Polynomial *p, int start) {
    double turn = (p->power[p->degree] > 0.0) == (start > 0) ? last_turn(p) : 0.0;
    if (!(turn > 0.0))
        return 1.5 * last_balance(p);
    if (fabs(p->power[1]) * turn < 0x1p-6 * fabs(p->power[0]))
        return greater(turn, first_balance(p)); /* before `first_balance`, only the constant term matters */
    return turn;
}
