/* Bounds of skipping: how long a disc can meet nothing, as a lower bound that holds for PIT's rounded paths.

   `docs/theory/pit.md` derives it. The root is that of a contact distance enlarged by `CAROM_PATH_MARGIN` of
   what |x| + |y| of both discs can grow to while a bound is used. If anything over- or underflows, the comparisons make
   the wait 0, and no test is skipped.

   A wait is a number of seconds for which two bodies can't interfere on their present paths: INF for never, 0 if they
   may interfere, or may soon, at the next frame, CAROM_IN_CONTACT if they may at this one. */

#pragma once

#include <math.h>

#include "carom/core/constants.h"
#include "carom/core/pit_impacts.h"
#include "carom/core/pit_motion.h"

enum {
    MAX_BOUND_FRAMES = 65536,      /* 2^16: after that many a bound is computed again */
    MAX_CURVED_BOUND_FRAMES = 1024 /* of curved paths, which grow with the square of the time */
};

/* ---- extents ---- */

/* Return what |x| + |y| of a disc can grow to while a bound is used, metres. */
static inline double extent_of(const State *s, const Disc *a) {
    return fabs(a->x) + fabs(a->y) + (fabs(a->vx) + fabs(a->vy)) * s->horizon + s->extra_extent;
}

/* Return the sum of the magnitudes of all that the places of driven bodies are computed from, metres. */
static inline double extent_of_paths(const State *s) {
    double extent = 0.0;
    for (Index p = 0; p < s->path_count; p++) {
        const Path *path = &s->paths[p];
        extent = greater(extent, fabs(path->x) + fabs(path->y));
        for (Index k = 0; k < path->leg_count; k++)
            extent = greater(extent, fabs(path->legs[k].moved_x) + fabs(path->legs[k].moved_y));
    }
    return 4.0 * extent;
}

/* Set how long a bound holds at most, and what gravity and paths add to extents. */
static inline void begin_bounds(State *s) {
    Index frames = s->motion == STRAIGHT ? MAX_BOUND_FRAMES : MAX_CURVED_BOUND_FRAMES;
    s->frame_span = (double)frames * (s->clock.step / s->clock.rate);
    s->horizon = s->frame_span;
    s->pull = sqrt(s->gx * s->gx + s->gy * s->gy) * (1.0 + CAROM_PATH_MARGIN);
    s->extra_extent = extent_of_paths(s) + (fabs(s->gx) + fabs(s->gy)) * s->horizon * s->horizon;
}

/* Set how long a bound holds at most from this frame on: with damping, frames are ever shorter in undamped time. */
static inline void limit_bounds(State *s) {
    double c = s->damping.rate;
    if (c > 0.0)
        s->horizon = s->frame_span * (1.0 - c * s->now) / (1.0 + c * s->frame_span) * (1.0 - CAROM_PATH_MARGIN);
}

/* ---- waits ---- */

/* Return a wait less its own rounding error; 0 if it is not a finite number above 0. */
static inline double shorten(double wait) {
    return 0.0 < wait && wait < CAROM_INF ? wait * (1.0 - CAROM_PATH_MARGIN) : 0.0;
}

/* Return how long a gap above 0 stays open, at a speed at which it closes and an acceleration that closes it. */
static inline double time_to_close(double gap, double speed, double pull) {
    double twice_mean = speed + sqrt(speed * speed + 2.0 * pull * gap);
    return twice_mean > 0.0 ? shorten(2.0 * gap / twice_mean) : CAROM_INF;
}

/* Return whether a gap certainly stays open for a time, as `time_to_close`: a quick test before it. */
static inline bool stays_open(double gap, double speed, double pull, double time) {
    return gap > 0.0 && gap * (1.0 - CAROM_PATH_MARGIN) > (speed + 0.5 * pull * time) * time;
}

/* ---- two discs ---- */

typedef struct Approach { /* of a disc b, as seen from a disc a */
    double dx;            /* centre */
    double dy;
    double ux; /* velocity */
    double uy;
    double along;   /* d.u, below 0 if they approach: the very number that PIT tests */
    double squared; /* distance */
    double margin;  /* what roundings of their paths can be, metres */
    double contact; /* sum of the radii, and the margin */
} Approach;

static inline Approach approach_of(const State *s, const Disc *a, const Disc *b, double extent_a) {
    Approach p;
    p.dx = b->x - a->x;
    p.dy = b->y - a->y;
    p.ux = b->vx - a->vx;
    p.uy = b->vy - a->vy;
    p.along = p.dx * p.ux + p.dy * p.uy;
    p.squared = p.dx * p.dx + p.dy * p.dy;
    p.margin = CAROM_PATH_MARGIN * (extent_a + extent_of(s, b));
    p.contact = a->radius + b->radius + p.margin;
    return p;
}

/* Return whether two discs may touch or overlap. */
static inline bool may_touch(const Approach *p) {
    return p->squared <= p->contact * p->contact;
}

/* Return the largest relative acceleration of two discs, of which one moves. */
static inline double relative_pull(const State *s, const Disc *a, const Disc *b) {
    int moving = (a->inverse_mass > 0.0) + (b->inverse_mass > 0.0);
    if (s->motion == STRAIGHT || (s->motion == FALLING && moving == 2))
        return 0.0;
    return s->motion == FALLING ? s->pull : (1.0 + CAROM_PATH_MARGIN) * s->deceleration * moving;
}

