/* Exponential functions, and the logarithm of 1 + x. Results are rounded to the nearest float, so they are
   bit-identical on every machine.

   Results of different C libraries differ by up to a unit in the last place. This file first approximates a result by a
   sum of two floats with a relative error of 2^-100. Usually, the error of 2^-100 is too small to change which float is
   nearest (Ziv's rounding test). For about one in 2^45 arguments, two floats remain possible. Fixed-point numbers of
   192 bits then decide between the two floats.

   Sources: P. T. P. Tang, "Table-driven implementation of the exponential function in IEEE floating-point arithmetic",
   ACM TOMS 15 (1989); A. Ziv, "Fast evaluation of elementary mathematical functions with correctly rounded last bit",
   ACM TOMS 17 (1991). */

#pragma once

#include "carom/core/arithmetic/double_double.h"
#include "carom/core/arithmetic/wide_integer.h"

/* Lower limit of x in e^x. For smaller x, e^x may have fewer than 53 bits. */
#define CAROM_EXP_LEAST (-708.0)
/* Below this x, e^x - 1 rounds to -1, because e^x is less than a quarter of the last place of 1. */
#define CAROM_EXPM1_LEAST (-40.0)

enum {
    EXP_STEPS = 32,
    /* added to the number of a step, because integer division by EXP_STEPS rounds down only if the sum is positive */
    EXP_OFFSET = 2048 * EXP_STEPS
};

/* The powers 2^(i / 32), with relative errors of 2^-107. */
static const DoubleDouble EXP_TABLE[EXP_STEPS] = {
    {0x1.0000000000000p+0, 0x0.0p+0},
    {0x1.059b0d3158574p+0, 0x1.d73e2a475b465p-55},
    {0x1.0b5586cf9890fp+0, 0x1.8a62e4adc610bp-54},
    {0x1.11301d0125b51p+0, -0x1.6c51039449b3ap-54},
    {0x1.172b83c7d517bp+0, -0x1.19041b9d78a76p-55},
    {0x1.1d4873168b9aap+0, 0x1.e016e00a2643cp-54},
    {0x1.2387a6e756238p+0, 0x1.9b07eb6c70573p-54},
    {0x1.29e9df51fdee1p+0, 0x1.612e8afad1255p-55},
    {0x1.306fe0a31b715p+0, 0x1.6f46ad23182e4p-55},
    {0x1.371a7373aa9cbp+0, -0x1.63aeabf42eae2p-54},
    {0x1.3dea64c123422p+0, 0x1.ada0911f09ebcp-55},
    {0x1.44e086061892dp+0, 0x1.89b7a04ef80d0p-59},
    {0x1.4bfdad5362a27p+0, 0x1.d4397afec42e2p-56},
    {0x1.5342b569d4f82p+0, -0x1.07abe1db13cadp-55},
    {0x1.5ab07dd485429p+0, 0x1.6324c054647adp-54},
    {0x1.6247eb03a5585p+0, -0x1.383c17e40b497p-54},
    {0x1.6a09e667f3bcdp+0, -0x1.bdd3413b26456p-54},
    {0x1.71f75e8ec5f74p+0, -0x1.16e4786887a99p-55},
    {0x1.7a11473eb0187p+0, -0x1.41577ee04992fp-55},
    {0x1.82589994cce13p+0, -0x1.d4c1dd41532d8p-54},
    {0x1.8ace5422aa0dbp+0, 0x1.6e9f156864b27p-54},
    {0x1.93737b0cdc5e5p+0, -0x1.75fc781b57ebcp-57},
    {0x1.9c49182a3f090p+0, 0x1.c7c46b071f2bep-56},
    {0x1.a5503b23e255dp+0, -0x1.d2f6edb8d41e1p-54},
    {0x1.ae89f995ad3adp+0, 0x1.7a1cd345dcc81p-54},
    {0x1.b7f76f2fb5e47p+0, -0x1.5584f7e54ac3bp-56},
    {0x1.c199bdd85529cp+0, 0x1.11065895048ddp-55},
    {0x1.cb720dcef9069p+0, 0x1.503cbd1e949dbp-56},
    {0x1.d5818dcfba487p+0, 0x1.2ed02d75b3707p-55},
    {0x1.dfc97337b9b5fp+0, -0x1.1a5cd4f184b5cp-54},
    {0x1.ea4afa2a490dap+0, -0x1.e9c23179c2893p-54},
    {0x1.f50765b6e4540p+0, 0x1.9d3e12dd8a18bp-54},
};

