/* End of a disc's stay in its cell: the edge that it crosses, or an obstacle that it meets before. */

#pragma once

#include "carom/core/grid.h"
#include "carom/core/motion.h"
#include "carom/core/obstacles.h"
#include "carom/core/state.h"
#include "carom/core/touched.h"

/* Find the first of some walls that a disc meets within a wait; return after what wait, and set its number.

   Without one, return the given wait. Of walls met at the same time (own time plus wait: two different waits can round to
   one time) the last comes first, since wall k is body -1 - k. */
static inline double find_first_wall(const State *s, Index i, const Disc *a, const int *numbers, double wait,
                                     Index *obstacle) {
    *obstacle = NO_OBSTACLE;
    for (; *numbers != NO_OBSTACLE; numbers++) {
        Index k = *numbers;
        if (a->last == -1 - k || (CAROM_UNLIKELY(s->touched != NULL) && is_touched(&s->touched[i], -1 - k)))
            continue;
        Wall w = s->walls[k];
        double found = wall_impact_wait(a, &w, wait);
        if (found < wait || (*obstacle != NO_OBSTACLE && a->time + found == a->time + wait)) {
            wait = found;
            *obstacle = k;
        }
    }
    return wait;
}

/* Find the first of some features that a disc meets within a wait, as `find_first_wall` does.

   Of two features of one wall the one with the smaller wait comes first; if they are equal, the one with the lower number.
   Of two walls the last comes first if the times are equal. */
static inline double find_first_feature(const State *s, Index i, const Disc *a, const int *numbers, double wait,
                                        Index *obstacle) {
    Mover mover = mover_of(a);
    *obstacle = NO_OBSTACLE;
    for (; *numbers != NO_OBSTACLE; numbers++) {
        Index k = *numbers;
        const Feature *f = &s->features[k];
        if (s->touched != NULL && is_touched(&s->touched[i], -1 - k))
            continue;
        double latest = wait + CAROM_TIME_ERROR * (a->time + wait);
        double found = feature_impact_wait(a, &mover, f, a->last == -1 - k, latest);
        if (found < wait || (*obstacle != NO_OBSTACLE && f->wall != s->features[*obstacle].wall &&
                             a->time + found == a->time + wait)) {
            wait = found;
            *obstacle = k;
        }
    }
    return wait;
}

/* Predict when disc `i` crosses an edge of its cell, or meets an obstacle before that, which is a feature or a wall.

   An edge that is reached at the time of an obstacle comes first: the obstacle is near the next cell too. */
static inline void predict_exit(State *s, Index i, bool has_features) {
    const Grid *g = &s->grid;
    Prediction *p = &s->predictions[i];
    Disc a = s->discs[i];
    Index row = p->cell >> COLUMN_BITS;
    Index column = p->cell & COLUMN_MASK;
    Index obstacle = NO_OBSTACLE;
    CellExit crossing = cell_exit(g, &a, row - 1, column - 1);
    unsigned int list = g->list_of[tile_of(g, row, column)];
    const int *numbers = g->lists + (list >> 1);
    bool has_list = list != 0;
    bool is_at_rim = list & 1;
    double wait = crossing.wait;
    while (has_list) { /* twice at most. One place calls the functions, so that a compiler inlines them here */
        wait = has_features ? find_first_feature(s, i, &a, numbers, crossing.wait, &obstacle)
                            : find_first_wall(s, i, &a, numbers, crossing.wait, &obstacle);
        has_list = is_at_rim && !stays_in_area(g, &a, wait);
        is_at_rim = false;
        numbers = g->lists + FULL_LIST;
        if (has_features && has_list)
            s->counts.beyond += 1;
    }
    p->exit_time = a.time + wait;
    p->obstacle = (int)obstacle;
    p->edge = (int)(obstacle == NO_OBSTACLE ? crossing.edge : NO_EDGE);
}
