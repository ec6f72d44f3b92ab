/* Motion of a disc that accelerates: its state at an instant, and when it reaches another disc or a feature of a wall.

   Two discs with the same acceleration move in a straight line relative to each other, so pair_time.h predicts their
   impact. Two discs with different accelerations collide at a root of a quartic, which fall_time.h solves. To compute
   the time of impact of two discs, both discs are moved to the later of the two instants at which their paths began. So
   the computed time depends only on the two paths, and not on when the code runs. */

#pragma once

#include "carom/core/damping.h"
#include "carom/core/impact_record.h"
#include "carom/core/parabola/fall_bounds.h"
#include "carom/core/pic/driven_path.h"

typedef struct Motion {
    double x;
    double y;
    double vx;
    double vy;
} Motion;

static inline Instant own_instant(const Disc *a, const Parabola *p) {
    return (Instant){a->time, p->time_low};
}

static inline Instant now_instant(const State *s) {
    return (Instant){s->clock.now, s->clock.now_low};
}

/* ---- state ---- */

/* Return the position and velocity, at a time, of a disc that impacts do not move. */
static inline Motion immovable_state(const State *s, Index i, double time) {
    const Disc *a = &s->discs[i];
    const Driven *row = driven_row(&s->driving, i);
    if (row == NULL) {
        return (Motion){a->x, a->y, 0.0, 0.0};
    }
    Disc seen = driven_disc_on(row, a, &s->driving.legs[leg_at(&s->driving, row, time)], time);
    return (Motion){seen.x, seen.y, seen.vx, seen.vy};
}

/* Return the state of a disc at an instant: on its present parabola, or at the point where it has stopped on a
   table. */
static inline Motion motion_at(const State *s, Index i, Instant at) {
    const Disc *a = &s->discs[i];
    if (a->inverse_mass == 0.0) {
        return immovable_state(s, i, at.high);
    }
    const Parabola *p = &s->accelerated.paths[i];
    Instant own = own_instant(a, p);
    if (s->accelerated.deceleration > 0.0 && !is_before(at, p->ends)) {
        /* The distance to the point at which the disc stops is computed from the mean speed. The usual formula would
           subtract two large distances. */
        double lasts = seconds_between(own, p->ends);
        return (Motion){a->x + 0.5 * lasts * a->vx, a->y + 0.5 * lasts * a->vy, 0.0, 0.0};
    }
    if (is_same_instant(at, own)) {
        return (Motion){a->x, a->y, a->vx, a->vy};
    }
    double dt = seconds_between(own, at);
    return (Motion){
        a->x + dt * (a->vx + 0.5 * p->ax * dt),
        a->y + dt * (a->vy + 0.5 * p->ay * dt),
        a->vx + p->ax * dt,
        a->vy + p->ay * dt,
    };
}

/* Return the state of a disc at an instant on its present path, for any kind of motion. */
static inline Motion disc_motion(const State *s, Index i, Instant at) {
    const Disc *a = &s->discs[i];
    if (a->inverse_mass == 0.0 || s->accelerated.paths != NULL) {
        return motion_at(s, i, at);
    }
    Point centre = position_at(a, at.high);
    return (Motion){centre.x, centre.y, a->vx, a->vy};
}

/* Return the state of a disc relative to a wall, at the time at which the disc's path began. */
static inline Motion motion_seen_from_wall(const State *s, Index i, Index wall) {
    const Disc *a = &s->discs[i];
    const Driven *row = driven_row(&s->driving, -1 - wall);
    if (row == NULL || row->leg_count == 0) {
        return (Motion){a->x, a->y, a->vx, a->vy};
    }
    const Leg *leg = &s->driving.legs[leg_at(&s->driving, row, a->time)];
    Motion there = disc_motion(s, i, (Instant){a->time, 0.0});
    Point moved = displacement_on(leg, a->time);
    return (Motion){there.x - moved.x, there.y - moved.y, there.vx - leg->vx, there.vy - leg->vy};
}

/* Return the spin of a disc at an instant. Between impacts, the spin changes only while the disc is in contact with a
   wall. */
static inline double spin_at(const State *s, Index i, Instant at) {
    const Parabola *p = &s->accelerated.paths[i];
    double spin = s->turning[i].spin;
    return p->spin_rate != 0.0 ? spin + p->spin_rate * seconds_between(own_instant(&s->discs[i], p), at) : spin;
}

/* After a disc's velocity has changed, set its deceleration by the table and the instant at which it stops. */
static inline void slow_down(State *s, Index i) {
    Disc *a = &s->discs[i];
    Parabola *p = &s->accelerated.paths[i];
    bool is_movable = a->inverse_mass > 0.0; /* the table does not slow a driven disc */
    double vx = is_movable ? a->vx : 0.0, vy = is_movable ? a->vy : 0.0;
    Slowing slowing = slowing_by(s->accelerated.deceleration, vx, vy, own_instant(a, p));
    p->ax = slowing.ax;
    p->ay = slowing.ay;
    p->ends = slowing.stops;
}