/* 1/3! to 1/6! as pairs, and 1/7! to 1/12! as floats. */
static const DoubleDouble EXP_PAIR_TERMS[4] = {
    {0x1.5555555555555p-3, 0x1.5555555555555p-57},
    {0x1.5555555555555p-5, 0x1.5555555555555p-59},
    {0x1.1111111111111p-7, 0x1.1111111111111p-63},
    {0x1.6c16c16c16c17p-10, -0x1.f49f49f49f49fp-65},
};
static const double EXP_TERMS[6] = {
    0x1.a01a01a01a01ap-13, 0x1.a01a01a01a01ap-16, 0x1.71de3a556c734p-19,
    0x1.27e4fb7789f5cp-22, 0x1.ae64567f544e4p-26, 0x1.1eed8eff8d898p-29,
};

/* An exponential in parts: e^x = 2^exponent (base + growth base), where `growth` is e^r - 1 for some |r| <= ln 2 / 64.
   If |x| is at most ln 2 / 64, then `is_small` is true, `exponent` is 0 and `base` is 1. */
typedef struct Exponential {
    DoubleDouble base;
    DoubleDouble growth;
    int exponent;
    bool is_small;
} Exponential;

/* Return e^r - 1 for |r| <= 0.011, with a relative error of 2^-102. */
static inline DoubleDouble expand_growth(DoubleDouble r) {
    double x = r.high;
    /* From r^7 / 7! on, terms are below 2^-51 times the sum, so floats are accurate enough for them. Omitted terms are
       below 2^-110 times the sum. */
    double tail =
        EXP_TERMS[0] +
        x * (EXP_TERMS[1] + x * (EXP_TERMS[2] + x * (EXP_TERMS[3] + x * (EXP_TERMS[4] + x * EXP_TERMS[5]))));
    DoubleDouble sum = two_prod(tail, x);
    for (int k = 3; k >= 0; k--) {
        sum = pair_product(pair_sum(EXP_PAIR_TERMS[k], sum), r);
    }
    sum = pair_product(pair_sum((DoubleDouble){0.5, 0.0}, sum), r);
    return pair_sum(r, pair_product(sum, r));
}

/* Return e^x in parts, for x from -710 to 710. */
static inline Exponential expand_exponential(double x) {
    int step = (int)(x * CAROM_STEPS_PER_UNIT + (x < 0.0 ? -0.5 : 0.5));
    DoubleDouble r = {x, 0.0};
    if (step != 0) {
        /* r is x minus `step` times ln 2 / 32. The difference with CAROM_STEP_HIGH is exact, because its two operands
           differ by at most a factor of 2. The difference with CAROM_STEP_LOW has an error of 2^-113. */
        r = two_diff(x - step * CAROM_STEP_HIGH, step * CAROM_STEP_MIDDLE);
        r = two_sum(r.high, r.low - step * CAROM_STEP_LOW);
    }
    int shifted = step + EXP_OFFSET;
    int exponent = shifted / EXP_STEPS - EXP_OFFSET / EXP_STEPS;
    return (Exponential){EXP_TABLE[shifted % EXP_STEPS], expand_growth(r), exponent, step == 0};
}

/* Return base + growth * base with a relative error of 2^-102. The result is from 0.98 to 2.03. */
static inline DoubleDouble combine_exponential(Exponential e) {
    return pair_sum(e.base, pair_product(e.base, e.growth));
}

