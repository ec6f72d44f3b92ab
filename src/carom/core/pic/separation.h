/* Separation: the bodies that a disc does not approach on its present path, regardless of rounding. These are the disc
   that it hit last, and the bodies that it touches without normal speed (touched_bodies.h). */

#pragma once

#include "carom/core/impact_record.h"
#include "carom/core/pic/driven_path.h"

/* Return the disc that disc `i` hit last, if both are still on the paths that began at that impact. Otherwise return
   NOBODY.

   Such a pair never collides again on these paths. Rounding can leave a small speed of approach (with restitution 0,
   the whole remaining normal speed is rounding). It must not cause another impact, and so on without end. The path of a
   disc that never moves is always the same. */
static inline Index last_partner(const State *s, Index i) {
    Index last = s->discs[i].last;
    if (last < 0)
        return NOBODY;
    return s->discs[last].inverse_mass == 0.0 || s->discs[last].last == i ? last : NOBODY;
}

/* Return whether disc `i` does not approach a body on its present path, because an impact has left it no normal
   speed. */
static inline bool is_parting_from(const State *s, Index i, Index body) {
    return s->discs[i].inverse_mass == 0.0 || s->discs[i].last == body || is_touched(&s->touched[i], body);
}

/* Return whether two discs touch without normal speed, or are still on the paths that began at their own impact. */
static inline bool are_parting(const State *s, Index i, Index j) {
    return is_parting_from(s, i, j) && is_parting_from(s, j, i);
}

/* Return when the motion of a body can end a contact, as `contact_end`; infinity for a body that is not driven. */
static inline double driven_contact_end(const State *s, Index body, bool is_flat, double nx, double ny) {
    const Driven *row = driven_row(&s->driving, body);
    if (row == NULL || row->leg_count == 0)
        return CAROM_INF;
    return contact_end(&s->driving.legs[leg_at(&s->driving, row, s->clock.now)], is_flat, nx, ny);
}

/* Return a contact of disc `i` with a flat wall from which disc `j` has the same distance, or NULL.

   The normal of an impact of both is then along the wall, although the roundings of their centres tilt it. Discs of the
   same radius that touch the same wall have the same distance from it, however much roundings have added up. Gravity
   across the wall has pulled them off it. */
static inline const Touched *find_wall_along(const State *s, Index i, Index j) {
    const Disc *a = &s->discs[i], *b = &s->discs[j];
    double sizes = size_of(a->x, a->y, a->radius) + size_of(b->x, b->y, b->radius);
    for (int k = 0; k < s->touched[i].count; k++) {
        Index body = s->touched[i].bodies[k].body;
        const Touched *wall = find_touched(&s->touched[i], body, s->clock.reported);
        bool is_flat = body < 0 && (s->feature_count == 0 || s->features[-1 - body].kind <= FACE);
        if (!is_flat || wall == NULL)
            continue;
        double offset = (b->x - a->x) * wall->nx + (b->y - a->y) * wall->ny;
        bool is_pulled_off = s->accelerated.gx * wall->nx + s->accelerated.gy * wall->ny != 0.0;
        bool touch_same = !is_pulled_off && a->radius == b->radius &&
                          find_touched(&s->touched[j], body, s->clock.reported) != NULL;
        if (touch_same || fabs(offset) <= gap_resolution(sizes))
            return wall;
    }
    return NULL;
}

/* Remove from the change of a disc's velocity the part along n. `before` is the velocity before the change. */
static inline void keep_speed_along(Disc *a, const double *before, double nx, double ny) {
    double change = (a->vx - before[0]) * nx + (a->vy - before[1]) * ny;
    a->vx -= change * nx;
    a->vy -= change * ny;
}

/* Store an impact of two discs that was just applied. The normal is the unit vector from one to the other. `before` has
   the velocities of both before the impact.

   Without friction, an impact along a wall does not change speeds along the wall's normal. */
static CAROM_NOINLINE void note_touching_discs(State *s, Index i, Index j, double nx, double ny, const double *before,
                                               bool is_elastic) {
    bool slides = can_rub(&s->law.contact) && !is_elastic, stops = s->law.restitution == 0.0 && !is_elastic;
    const Touched *wall = find_wall_along(s, i, j);
    if (wall == NULL)
        wall = find_wall_along(s, j, i);
    if (wall != NULL && !slides) {
        keep_speed_along(&s->discs[i], before, wall->nx, wall->ny);
        keep_speed_along(&s->discs[j], before + 2, wall->nx, wall->ny);
        nx = wall->ny;
        ny = -wall->nx;
    }
    Index pair[2] = {i, j};
    for (int k = 0; k < 2; k++) {
        Index other = pair[1 - k];
        Touched touched = {(int)other, nx, ny, driven_contact_end(s, other, false, nx, ny)};
        note_touched(&s->touched[pair[k]], touched, s->clock.reported, slides, stops);
    }
}

/* Store an impact on wall or feature `k` that was just applied. n is the unit normal.

   The inside of an arc is excluded. A disc that moves along it without normal speed is pressed against it. */
static CAROM_NOINLINE void note_touching_wall(State *s, Index i, Index k, double nx, double ny, bool is_elastic) {
    const Law *law = s->feature_count > 0 ? &s->wall_laws[s->features[k].wall] : &s->law;
    bool is_bent_inwards = s->feature_count > 0 && s->features[k].kind == INNER_ARC;
    bool slides = can_rub(&law->wall_contact) && !is_elastic;
    bool stops = law->wall_restitution == 0.0 && !is_elastic && !is_bent_inwards;
    Index wall = s->feature_count > 0 ? s->features[k].wall : k;
    bool is_flat = s->feature_count == 0 || s->features[k].kind <= FACE;
    Touched touched = {(int)(-1 - k), nx, ny, driven_contact_end(s, -1 - wall, is_flat, nx, ny)};
    note_touched(&s->touched[i], touched, s->clock.reported, slides, stops);
}

/* Remove from a scan the discs that disc `i` does not approach. Return how many remain. */
static CAROM_NOINLINE Index remove_touching(State *s, Index i, Index count) {
    Index kept = 0;
    for (Index k = 0; k < count; k++) {
        Index j = s->candidates.disc[k];
        if (!are_parting(s, i, j))
            s->candidates.disc[kept++] = (int)j;
    }
    return kept;
}
