/* Prescribed motion: position and velocity of a driven body at a time. The path of a driven body consists of legs,
   which are parts with constant velocity.

   The coordinates of a driven wall's features are those at the start of the run. To compare a disc with a driven wall,
   the disc's position is converted to coordinates that move with the wall. The position of a driven disc is its centre
   at the start of the run plus the displacement on its path. */

#pragma once

#include "carom/core/pic/straight_motion.h"

/* Return the row of a body, or NULL if the body is not driven. Wall k has the number -1 - k. */
static inline const Driven *driven_row(const Driving *d, Index body) {
    for (Index k = 0; k < d->count; k++) {
        if (d->rows[k].body == body)
            return &d->rows[k];
    }
    return NULL;
}

static inline bool is_driven_wall(const Driving *d, Index wall) {
    const Driven *row = driven_row(d, -1 - wall);
    return row != NULL && row->leg_count > 0;
}

/* Return the number of the leg (part with constant velocity) on which a body is at a time. For a time before the first
   leg, return the first leg. */
static inline Index leg_at(const Driving *d, const Driven *row, double time) {
    Index low = row->first_leg;
    Index high = row->first_leg + row->leg_count;
    while (high - low > 1) { /* the result is at least `low`, and below `high` */
        Index middle = (low + high) / 2;
        if (d->legs[middle].begin <= time)
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* Return the position and velocity of a disc relative to a wall, at a time on the disc's present path. `leg` is the
   part of the wall's path at that time. */
static inline Disc seen_from_leg(const Disc *a, const Leg *leg, double time) {
    Disc seen = *a;
    Point centre = position_at(a, time);
    Point moved = displacement_on(leg, time);
    seen.x = centre.x - moved.x;
    seen.y = centre.y - moved.y;
    seen.vx -= leg->vx;
    seen.vy -= leg->vy;
    seen.time = time;
    return seen;
}

static inline Disc seen_from_wall(const State *s, const Disc *a, const Driven *row, double time) {
    if (row->leg_count == 0)
        return *a;
    return seen_from_leg(a, &s->driving.legs[leg_at(&s->driving, row, time)], time);
}

static inline Surface surface_at(const State *s, const Driven *row, double time) {
    Surface surface = {0.0, 0.0, row->belt};
    if (row->leg_count > 0) {
        const Leg *leg = &s->driving.legs[leg_at(&s->driving, row, time)];
        surface.vx = leg->vx;
        surface.vy = leg->vy;
    }
    return surface;
}

/* Return a driven disc's position and velocity at a time within a leg (straight part) of its path. */
static inline Disc driven_disc_on(const Driven *row, const Disc *b, const Leg *leg, double time) {
    Disc moved = *b;
    Point displacement = displacement_on(leg, time);
    moved.x = row->x + displacement.x;
    moved.y = row->y + displacement.y;
    moved.vx = leg->vx;
    moved.vy = leg->vy;
    return moved;
}

/* If disc `i` is driven, move the disc to its position at a time. */
static inline void move_driven_disc(State *s, Index i, double time) {
    if (s->discs[i].inverse_mass > 0.0)
        return;
    const Driven *row = driven_row(&s->driving, i);
    if (row != NULL)
        s->discs[i] = driven_disc_on(row, &s->discs[i], &s->driving.legs[leg_at(&s->driving, row, time)], time);
}

/* Convert the start and end times of all legs: from seconds since the start of the run, to seconds since the present
   epoch. */
static inline void count_legs_from_epoch(State *s) {
    const Clock *clock = &s->clock;
    for (Index k = 0; k < s->driving.leg_count; k++) {
        Leg *leg = &s->driving.legs[k];
        leg->begin = (leg->begins - clock->epoch) - clock->epoch_rest;
        leg->end = (leg->ends - clock->epoch) - clock->epoch_rest;
    }
}

/* If disc `i` hit a driven body last and this body has begun another leg (straight part of its path) since, clear
   `Disc.last`. The disc may then hit the body again. */
static inline void clear_last_of_ended_leg(State *s, Index i) {
    Disc *a = &s->discs[i];
    if (a->last == NO_BODY)
        return;
    Index body = a->last >= 0 ? a->last : -1 - (Index)s->features[-1 - a->last].wall;
    const Driven *row = driven_row(&s->driving, body);
    if (row != NULL && row->leg_count > 1 &&
        s->driving.legs[leg_at(&s->driving, row, a->time)].end <= s->clock.now)
        a->last = NO_BODY;
}
