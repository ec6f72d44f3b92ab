/* Arena: one piece of memory for all rows whose number is fixed.

   A `lay_out` function runs twice: without memory, to find the size, and then with it, to place the rows. */

#pragma once

#include <stddef.h>

typedef struct Arena {
    char *memory; /* NULL to measure */
    size_t used;  /* bytes */
} Arena;

/* Return where the next rows begin, at a cache line, and reserve `size` bytes for them. */
static inline void *reserve(Arena *arena, size_t size) {
    void *begin = arena->memory == NULL ? NULL : arena->memory + arena->used;
    arena->used += (size + 63) / 64 * 64;
    return begin;
}

/* Reserve memory for a number of rows of a type. */
#define RESERVE_ROWS(arena, type, count) ((type *)reserve((arena), (size_t)(count) * sizeof(type)))
