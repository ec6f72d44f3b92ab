/* The functions of string.h that the core uses, for a target without a C library. Each function is one instruction of
   WebAssembly. */

#ifndef CAROM_WASM_STRING_H
#define CAROM_WASM_STRING_H

#include <stddef.h>

#define memcpy __builtin_memcpy
#define memset __builtin_memset

#endif
