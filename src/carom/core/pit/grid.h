/* Broad phase of PIT: finds discs that are near each other, for any radii and positions.

   Discs of about the same size (within a factor of 2) share a level of square cells, which cover the whole plane. Each
   cell belongs to one of a fixed number of lists of discs. Several cells may share a list. A search of a cell may also
   find discs of other cells, which tests of distances exclude.

   A disc is put into its cell when the code computes its due time, before which it can have no impact. The due time is
   before the disc has moved farther than the `leeway` of its level. So if two discs can touch, the positions at which
   they were put into cells are no farther apart than the sum of their radii and leeways. Cells decide when two discs
   are tested, and never change a result. */

#pragma once

#include "carom/core/pit/state.h"

enum {
    /* largest number of discs for which no cells are used, because searching nine cells would take as long as testing
       all discs */
    FEW_DISCS = 36,
    LISTS_PER_DISC = 2, /* smallest number of lists per disc, so that few cells share a list */
};

/* Return the number of the row or column that contains a coordinate, which is given in widths of a cell. The result
   never decreases when the coordinate grows. */
static inline int64_t cell_number(double place) {
    if (!(fabs(place) < CAROM_LAST_CELL)) {
        if (place != place)
            return 0;
        place = place > 0.0 ? CAROM_LAST_CELL : -CAROM_LAST_CELL;
    }
    int64_t number = (int64_t)place;
    return number - (int64_t)((double)number > place);
}

static inline Index list_of(const Grid *g, Index level, int64_t row, int64_t column) {
    uint64_t number = (uint64_t)column + (uint64_t)row * CAROM_ROW_STEP + (uint64_t)level * CAROM_LEVEL_STEP;
    return (Index)(number & (uint64_t)(g->list_count - 1));
}

/* Put a disc into the cell that contains it now. */
static inline void update_cell(State *s, Index i) {
    Grid *g = &s->grid;
    Disc *a = &s->discs[i];
    if (g->list_count == 0)
        return;
    double width = g->levels[a->level].width;
    Index list = list_of(g, a->level, cell_number(a->y / width), cell_number(a->x / width));
    if (list == a->cell)
        return;
    if (a->cell != NO_CELL) {
        int *link = &g->first[a->cell];
        while (*link != i)
            link = &s->discs[*link].next;
        *link = a->next;
    }
    a->cell = (int)list;
    a->next = g->first[list];
    g->first[list] = (int)i;
}

/* A disc was just put into its cell. Return for how many seconds the disc moves no farther than its leeway. The result
   is at most `State.horizon`.

   `margin` is an upper bound of the rounding errors of the disc's path, in metres. */
static inline double time_in_leeway(const State *s, const Disc *a, double margin) {
    if (s->grid.list_count == 0)
        return s->horizon;
    double speed = sqrt(a->vx * a->vx + a->vy * a->vy);
    double pull = a->inverse_mass != 0.0 ? sqrt(s->gx * s->gx + s->gy * s->gy) : 0.0;
    double left = s->grid.levels[a->level].leeway - margin;
    if ((speed + 0.5 * pull * s->horizon) * s->horizon <= left)
        return s->horizon;
    if (!(left > 0.0))
        return 0.0;
    return pull == 0.0 ? left / speed : 2.0 * left / (speed + sqrt(speed * speed + 2.0 * pull * left));
}

/* ---- levels, chosen once ---- */

/* Return the largest k for which largest / 2^k is not less than a disc's radius. The result is less than MAX_LEVELS. */
static inline int halvings_of(double radius, double largest) {
    int power;
    double fraction = frexp(radius / largest, &power);
    int halvings = 1 - power - (fraction > 0.5);
    return halvings < MAX_LEVELS - 1 ? halvings : MAX_LEVELS - 1;
}

/* Choose the levels of cells from the radii and positions of all discs, and put each disc into its cell. */
static inline void choose_levels(State *s) {
    Grid *g = &s->grid;
    Index counts[MAX_LEVELS] = {0};
    double radii[MAX_LEVELS] = {0.0};
    int levels[MAX_LEVELS] = {0};
    double left = s->discs[0].x, right = left, low = s->discs[0].y, high = low, largest = 0.0;
    for (Index i = 0; i < s->disc_count; i++) {
        const Disc *a = &s->discs[i];
        left = a->x < left ? a->x : left;
        right = a->x > right ? a->x : right;
        low = a->y < low ? a->y : low;
        high = a->y > high ? a->y : high;
        largest = a->radius > largest ? a->radius : largest;
    }
    for (Index i = 0; i < s->disc_count; i++) {
        Disc *a = &s->discs[i];
        a->level = halvings_of(a->radius, largest);
        counts[a->level] += 1;
        radii[a->level] = a->radius > radii[a->level] ? a->radius : radii[a->level];
    }
    for (int k = 0; k < MAX_LEVELS; k++) {
        if (counts[k] == 0)
            continue;
        double distance = sqrt((right - left) / (double)counts[k] * (high - low));
        double least = CAROM_LEAST_LEEWAY_PART * radii[k];
        double leeway = CAROM_LEEWAY_PART * distance > least ? CAROM_LEEWAY_PART * distance : least;
        levels[k] = (int)g->level_count;
        g->levels[g->level_count] = (Level){
            2.0 * (radii[k] + leeway), leeway, radii[k] + leeway, radii[k], 1.0 / (CAROM_SWEEP_WIDTH * radii[k])};
        g->level_count += 1;
    }
    for (Index i = 0; i < s->disc_count; i++) {
        s->discs[i].level = levels[s->discs[i].level];
        update_cell(s, i);
    }
}

/* Return the number of lists for cells: a power of 2. For few discs, or if no test is skipped, return 0. */
static inline Index count_lists(const State *s) {
    if (!s->skips || s->disc_count <= FEW_DISCS)
        return 0;
    Index count = 1;
    while (count < LISTS_PER_DISC * s->disc_count)
        count *= 2;
    return count;
}