/* Write the float nearest to a number, from a pair that approximates the number with an error of at most `error`.
   Return whether the written float is certainly the nearest. */
static inline bool round_pair(DoubleDouble value, double error, double *nearest) {
    *nearest = value.high + (value.low + error);
    return *nearest == value.high + (value.low - error);
}

/* ---- arguments that need 192 bits ---- */

/* Return n with e^x = n 2^(twos - 192) and a relative error of 2^-180, for x from -710 to 710. */
static inline WideInteger wide_exponential(double x, int *twos) {
    static const WideInteger LN2 = {{0x7298b62d, 0x40f34326, 0x03f2f6af, 0xc9e3b398, 0xd1cf79ab, 0xb17217f7, 0, 0}};
    /* the quotient of x and ln 2, rounded down, with an error of at most 1 */
    int count = (int)(x / CAROM_LN2) - (x < 0.0);
    WideInteger rest = wide_multiply_small(LN2, (uint32_t)(count < 0 ? -count : count));
    rest = wide_subtract(wide_from_double(x, FRACTION_BITS), count < 0 ? wide_negate(rest) : rest);
    while (wide_is_negative(rest)) {
        rest = wide_add(rest, LN2);
        count--;
    }
    while (!wide_is_negative(wide_subtract(rest, LN2))) {
        rest = wide_subtract(rest, LN2);
        count++;
    }
    WideInteger total = wide_power_of_two(FRACTION_BITS);
    WideInteger term = total;
    for (uint32_t k = 1; !wide_is_zero(term); k++) {
        term = wide_divide_small(wide_multiply(term, rest), k);
        total = wide_add(total, term);
    }
    *twos = count;
    return total;
}

static CAROM_NOINLINE double decide_exp(double x) {
    int twos;
    WideInteger power = wide_exponential(x, &twos);
    return wide_to_double(power, twos - FRACTION_BITS);
}

static CAROM_NOINLINE double decide_expm1(double x) {
    int twos;
    WideInteger power = wide_exponential(x, &twos);
    if (twos <= FRACTION_BITS) {
        return wide_to_double(wide_subtract(power, wide_power_of_two(FRACTION_BITS - twos)), twos - FRACTION_BITS);
    }
    /* The last bit of `power` has a value of more than 1 here. So an eighth of the last bit is subtracted instead of 1,
       which gives the same rounding. */
    power = wide_subtract(wide_multiply_small(power, 8), wide_power_of_two(0));
    return wide_to_double(power, twos - FRACTION_BITS - 3);
}

/* Return the natural logarithm of 1 + x. `near` is a float near the result, which one step of third order improves. */
static CAROM_NOINLINE double decide_log1p(double x, double near) {
    int twos;
    int exponent;
    WideInteger power = wide_exponential(-near, &twos);
    DoubleDouble sum = two_sum(x, 1.0);
    frexp(sum.high, &exponent);
    int shift = FRACTION_BITS - exponent;
    WideInteger scaled = wide_add(wide_from_double(sum.high, shift), wide_from_double(sum.low, shift));
    WideInteger ratio = wide_shift(wide_multiply(scaled, power), exponent + twos); /* (1 + x) / e^near, about 1 */
    WideInteger rest = wide_subtract(ratio, wide_power_of_two(FRACTION_BITS));
    WideInteger size = wide_is_negative(rest) ? wide_negate(rest) : rest;
    rest = wide_subtract(rest, wide_shift(wide_multiply(size, size), -1));
    return wide_to_double(wide_add(wide_from_double(near, FRACTION_BITS), rest), -FRACTION_BITS);
}

/* ---- the functions ---- */

/* Return `a` times 2^exponent, for exponents from -1022 to 1024 and `a` of about 1. If the product exceeds the largest
   float, return infinity. */
static inline double scale_by_two(double a, int exponent) {
    return exponent > -1000 && exponent < 1000 ? a * ldexp(1.0, exponent) : ldexp(a, exponent);
}

