/* The functions of math.h that the core uses, for a target without a C library. */

#ifndef CAROM_WASM_MATH_H
#define CAROM_WASM_MATH_H

#define HUGE_VAL __builtin_huge_val()
#define INFINITY __builtin_inff()
#define NAN __builtin_nanf("")

#define fabs __builtin_fabs
#define sqrt __builtin_sqrt

/* memory.c defines these functions as the C standard describes them. */
double frexp(double x, int *exponent);
double ldexp(double x, int exponent);

#endif
