/* Features of walls, one struct for each kind, and a disc as seen from a wall.

   A feature is the smallest part of a wall that a disc can meet: the line of a half-plane, a face (one straight edge of
   a finite wall), a vertex, or an arc from outside or inside. `carom/core/numbered.py` writes a feature as a row of
   FEATURE_NUMBERS floats, which `feature_from` reads. Lengths are in metres, velocities in metres per second. */

#pragma once

#include <stdbool.h>

#include "carom/core/double_double.h"

/* `numbered.py` has the same numbers. */
typedef enum FeatureKind {
    PLANE = 0, /* the whole line of a half-plane */
    FACE = 1,
    VERTEX = 2,
    OUTER_ARC = 3,
    INNER_ARC = 4,
} FeatureKind;

typedef struct Feature {
    FeatureKind kind;
    int wall;
    bool whole;  /* an arc that is the whole circle, or a vertex: it has no ends */
    bool reflex; /* an arc of more than half a circle */
    double half_width;
    double fits_below; /* radius: of an arc from inside and its stops */
    double nx;         /* of a plane or face: unit normal into the free side, to the nearest floats */
    double ny;
    DoubleDouble x; /* start of a face, place of a vertex, centre of an arc, or a point of a plane */
    DoubleDouble y;
    DoubleDouble size; /* length of a face, radius of an arc, 0 for a vertex */
    DoubleDouble ex;   /* of a face: from start to end; of an arc: from the centre to the start */
    DoubleDouble ey;
    DoubleDouble fx; /* of a face: its end; of an arc: from the centre to the end */
    DoubleDouble fy;
} Feature;

/* Length of a row of `numbered.py`. */
enum { FEATURE_NUMBERS = 22 };

/* A disc as seen from a wall. */
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

/* Return the feature that a row of `numbered.py` describes. */
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

/* Return a disc as seen from a wall that does not move. */
static inline Mover mover_at(double x, double y, double vx, double vy, double radius) {
    return (Mover){{x, 0.0}, {y, 0.0}, two_diff(vx, 0.0), two_diff(vy, 0.0), radius};
}