/* Return the component of a vector along the surface of a straight feature. */
static inline double along_ground(const Feature *ground, double x, double y) {
    return x * ground->ny - y * ground->nx;
}

/* Move a disc along its path to an instant. The disc's next path begins at that instant. */
static inline void move_on_parabola(State *s, Index i, Instant at) {
    Disc *a = &s->discs[i];
    Motion there = motion_at(s, i, at);
    if (a->inverse_mass > 0.0) {
        Parabola *p = &s->accelerated.paths[i];
        bool has_stopped = s->accelerated.deceleration > 0.0 && !is_before(at, p->ends);
        if (CAROM_UNLIKELY(p->corner != NO_BODY)) {
            const Feature *f = &s->features[p->corner_ground];
            double dt = seconds_between(own_instant(a, p), at);
            p->corner_way += dt * (along_ground(f, a->vx, a->vy) + 0.5 * along_ground(f, p->ax, p->ay) * dt);
        }
        s->turning[i].spin = spin_at(s, i, at);
        a->time = at.high;
        p->time_low = at.low;
        a->x = there.x;
        a->y = there.y;
        a->vx = there.vx;
        a->vy = there.vy;
        if (has_stopped) {
            slow_down(s, i);
        }
        return;
    }
    a->x = there.x;
    a->y = there.y;
    a->vx = there.vx;
    a->vy = there.vy;
}

/* For a disc that slides or rolls on a ground, return when it hits the other body of its corner again: see
   `Parabola.corner`. The vector (x, y) points along the ground from the corner to the side where the disc is.

   The disc moves straight to the corner, and the other body is convex, so the disc does not touch that body earlier. */
static inline Instant return_to_corner(const State *s, Index i, double x, double y) {
    const Disc *a = &s->discs[i];
    const Parabola *p = &s->accelerated.paths[i];
    const Feature *ground = &s->features[p->ground];
    double side = along_ground(ground, x, y) < 0.0 ? -1.0 : 1.0;
    double speed = side * along_ground(ground, a->vx, a->vy), rate = side * along_ground(ground, p->ax, p->ay);
    double wait = descent_time((DoubleDouble){side * p->corner_way, 0.0}, (DoubleDouble){speed, 0.0},
                               (DoubleDouble){rate, 0.0});
    return wait < CAROM_INF ? instant_after(own_instant(a, p), wait) : NEVER;
}

/* A corner is a position at which a disc touches both a ground and another body. Return whether a disc is in contact
   with the ground of its corner and `body` is the other body of the corner. Feature k has the body number -1 - k. */
static inline bool is_in_corner_with(const Parabola *p, Index body) {
    return p->corner == body && p->ground == p->corner_ground;
}

/* Return whether a disc has just hit the ground of its corner without leaving the ground again, and `body` is the other
   body of the corner. The disc cannot hit `body` before the contact with the ground begins, although the rounded gap to
   `body` may be 0. */
static inline bool lands_at_corner_of(const State *s, Index i, Index body) {
    const Parabola *p = &s->accelerated.paths[i];
    return p->corner == body && p->ground == NO_OBSTACLE && s->discs[i].last == -1 - p->corner_ground &&
           p->leaving == 0.0;
}

/* ---- two discs ---- */

static inline bool accelerate_alike(const State *s, Index i, Index j) {
    const Parabola *p = &s->accelerated.paths[i], *q = &s->accelerated.paths[j];
    return p->ax == q->ax && p->ay == q->ay;
}

/* Return when disc `i` hits a disc that impacts do not move. If the two discs do not collide on their present paths,
   return NEVER. */
static inline Instant immovable_impact_time(const State *s, Index i, Index fixed) {
    const Disc *a = &s->discs[i], *b = &s->discs[fixed];
    const Parabola *p = &s->accelerated.paths[i];
    if (CAROM_UNLIKELY(is_in_corner_with(p, fixed))) {
        return return_to_corner(s, i, a->x - b->x, a->y - b->y);
    }
    if (CAROM_UNLIKELY(lands_at_corner_of(s, i, fixed))) {
        return NEVER;
    }
    const Driven *row = driven_row(&s->driving, fixed);
    Index first = row == NULL ? 0 : leg_at(&s->driving, row, a->time);
    Index end = row == NULL ? 1 : row->first_leg + row->leg_count;
    for (Index n = first; n < end; n++) {
        const Leg *leg = row == NULL ? NULL : &s->driving.legs[n];
        Instant begin = n == first ? own_instant(a, p) : (Instant){leg->begin, 0.0};
        Motion seen = motion_at(s, i, begin);
        Motion from = {b->x, b->y, 0.0, 0.0};
        if (leg != NULL) {
            Disc there = driven_disc_on(row, b, leg, begin.high);
            from = (Motion){there.x, there.y, there.vx, there.vy};
        }
        FallingDisc disc = {seen.x, seen.y, seen.vx - from.vx, seen.vy - from.vy, a->radius};
        bool has_just_left = n == first && a->last == fixed;
        double wait = disc_fall_time(&s->accelerated.exact, &disc, from.x, from.y, b->radius, p->ax, p->ay,
                                     has_just_left, p->leaving);
        Instant met = instant_after(begin, wait);
        if (leg == NULL || met.high < leg->end) {
            return met;
        }
    }
    return NEVER;
}

