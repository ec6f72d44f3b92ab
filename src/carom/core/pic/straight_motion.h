/* Straight motion of a disc: its position on its path, and when it reaches another disc or an obstacle.

   The path of a disc begins at the time `Disc.time`. From the start of its path until its next impact, a disc moves in
   a straight line at constant velocity. For discs that accelerate, parabola_motion.h contains the same functions. Exact
   times are computed by pair_time.h and feature_time.h. */

#pragma once

#include "carom/core/pic/state.h"

/* ---- position ---- */

/* Return a disc's centre `wait` seconds after the start of its path. */
static inline Point position_after(const Disc *a, double wait) {
    return (Point){a->x + a->vx * wait, a->y + a->vy * wait};
}

static inline Point position_at(const Disc *a, double time) {
    return position_after(a, time - a->time);
}

/* Move a disc along its path to a time. The disc's next path begins at that time. For a disc that never moves,
   `Disc.time` stays 0. */
static inline void move_to(Disc *a, double time) {
    if (a->inverse_mass > 0.0) {
        Point centre = position_at(a, time);
        a->x = centre.x;
        a->y = centre.y;
        a->time = time;
    }
}

/* Return a disc at the start of its path as a `Mover`, the type that functions for walls require. */
static inline Mover mover_of(const Disc *a) {
    return mover_at(a->x, a->y, a->vx, a->vy, a->radius);
}

/* ---- two discs ---- */

typedef struct RelativeMotion { /* motion of disc b relative to disc a */
    double start;               /* the later of the two times at which the paths of the discs began */
    double dx;                  /* centre of b minus centre of a, at the time `start` */
    double dy;
    double ux; /* velocity */
    double uy;
} RelativeMotion;

static inline RelativeMotion relative_motion(const Disc *a, const Disc *b) {
    double start = greater(a->time, b->time);
    Point from = position_at(a, start);
    Point to = position_at(b, start);
    return (RelativeMotion){start, to.x - from.x, to.y - from.y, b->vx - a->vx, b->vy - a->vy};
}

/* Return when two discs collide on their present paths; infinity for never.

   Disc a must have the lower number, because the order of the discs affects rounding. */
static inline double pair_impact_time(const Disc *a, const Disc *b) {
    double start = greater(a->time, b->time);
    Point first = position_at(a, start);
    Point second = position_at(b, start);
    return start + pair_time(first.x, first.y, a->vx, a->vy, a->radius, second.x, second.y, b->vx, b->vy, b->radius);
}

/* ---- a disc and an obstacle ---- */

/* Return how many seconds a disc takes to reach a wall. If the disc never reaches the wall, or certainly takes longer
   than `wait`, return infinity.

   An impact after `wait` is not excluded if rounding could make it simultaneous with an impact at `wait`. */
static inline double wall_impact_wait(const Disc *a, const Wall *w, double wait) {
    Bounded toward = approach(a->vx, a->vy, w->nx, w->ny);
    Bounded rim = approach(a->x - w->x, a->y - w->y, w->nx, w->ny);
    double gap = rim.value - a->radius - (rim.error + CAROM_ERROR * a->radius);
    if (toward.value > toward.error ||
        gap > (toward.error - toward.value) * (wait + CAROM_TIME_ERROR * (a->time + wait)))
        return CAROM_INF;
    return wall_time(a->x, a->y, a->vx, a->vy, a->radius, w->x, w->y, w->nx, w->ny);
}

/* Return whether a disc certainly does not reach a feature within `wait` seconds. The bounds include rounding errors.

   The result is also true if the disc's centre is behind the line of a face, because the disc can then hit only the
   other side of the edge. Each error bound is larger than eight roundings of a term, or sixteen roundings of a
   distance. */
static inline bool is_out_of_reach(const Disc *a, const Mover *mover, const Feature *f, double wait) {
    double reach = a->radius + f->half_width;
    if (f->kind <= FACE) {
        Bounded toward = approach(a->vx, a->vy, f->nx, f->ny);
        Bounded rim = approach(a->x - f->x.high, a->y - f->y.high, f->nx, f->ny);
        if (f->kind == FACE && rim.value < -rim.error)
            return true;
        double gap = rim.value - reach - (rim.error + CAROM_ERROR * reach);
        if (toward.value > toward.error || gap > (toward.error - toward.value) * wait)
            return true;
        return f->kind == FACE && gap > 0.0 && is_certainly_beside(mover, f);
    }
    double dx = (a->x - f->x.high) - f->x.low;
    double dy = (a->y - f->y.high) - f->y.low;
    if (f->kind != INNER_ARC)
        return is_passed(dx, dy, a->vx, a->vy, f->size.high + reach, wait);
    double touch = f->size.high - reach;
    if (touch < 0.0)
        return false; /* the disc may be too wide for the arc; in this rare case the caller computes the exact time */
    double away = sqrt(dx * dx + dy * dy);
    double gap = fabs(away - touch) - 2.0 * CAROM_ERROR * (away + f->size.high + reach);
    return gap > (fabs(a->vx) + fabs(a->vy)) * wait;
}

/* Return how many seconds a disc takes to reach a feature. If the disc never reaches the feature, or certainly takes
   longer than `wait`, return infinity.

   `mover` must be the result of `mover_of` for the disc. */
static inline double feature_impact_wait(const Disc *a, const Mover *mover, const Feature *f, PathStart start,
                                         double wait) {
    if (start == ELSEWHERE && is_out_of_reach(a, mover, f, wait))
        return CAROM_INF;
    return feature_time(mover, f, start).time;
}
