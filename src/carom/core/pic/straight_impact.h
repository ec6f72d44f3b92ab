/* Impacts in straight motion: set the clock, move the discs to the time of the impact, apply the impact law, and record
   the impact. */

#pragma once

#include "carom/core/impact_law.h"
#include "carom/core/pic/clock.h"
#include "carom/core/pic/separation.h"

/* Return whether less than the contact duration (of the TC model) has passed since the last impact of disc `i`. If the
   result is true, the present impact loses no energy. */
static inline bool is_one_contact(State *s, Index i) {
    bool found = false;
    if (s->law.contact_duration > 0.0 && s->discs[i].inverse_mass > 0.0) {
        found = s->clock.now - s->last_impact[i] < s->law.contact_duration;
        s->last_impact[i] = s->clock.now;
    }
    return found;
}

static inline Body body_of(State *s, Index i, bool has_spins) {
    Disc *a = &s->discs[i];
    return (Body){&a->vx, a->inverse_mass, a->radius, has_spins ? &s->turning[i] : NULL};
}

/* ---- two discs ---- */

/* Apply the impact of discs `i` < `j`. Record the impact if `is_wanted`. */
static inline void apply_pair_impact(State *s, Index i, Index j, double time, bool is_wanted, bool has_spins) {
    Disc *a = &s->discs[i];
    Disc *b = &s->discs[j];
    count_impact(s, time);
    bool is_elastic = is_one_contact(s, i) | is_one_contact(s, j);
    move_to(a, s->clock.now);
    move_to(b, s->clock.now);
    double dx = b->x - a->x;
    double dy = b->y - a->y;
    double avx = a->vx, avy = a->vy, bvx = b->vx, bvy = b->vy;
    Body first = body_of(s, i, has_spins);
    Body second = body_of(s, j, has_spins);
    Spins spins;
    collide_discs(&s->law, dx, dy, &first, &second, is_elastic, has_spins, &spins);
    a->impacts += 1;
    b->impacts += 1;
    a->last = (int)j;
    b->last = (int)i;
    double distance2 = dx * dx + dy * dy;
    double reach = a->radius + b->radius;
    s->counts.too_far += !are_distinguishable(a->x, a->y, b->x, b->y, reach);
    s->counts.predictions += (Index)(a->inverse_mass > 0.0) + (Index)(b->inverse_mass > 0.0);
    if (CAROM_UNLIKELY(s->touched != NULL))
        note_touching_discs(s, i, j, dx / sqrt(distance2), dy / sqrt(distance2), (double[]){avx, avy, bvx, bvy},
                            is_elastic);
    /* marked as unlikely, so that compilers place this code apart from the code of runs that record no impacts */
    if (CAROM_UNLIKELY(is_wanted)) {
        double distance = sqrt(distance2);
        double nx = dx / distance;
        double ny = dy / distance;
        double ux = avx - bvx;
        double uy = avy - bvy;
        double sizes = size_of(a->x, a->y, a->radius) + size_of(b->x, b->y, b->radius);
        double resolution =
            pair_resolution(sizes, reach, ux, uy, ux * nx + uy * ny) + clock_resolution(s->clock.reported);
        Impact impact = {s->clock.reported, i, j, {nx, ny}, {avx, avy}, {bvx, bvy}, {a->vx, a->vy}, {b->vx, b->vy}};
        record_impact(&s->record, &impact, &spins, (Contact){a->x, a->y, NO_FEATURE},
                      &(Ambiguity){resolution, s->law.contact.friction > 0.0, a->inverse_mass > 0.0,
                                   b->inverse_mass > 0.0, NO_FEATURE, false});
    }
}

/* ---- a disc and a wall ---- */

/* Apply the impact of disc `i`, which moves, on wall `k`. */
static inline void apply_wall_impact(State *s, Index i, Index k, double time, bool is_wanted, bool has_spins) {
    Disc *a = &s->discs[i];
    Wall w = s->walls[k];
    count_impact(s, time);
    bool is_elastic = is_one_contact(s, i);
    move_to(a, s->clock.now);
    double avx = a->vx, avy = a->vy;
    Body body = body_of(s, i, has_spins);
    Spins spins;
    double along = collide_wall(&s->law, &w, NULL, &body, is_elastic, has_spins, &spins);
    a->impacts += 1;
    a->last = (int)(-1 - k);
    s->counts.wall_impacts += 1;
    s->counts.predictions += 1;
    if (CAROM_UNLIKELY(s->touched != NULL))
        note_touching_wall(s, i, k, w.nx, w.ny, fabs(avx) + fabs(avy), is_elastic);
    if (CAROM_UNLIKELY(is_wanted)) {
        double sizes = size_of(a->x, a->y, a->radius) + size_of(w.x, w.y, 0.0);
        double resolution = wall_resolution(sizes, -along) + clock_resolution(s->clock.reported);
        Impact impact = {s->clock.reported, i, -1 - k, {-w.nx, -w.ny}, {avx, avy}, {0.0}, {a->vx, a->vy}, {0.0}};
        record_impact(&s->record, &impact, &spins, (Contact){a->x, a->y, k},
                      &(Ambiguity){resolution, s->law.wall_contact.friction > 0.0, true, false, NO_FEATURE, false});
    }
}

