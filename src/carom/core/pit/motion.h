/* Motion of discs and driven bodies from frame to frame.

   Discs are advanced frame by frame (x += v dt). Each product and sum is rounded, as Algorithm 1 of the source paper
   requires. So one long step cannot replace several short steps. However, the code can advance one disc over many
   frames before it advances the next disc.

   `advance_disc` and `carom_pit_write_states` have a branch for each kind of motion. */

#pragma once

#include "carom/core/damping.h"
#include "carom/core/pit/state.h"

/* ---- driven bodies: their positions at a frame, and discs relative to them ---- */

/* Return the number of the leg (straight part of its path) on which a driven body is at a time. `leg` is the body's leg
   at an earlier time. */
static inline Index leg_at(const Path *path, double time, Index leg) {
    while (leg + 1 < path->leg_count && path->legs[leg + 1].begin <= time)
        leg += 1;
    return leg;
}

/* Write the state of a driven disc at a time within a leg (straight part) of its path. */
static inline void write_driven(const Path *path, const Leg *leg, double time, double *centre, double *velocity) {
    Point moved = displacement_on(leg, time);
    centre[0] = path->x + moved.x;
    centre[1] = path->y + moved.y;
    velocity[0] = leg->vx;
    velocity[1] = leg->vy;
}

/* A driven body has begun another leg (straight part of its path). Clear `Disc.last` of all discs that hit this body
   last, so that they may hit it again. */
static inline void forget_body(State *s, Index body) {
    int last = (int)(body < 0 ? ON_WALL + 1 + body : body);
    for (Index i = 0; i < s->disc_count; i++) {
        if (s->discs[i].last == last)
            s->discs[i].last = NOBODY;
    }
}

static inline void move_driven(State *s) {
    for (Index p = 0; p < s->path_count; p++) {
        Path *path = &s->paths[p];
        Index leg = leg_at(path, s->now, path->leg);
        if (leg != path->leg)
            forget_body(s, path->body);
        path->leg = leg;
        if (path->body >= 0) {
            Disc *a = &s->discs[path->body];
            write_driven(path, &path->legs[leg], s->now, &a->x, &a->vx);
        } else {
            WallMotion *motion = &s->wall_motions[-1 - path->body];
            Point moved = displacement_on(&path->legs[leg], s->now);
            motion->moved_x = moved.x;
            motion->moved_y = moved.y;
            motion->surface.vx = path->legs[leg].vx;
            motion->surface.vy = path->legs[leg].vy;
        }
    }
}

/* Return a disc relative to wall k, in coordinates in which the wall stays at its start position. For a wall that never
   moves, the result is the disc itself. */
static inline const Disc *relative_to_wall(const State *s, const Disc *a, Index k, Disc *relative) {
    if (s->wall_motions == NULL || s->wall_motions[k].path == NO_PATH)
        return a;
    const WallMotion *motion = &s->wall_motions[k];
    *relative = *a;
    relative->x = a->x - motion->moved_x;
    relative->y = a->y - motion->moved_y;
    relative->vx = a->vx - motion->surface.vx;
    relative->vy = a->vy - motion->surface.vy;
    return relative;
}

/* Return the path of disc i, or NULL if the disc is not driven. */
static inline const Path *disc_path(const State *s, Index i) {
    return s->disc_paths == NULL || s->disc_paths[i] == NO_PATH ? NULL : &s->paths[s->disc_paths[i]];
}

/* Return the path of wall k, or NULL if the wall does not move. */
static inline const Path *wall_path(const State *s, Index k) {
    return s->wall_motions == NULL || s->wall_motions[k].path == NO_PATH ? NULL : &s->paths[s->wall_motions[k].path];
}

/* ---- time ---- */

/* Return the time of a frame by the clock, in seconds since the start. */
static inline double clock_time(const State *s, Index frame) {
    return (double)frame * s->clock.step / s->clock.rate;
}

/* Return the time of a frame for computing the motion of discs. With damping, the result is the undamped time. */
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

static inline void advance_falling(const State *s, double *centre, double *velocity, double step) {
    centre[0] += step * (velocity[0] + 0.5 * s->gx * step);
    centre[1] += step * (velocity[1] + 0.5 * s->gy * step);
    velocity[0] += s->gx * step;
    velocity[1] += s->gy * step;
}

static inline void advance_slowing(double *centre, double *velocity, Slowing *slowing, double from, double to) {
    if (is_before((Instant){to, 0.0}, slowing->stops)) {
        double step = to - from;
        centre[0] += step * (velocity[0] + 0.5 * slowing->ax * step);
        centre[1] += step * (velocity[1] + 0.5 * slowing->ay * step);
        velocity[0] += slowing->ax * step;
        velocity[1] += slowing->ay * step;
        return;
    }
    /* The distance to the point at which the disc stops is computed from the mean speed. The usual formula would
       subtract two large distances. */
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

/* On a table that decelerates discs, set the deceleration of disc i from its present velocity. */
static inline void slow_disc(State *s, Index i) {
    const Disc *a = &s->discs[i];
    if (s->motion == SLOWING && a->inverse_mass > 0.0)
        s->slowing[i] = slowing_by(s->deceleration, a->vx, a->vy, (Instant){s->now, 0.0});
}

/* ---- all discs ---- */

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

/* Advance two discs over some steps on straight paths. With one disc, the processor would wait for each sum before the
   next sum can begin. With two discs, the processor computes the sums of one disc while it would wait for the other. */
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

/* Advance all discs over the first `count` frames of `s->times`. `from` is the time of the frame before these
   frames. */
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
