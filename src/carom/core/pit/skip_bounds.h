/* Bounds that allow skipping: lower bounds of the time until a disc can hit another body. The bounds are valid for
   PIT's paths, which include rounding errors.

   The page docs/theory/pit.md derives the bounds. To allow for rounding errors, the contact distance is enlarged by
   `CAROM_PATH_MARGIN` times an upper bound of |x| + |y| of both discs during the time for which a bound is used. If a
   number overflows or underflows, comparisons are false and the wait is 0, so that no test is skipped.

   Two bodies interfere at a frame, and then have an impact, if they overlap and approach. A wait is a number of seconds
   for which two bodies cannot interfere on their present paths. The wait is INF if the bodies can never interfere, and
   0 if they may interfere at the next frame. If two bodies may interfere at this frame, the wait is
   CAROM_IN_CONTACT. */

#pragma once

#include "carom/core/pit/interference_test.h"
#include "carom/core/pit/motion.h"

enum {
    /* largest number of frames for which a bound is used, 2^16. The bound is computed again after this number of
       frames */
    MAX_BOUND_FRAMES = 65536,
    /* MAX_BOUND_FRAMES for curved paths, whose deviation from a straight path grows like the square of the time */
    MAX_CURVED_BOUND_FRAMES = 1024
};

/* ---- extents ---- */

/* Return an upper bound of |x| + |y| of a disc during the time for which a bound is used, in metres. */
static inline double extent_of(const State *s, const Disc *a) {
    return fabs(a->x) + fabs(a->y) + (fabs(a->vx) + fabs(a->vy)) * s->horizon + s->extra_extent;
}

/* Return an upper bound, in metres, of the sum of the magnitudes of all terms in a driven body's position. */
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

/* At the start of a run, set the longest time for which a bound is used, and the length that `extent_of` adds for
   gravity and for driven bodies. */
static inline void begin_bounds(State *s) {
    Index frames = s->motion == STRAIGHT ? MAX_BOUND_FRAMES : MAX_CURVED_BOUND_FRAMES;
    s->frame_span = (double)frames * (s->clock.step / s->clock.rate);
    s->horizon = s->frame_span;
    s->pull = sqrt(s->gx * s->gx + s->gy * s->gy) * (1.0 + CAROM_PATH_MARGIN);
    s->extra_extent = extent_of_paths(s) + (fabs(s->gx) + fabs(s->gy)) * s->horizon * s->horizon;
}

/* At a frame, set the longest time for which a bound is used from the present frame on. With damping, the undamped time
   between frames becomes shorter and shorter. */
static inline void limit_bounds(State *s) {
    double c = s->damping.rate;
    if (c > 0.0)
        s->horizon = s->frame_span * (1.0 - c * s->now) / (1.0 + c * s->frame_span) * (1.0 - CAROM_PATH_MARGIN);
}

/* ---- waits ---- */

/* Decrease a wait by an upper bound of its rounding error. If the wait is not a finite positive number, return 0. */
static inline double shorten_wait(double wait) {
    return 0.0 < wait && wait < CAROM_INF ? wait * (1.0 - CAROM_PATH_MARGIN) : 0.0;
}

/* Return a lower bound of the time until a positive gap closes. `speed` and `pull` are upper bounds of the speed and
   the acceleration at which the gap closes. */
static inline double time_to_close(double gap, double speed, double pull) {
    double twice_mean = speed + sqrt(speed * speed + 2.0 * pull * gap);
    return twice_mean > 0.0 ? shorten_wait(2.0 * gap / twice_mean) : CAROM_INF;
}

/* Return whether a gap certainly stays open for a time. The test is faster than `time_to_close`. */
static inline bool stays_open(double gap, double speed, double pull, double time) {
    return gap > 0.0 && gap * (1.0 - CAROM_PATH_MARGIN) > (speed + 0.5 * pull * time) * time;
}

/* ---- two discs ---- */

