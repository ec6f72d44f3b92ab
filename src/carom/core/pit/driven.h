/* Driven bodies in PIT: their positions at a frame, and the motion of a disc relative to them. */

#pragma once

#include <math.h>

#include "carom/core/pit/state.h"

/* Return the number of the leg at a time. `leg` is the leg at an earlier time. */
static inline Index leg_at(const Path *path, double time, Index leg) {
    while (leg + 1 < path->leg_count && path->legs[leg + 1].begin <= time)
        leg += 1;
    return leg;
}

/* Return the displacement of a body at a time within a leg, metres. */
static inline Point moved_at(const Leg *leg, double time) {
    double lasted = time - leg->begin;
    return (Point){leg->moved_x + leg->vx * lasted, leg->moved_y + leg->vy * lasted};
}

/* Write the state of a driven disc at a time within a leg. */
static inline void write_driven(const Path *path, const Leg *leg, double time, double *centre, double *velocity) {
    Point moved = moved_at(leg, time);
    centre[0] = path->x + moved.x;
    centre[1] = path->y + moved.y;
    velocity[0] = leg->vx;
    velocity[1] = leg->vy;
}

/* Clear `last` of each disc whose last impact was with this driven body. The body is on another leg now, so the disc
   may hit it again. */
static inline void forget_body(State *s, Index body) {
    int last = (int)(body < 0 ? ON_WALL + 1 + body : body);
    for (Index i = 0; i < s->disc_count; i++) {
        if (s->discs[i].last == last)
            s->discs[i].last = NOBODY;
    }
}

/* Move all driven bodies to the present frame. */
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
            Point moved = moved_at(&path->legs[leg], s->now);
            motion->moved_x = moved.x;
            motion->moved_y = moved.y;
            motion->surface.vx = path->legs[leg].vx;
            motion->surface.vy = path->legs[leg].vy;
        }
    }
}

/* Return a disc relative to wall k, in the frame in which the wall is at its start position. For a wall that never
   moves this is the disc itself. */
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

/* Return the path of disc i; NULL if it is not driven. */
static inline const Path *disc_path(const State *s, Index i) {
    return s->disc_paths == NULL || s->disc_paths[i] == NO_PATH ? NULL : &s->paths[s->disc_paths[i]];
}

/* Return the path of wall k; NULL if it does not move. */
static inline const Path *wall_path(const State *s, Index k) {
    return s->wall_motions == NULL || s->wall_motions[k].path == NO_PATH ? NULL : &s->paths[s->wall_motions[k].path];
}
