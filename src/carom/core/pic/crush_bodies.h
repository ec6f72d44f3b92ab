/* Functions for crush.h: the state and path of a body at an instant, and whether other bodies may come near a disc. */

#pragma once

#include "carom/core/pic/obstacle_lists.h"

/* ---- bodies at an instant ---- */

typedef struct LegsAhead { /* the legs (straight parts) of a body's path from a given time onwards */
    const Leg *legs;
    Index count; /* number of legs; 1 for a body that is not driven */
} LegsAhead;

static const Leg NO_MOTION = {0.0, CAROM_INF, 0.0, CAROM_INF, 0.0, 0.0, 0.0, 0.0};

static inline LegsAhead legs_ahead(const State *s, Index body, double time) {
    const Driven *row = driven_row(&s->driving, body);
    if (row == NULL || row->leg_count == 0)
        return (LegsAhead){&NO_MOTION, 1};
    Index first = leg_at(&s->driving, row, time);
    return (LegsAhead){&s->driving.legs[first], row->first_leg + row->leg_count - first};
}

/* Return the greatest speed of a driven body at and after a given time. If the body is not driven, return 0. */
static inline double top_speed(const State *s, Index body, double time) {
    LegsAhead ahead = legs_ahead(s, body, time);
    double fastest = 0.0;
    for (Index n = 0; n < ahead.count; n++)
        fastest = greater(fastest, nearest_length(ahead.legs[n].vx, ahead.legs[n].vy));
    return fastest;
}

static inline double belt_of(const State *s, Index wall) {
    const Driven *row = driven_row(&s->driving, -1 - wall);
    return row == NULL ? 0.0 : row->belt;
}

/* Return whether a disc's impact on a wall can change the disc's spin or its velocity along the wall. */
static inline bool rubs_on(const State *s, Index wall) {
    return s->wall_laws[wall].wall_contact.friction > 0.0 || s->accelerated.rolling_resistance > 0.0;
}

static inline double stored_spin(const State *s, Index i) {
    return s->turning == NULL ? 0.0 : s->turning[i].spin;
}

/* Return the distance between a disc's rim and a feature. `seen` is the disc's motion relative to the feature's
   wall. */
static inline double room_to_feature(const Feature *f, const Motion *seen, double radius) {
    if (f->kind == PLANE)
        return (seen->x - f->x.high) * f->nx + (seen->y - f->y.high) * f->ny - radius;
    return distance_to(f, seen->x, seen->y).value - f->half_width - radius;
}

/* ---- other bodies that may hit discs between two approaching bodies ---- */

typedef bool (*IsAmong)(const State *s, const void *bodies, Index body);

/* Return whether another body may come near disc `i` within `seconds`, if no path changes. In `seconds`, the disc moves
   at most the distance `way`, plus the distance due to gravity. Ignore bodies for which `is_among` is true: the two
   approaching bodies, and the discs between them. */
static inline bool is_disturbed(const State *s, Index i, IsAmong is_among, const void *bodies, double way,
                                double seconds) {
    const Disc *a = &s->discs[i];
    double now = a->time;
    double fall = 0.5 * nearest_length(s->accelerated.gx, s->accelerated.gy) * seconds * seconds;
    way += fall;
    for (Index k = 0; k < s->feature_count; k++) {
        Index wall = s->features[k].wall;
        if (is_among(s, bodies, -1 - wall))
            continue;
        Motion seen = motion_seen_from_wall(s, i, wall);
        if (room_to_feature(&s->features[k], &seen, a->radius) <= way + top_speed(s, -1 - wall, now) * seconds)
            return true;
    }
    for (Index j = 0; j < s->disc_count; j++) {
        if (j == i || is_among(s, bodies, j))
            continue;
        Motion other = disc_motion(s, j, (Instant){now, 0.0});
        double room = nearest_length(other.x - a->x, other.y - a->y) - a->radius - s->discs[j].radius;
        double fastest = greater(nearest_length(other.vx, other.vy), top_speed(s, j, now));
        if (room <= way + fall + fastest * seconds)
            return true;
    }
    return false;
}
