/* Integers of 256 bits, for the few exponentials and logarithms whose rounding floats cannot decide: see
   exponentials.h.

   A number consists of eight limbs (digits of 32 bits), the lowest first, in two's complement. Limbs have only 32 bits
   because compilers for 32-bit machines do not support products of two 64-bit numbers. Operations ignore overflow, so
   callers must keep numbers in range. */

#pragma once

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

enum {
    WIDE_LIMBS = 8,
    FRACTION_LIMBS = 6,  /* number of limbs after the point of a fixed-point number: 192 bits */
    FRACTION_BITS = 192
};

typedef struct WideInteger {
    uint32_t limb[WIDE_LIMBS];
} WideInteger;

/* Return 2^`bit`, for a `bit` from 0 to 254. */
static inline WideInteger wide_power_of_two(int bit) {
    WideInteger power = {{0}};
    power.limb[bit / 32] = (uint32_t)1 << (bit % 32);
    return power;
}

static inline bool wide_is_negative(WideInteger a) {
    return a.limb[WIDE_LIMBS - 1] >> 31 != 0;
}

static inline bool wide_is_zero(WideInteger a) {
    uint32_t bits = 0;
    for (int i = 0; i < WIDE_LIMBS; i++) {
        bits |= a.limb[i];
    }
    return bits == 0;
}

static inline WideInteger wide_add(WideInteger a, WideInteger b) {
    WideInteger sum;
    uint64_t carry = 0;
    for (int i = 0; i < WIDE_LIMBS; i++) {
        carry += (uint64_t)a.limb[i] + b.limb[i];
        sum.limb[i] = (uint32_t)carry;
        carry >>= 32;
    }
    return sum;
}

static inline WideInteger wide_subtract(WideInteger a, WideInteger b) {
    WideInteger difference;
    uint64_t carry = 1;
    for (int i = 0; i < WIDE_LIMBS; i++) {
        carry += (uint64_t)a.limb[i] + (uint32_t)~b.limb[i];
        difference.limb[i] = (uint32_t)carry;
        carry >>= 32;
    }
    return difference;
}

static inline WideInteger wide_negate(WideInteger a) {
    return wide_subtract((WideInteger){{0}}, a);
}

/* Return `a` times 2^shift, rounded down, for a `shift` from -255 to 255. `a` may have any sign. */
static inline WideInteger wide_shift(WideInteger a, int shift) {
    WideInteger shifted;
    uint32_t sign = wide_is_negative(a) ? 0xFFFFFFFFu : 0;
    /* `a` is first shifted down by `down` limbs, and then up by `up` bits */
    int down = shift < 0 ? (-shift + 31) / 32 : 0;
    int up = shift + 32 * down;
    for (int i = 0; i < WIDE_LIMBS; i++) {
        int source = i + down - up / 32;
        uint32_t here = source < 0 ? 0 : source < WIDE_LIMBS ? a.limb[source] : sign;
        uint32_t below = source < 1 ? 0 : source <= WIDE_LIMBS ? a.limb[source - 1] : sign;
        shifted.limb[i] = up % 32 == 0 ? here : here << (up % 32) | below >> (32 - up % 32);
    }
    return shifted;
}

/* Return the product of two nonnegative fixed-point numbers: a b / 2^192, rounded down. */
static inline WideInteger wide_multiply(WideInteger a, WideInteger b) {
    uint32_t product[2 * WIDE_LIMBS] = {0};
    for (int i = 0; i < WIDE_LIMBS; i++) {
        uint64_t carry = 0;
        for (int j = 0; j < WIDE_LIMBS; j++) {
            carry += (uint64_t)a.limb[i] * b.limb[j] + product[i + j];
            product[i + j] = (uint32_t)carry;
            carry >>= 32;
        }
        product[i + WIDE_LIMBS] = (uint32_t)carry;
    }
    WideInteger quotient;
    for (int i = 0; i < WIDE_LIMBS; i++) {
        quotient.limb[i] = product[i + FRACTION_LIMBS];
    }
    return quotient;
}

/* Return the product of `a` and a factor of at most 32 bits. `a` may have any sign. */
static inline WideInteger wide_multiply_small(WideInteger a, uint32_t factor) {
    WideInteger product;
    uint64_t carry = 0;
    for (int i = 0; i < WIDE_LIMBS; i++) {
        carry += (uint64_t)a.limb[i] * factor;
        product.limb[i] = (uint32_t)carry;
        carry >>= 32;
    }
    return product;
}

/* Return a nonnegative number divided by a divisor, rounded down. */
static inline WideInteger wide_divide_small(WideInteger a, uint32_t divisor) {
    WideInteger quotient;
    uint64_t rest = 0;
    for (int i = WIDE_LIMBS - 1; i >= 0; i--) {
        rest = rest << 32 | a.limb[i];
        quotient.limb[i] = (uint32_t)(rest / divisor);
        rest %= divisor;
    }
    return quotient;
}

/* Return x times 2^shift, rounded down. The magnitude of the result must be below 2^255, and x must be finite. */
static inline WideInteger wide_from_double(double x, int shift) {
    int exponent;
    double mantissa = ldexp(frexp(fabs(x), &exponent), 53);
    uint64_t bits = (uint64_t)mantissa; /* x is `bits` times 2^(exponent - 53) */
    WideInteger whole = {{(uint32_t)bits, (uint32_t)(bits >> 32)}};
    shift += exponent - 53;
    if (x < 0.0) {
        whole = wide_negate(whole);
    }
    return wide_shift(whole, shift < -255 ? -255 : shift);
}

/* Return the float nearest to `a` times 2^exponent, or the even one of two equally near floats. If the product exceeds
   the largest float, return infinity. The result must not be subnormal. */
static inline double wide_to_double(WideInteger a, int exponent) {
    bool negative = wide_is_negative(a);
    WideInteger size = negative ? wide_negate(a) : a;
    int bits = 32 * WIDE_LIMBS;
    while (bits > 0 && size.limb[(bits - 1) / 32] >> ((bits - 1) % 32) == 0) {
        bits--;
    }
    int dropped = bits > 53 ? bits - 53 : 0;
    WideInteger top = wide_shift(size, -dropped);
    uint64_t mantissa = (uint64_t)top.limb[1] << 32 | top.limb[0];
    if (dropped > 0) {
        WideInteger rest = wide_subtract(size, wide_shift(top, dropped));
        /* `rest` is the part that rounding drops. `excess` is `rest` minus half of a unit in the last place. */
        WideInteger excess = wide_subtract(rest, wide_power_of_two(dropped - 1));
        if (!wide_is_negative(excess) && (!wide_is_zero(excess) || (mantissa & 1) != 0)) {
            mantissa++;
        }
    }
    double value = ldexp((double)mantissa, exponent + dropped);
    return negative ? -value : value;
}
