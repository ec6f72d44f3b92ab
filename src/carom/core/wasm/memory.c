/* Memory and input of the core in WebAssembly, and replacements for functions of a C library. */

#include <string.h>

#include "carom/core/wasm/input.h"

/* ---- memory ---- */

enum { PAGE = 65536, ALIGNMENT = 64 };

extern unsigned char __heap_base; /* the memory from here on is free; the linker sets this address */

Input carom_input;
double carom_results[RESULTS];

static uintptr_t used_end; /* end of the allocated memory */

/* Return a block of memory, or NULL if there is not enough memory. */
static void *allocate(size_t size) {
    uintptr_t begin = used_end;
    uintptr_t pages = (uintptr_t)__builtin_wasm_memory_size(0);
    if (size > (size_t)1 << 30 || begin + size > (uintptr_t)1 << 31)
        return NULL;
    uintptr_t end = begin + (size + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    if (end > pages * PAGE && __builtin_wasm_memory_grow(0, (end - pages * PAGE + PAGE - 1) / PAGE) == (size_t)-1)
        return NULL;
    used_end = end;
    return (void *)begin;
}

/* The old block stays allocated until the next run begins. Arrays of up to 2^22 rows at least double their size when
   they grow. So all old blocks together take at most as much memory as the current block. */
void *carom_resize(void *memory, size_t used, size_t size) {
    void *block = size == 0 ? NULL : allocate(size);
    if (block != NULL && used > 0)
        memcpy(block, memory, used);
    return block;
}

/* ---- input ---- */

CAROM_EXPORT("begin_input") void begin_input(void) {
    used_end = ((uintptr_t)&__heap_base + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    memset(&carom_input, 0, sizeof carom_input);
    memset(carom_results, 0, sizeof carom_results);
}

/* Allocate an array of the input, and return the address to which JavaScript writes its numbers. Return 0 if there is
   not enough memory. */
CAROM_EXPORT("add_array") double *add_array(Array array, Index length) {
    carom_input.lengths[array] = length;
    carom_input.arrays[array] = allocate((size_t)length * sizeof(double));
    return carom_input.arrays[array];
}

CAROM_EXPORT("numbers") double *numbers(void) {
    return carom_input.numbers;
}

CAROM_EXPORT("results") double *results(void) {
    return carom_results;
}

/* ---- replacements for functions of a C library ---- */

static double power_of_two(int exponent) {
    uint64_t bits = (uint64_t)(exponent + 1023) << 52;
    double power;
    memcpy(&power, &bits, sizeof power);
    return power;
}

double ldexp(double x, int exponent) {
    for (int k = 0; k < 2 && exponent > 1023; k++) {
        x *= 0x1p1023;
        exponent -= 1023;
    }
    /* Steps of 2^-969 keep all bits if the final result is above the smallest float. So only the last step rounds. */
    for (int k = 0; k < 2 && exponent < -1022; k++) {
        x *= 0x1p-969;
        exponent += 969;
    }
    exponent = exponent > 1023 ? 1023 : exponent < -1022 ? -1022 : exponent;
    return x * power_of_two(exponent);
}

double frexp(double x, int *exponent) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    int power = (int)(bits >> 52 & 0x7FF);
    *exponent = 0;
    if (x == 0.0 || power == 0x7FF)
        return x;
    if (power == 0) { /* subnormal: below the smallest number of full precision */
        x = frexp(x * 0x1p64, exponent);
        *exponent -= 64;
        return x;
    }
    *exponent = power - 1022;
    bits = (bits & 0x800FFFFFFFFFFFFFull) | 0x3FE0000000000000ull;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* JavaScript calls this function. In JavaScript, products with powers of two would round tiny results twice. */
CAROM_EXPORT("times_power") double times_power(double x, int exponent) {
    return ldexp(x, exponent);
}
