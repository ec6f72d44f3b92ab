/* Two discs without walls: they collide at most once, and a formula gives the time of this impact.

   `solve_two_discs` solves a scene of two discs without the event loop, but with the same floating-point operations.
   Tests check that the results are bit-identical to those of the event loop. */

#pragma once

#include "carom/core/impact_law.h"
#include "carom/core/impact_record.h"
#include "carom/core/straight/pair_time.h"

typedef struct FreeDisc {
    double x;
    double y;
    double vx;
    double vy;
    double radius;
    double inverse_mass; /* 1 / mass; 0 for a disc that never moves */
} FreeDisc;

typedef struct TwoDiscsResult {
    Impact impact;
    double position[4]; /* centres at the end, in metres: x and y of the first disc, then of the second */
    double velocity[4];
    bool has_impact;
} TwoDiscsResult;

static inline bool is_ordinary(double number) {
    return number == 0.0 || (CAROM_LEAST_ORDINARY <= fabs(number) && fabs(number) <= CAROM_ORDINARY);
}

static inline bool is_ordinary_disc(const FreeDisc *a) {
    return is_ordinary(a->x) && is_ordinary(a->y) && is_ordinary(a->vx) && is_ordinary(a->vy) &&
           is_ordinary(a->radius) && is_ordinary(a->inverse_mass);
}

static inline void move_disc(FreeDisc *a, double wait) {
    if (a->inverse_mass > 0.0) {
        a->x += a->vx * wait;
        a->y += a->vy * wait;
    }
}

static inline void write_disc(const FreeDisc *a, double wait, double *position, double *velocity) {
    position[0] = a->x + a->vx * wait;
    position[1] = a->y + a->vy * wait;
    write_velocity(velocity, a->vx, a->vy);
}

/* Apply and record the impact of two discs that touch. Return false if the discs are too far from the origin to compute
   the normal of their impact. */
static inline bool apply_impact(FreeDisc *a, FreeDisc *b, double time, double restitution, Impact *row) {
    double dx = b->x - a->x;
    double dy = b->y - a->y;
    double distance = sqrt(dx * dx + dy * dy);
    *row = (Impact){
        .time = time,
        .first = 0,
        .second = 1,
        .normal = {dx / distance, dy / distance},
        .first_before = {a->vx, a->vy},
        .second_before = {b->vx, b->vy},
    };
    bounce_pair(dx, dy, &a->vx, a->inverse_mass, &b->vx, b->inverse_mass, restitution);
    write_velocity(row->first_after, a->vx, a->vy);
    write_velocity(row->second_after, b->vx, b->vy);
    return are_distinguishable(a->x, a->y, b->x, b->y, a->radius + b->radius);
}

/* Solve a scene of two discs up to the time `end`, in seconds.

   Return false if a number is not of ordinary size (`carom.support.limits`), or if the discs meet too far from the
   origin. The caller then uses the event loop. */
static inline bool solve_two_discs(FreeDisc first, FreeDisc second, double restitution, double end,
                                   TwoDiscsResult *result) {
    FreeDisc *a = &first;
    FreeDisc *b = &second;
    if (!is_ordinary_disc(a) || !is_ordinary_disc(b) || !(is_ordinary(end) && end >= 0.0))
        return false;
    double time = pair_time(a->x, a->y, a->vx, a->vy, a->radius, b->x, b->y, b->vx, b->vy, b->radius);
    double wait = end;
    result->has_impact = time <= end;
    if (result->has_impact) {
        move_disc(a, time);
        move_disc(b, time);
        if (!apply_impact(a, b, time, restitution, &result->impact))
            return false;
        wait = end - time;
    }
    write_disc(a, wait, result->position, result->velocity);
    write_disc(b, wait, result->position + 2, result->velocity + 2);
    return true;
}
