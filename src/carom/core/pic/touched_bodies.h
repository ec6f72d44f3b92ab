/* Bodies that a disc touches without normal speed.

   After an impact with restitution 0, two bodies have no relative velocity along the normal. In floats, a rounding
   error of the normal velocity remains, which must not cause another impact. So the contact and its normal are stored:
   the disc does not hit the body again until an impact changes the disc's velocity along the stored normal. An impact
   whose normal is orthogonal to the stored normal does not change the velocity along the stored normal, unless friction
   acts. Any other impact changes the velocity along the stored normal.

   Each component of a unit normal has two rounding errors. So the computed scalar product of two orthogonal normals is
   at most CAROM_ERROR. A change of a velocity by less than CAROM_ERROR times the velocity is smaller than the rounding
   error of the velocity. The limit CAROM_ERROR also applies when a driven wall begins another leg (straight part of its
   path). See docs/theory/pic.md, section "Contacts after restitution 0". */

#pragma once

#include "carom/core/carom_core.h"
#include "carom/core/constants.h"

enum {
    /* In the plane, the components along two normals that are not parallel determine a velocity. A third entry is
       needed if a wall is stored twice. */
    MOST_TOUCHED = 3
};

/* times until which a contact lasts, in seconds since the start; infinity for a body at rest */
typedef struct TouchEnd {
    double until; /* end of the contact if no other impact changes the velocity of the disc */
    double sure;  /* end of the contact even if another impact changes the velocity of the disc along the tangent */
} TouchEnd;

typedef struct Touched {
    int body; /* i for disc i; -1 - k for obstacle or wall k */
    double nx; /* unit normal of the impact, in either direction */
    double ny;
    TouchEnd end;
} Touched;

typedef struct TouchedBodies {
    int count;
    Touched bodies[MOST_TOUCHED]; /* sorted by time, oldest first */
} TouchedBodies;

/* Return the contact with a body if the contact lasts beyond `time`, in seconds since the start; otherwise NULL. */
static inline const Touched *find_touched(const TouchedBodies *t, ptrdiff_t body, double time) {
    for (int k = 0; k < t->count; k++) {
        if (t->bodies[k].body == body) {
            return time < t->bodies[k].end.until ? &t->bodies[k] : NULL;
        }
    }
    return NULL;
}

/* Return whether a disc touches a body. The body must not be driven, because the end of the contact is ignored. */
static inline bool is_touched(const TouchedBodies *t, ptrdiff_t body) {
    return find_touched(t, body, 0.0) != NULL;
}

typedef enum Shape { /* shape of a driven body at the point where a disc touches it */
    FLAT,
    CONVEX,
    OTHER_SHAPE, /* concave, or any shape if the disc accelerates */
} Shape;

typedef struct NewContact { /* contact that an impact of a disc on a driven body has caused */
    Shape shape;
    double nx;         /* unit normal of the contact */
    double ny;
    double vx;         /* velocity of the disc */
    double vy;
    double speed;      /* sum of the absolute values of the disc's velocity components before the impact */
    double time;       /* time of the impact, in seconds since the start */
    double reach;      /* distance from the disc's centre to the centre of the body's curvature */
    double resolution; /* resolution of `reach`, in metres; 0 for a flat body */
} NewContact;

/* Return the times until which a contact with a driven body lasts. The body is on the given leg (straight part) of its
   path.

   The contact ends when the body begins a leg (straight part of its path) with another speed along the normal. A
   contact with a convex body also ends when the body begins to move back past the disc. Until a convex body moves back,
   it only separates from the disc, along the tangent of the contact. Rounding errors of velocities are multiplied by
   the time since the impact, because they change a displacement more and more. */
static inline TouchEnd contact_end(const NewContact *t, const Leg *leg) {
    double error = t->resolution / t->reach, moved = 0.0; /* `moved`: displacement to the left of the normal */
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

/* Return whether impacts can have a tangential impulse. If the tangential restitution is -1, impacts have no tangential
   impulse. */
static inline bool can_rub(const ContactFriction *contact) {
    return contact->friction > 0.0 && contact->restitution > -1.0;
}

/* After an impact of a disc on a body at `time` (since the start), update the list of bodies that the disc touches.
   `slides` is true if friction may have acted. `stops` is true if the impact leaves no relative velocity along the
   normal. */
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