/* Return when discs i < j collide on their present paths; NEVER if they do not collide. */
static inline Instant parabola_pair_time(const State *s, Index i, Index j) {
    const Disc *a = &s->discs[i], *b = &s->discs[j];
    if (a->inverse_mass == 0.0 || b->inverse_mass == 0.0) {
        if (a->inverse_mass == 0.0 && b->inverse_mass == 0.0) {
            return NEVER;
        }
        return a->inverse_mass == 0.0 ? immovable_impact_time(s, j, i) : immovable_impact_time(s, i, j);
    }
    const Parabola *p = &s->accelerated.paths[i], *q = &s->accelerated.paths[j];
    bool alike = accelerate_alike(s, i, j);
    bool has_just_met = a->last == j && b->last == i;
    if (has_just_met && alike) {
        return NEVER;
    }
    Instant start = later_of(own_instant(a, p), own_instant(b, q));
    Motion first = motion_at(s, i, start), second = motion_at(s, j, start);
    if (alike) {
        return instant_after(start, pair_time(first.x, first.y, first.vx, first.vy, a->radius, second.x, second.y,
                                              second.vx, second.vy, b->radius));
    }
    FallingDisc disc = {first.x - second.x, first.y - second.y, first.vx - second.vx, first.vy - second.vy, a->radius};
    double wait = disc_fall_time(&s->accelerated.exact, &disc, 0.0, 0.0, b->radius, p->ax - q->ax, p->ay - q->ay,
                                 has_just_met, p->leaving);
    return instant_after(start, wait);
}

static inline double fastest_leg(const Driving *d, const Driven *row) {
    double fastest = 0.0;
    for (Index n = row->first_leg; n < row->first_leg + row->leg_count; n++) {
        const Leg *leg = &d->legs[n];
        fastest = greater(fastest, sqrt(leg->vx * leg->vx + leg->vy * leg->vy));
    }
    return fastest;
}

/* Return an instant before which two discs with different accelerations cannot collide.

   The exact instant is a root of a quartic, and computing this root is expensive. In most cases the disc hits something
   else first, so the exact instant is not needed. */
static inline Instant earliest_meeting(const State *s, Index i, Index j) {
    if (s->discs[i].inverse_mass == 0.0) {
        return earliest_meeting(s, j, i);
    }
    const Disc *a = &s->discs[i], *b = &s->discs[j];
    const Parabola *p = &s->accelerated.paths[i], *q = &s->accelerated.paths[j];
    bool is_free = b->inverse_mass > 0.0;
    Instant start = is_free ? later_of(own_instant(a, p), own_instant(b, q)) : own_instant(a, p);
    if (a->last == j || (is_free && b->last == i) || CAROM_UNLIKELY(is_in_corner_with(p, j))) {
        return start;
    }
    const Driven *row = is_free ? NULL : driven_row(&s->driving, j);
    Motion one = motion_at(s, i, start), other = motion_at(s, j, start);
    FallingDisc disc = {one.x, one.y, one.vx - other.vx, one.vy - other.vy, a->radius};
    if (row == NULL || row->leg_count == 1) {
        double ax = p->ax - q->ax, ay = p->ay - q->ay;
        return instant_after(start, fall_pair_lower_bound(&disc, other.x, other.y, b->radius, ax, ay));
    }
    /* A driven disc approaches no faster than its greatest speed on any leg (straight part) of its path. */
    double dx = one.x - other.x, dy = one.y - other.y;
    double gap = sqrt(dx * dx + dy * dy) - (a->radius + b->radius);
    gap -= 2.0 * gap_resolution(size_of(one.x, one.y, a->radius) + size_of(other.x, other.y, b->radius));
    double speed = sqrt(one.vx * one.vx + one.vy * one.vy) + fastest_leg(&s->driving, row);
    double pull = sqrt(p->ax * p->ax + p->ay * p->ay);
    double wait = closing_lower_bound(gap, -speed, -pull);
    return instant_after(start, wait * (1.0 - CAROM_ROOT_ERROR));
}