/* Return e^x, rounded to the nearest float. If e^x exceeds the largest float, return infinity. For x below -708, where
   e^x may have fewer than 53 bits, return 0. */
static inline double nearest_exp(double x) {
    if (!(x >= CAROM_EXP_LEAST && x <= CAROM_EXP_MOST)) {
        return x < CAROM_EXP_LEAST ? 0.0 : x > CAROM_EXP_MOST ? CAROM_INF : x; /* NaN stays NaN */
    }
    if (fabs(x) <= CAROM_EXP_LINEAR) {
        return 1.0;
    }
    Exponential power = expand_exponential(x);
    double nearest;
    if (CAROM_LIKELY(round_pair(combine_exponential(power), 2.0 * CAROM_EXP_ERROR, &nearest))) {
        return scale_by_two(nearest, power.exponent);
    }
    return decide_exp(x);
}

/* Return (e^x - 1) / 2^exponent as a pair, for x from -40 to 710 except 0. `error` is set to an upper bound of the
   result's error. */
static inline DoubleDouble expand_expm1(double x, int *exponent, double *error) {
    Exponential power = expand_exponential(x);
    if (power.is_small) {
        *exponent = 0;
        *error = CAROM_EXP_ERROR * fabs(power.growth.high);
        return power.growth;
    }
    *exponent = power.exponent;
    DoubleDouble whole = combine_exponential(power);
    DoubleDouble value = pair_sum((DoubleDouble){-scale_by_two(1.0, -power.exponent), 0.0}, whole);
    *error = CAROM_EXP_ERROR * (2.0 + fabs(value.high));
    return value;
}

/* Return e^x - 1, rounded to the nearest float. If the result exceeds the largest float, return infinity. */
static inline double nearest_expm1(double x) {
    if (!(x >= CAROM_EXPM1_LEAST && x <= CAROM_EXP_MOST)) {
        return x < CAROM_EXPM1_LEAST ? -1.0 : x > CAROM_EXP_MOST ? CAROM_INF : x; /* NaN stays NaN */
    }
    if (fabs(x) < CAROM_EXP_LINEAR) {
        return x;
    }
    int exponent;
    double error;
    double nearest;
    DoubleDouble value = expand_expm1(x, &exponent, &error);
    return CAROM_LIKELY(round_pair(value, error, &nearest)) ? scale_by_two(nearest, exponent) : decide_expm1(x);
}

/* Return the logarithm of 1 + x, for x above -1, with a relative error below 2^-48. */
static inline double approximate_log1p(double x) {
    int exponent = 0;
    double rest = x;
    if (x < -0.29 || x > 0.41) {
        rest = 2.0 * frexp(1.0 + x, &exponent) - 1.0;
        exponent--;
        if (rest > 0.41) {
            rest = 0.5 * (rest - 1.0);
            exponent++;
        }
    }
    /* The logarithm of 1 + rest is 2 (z + z^3 / 3 + z^5 / 5 + ...), where |z| is at most 0.172. */
    double z = rest / (2.0 + rest);
    double square = z * z;
    double series = 0.0;
    for (int k = 19; k >= 1; k -= 2) {
        series = series * square + 1.0 / k;
    }
    return exponent * CAROM_LN2 + 2.0 * z * series;
}

