/* Motion between frames.

   Discs are advanced frame by frame, x += v dt with each product and sum rounded, as the definition does. So a disc
   can't be advanced over many frames in one step, but it can be advanced over many frames before the next disc is. */

#ifndef CAROM_PIT_MOTION_H
#define CAROM_PIT_MOTION_H

#include "carom/core/pit_state.h"

/* Return the time of a frame, seconds since the start. */
static inline double frame_time(const Clock *clock, Index frame) {
    return (double)frame * clock->step / clock->rate;
}

/* Advance a falling disc along its parabola. */
static inline void advance_falling(const State *s, double *centre, double *velocity, double step) {
    centre[0] += step * (velocity[0] + 0.5 * s->gx * step);
    centre[1] += step * (velocity[1] + 0.5 * s->gy * step);
    velocity[0] += s->gx * step;
    velocity[1] += s->gy * step;
}

/* Advance a disc by a step to the next frame. */
static inline void advance_disc(State *s, Index i, double step) {
    Disc *a = &s->discs[i];
    if (a->inverse_mass == 0.0)
        return;
    if (s->falls) {
        advance_falling(s, &a->x, &a->vx, step);
    } else {
        a->x += a->vx * step;
        a->y += a->vy * step;
    }
}

/* Advance every disc to the next frame. */
static inline void advance_to_next_frame(State *s) {
    double time = frame_time(&s->clock, s->counts.frames);
    double step = time - s->now;
    if (s->counts.frames > 0) {
        for (Index i = 0; i < s->disc_count; i++)
            advance_disc(s, i, step);
    }
    s->now = time;
}

/* Advance two discs over some steps. Two at a time, since each sum waits for the one before it. */
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

#endif
