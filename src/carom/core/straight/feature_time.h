/* Time of impact of a disc on any feature of a wall, in straight uniform motion. Also the gap to a feature, and the
   normal when they touch. */

#pragma once

#include <math.h>
#include <stdbool.h>

#include "carom/core/feature.h"
#include "carom/core/straight/arc_time.h"
#include "carom/core/straight/half_plane.h"
#include "carom/core/straight/line_time.h"

/* A unit vector. */
typedef struct Direction {
    double x;
    double y;
} Direction;

/* Return when a disc touches a feature.

   `just_left` says that the feature is the last thing that the disc hit on its present path. On a straight path the
   disc returns to it only if it is the inside of an arc. */
static inline Touch feature_time(const Mover *disc, const Feature *feature, bool just_left) {
    if (feature->kind == INNER_ARC)
        return inner_arc_time(disc, feature, just_left);
    if (just_left)
        return (Touch){CAROM_INF, false};
    if (feature->kind == FACE)
        return (Touch){face_time(disc, feature), false};
    if (feature->kind == PLANE) {
        double time = wall_time(disc->x.high, disc->y.high, disc->ux.high, disc->uy.high, disc->radius, feature->x.high,
                                feature->y.high, feature->nx, feature->ny);
        return (Touch){time, false};
    }
    return (Touch){outer_arc_time(disc, feature), false};
}

/* Return the unit vector from a feature to a disc that touches it. */
static inline Direction normal_at(const Feature *feature, const Mover *disc) {
    if (feature->kind == FACE || feature->kind == PLANE)
        return (Direction){feature->nx, feature->ny};
    double x = offset_between(disc->x, feature->x).high;
    double y = offset_between(disc->y, feature->y).high;
    double distance = sqrt(x * x + y * y);
    if (feature->kind == INNER_ARC)
        return (Direction){-x / distance, -y / distance};
    return (Direction){x / distance, y / distance};
}

/* Return the distance of a disc's rim from a feature, along the normal.

   The radius of an arc may be far larger than all other lengths. The difference of two distances from its centre would
   then have a large rounding error. The difference of their squares does not. */
static inline double feature_gap(const Mover *disc, const Feature *f) {
    if (f->kind == PLANE) {
        return wall_gap(disc->x.high, disc->y.high, disc->radius, f->x.high, f->y.high, f->nx, f->ny).high;
    }
    if (f->kind == FACE) {
        return face_gap(disc, f).high / f->size.high;
    }
    DoubleDouble reach = reach_of(disc, f);
    double x = disc->x.high - f->x.high, y = disc->y.high - f->y.high;
    double away = sqrt(x * x + y * y);
    double gap = excess(offset_between(disc->x, f->x), offset_between(disc->y, f->y), reach).high / (away + reach.high);
    return f->kind == INNER_ARC ? -gap : gap;
}
