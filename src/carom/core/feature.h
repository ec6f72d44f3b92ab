/* A struct for features of walls of all kinds, and a struct for a disc relative to a wall.

   A feature is a part of a wall that a disc can hit: the line of a half-plane, a face, a vertex, or the outside or
   inside of an arc. A face is one side of a straight edge of a finite wall. `carom/core/input_rows.py` writes a feature
   as a row of FEATURE_NUMBERS floats, and `feature_from` reads it. Lengths are in metres, velocities in metres per
   second. */

#pragma once

#include "carom/core/arithmetic/double_double.h"

/* The kinds of features. `input_rows.py` uses the same numbers. */
typedef enum FeatureKind {
    PLANE = 0, /* the line that bounds a half-plane */
    FACE = 1,
    VERTEX = 2,
    OUTER_ARC = 3,
    INNER_ARC = 4,
} FeatureKind;

typedef struct Feature {
    FeatureKind kind;
    int wall;
    bool whole;  /* whether the feature has no ends, because it is a whole circle or a vertex */
    bool reflex; /* for an arc: whether it is longer than half a circle */
    double half_width;
    /* smallest radius of discs that do not fit into the arc, in metres. Discs with a smaller radius hit the inside of
       the arc. Other discs hit the arc's stops instead (see `_build_stops` in wall_parts.py). */
    double fits_below;
    double nx;         /* for a half-plane or face: unit normal that points to the free side, rounded to floats */
    double ny;
    DoubleDouble x; /* start of a face, position of a vertex, centre of an arc, or a point of a half-plane */
    DoubleDouble y;
    DoubleDouble size; /* length of a face, radius of an arc, 0 for a vertex */
    /* for a face: vector from its start to its end; for an arc: vector from its centre to its start */
    DoubleDouble ex;
    DoubleDouble ey;
    DoubleDouble fx; /* for a face: its end; for an arc: vector from its centre to its end */
    DoubleDouble fy;
} Feature;

/* Length of a row of `input_rows.py`. */
enum { FEATURE_NUMBERS = 22 };

/* Position and velocity of a disc relative to a wall, and the disc's radius. */
typedef struct Mover {
    DoubleDouble x;
    DoubleDouble y;
    DoubleDouble ux;
    DoubleDouble uy;
    double radius;
} Mover;

static inline DoubleDouble pair_at(const double *row) {
    return (DoubleDouble){row[0], row[1]};
}

/* Return the feature that a row of `input_rows.py` describes. */
static inline Feature feature_from(const double *row) {
    return (Feature){
        .kind = (FeatureKind)(int)row[0],
        .wall = (int)row[1],
        .whole = row[2] != 0.0,
        .reflex = row[3] != 0.0,
        .half_width = row[4],
        .fits_below = row[5],
        .nx = row[6],
        .ny = row[7],
        .x = pair_at(row + 8),
        .y = pair_at(row + 10),
        .size = pair_at(row + 12),
        .ex = pair_at(row + 14),
        .ey = pair_at(row + 16),
        .fx = pair_at(row + 18),
        .fy = pair_at(row + 20),
    };
}

/* Return a disc relative to a wall that does not move. */
static inline Mover mover_at(double x, double y, double vx, double vy, double radius) {
    return (Mover){{x, 0.0}, {y, 0.0}, {vx, 0.0}, {vy, 0.0}, radius};
}