typedef struct Approach { /* motion of disc b relative to disc a */
    double dx;            /* centre of b minus centre of a, in metres */
    double dy;
    double ux; /* velocity of b minus velocity of a, in metres per second */
    double uy;
    /* inner product of (dx, dy) and (ux, uy), negative if the discs approach. The interference test of PIT computes
       exactly this number */
    double along;
    double squared; /* squared distance of the centres */
    double margin;  /* upper bound of the rounding errors of both paths, in metres */
    double contact; /* sum of the radii and `margin` */
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

static inline bool may_touch(const Approach *p) {
    return p->squared <= p->contact * p->contact;
}

/* Return an upper bound of the relative acceleration of two discs, at least one of which is movable. */
static inline double relative_pull(const State *s, const Disc *a, const Disc *b) {
    int moving = (a->inverse_mass > 0.0) + (b->inverse_mass > 0.0);
    if (s->motion == STRAIGHT || (s->motion == FALLING && moving == 2))
        return 0.0;
    return s->motion == FALLING ? s->pull : (1.0 + CAROM_PATH_MARGIN) * s->deceleration * moving;
}

/* Return the wait (time without an impact) of two discs that may touch. */
static inline double bound_touching(const State *s, const Disc *a, const Disc *b, const Approach *p) {
    if (p->along < 0.0)
        return CAROM_IN_CONTACT;
    /* If the discs have the same velocity, `along` is 0 and stays 0, because the same rounded operations change both
       velocities. */
    bool has_rest = s->motion == SLOWING ? a->vx == 0.0 && a->vy == 0.0 : relative_pull(s, a, b) == 0.0;
    if (has_rest && p->ux == 0.0 && p->uy == 0.0)
        return CAROM_INF;
    /* While two discs separate on straight paths, `along` grows, apart from rounding errors. So discs that separate on
       straight paths never interfere. */
    return s->motion == STRAIGHT && p->along > p->margin * (fabs(p->ux) + fabs(p->uy)) ? CAROM_INF : 0.0;
}

/* Return a lower bound of the time that two discs on straight paths take to come within `distance`; INF if they never
   come so near. */
static inline double time_to_distance(const Approach *p, double distance) {
    double across = p->dx * p->uy - p->dy * p->ux;
    double largest = (p->ux * p->ux + p->uy * p->uy) * (distance * distance);
    double d = largest - across * across;
    if (p->along >= 0.0)
        return CAROM_INF;
    if (largest < CAROM_NEGLIGIBLE) /* the square may have underflowed, so nothing is known */
        return 0.0;
    if (d < 0.0)
        return CAROM_INF;
    return shorten_wait((p->squared - distance * distance) / (sqrt(d) - p->along));
}

/* Return the wait (time without an impact) of two discs that are apart. The relative acceleration of the discs is at
   most `pull`. The caller needs no wait longer than `least`, so the function may return `least` instead of a longer
   wait.

   During a time t, the relative path deviates from a straight path by at most pull t^2 / 2. So if two discs on straight
   paths do not reach a contact distance enlarged by pull t^2 / 2 within t, they cannot touch within t. A smaller t
   gives a better bound. */
static inline double bound_curved_approach(const Approach *p, double pull, double least) {
    double distance = sqrt(p->squared);
    double gap = distance - p->contact;
    double u2 = p->ux * p->ux + p->uy * p->uy;
    if (p->along >= 0.0) /* on straight paths the discs would only separate */
        return time_to_close(gap, 0.0, pull);
    double wait = time_to_close(gap, sqrt(u2), pull);
    double within = lesser(lesser(least, time_to_distance(p, p->contact)), -2.0 * p->along / u2);
    double wider = p->contact + 0.5 * pull * within * within * (1.0 + CAROM_PATH_MARGIN);
    if (wider < distance)
        wait = greater(wait, lesser(within, time_to_distance(p, wider)));
    return wait;
}

/* Return the wait (time without an impact) of two discs that are apart. The function may return `least` instead of a
   longer wait. */
static inline double bound_approach(const State *s, const Disc *a, const Disc *b, const Approach *p, double least) {
    double pull = relative_pull(s, a, b);
    double far = p->contact + 0.5 * pull * least * least;
    /* On straight paths, the squared distance after a time t is at least squared + 2 along t. The test below is true
       for most pairs of discs, which are too far apart to touch within `least`. */
    if (p->squared * (1.0 - CAROM_PATH_MARGIN) + 2.0 * lesser(p->along, 0.0) * least > far * far)
        return least;
    return pull == 0.0 ? time_to_distance(p, p->contact) : bound_curved_approach(p, pull, least);
}

/* ---- a disc and a wall ---- */

/* Return the wait (time without an impact) of a half-plane and a disc in straight motion, computed from their gap.

   The gap changes linearly in time. The computed rate of change has a rounding error of less than 2^-51 of the disc's
   speed. */
static inline double bound_straight_plane(const Disc *a, const Wall *wall, double gap) {
    double along = a->vx * wall->nx + a->vy * wall->ny;
    if (along >= 0.0) /* the interference test of PIT computes exactly this number at every frame */
        return CAROM_INF;
    if (gap > 0.0)
        return shorten_wait(gap / (CAROM_PATH_MARGIN * (fabs(a->vx) + fabs(a->vy)) - along));
    return CAROM_IN_CONTACT;
}

/* For a disc that falls or is slowed by a table, return the wait (time without an impact) of the disc and a half-plane,
   computed from their gap. The normal speed of a falling or slowed disc has additional rounding errors at each frame.
   The function may return `least` instead of a longer wait. */
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
    if (speed < 0.0) /* the disc approaches, and reaches the wall unless gravity reverses its motion first */
        return d < 0.0 ? CAROM_INF : shorten_wait(2.0 * gap / (sqrt(d) - speed));
    /* The disc moves away from the wall, falls back and reaches the wall. If the disc overlaps the wall all the time,
       disc and wall interfere when the disc approaches again, after the apex of its path. */
    return shorten_wait((speed + sqrt(greater(d, 0.0))) / -pull);
}

/* Return the wait (time without an impact) of a disc and a chain (finite wall), computed from their gap. The function
   may return `least` instead of a longer wait.

   The gap closes no faster than the disc moves. The direction of motion does not matter, because a disc that leaves one
   part of a chain can hit another part. */
static inline double bound_chain(const State *s, const Disc *a, double gap, double least) {
    if (a->vx == 0.0 && a->vy == 0.0 && s->pull == 0.0) /* the disc does not move relative to the chain */
        return CAROM_INF;
    if (gap <= 0.0)
        return CAROM_IN_CONTACT;
    double speed = sqrt(a->vx * a->vx + a->vy * a->vy) * (1.0 + CAROM_PATH_MARGIN);
    return stays_open(gap, speed, s->pull, least) ? least : time_to_close(gap, speed, s->pull);
}

/* Return the wait (time without an impact) of a disc and a driven wall, computed from their gap. The wait is valid on
   all legs (straight parts) of the wall's path, because it uses the wall's greatest speed. */
static inline double bound_on_any_leg(const State *s, const Path *path, const Disc *a, double gap) {
    double speed = sqrt(a->vx * a->vx + a->vy * a->vy) + path->fastest;
    return gap > 0.0 ? time_to_close(gap, speed * (1.0 + CAROM_PATH_MARGIN), s->pull) : 0.0;
}
