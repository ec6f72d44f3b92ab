/* Prediction of when a disc in straight motion leaves its cell, or hits an obstacle before that. */

#pragma once

#include "carom/core/pic/obstacle_lists.h"
#include "carom/core/pic/separation.h"

/* ---- a disc and its cell ---- */

typedef struct CellExit {
    double wait; /* seconds until the disc leaves the cell; INF for never */
    Edge edge;
} CellExit;

/* Return which edge of its cell a disc crosses first, and how long it takes to reach this edge. `row` and `column` do
   not count the ring of empty cells around the grid.

   A cell at the border of the grid extends outwards without limit, so it has no outer edge. */
static inline CellExit cell_exit(const Grid *g, const Disc *a, Index row, Index column) {
    Index right = a->vx > 0.0;
    Index up = a->vy > 0.0;
    double across = a->vx != 0.0 ? ((g->x0 + (double)(column + right) * g->width) - a->x) / a->vx : CAROM_INF;
    double along = a->vy != 0.0 ? ((g->y0 + (double)(row + up) * g->width) - a->y) / a->vy : CAROM_INF;
    across = column == right * (g->columns - 1) ? CAROM_INF : across;
    along = row == up * (g->rows - 1) ? CAROM_INF : along;
    Index is_vertical = along < across;
    return (CellExit){lesser(along, across), (Edge)(LEFT + right + is_vertical * (DOWN + up - LEFT - right))};
}

/* Return whether a disc is in the area in which lists of obstacles are valid, from now until the end of a wait. */
static inline bool stays_in_area(const Grid *g, const Disc *a, double wait) {
    /* if the wait is infinite, a coordinate is NaN, and the comparisons below are false */
    Point end = position_after(a, wait);
    bool is_inside = (g->area.left <= a->x) & (a->x <= g->area.right) & (g->area.low <= a->y) & (a->y <= g->area.high);
    return is_inside & (g->area.left <= end.x) & (end.x <= g->area.right) & (g->area.low <= end.y) &
           (end.y <= g->area.high);
}

/* ---- obstacles ---- */

/* Find the first wall in a list that a disc hits within `wait` seconds. Return how long the disc takes to reach the
   wall, and set `obstacle` to the wall's number.

   If the disc hits no wall within `wait`, return `wait` and set `obstacle` to NO_OBSTACLE. The time of an impact is
   `Disc.time` plus the wait, so different waits can round to the same time. If several walls are hit at the same time,
   the wall with the highest number k is first, because its body number -1 - k is the lowest. */
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

/* Find the first feature in a list that a disc hits within `wait` seconds. Arguments and results are like those of
   `find_first_wall`.

   If two features of one wall are hit at the same time, the feature with the shorter wait is first. If both waits are
   also equal, the feature with the lower number is first. If features of two walls are hit at the same time, the wall
   with the higher number is first. */
static inline double find_first_feature(const State *s, Index i, const Disc *a, const int *numbers, double wait,
                                        Index *obstacle) {
    Mover mover = mover_of(a);
    double latest = wait + CAROM_TIME_ERROR * (a->time + wait);
    *obstacle = NO_OBSTACLE;
    for (; *numbers != NO_OBSTACLE; numbers++) {
        Index k = *numbers;
        const Feature *f = &s->features[k];
        if (is_left_for_good(s, i, k, 0.0))
            continue;
        double found = feature_impact_wait(a, &mover, f, path_start(s, i, k, a->last), latest);
        if (found < wait || (*obstacle != NO_OBSTACLE && f->wall != s->features[*obstacle].wall &&
                             a->time + found == a->time + wait)) {
            wait = found;
            latest = wait + CAROM_TIME_ERROR * (a->time + wait);
            *obstacle = k;
        }
    }
    return wait;
}

/* ---- the prediction ---- */

/* Predict when disc `i` crosses an edge of its cell, or hits an obstacle (a feature or a wall) before that.

   If both times are equal, predict the crossing, because the list of the next cell also contains the obstacle. */
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
    /* the loop has at most two iterations: the second iteration checks all obstacles, because the disc may leave the
       area in which the list is valid. Each function has a single call, so that compilers inline it */
    while (has_list) {
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