/* Return the natural logarithm of 1 + x as a pair, for x above -1. `error` is set to a bound of the result's error. */
static inline DoubleDouble expand_log1p(double x, double *error) {
    /* The result is the approximation `first` plus the logarithm of 1 + `rest`, where `rest` is (1 + x) / e^first - 1.
       The magnitude of `rest` is at most 2^-48 times that of `first`. The first two terms of the logarithm's series, r
       and -r^2 / 2 with r = `rest`, have an error of less than 2^-120 times the result. */
    double first = approximate_log1p(x);
    Exponential inverse = expand_exponential(-first);
    DoubleDouble rest;
    *error = CAROM_EXP_ERROR * fabs(first);
    if (inverse.is_small) { /* `rest` is x + `growth` + x `growth`, where x and `growth` nearly cancel */
        DoubleDouble product = pair_product((DoubleDouble){x, 0.0}, inverse.growth);
        DoubleDouble sum = two_sum(x, inverse.growth.high);
        rest = two_sum(sum.high, product.high);
        rest.low += sum.low + (inverse.growth.low + product.low);
    } else {
        DoubleDouble sum = two_sum(x, 1.0);
        DoubleDouble scaled = {ldexp(sum.high, inverse.exponent), ldexp(sum.low, inverse.exponent)};
        rest = pair_sum((DoubleDouble){-1.0, 0.0}, pair_product(scaled, combine_exponential(inverse)));
        *error += CAROM_EXP_ERROR;
    }
    DoubleDouble value = two_sum(first, rest.high);
    return two_sum(value.high, value.low + (rest.low - 0.5 * rest.high * rest.high));
}

/* A number 1 + x and its logarithm. Logarithms of numbers near 1 + x are computed faster from this logarithm. */
typedef struct LogAnchor {
    double x;
    DoubleDouble log; /* logarithm of 1 + x */
    double error;     /* upper bound of the error of `log` */
} LogAnchor;

/* Return the anchor with which a series of calls begins: the number 1 with the logarithm 0. */
static inline LogAnchor first_anchor(void) {
    return (LogAnchor){0.0, {0.0, 0.0}, 0.0};
}

/* Write the float nearest to the logarithm of 1 + x, computed from the anchor's logarithm. Return whether the written
   float is certainly the nearest.

   With 1 + x = (1 + r) a, where a is the anchor's number, the result is the sum of the logarithms of a and of 1 + r.
   For |r| <= 2^-8, the series of the logarithm of 1 + r ends with r^7. The omitted terms are at most 2^-51 r^2 in all.
   The rounding errors of the terms from r^2 on are also at most 2^-51 r^2 in all. */
static inline bool log1p_near(const LogAnchor *anchor, double x, double *nearest) {
    DoubleDouble step = two_diff(x, anchor->x), number = two_sum(1.0, anchor->x);
    double r = step.high / number.high;
    if (!(fabs(r) <= 0x1p-8)) {
        return false;
    }
    DoubleDouble product = two_prod(r, number.high);
    double rest = (((step.high - product.high) - product.low) + (step.low - r * number.low)) / number.high;
    double series = r * r * (-0.5 + r * (1.0 / 3 + r * (-0.25 + r * (0.2 + r * (-1.0 / 6 + r * (1.0 / 7))))));
    DoubleDouble sum = two_sum(anchor->log.high, r);
    double error = anchor->error + 0x1p-49 * (r * r) + CAROM_EXP_ERROR * (fabs(r) + fabs(anchor->log.high));
    return round_pair((DoubleDouble){sum.high, sum.low + (anchor->log.low + (rest + series))}, error, nearest);
}

/* Return the natural logarithm of 1 + x: minus infinity for x = -1, and NaN for smaller x. If the anchor's logarithm
   does not decide which float is nearest, the logarithm is computed directly, and 1 + x becomes the new anchor. */
static inline double nearest_log1p_from(LogAnchor *anchor, double x) {
    double nearest;
    if (!(x > -1.0 && x < CAROM_INF)) {
        return x == -1.0 ? -CAROM_INF : x < -1.0 ? NAN : x; /* NaN stays NaN */
    }
    if (fabs(x) < CAROM_EXP_LINEAR) {
        return x;
    }
    if (CAROM_LIKELY(log1p_near(anchor, x, &nearest))) {
        return nearest;
    }
    anchor->x = x;
    anchor->log = expand_log1p(x, &anchor->error);
    bool is_certain = round_pair(anchor->log, anchor->error, &nearest);
    return CAROM_LIKELY(is_certain) ? nearest : decide_log1p(x, anchor->log.high);
}
