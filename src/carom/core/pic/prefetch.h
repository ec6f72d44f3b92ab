/* Prefetching: the memory that the next event needs is loaded while the present event is processed. Prefetching changes
   no result.

   A row in memory often contains the number of another row that is needed soon. The rows of a disc contain the numbers
   of its partner and its cell, and a cell contains the numbers of discs. */

#pragma once

#include "carom/core/pic/grid.h"

#if defined(__GNUC__)
/* GCC assumes that a function that only prefetches has no effect, and removes its calls. An empty assembler statement
   keeps the calls. */
#define CAROM_PREFETCH(place)      \
    do {                           \
        __builtin_prefetch(place); \
        __asm__ volatile("");      \
    } while (0)
#else
#define CAROM_PREFETCH(place) ((void)(place))
#endif

enum {
    /* smallest number of discs for which memory is prefetched, because the rows of all discs no longer fit into a
       cache. Prefetching multiplies the time of a run of 8,000 discs by 1.01, of 16,000 discs by .91, and of 30,000
       discs by .78. The factors were measured on a processor with 1 MB of cache per core. */
    PREFETCH_FROM = 10000
};

/* Prefetch the row of a disc. If `i` is negative, the function prefetches an address before the first row, which is
   harmless. A branch that excludes negative numbers would be slow, because the processor could not predict it. */
static inline void prefetch_row(const State *s, Index i) {
    CAROM_PREFETCH((const void *)((uintptr_t)s->discs + (uintptr_t)i * sizeof(Disc)));
}

static inline void prefetch_disc(const State *s, Index i) {
    Index match = s->queue.level[1] + (i >> 3);
    CAROM_PREFETCH(s->discs + i);
    CAROM_PREFETCH(s->predictions + i);
    CAROM_PREFETCH(s->queue.time + i);
    CAROM_PREFETCH(s->queue.time + match);
    CAROM_PREFETCH(s->queue.holder + match);
    if (s->record.is_wanted)
        CAROM_PREFETCH(s->record.recent + i);
}

static inline void prefetch_cells(const State *s, Index i) {
    Block block = cells_around(s, i);
    for (Index line = 0; line < 3; line++) {
        const Cell *cells = s->grid.cells + block.first + line * block.to_line;
        CAROM_PREFETCH(cells);
        CAROM_PREFETCH(&cells[2].disc[PLACES - 1]);
    }
    Index cell = s->predictions[i].cell;
    CAROM_PREFETCH(s->grid.list_of + tile_of(&s->grid, cell >> COLUMN_BITS, cell & COLUMN_MASK));
}

static inline void prefetch_surroundings(const State *s, Index i) {
    Index partner = s->predictions[i].partner;
    if (partner != NOBODY) {
        CAROM_PREFETCH(s->discs + partner);
        CAROM_PREFETCH(s->predictions + partner);
        CAROM_PREFETCH(s->queue.time + partner);
        if (s->record.is_wanted)
            CAROM_PREFETCH(s->record.recent + partner);
    }
    prefetch_row(s, s->discs[i].last);
    prefetch_cells(s, i);
}

static inline void prefetch_neighbours(const State *s, Index i) {
    Block block = cells_around(s, i);
    for (Index line = 0; line < 3; line++) {
        for (Index k = 0; k < 3; k++) {
            const Cell *cell = s->grid.cells + block.first + line * block.to_line + k;
            for (Index place = 0; place < PLACES; place++)
                prefetch_row(s, cell->disc[place]);
        }
    }
}

static inline void prefetch_partner_cells(const State *s, Index i) {
    if (s->predictions[i].partner != NOBODY)
        prefetch_cells(s, s->predictions[i].partner);
}
