/* Bodies that a disc touches without normal speed.

   An impact with restitution 0 leaves two bodies without relative velocity along the normal. In floats a rounding error
   of this velocity remains, and it must not cause another impact. So the contact is stored as a fact: the disc does not
   hit that body again until an impact on the disc changes the velocity along that normal. An impact with an orthogonal
   normal does not change this velocity. Any other impact changes it, and so does friction.

   Each component of a unit normal has two roundings. If two such normals are orthogonal, their computed scalar product
   is therefore at most CAROM_ERROR. If the velocity along a normal changes by less than this fraction, the change is
   smaller than the rounding of the velocity itself. The same is true when a driven wall begins another leg of its path.
   See docs/theory/pic.md, section "Contacts after restitution 0". */

#pragma once

#include "carom/core/carom_core.h"
#include "carom/core/constants.h"

enum {
    /* In the plane, two normals that are not parallel fix a velocity. A third entry is needed for a wall that is stored
       twice. */
    MOST_TOUCHED = 3
};

typedef struct TouchEnd { /* times since the start up to which a contact lasts; infinity for a body at rest */
    double until; /* if no other impact changes the velocity of the disc */
    double sure;  /* even if another impact changes the velocity of the disc along the tangent */
} TouchEnd;

typedef struct Touched {
    int body; /* disc i as i; obstacle or wall k as -1 - k */
    double nx; /* unit normal of the impact; its sense does not matter */
    double ny;
    TouchEnd end;
} Touched;

typedef struct TouchedBodies {
    int count;
    Touched bodies[MOST_TOUCHED]; /* oldest first */
} TouchedBodies;

/* Return the contact with a body if it still lasts at `time`, counted from the start of the run; otherwise NULL. */
static inline const Touched *find_touched(const TouchedBodies *t, ptrdiff_t body, double time) {
    for (int k = 0; k < t->count; k++) {
        if (t->bodies[k].body == body) {
            return time < t->bodies[k].end.until ? &t->bodies[k] : NULL;
        }
    }
    return NULL;
}

/* Return whether a disc touches a body. The body must not be driven, since the end of the contact is ignored. */
static inline bool is_touched(const TouchedBodies *t, ptrdiff_t body) {
    return find_touched(t, body, 0.0) != NULL;
}

typedef enum Shape { /* of a driven body where a disc touches it */
    FLAT,
    CONVEX,
    OTHER_SHAPE, /* concave, or of any shape if the disc accelerates */
} Shape;

typedef struct NewContact { /* contact of a disc and a driven body, which an impact has caused */
    Shape shape;
    double nx;         /* unit normal of the contact */
    double ny;
    double vx;         /* velocity of the disc */
    double vy;
    double speed;      /* sum of the absolute values of the disc's velocity components before the impact */
    double time;       /* of the impact, in seconds since the start */
    double reach;      /* distance from the disc's centre to the centre of the body's curvature */
    double resolution; /* of that distance, in metres; 0 for a flat body */
} NewContact;

/* Return up to which times a contact with a driven body lasts. The body is on the given leg.

   The contact ends when a leg begins on which the body's speed along the normal is different. For a convex body it also
   ends when the body begins to move back past the disc: until then the two only separate, along the tangent of the
   contact. Rounding errors of the impact add to a displacement as time passes, so they count with the elapsed time. */
static inline TouchEnd contact_end(const NewContact *t, const Leg *leg) {
    double error = t->resolution / t->reach, moved = 0.0; /* `moved`: to the left of the normal */
    TouchEnd end = {leg->ends, leg->ends};
    if (t->shape == OTHER_SHAPE || error > CAROM_COARSEST_NORMAL)
        return end;
    for (const Leg *last = leg; last->ends < CAROM_INF;) {
        moved += (t->nx * (last->vy - t->vy) - t->ny * (last->vx - t->vx)) *
                 (last->ends - (last == leg ? t->time : last->begins));
        last += 1;
        double ux = last->vx - leg->vx, uy = last->vy - leg->vy, wx = last->vx - t->vx, wy = last->vy - t->vy;
        double sizes = fabs(last->vx) + fabs(last->vy) + fabs(leg->vx) + fabs(leg->vy);
        double noise = t->resolution + (CAROM_ERROR + error) * (t->speed + sizes) * (last->begins - t->time);
        bool is_equal = fabs(ux * t->nx + uy * t->ny) <= CAROM_ERROR * sizes + error * (fabs(wx) + fabs(wy));
        bool moves_back = t->shape == CONVEX && fabs(moved) > noise && moved * (t->nx * wy - t->ny * wx) < 0.0;
        if (!is_equal || moves_back)
            break;
        end.until = last->ends;
    }
    if (t->shape == FLAT)
        end.sure = end.until;
    return end;
}

/* Return whether impacts can have a tangential impulse. With the tangential restitution -1 they have none. */
static inline bool can_rub(const ContactFriction *contact) {
    return contact->friction > 0.0 && contact->restitution > -1.0;
}

/* Store an impact of a disc on a body at a time since the start. `slides` is true if friction may have acted. `stops`
   is true if the impact leaves no relative velocity along the normal. */
static inline void note_touched(TouchedBodies *t, Touched body, double time, bool slides, bool stops) {
    int kept = 0;
    for (int k = 0; k < t->count; k++) {
        const Touched *one = &t->bodies[k];
        bool is_orthogonal = fabs(one->nx * body.nx + one->ny * body.ny) <= CAROM_ERROR;
        if (!slides && is_orthogonal && one->body != body.body && one->end.sure > time) {
            t->bodies[kept] = *one;
            t->bodies[kept++].end.until = one->end.sure;
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
