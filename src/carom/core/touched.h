/* Bodies that a disc touches with no speed along the normal.

   An impact with restitution 0 leaves two bodies without relative velocity along the normal. Floats leave a rounding of
   it instead, which must not become another impact. So the contact is kept as a fact: until an impact on the disc changes
   the velocity along that normal, the disc does not meet that body again. An impact whose normal is orthogonal changes
   nothing along it; any other does, and so does friction. Two unit normals of floats, of two roundings a component, have
   a product of at most CAROM_ERROR if they are orthogonal: what an impact changes along a normal by less than that is
   less than the rounding of the velocity itself. docs/theory/pic.md, section "Contacts after restitution 0". */

#pragma once

#include <math.h>

#include "carom/core/carom_core.h"
#include "carom/core/constants.h"

enum {
    /* In the plane two normals that are not parallel fix a velocity; the third is for a wall that is given twice. */
    MOST_TOUCHED = 3
};

typedef struct Touched {
    int body; /* disc, or -1 - that obstacle or wall */
    double nx; /* unit normal of the impact, in either direction */
    double ny;
    double until; /* when a driven body changes to another leg of its path, since the start; else infinity */
} Touched;

typedef struct TouchedBodies {
    int count;
    Touched bodies[MOST_TOUCHED]; /* the oldest first */
} TouchedBodies;

static inline bool is_touched(const TouchedBodies *t, ptrdiff_t body) {
    for (int k = 0; k < t->count; k++) {
        if (t->bodies[k].body == body) {
            return true;
        }
    }
    return false;
}

/* Note an impact of a disc on a body at a time since the start. `slides` says whether friction may have acted, `stops`
   whether the impact leaves no relative velocity along the normal. */
static inline void note_touched(TouchedBodies *t, Touched body, double time, bool slides, bool stops) {
    int kept = 0;
    for (int k = 0; k < t->count; k++) {
        const Touched *one = &t->bodies[k];
        bool is_orthogonal = fabs(one->nx * body.nx + one->ny * body.ny) <= CAROM_ERROR;
        if (!slides && is_orthogonal && one->body != body.body && one->until > time) {
            t->bodies[kept++] = *one;
        }
    }
    if (stops) {
        if (kept == MOST_TOUCHED) {
            for (int k = 1; k < kept; k++) {
                t->bodies[k - 1] = t->bodies[k];
            }
            kept -= 1;
        }
        t->bodies[kept++] = body;
    }
    t->count = kept;
}
