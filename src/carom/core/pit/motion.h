/* Motion between frames.

   Discs are advanced frame by frame, x += v dt, and each product and sum is rounded, as Algorithm 1 requires. One long
   step therefore cannot replace several frames. But one disc can be advanced over many frames before the next disc is.

   Each kind of motion is a branch in `advance_disc`, `skip_disc` and `carom_pit_write_states`. */

#pragma once

#include <math.h>

#include "carom/core/damping.h"
#include "carom/core/pit/driven.h"

/* ---- time ---- */

/* Return the time of a frame by the clock, seconds since the start. */
static inline double clock_time(const State *s, Index frame) {
    return (double)frame * s->clock.step / s->clock.rate;
}

/* Return the time that discs use at a frame. With damping it is the undamped time. */
static inline double frame_time(State *s, Index frame) {
    Damping *d = &s->damping;
    if (d->rate == 0.0)
        return clock_time(s, frame);
    if (frame != d->frame) {
        d->time = undamped_time(d->rate, clock_time(s, frame));
        d->frame = frame;
    }
    return d->time;
}

/* ---- one disc ---- */

/* Advance a falling disc along its parabola. */
static inline void advance_falling(const State *s, double *centre, double *velocity, double step) {
    centre[0] += step * (velocity[0] + 0.5 * s->gx * step);
    centre[1] += step * (velocity[1] + 0.5 * s->gy * step);
    velocity[0] += s->gx * step;
    velocity[1] += s->gy * step;
}

/* Find the deceleration of a disc on a table, and when the disc stops, if it has a velocity at a time. */
static inline Slowing slowing_of(const State *s, double vx, double vy, double time) {
    double speed = nearest_length(vx, vy);
    if (speed == 0.0)
        return (Slowing){0.0, 0.0, NEVER};
    double a = -s->deceleration; /* times a unit vector: divided by a tiny speed, it would be infinite */
    return (Slowing){a * (vx / speed), a * (vy / speed), instant_after((Instant){time, 0.0}, speed / s->deceleration)};
}

/* Advance a disc on a table from one time to another. */
static inline void advance_slowing(double *centre, double *velocity, Slowing *slowing, double from, double to) {
    if (is_before((Instant){to, 0.0}, slowing->stops)) {
        double step = to - from;
        centre[0] += step * (velocity[0] + 0.5 * slowing->ax * step);
        centre[1] += step * (velocity[1] + 0.5 * slowing->ay * step);
        velocity[0] += slowing->ax * step;
        velocity[1] += slowing->ay * step;
        return;
    }
    /* The distance to the stop is computed from the mean speed, which avoids the difference of two large distances. */
    double lasts = seconds_between((Instant){from, 0.0}, slowing->stops);
    centre[0] += 0.5 * lasts * velocity[0];
    centre[1] += 0.5 * lasts * velocity[1];
    velocity[0] = velocity[1] = 0.0;
    *slowing = (Slowing){0.0, 0.0, NEVER};
}

/* Advance disc i, which is movable, from one frame to the next. */
static inline void advance_disc(State *s, Index i, double from, double to) {
    Disc *a = &s->discs[i];
    double step = to - from;
    if (s->motion == STRAIGHT) {
        a->x += a->vx * step;
        a->y += a->vy * step;
    } else if (s->motion == FALLING) {
        advance_falling(s, &a->x, &a->vx, step);
    } else {
        advance_slowing(&a->x, &a->vx, &s->slowing[i], from, to);
    }
}

/* Set the deceleration by the table for disc i, whose velocity an impact has just changed. */
static inline void slow_disc(State *s, Index i) {
    const Disc *a = &s->discs[i];
    if (s->motion == SLOWING && a->inverse_mass > 0.0)
        s->slowing[i] = slowing_of(s, a->vx, a->vy, s->now);
}

/* ---- all discs ---- */

/* Advance every disc to the next frame. */
static inline void advance_to_next_frame(State *s) {
    double time = frame_time(s, s->counts.frames);
    if (s->counts.frames > 0 && (s->motion == STRAIGHT || time != s->now)) {
        for (Index i = 0; i < s->disc_count; i++) {
            if (s->discs[i].inverse_mass != 0.0)
                advance_disc(s, i, s->now, time);
        }
    }
    s->now = time;
    s->reported = clock_time(s, s->counts.frames);
    if (s->counts.frames > 0)
        move_driven(s);
}

/* Advance two discs straight over some steps. Each sum depends on the one before it, so two discs at a time keep the
   processor busy. */
static inline void advance_two(Disc *a, Disc *b, const double *steps, Index count) {
    double ax = a->x, ay = a->y, avx = a->vx, avy = a->vy;
    double bx = b->x, by = b->y, bvx = b->vx, bvy = b->vy;
    for (Index k = 0; k < count; k++) {
        ax += avx * steps[k];
        ay += avy * steps[k];
        bx += bvx * steps[k];
        by += bvy * steps[k];
    }
    if (a->inverse_mass != 0.0) {
        a->x = ax;
        a->y = ay;
    }
    if (b->inverse_mass != 0.0) {
        b->x = bx;
        b->y = by;
    }
}

/* Advance disc i over some frames on a curved path. */
static inline void advance_curved(State *s, Index i, double from, Index count) {
    Disc a = s->discs[i];
    if (a.inverse_mass == 0.0)
        return;
    if (s->motion == FALLING) {
        for (Index k = 0; k < count; k++)
            advance_falling(s, &a.x, &a.vx, s->steps[k]);
    } else {
        Slowing slowing = s->slowing[i];
        for (Index k = 0; k < count; k++)
            advance_slowing(&a.x, &a.vx, &slowing, k == 0 ? from : s->times[k - 1], s->times[k]);
        s->slowing[i] = slowing;
    }
    s->discs[i] = a;
}

/* Advance all discs over the first `count` frames of `s->times`. `from` is the time before these. */
static inline void advance_over_frames(State *s, double from, Index count) {
    Index last = s->disc_count - 1;
    if (s->motion == STRAIGHT) {
        for (Index i = 0; i <= last; i += 2)
            advance_two(&s->discs[i], &s->discs[i < last ? i + 1 : last], s->steps, count);
    } else {
        for (Index i = 0; i <= last; i++)
            advance_curved(s, i, from, count);
    }
    if (s->path_count > 0)
        move_driven(s);
}
