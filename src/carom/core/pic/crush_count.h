/* Crushes: discs that bounce to and fro between two bodies that close in on them.

   This file counts such impacts in succession. After many, `crush.h` decides whether the disc is crushed. */

#pragma once

#include <math.h>

#include "carom/core/pic/crush.h"
#include "carom/core/pic/state.h"

/* Count an impact of a disc on a body. The normal points to the disc. Return whether the disc bounces to and fro. */
static inline bool goes_to_and_fro(ToAndFro *t, int body, int obstacle, double nx, double ny) {
    bool is_opposite = t->last != NO_BODY && t->last != body && t->nx == -nx && t->ny == -ny;
    if (is_opposite) {
        t->across = t->last;
        t->across_obstacle = t->last_obstacle;
    } else if (!(body >= 0 && t->last == body && t->nx == nx && t->ny == ny)) {
        t->across = NO_BODY;
        t->row = -1;
    }
    t->last = body;
    t->last_obstacle = obstacle;
    t->nx = nx;
    t->ny = ny;
    t->row += 1;
    return t->row > 0;
}

/* Return whether a disc that bounces to and fro is crushed before the requested end. If so, set `State.crush`. */
static CAROM_NOINLINE bool is_crushed(State *s, Index disc) {
    Crush crush;
    if (!find_crush(s, disc, &crush))
        return false;
    crush.time = s->clock.epoch + (s->clock.epoch_rest + crush.time);
    if (crush.time > s->until)
        return false;
    s->crush = crush;
    return true;
}

/* Count an impact of a free disc on a body; return whether the disc is crushed before the requested end. */
static inline bool is_crushed_by(State *s, Index disc, Index body, int obstacle, double nx, double ny) {
    ToAndFro *t = &s->to_and_fro[disc];
    return goes_to_and_fro(t, (int)body, obstacle, nx, ny) && t->row > s->standstill && is_crushed(s, disc);
}

/* Count an impact of two discs; return whether one of them is crushed. */
static inline bool is_one_crushed(State *s, Index i, Index j) {
    const Disc *a = &s->discs[i];
    const Disc *b = &s->discs[j];
    double dx = b->x - a->x;
    double dy = b->y - a->y;
    double distance = sqrt(dx * dx + dy * dy);
    double nx = dx / distance;
    double ny = dy / distance;
    bool is_first = a->inverse_mass > 0.0 && is_crushed_by(s, i, j, NO_OBSTACLE, -nx, -ny);
    bool is_second = b->inverse_mass > 0.0 && is_crushed_by(s, j, i, NO_OBSTACLE, nx, ny);
    return is_first || is_second;
}
