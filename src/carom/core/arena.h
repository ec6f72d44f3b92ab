/* Arena: one block of memory for all rows whose number is fixed.

   A `lay_out` function runs twice. The first time it has no memory and computes the size. The second time it places the
   rows. */

#pragma once

#include <stddef.h>

typedef struct Arena {
    char *memory; /* NULL to measure */
    size_t used;  /* bytes */
} Arena;

/* Reserve `size` bytes for rows and return where they begin, which is at a cache line. */
static inline void *reserve(Arena *arena, size_t size) {
    void *begin = arena->memory == NULL ? NULL : arena->memory + arena->used;
    arena->used += (size + 63) / 64 * 64;
    return begin;
}

/* Reserve memory for a number of rows of a type. */
#define RESERVE_ROWS(arena, type, count) ((type *)reserve((arena), (size_t)(count) * sizeof(type)))
