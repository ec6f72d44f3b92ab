/* Bounds of skipping: how long a disc can meet nothing, as a lower bound that holds for PIT's rounded paths.

   `docs/physics.md`, section 4, derives it. The root is that of a contact distance enlarged by `CAROM_PATH_MARGIN` of
   what |x| + |y| of both discs can grow to over `MAX_BOUND_FRAMES` frames. If anything over- or underflows, the
   comparisons make the wait 0, and no test is skipped. */

#ifndef CAROM_PIT_BOUNDS_H
#define CAROM_PIT_BOUNDS_H

#include <math.h>

#include "carom/core/constants.h"
#include "carom/core/pit_state.h"

enum { MAX_BOUND_FRAMES = 65536 }; /* 2^16: after that many a bound is computed again */

/* Return what |x| + |y| of a disc can grow to while a bound is used, metres. */
static inline double extent_of(const State *s, const Disc *a) {
    return fabs(a->x) + fabs(a->y) + (fabs(a->vx) + fabs(a->vy)) * s->horizon;
}

/* Return a wait less its own rounding error; 0 if it is not a finite number above 0. */
static inline double shorten(double wait) {
    return 0.0 < wait && wait < CAROM_INF ? wait * (1.0 - CAROM_PATH_MARGIN) : 0.0;
}

/* Return for how many seconds two discs can't interfere on their present paths; INF for never, or CAROM_IN_CONTACT.

   0 if they may interfere, or may soon, at the next frame. */
static inline double bound_pair_wait(const State *s, const Disc *a, const Disc *b, double extent_a) {
    double dx = b->x - a->x;
    double dy = b->y - a->y;
    double ux = b->vx - a->vx;
    double uy = b->vy - a->vy;
    double along = dx * ux + dy * uy;
    double squared = dx * dx + dy * dy;
    double margin = CAROM_PATH_MARGIN * (extent_a + extent_of(s, b));
    double contact = a->radius + b->radius + margin;
    if (squared > contact * contact) {
        if (along >= 0.0)
            return CAROM_INF;
        double across = dx * uy - dy * ux;
        double d = (ux * ux + uy * uy) * (contact * contact) - across * across;
        if (d < 0.0)
            return CAROM_INF;
        return shorten((squared - contact * contact) / (sqrt(d) - along));
    }
    if (along < 0.0) /* the very number that PIT tests */
        return CAROM_IN_CONTACT;
    /* While they separate, `along` grows, except for rounding. At rest to each other, it is 0 and stays 0. */
    if (along > margin * (fabs(ux) + fabs(uy)) || (ux == 0.0 && uy == 0.0))
        return CAROM_INF;
    return 0.0;
}

/* Return for how many seconds a disc can't interfere with a half-plane, as `bound_pair_wait`.

   The gap is linear in time; its speed is rounded, too, by less than 2^-51 of the disc's own. */
static inline double bound_plane_wait(const Disc *a, const Wall *wall, double extent_a) {
    double along = a->vx * wall->nx + a->vy * wall->ny;
    if (along >= 0.0) /* the very number that PIT tests, at every frame */
        return CAROM_INF;
    double margin = CAROM_PATH_MARGIN * (extent_a + fabs(wall->x) + fabs(wall->y) + a->radius);
    double gap = (a->x - wall->x) * wall->nx + (a->y - wall->y) * wall->ny - a->radius - margin;
    if (gap > 0.0)
        return shorten(gap / (CAROM_PATH_MARGIN * (fabs(a->vx) + fabs(a->vy)) - along));
    return CAROM_IN_CONTACT;
}

/* Return for how many seconds a disc can't interfere with a chain, as `bound_pair_wait`.

   No nearest point of the chain approaches it faster than it moves. A disc can leave a chain that bends, or has another
   side, and meet it again. */
static inline double bound_chain_wait(const Disc *a, const Chain *chain, double extent_a) {
    if (a->vx == 0.0 && a->vy == 0.0) /* it does not approach */
        return CAROM_INF;
    double margin = CAROM_PATH_MARGIN * (extent_a + chain->size + a->radius);
    double gap = bound_distance(chain, a->x, a->y) - (chain->half_width + a->radius) - margin;
    if (gap > 0.0)
        return shorten(gap / (sqrt(a->vx * a->vx + a->vy * a->vy) * (1.0 + CAROM_PATH_MARGIN)));
    return CAROM_IN_CONTACT;
}

#endif