/* ---- a disc and a feature ---- */

/* Return the resolution (bound of the rounding error), in seconds, of the time at which a disc with the relative
   velocity u hits a feature.

   Disc `a` is at its position at the impact, with rounded coordinates. `speed` is the relative speed along the normal.
   `returns` is true if the disc's last impact was on the same feature, which is then the inside of an arc. The time
   between two impacts on the inside of an arc is the time for one chord of the arc. A rounded gap does not affect the
   time for a chord, so its resolution is 0. */
static inline double feature_resolution(const Feature *f, const Disc *a, double ux, double uy, double speed,
                                        bool returns) {
    Mover disc = mover_of(a);
    double sizes = size_of(a->x, a->y, a->radius);
    if (returns)
        return 0.0;
    if (f->kind == PLANE)
        return wall_resolution(sizes + size_of(f->x.high, f->y.high, 0.0), speed);
    if (f->kind == FACE)
        return wall_resolution(sizes + size_of(f->x.high, f->y.high, f->half_width), speed);
    if (f->kind == VERTEX) {
        sizes += size_of(f->x.high, f->y.high, f->half_width);
        return pair_resolution(sizes, a->radius + f->half_width, ux, uy, speed);
    }
    sizes += size_of(f->x.high, f->y.high, f->size.high + f->half_width);
    return pair_resolution(sizes, reach_of(&disc, f).high, ux, uy, speed);
}

/* If the velocity of a disc after an impact differs from the velocity of the surface only by rounding errors, make the
   two velocities equal. `speed` is the relative speed before the impact. If the velocities differed, the disc would
   glide along an arc although the impact has stopped it. */
static inline void remove_rounding_of_rest(Disc *a, const Surface *surface, double speed) {
    double sizes = speed + fabs(surface->vx) + fabs(surface->vy);
    if (fabs(a->vx - surface->vx) + fabs(a->vy - surface->vy) <= CAROM_ERROR * sizes) {
        a->vx = surface->vx;
        a->vy = surface->vy;
    }
}

/* Apply the impact of disc `i`, which moves, on feature `k`. Return the normal of the impact. */
static inline Direction apply_feature_impact(State *s, Index i, Index k, double time, bool is_wanted) {
    Disc *a = &s->discs[i];
    const Feature *f = &s->features[k];
    const Law *law = &s->wall_laws[f->wall];
    bool has_spins = s->record.has_spins;
    bool returns = a->last == -1 - k;
    count_impact(s, time);
    bool is_elastic = is_one_contact(s, i);
    move_to(a, s->clock.now);
    extend_box(&s->visited, a->x, a->y);
    Disc relative;
    const Disc *seen = a;
    Surface surface = {0.0, 0.0, 0.0};
    const Driven *row = driven_row(&s->driving, -1 - (Index)f->wall);
    if (row != NULL) {
        relative = seen_from_wall(s, a, row, a->time);
        seen = &relative;
        surface = surface_at(s, row, a->time);
    }
    Mover disc = mover_of(seen);
    double avx = a->vx, avy = a->vy;
    Body body = body_of(s, i, has_spins);
    Spins spins;
    Direction normal = normal_at(f, &disc);
    Wall w = {f->x.high, f->y.high, normal.x, normal.y};
    double ux = seen->vx;
    double uy = seen->vy;
    double along = collide_wall(law, &w, row != NULL ? &surface : NULL, &body, is_elastic, has_spins, &spins);
    if (f->kind == INNER_ARC && law->wall_restitution == 0.0 && !is_elastic)
        remove_rounding_of_rest(a, &surface, fabs(ux) + fabs(uy));
    a->impacts += 1;
    a->last = (int)(-1 - k);
    s->counts.wall_impacts += 1;
    s->counts.predictions += 1;
    if (s->touched != NULL)
        note_touching_wall(s, i, k, w.nx, w.ny, fabs(avx) + fabs(avy), is_elastic);
    if (is_wanted) {
        double resolution = feature_resolution(f, a, ux, uy, -along, returns);
        resolution += clock_resolution(s->clock.reported);
        Impact impact = {s->clock.reported, i, -1 - (Index)f->wall, {-w.nx, -w.ny}, {avx, avy},
                         {surface.vx, surface.vy}, {a->vx, a->vy}, {surface.vx, surface.vy}};
        record_impact(&s->record, &impact, &spins, (Contact){seen->x, seen->y, k},
                      &(Ambiguity){resolution, law->wall_contact.friction > 0.0, true, false,
                                   f->kind == PLANE ? NO_FEATURE : (int)k, law->wall_restitution == 1.0});
    }
    return normal;
}
