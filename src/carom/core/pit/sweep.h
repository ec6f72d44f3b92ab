/* Sweep: finds all touching pairs of bodies at a frame, and tests them. A sweep does not use the times before which
   discs can have no impact (`State.due`). Touching discs are found by means of cells, and tested in the order of
   Algorithm 1 of the source paper.

   If most discs may have an impact at most frames, a sweep costs less than computing when each disc may have its next
   impact. The cells are filled for a single frame, so discs need no leeway (distance that they may move). */

#pragma once

#include <string.h>

#include "carom/core/pit/schedule.h"

/* If disc `a` may touch or overlap disc j, add disc j to `State.touching`. */
static inline void note_overlap(State *s, const Disc *a, Index j) {
    const Disc *b = &s->discs[j];
    double dx = b->x - a->x;
    double dy = b->y - a->y;
    double contact = a->radius + b->radius;
    s->counts.pair_tests += 1;
    if (dx * dx + dy * dy <= contact * contact * (1.0 + CAROM_ROOT_ROOM))
        add_touching(s, j);
}

/* For one level of cells, add the discs that disc i may touch or overlap to `State.touching`. At this time, the cells
   contain only discs with numbers above i. */
static inline void sweep_level(State *s, Index i, Index level) {
    const Grid *g = &s->grid;
    const Disc *a = &s->discs[i];
    double density = g->levels[level].density;
    double reach = (a->radius + g->levels[level].radius) * (1.0 + CAROM_REACH_MARGIN);
    int64_t left = cell_number((a->x - reach) * density), right = cell_number((a->x + reach) * density);
    int64_t lower = cell_number((a->y - reach) * density), upper = cell_number((a->y + reach) * density);
    if ((double)(right - left + 1) * (double)(upper - lower + 1) > (double)s->disc_count) {
        for (Index j = i + 1; j < s->disc_count; j++) {
            if (s->discs[j].level == level)
                note_overlap(s, a, j);
        }
        return;
    }
    for (int64_t row = lower; row <= upper; row++) {
        for (int64_t column = left; column <= right; column++) {
            for (Index j = g->swept[list_of(g, level, row, column)]; j != NOBODY; j = g->swept_next[j])
                note_overlap(s, a, j);
        }
    }
}

static inline void sweep_into_cell(State *s, Index i) {
    Grid *g = &s->grid;
    const Disc *a = &s->discs[i];
    double density = g->levels[a->level].density;
    Index list = list_of(g, a->level, cell_number(a->y * density), cell_number(a->x * density));
    g->swept_next[i] = g->swept[list];
    g->swept[list] = (int)i;
}

/* For each disc i, find the discs j > i that it touches. */
static inline void sweep_discs(State *s) {
    s->touching.count = 0;
    memset(s->grid.swept, 0xFF, (size_t)s->grid.list_count * sizeof(int)); /* the bytes 0xFF are the number NOBODY */
    for (Index i = s->disc_count - 1; i >= 0; i--) {
        Index first = s->touching.count;
        for (Index level = 0; level < s->grid.level_count; level++)
            sweep_level(s, i, level);
        sweep_into_cell(s, i);
        s->searches[i] = (Search){0, first, s->touching.count - first, false};
    }
}

static inline void sort_numbers(int *numbers, Index count) {
    for (Index k = 1; k < count; k++) {
        int number = numbers[k];
        Index place = k;
        for (; place > 0 && numbers[place - 1] > number; place--)
            numbers[place] = numbers[place - 1];
        numbers[place] = number;
    }
}

/* Test disc i with the discs that it may touch. A disc can be found twice, because two cells may share a list of
   discs. */
static inline void test_swept(State *s, Index i) {
    int *bodies = &s->touching.bodies[s->searches[i].first];
    Index count = s->searches[i].count;
    sort_numbers(bodies, count);
    for (Index k = 0; k < count; k++) {
        Index j = bodies[k];
        if (k > 0 && j == bodies[k - 1])
            continue;
        if (pair_interferes(s, i, j)) {
            apply_pair_impact(s, i, j);
            s->due[i] = s->due[j] = s->now;
        }
    }
}

/* Return whether disc i certainly does not touch any wall that never moves. */
static inline bool is_apart_from_walls(State *s, Index i) {
    const Disc *a = &s->discs[i];
    double extent = fabs(a->x) + fabs(a->y);
    if (bound_clearance(s, i, extent) > 0.0)
        return true;
    begin_clearance(s, i);
    for (Index k = 0; k < s->wall_count; k++) {
        if (wall_path(s, k) == NULL)
            find_distance(s, i, a, k);
    }
    s->counts.pair_tests += s->wall_count;
    return bound_clearance(s, i, extent) > 0.0;
}

static inline void test_walls(State *s, Index i) {
    bool is_apart = is_apart_from_walls(s, i);
    if (is_apart && s->wall_motions == NULL)
        return;
    for (Index k = 0; k < s->wall_count; k++) {
        if ((!is_apart || wall_path(s, k) != NULL) && wall_interferes(s, i, k)) {
            apply_wall_impact(s, i, k);
            s->due[i] = s->now;
        }
    }
}

/* Make all tests of the next frame that can find an impact. */
static inline void sweep_frame(State *s) {
    advance_to_next_frame(s);
    s->is_settled = true;
    sweep_discs(s);
    for (Index i = 0; i < s->disc_count; i++)
        test_swept(s, i);
    for (Index i = 0; i < s->disc_count; i++)
        test_walls(s, i);
    s->next_due = s->now;
    s->counts.tested += 1;
    s->counts.frames += 1;
    s->work -= frame_work(s);
    s->excess -= CAROM_EXCESS_PART * frame_work(s);
}