/* Return the wait of two discs that may touch. */
static inline double bound_touching(const State *s, const Disc *a, const Disc *b, const Approach *p) {
    if (p->along < 0.0)
        return CAROM_IN_CONTACT;
    /* At rest to each other, `along` is 0 and stays 0: both velocities get the same roundings. */
    bool has_rest = s->motion == SLOWING ? a->vx == 0.0 && a->vy == 0.0 : relative_pull(s, a, b) == 0.0;
    if (has_rest && p->ux == 0.0 && p->uy == 0.0)
        return CAROM_INF;
    /* While they separate on straight paths, `along` grows, except for rounding. */
    return s->motion == STRAIGHT && p->along > p->margin * (fabs(p->ux) + fabs(p->uy)) ? CAROM_INF : 0.0;
}

/* Return how long two discs take to a distance on straight paths; INF if they never come that near. */
static inline double time_to_distance(const Approach *p, double distance) {
    double across = p->dx * p->uy - p->dy * p->ux;
    double d = (p->ux * p->ux + p->uy * p->uy) * (distance * distance) - across * across;
    if (p->along >= 0.0 || d < 0.0)
        return CAROM_INF;
    return shorten((p->squared - distance * distance) / (sqrt(d) - p->along));
}

/* Return the wait of two discs that are apart and have a relative acceleration of at most `pull`; it need hold no
   longer than `least`.

   Within t the path leaves the straight one by pull t^2 / 2. So contact is a straight path's with a contact distance
   that is larger by that. The bound is better for smaller t. */
static inline double bound_curved_approach(const Approach *p, double pull, double least) {
    double distance = sqrt(p->squared);
    double gap = distance - p->contact;
    double u2 = p->ux * p->ux + p->uy * p->uy;
    if (p->along >= 0.0) /* a straight path would only lead away */
        return time_to_close(gap, 0.0, pull);
    double wait = time_to_close(gap, sqrt(u2), pull);
    double within = lesser(lesser(least, time_to_distance(p, p->contact)), -2.0 * p->along / u2);
    double wider = p->contact + 0.5 * pull * within * within * (1.0 + CAROM_PATH_MARGIN);
    if (wider < distance)
        wait = greater(wait, lesser(within, time_to_distance(p, wider)));
    return wait;
}

/* Return the wait of two discs that are apart; it need hold no longer than `least`. */
static inline double bound_approach(const State *s, const Disc *a, const Disc *b, const Approach *p, double least) {
    double pull = relative_pull(s, a, b);
    double far = p->contact + 0.5 * pull * least * least;
    /* d.d grows by 2 d.u t at least on a straight path: most discs are too far away to touch within `least`. */
    if (p->squared * (1.0 - CAROM_PATH_MARGIN) + 2.0 * lesser(p->along, 0.0) * least > far * far)
        return least;
    return pull == 0.0 ? time_to_distance(p, p->contact) : bound_curved_approach(p, pull, least);
}

/* ---- a disc and a wall ---- */

/* Return the wait of a disc and a half-plane with a gap in straight motion.

   The gap is linear in time; its speed is rounded, too, by less than 2^-51 of the disc's own. */
static inline double bound_straight_plane(const Disc *a, const Wall *wall, double gap) {
    double along = a->vx * wall->nx + a->vy * wall->ny;
    if (along >= 0.0) /* the very number that PIT tests, at every frame */
        return CAROM_INF;
    if (gap > 0.0)
        return shorten(gap / (CAROM_PATH_MARGIN * (fabs(a->vx) + fabs(a->vy)) - along));
    return CAROM_IN_CONTACT;
}

/* Return the wait of a disc and a half-plane with a gap if the disc falls, or a table slows it: then its speed along
   the normal has roundings of its own at each frame. It need hold no longer than `least`. */
static inline double bound_curved_plane(const State *s, const Disc *a, const Wall *wall, double gap, double least) {
    double along = a->vx * wall->nx + a->vy * wall->ny;
    double pull = s->gx * wall->nx + s->gy * wall->ny;
    double speed = along - CAROM_PATH_MARGIN * (fabs(a->vx) + fabs(a->vy) + s->pull * s->horizon);
    if (stays_open(gap, -speed, greater(-pull, 0.0), least))
        return least;
    if (speed >= 0.0 && pull >= 0.0)
        return CAROM_INF;
    if (gap <= 0.0 && speed < 0.0)
        return CAROM_IN_CONTACT;
    double d = speed * speed - 2.0 * pull * gap;
    if (speed < 0.0) /* it approaches, and reaches the wall unless gravity turns it back before */
        return d < 0.0 ? CAROM_INF : shorten(2.0 * gap / (sqrt(d) - speed));
    /* It leaves the wall, falls back, and reaches it; if it overlaps all the time, it approaches from the apex on. */
    return shorten((speed + sqrt(greater(d, 0.0))) / -pull);
}

/* Return the wait of a disc and a chain with a gap; it need hold no longer than `least`.

   No nearest point of the chain approaches it faster than it moves. A disc can leave a chain that bends, or has another
   side, and meet it again. */
static inline double bound_chain(const State *s, const Disc *a, double gap, double least) {
    if (a->vx == 0.0 && a->vy == 0.0 && s->pull == 0.0) /* it does not approach */
        return CAROM_INF;
    if (gap <= 0.0)
        return CAROM_IN_CONTACT;
    double speed = sqrt(a->vx * a->vx + a->vy * a->vy) * (1.0 + CAROM_PATH_MARGIN);
    return stays_open(gap, speed, s->pull, least) ? least : time_to_close(gap, speed, s->pull);
}

/* Return the wait of a disc and a driven wall with a gap on any of the wall's legs: none is faster than the fastest. */
static inline double bound_on_any_leg(const State *s, const Path *path, const Disc *a, double gap) {
    double speed = sqrt(a->vx * a->vx + a->vy * a->vy) + path->fastest;
    return gap > 0.0 ? time_to_close(gap, speed * (1.0 + CAROM_PATH_MARGIN), s->pull) : 0.0;
}
