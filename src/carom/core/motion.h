/* Motion of a disc: its path, and when that path reaches another disc, an obstacle, or an edge of a cell.

   A free disc moves in a straight line at constant velocity from its own time on. Everything that relies on this is in
   this file: another kind of motion is another branch in these functions. The exact times are those of pair.h and
   feature_time.h. */

#pragma once

#include <math.h>

#include "carom/core/feature_time.h"
#include "carom/core/pair.h"
#include "carom/core/state.h"

typedef struct Point {
    double x;
    double y;
} Point;

/* ---- position ---- */

/* Return a disc's centre after a wait, counted from its own time. */
static inline Point position_after(const Disc *a, double wait) {
    return (Point){a->x + a->vx * wait, a->y + a->vy * wait};
}

/* Return a disc's centre at a time. */
static inline Point position_at(const Disc *a, double time) {
    return position_after(a, time - a->time);
}

/* Move a disc along its path to a time, which becomes its own. A disc that never moves keeps the time of the start. */
static inline void move_to(Disc *a, double time) {
    if (a->inverse_mass > 0.0) {
        Point centre = position_at(a, time);
        a->x = centre.x;
        a->y = centre.y;
        a->time = time;
    }
}

/* Return a disc at its own time as a wall sees it. */
static inline Mover mover_of(const Disc *a) {
    return mover_at(a->x, a->y, a->vx, a->vy, a->radius);
}

/* ---- two discs ---- */

typedef struct RelativeMotion { /* of a disc b, as seen from a disc a */
    double start;               /* the later of their own times */
    double dx;                  /* centre at that time */
    double dy;
    double ux; /* velocity */
    double uy;
} RelativeMotion;

/* Return how disc b moves as seen from disc a. */
static inline RelativeMotion relative_motion(const Disc *a, const Disc *b) {
    double start = greater(a->time, b->time);
    Point from = position_at(a, start);
    Point to = position_at(b, start);
    return (RelativeMotion){start, to.x - from.x, to.y - from.y, b->vx - a->vx, b->vy - a->vy};
}

/* Return when two discs collide on their present paths, infinity for never.

   The order of the discs matters for rounding: the one with the lower number is first. */
static inline double pair_impact_time(const Disc *a, const Disc *b) {
    double start = greater(a->time, b->time);
    Point first = position_at(a, start);
    Point second = position_at(b, start);
    return start + pair_time(first.x, first.y, a->vx, a->vy, a->radius, second.x, second.y, b->vx, b->vy, b->radius);
}

/* ---- a disc and an obstacle ---- */

/* Return how long a disc takes to reach a wall; infinity for never, or if it certainly takes longer than `wait`.

   Times that may round to the time after `wait` are never left out, even if all roundings are against it. */
static inline double wall_impact_wait(const Disc *a, const Wall *w, double wait) {
    Bounded toward = approach(a->vx, a->vy, w->nx, w->ny);
    Bounded rim = approach(a->x - w->x, a->y - w->y, w->nx, w->ny);
    double gap = rim.value - a->radius - (rim.error + CAROM_ERROR * a->radius);
    if (toward.value > toward.error ||
        gap > (toward.error - toward.value) * (wait + CAROM_TIME_ERROR * (a->time + wait)))
        return CAROM_INF;
    return wall_time(a->x, a->y, a->vx, a->vy, a->radius, w->x, w->y, w->nx, w->ny);
}

/* Return whether a disc's path certainly misses the circle around the middle of a face that contains all touches of it. */
static inline bool misses_face_circle(const Disc *a, const Feature *face, double reach) {
    double dx = (face->x.high - a->x) + 0.5 * face->ex.high;
    double dy = (face->y.high - a->y) + 0.5 * face->ey.high;
    /* Enlarged by more than the roundings of the middle, as seen from the disc, and of the sum. */
    double circle = (reach + 0.5 * face->size.high) * (1.0 + 4.0 * CAROM_ERROR) + 4.0 * CAROM_ERROR * (fabs(dx) + fabs(dy));
    Bounded d = discriminant(dx, dy, a->vx, a->vy, circle);
    return d.value < -d.error;
}

/* Return whether a disc certainly does not reach a feature within a wait, even if all roundings are against it.

   This includes a face whose line the centre is behind: the disc can only meet its other side. Error bounds are those of
   eight roundings of a term, or of sixteen of a distance. */
static inline bool is_out_of_reach(const Disc *a, const Feature *f, double wait) {
    double reach = a->radius + f->half_width;
    if (f->kind <= FACE) {
        Bounded toward = approach(a->vx, a->vy, f->nx, f->ny);
        Bounded rim = approach(a->x - f->x.high, a->y - f->y.high, f->nx, f->ny);
        if (f->kind == FACE && rim.value < -rim.error)
            return true;
        double gap = rim.value - reach - (rim.error + CAROM_ERROR * reach);
        if (toward.value > toward.error || gap > (toward.error - toward.value) * wait)
            return true;
        return f->kind == FACE && misses_face_circle(a, f, reach);
    }
    double dx = (a->x - f->x.high) - f->x.low;
    double dy = (a->y - f->y.high) - f->y.low;
    double away = sqrt(dx * dx + dy * dy);
    double touch = f->kind == INNER_ARC ? f->size.high - reach : f->size.high + reach;
    if (f->kind == INNER_ARC && touch < 0.0)
        return false; /* it may not fit inside: rare, so it is not decided here */
    double gap = f->kind == INNER_ARC ? fabs(away - touch) : away - touch;
    return gap - 2.0 * CAROM_ERROR * (away + f->size.high + reach) > (fabs(a->vx) + fabs(a->vy)) * wait;
}

/* Return how long a disc takes to reach a feature; infinity for never, or if it certainly takes longer than `wait`.

   `mover` is the disc as `mover_of` returns it. `has_just_left` says that the feature is what the disc met last on this
   path: it can meet only the inside of an arc again. */
static inline double feature_impact_wait(const Disc *a, const Mover *mover, const Feature *f, bool has_just_left,
                                         double wait) {
    if (has_just_left ? f->kind != INNER_ARC : is_out_of_reach(a, f, wait))
        return CAROM_INF;
    return feature_time(mover, f, has_just_left).time;
}

/* ---- a disc and its cell ---- */

typedef struct CellExit {
    double wait; /* INF for never */
    Edge edge;
} CellExit;

/* Return which edge of a cell a disc crosses first, and how long it takes. Row and column are those without the ring.

   A cell at the rim of the grid is unbounded outwards. */
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
