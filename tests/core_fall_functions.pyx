"""Functions of the core for free fall, one at a time, for tests; exact questions go to the integer solver of Python.

The extension contains this module only where it is built in place: see setup.py.
"""

from math import inf

cdef extern from "stdbool.h":
    ctypedef bint c_bool "bool"

from carom.core.formulas cimport FEATURE_NUMBERS, DoubleDouble, Feature, Mover, feature_from

from carom.core.exact_quartic import solve_quartic

cdef extern from "carom/core/parabola/fall_bounds.h" nogil:
    enum:
        QUARTIC_POWERS
        QUARTIC_SIGN
        MOST_PRODUCTS

    struct Product:
        double a
        double b

    struct Products:
        double time_origin "from"
        c_bool is_closed
        int count[QUARTIC_POWERS]
        Product products[QUARTIC_POWERS][MOST_PRODUCTS]

    struct PairPolynomial:
        int degree
        DoubleDouble power[QUARTIC_POWERS]
        double size[QUARTIC_POWERS]

    struct Gap:
        void (*write_pairs)(const void *source, PairPolynomial *p) noexcept nogil
        void (*write_products)(const void *source, Products *products) noexcept nogil
        const void *source

    struct ExactQuartic:
        double (*solve)(void *context, const Products *gap, int index) noexcept nogil
        void *context

    struct Falls:
        pass

    struct FallingDisc:
        double x
        double y
        double vx
        double vy
        double radius

    void add_products(Products *products, int power, const double *a, int a_count, const double *b, int b_count, double factor)
    void begin_with_pairs(Falls *falls, const ExactQuartic *exact, const Gap *form)
    int sign_of_gap(Falls *falls)
    void set_start(Falls *falls, int sign_now)
    double c_next_fall "next_fall"(Falls *falls)
    double c_disc_fall_time "disc_fall_time"(
        const ExactQuartic *exact, const FallingDisc *disc, double fixed_x, double fixed_y, double fixed_radius,
        double ax, double ay, c_bool has_just_left, double leaving
    )
    double c_feature_fall_time "feature_fall_time"(
        const ExactQuartic *exact, const Mover *disc, const Feature *feature, double ax, double ay,
        c_bool has_just_left, double leaving
    )
    double c_pair_lower_bound "fall_pair_lower_bound"(
        const FallingDisc *disc, double fixed_x, double fixed_y, double fixed_radius, double ax, double ay
    )
    c_bool c_misses "fall_misses_feature"(const Mover *disc, const Feature *f, double ax, double ay, double within)


cdef double solve(void *context, const Products *gap, int index) noexcept with gil:
    powers = [[(gap.products[k][i].a, gap.products[k][i].b) for i in range(gap.count[k])] for k in range(QUARTIC_POWERS)]
    return solve_quartic(powers, gap.time_origin, gap.is_closed, index)


cdef ExactQuartic exact = ExactQuartic(<double (*)(void *, const Products *, int) noexcept nogil> solve, NULL)


cdef FallingDisc _falling_disc(disc):
    x, y, vx, vy, radius = disc
    return FallingDisc(x, y, vx, vy, radius)


cdef Mover _mover(disc):
    (x, xl), (y, yl), (ux, uxl), (uy, uyl), radius = disc
    return Mover(DoubleDouble(x, xl), DoubleDouble(y, yl), DoubleDouble(ux, uxl), DoubleDouble(uy, uyl), radius)


cdef Feature _feature(numbers):
    cdef double[FEATURE_NUMBERS] row
    for k in range(FEATURE_NUMBERS):
        row[k] = numbers[k]
    return feature_from(row)


def disc_fall_time(disc, fixed, acceleration, leaving=None):
    cdef FallingDisc falling = _falling_disc(disc)
    x, y, radius = fixed
    ax, ay = acceleration
    return c_disc_fall_time(&exact, &falling, x, y, radius, ax, ay, leaving is not None, leaving or 0.0)


def feature_fall_time(numbers, disc, acceleration, leaving=None):
    cdef Feature feature = _feature(numbers)
    cdef Mover mover = _mover(disc)
    ax, ay = acceleration
    return c_feature_fall_time(&exact, &mover, &feature, ax, ay, leaving is not None, leaving or 0.0)


def pair_lower_bound(disc, fixed, acceleration):
    cdef FallingDisc falling = _falling_disc(disc)
    x, y, radius = fixed
    ax, ay = acceleration
    return c_pair_lower_bound(&falling, x, y, radius, ax, ay)


def misses_feature(numbers, disc, acceleration, double within):
    cdef Feature feature = _feature(numbers)
    cdef Mover mover = _mover(disc)
    ax, ay = acceleration
    return bool(c_misses(&mover, &feature, ax, ay, within))


cdef struct Powers:
    DoubleDouble power[QUARTIC_POWERS]


cdef void write_pairs(const void *source, PairPolynomial *p) noexcept nogil:
    cdef const Powers *powers = <const Powers *> source
    cdef int k
    p.degree = QUARTIC_POWERS - 1
    while p.degree > 0 and powers.power[p.degree].high == 0.0:
        p.degree -= 1
    for k in range(QUARTIC_POWERS):
        p.power[k] = powers.power[k]
        p.size[k] = abs(powers.power[k].high)


cdef void write_products(const void *source, Products *products) noexcept nogil:
    cdef const Powers *powers = <const Powers *> source
    cdef double[2] parts
    cdef double one = 1.0
    cdef int k
    for k in range(QUARTIC_POWERS):
        parts[0] = powers.power[k].high
        parts[1] = powers.power[k].low
        add_products(products, k, parts, 2, &one, 1, 1.0)


def falls(powers):
    """Return all falls of a polynomial whose powers are pairs, lowest first."""
    cdef Powers numbers
    cdef Falls found
    cdef Gap gap = Gap(write_pairs, write_products, &numbers)
    for k in range(QUARTIC_POWERS):
        high, low = powers[k]
        numbers.power[k] = DoubleDouble(high, low)
    begin_with_pairs(&found, &exact, &gap)
    set_start(&found, sign_of_gap(&found))
    times = []
    while (time := c_next_fall(&found)) < inf:
        times.append(time)
    return times
