/* Separation: the bodies that a disc does not approach on its present path, regardless of rounding. A disc does not
   approach the disc that it hit last, or bodies that it touches without normal speed (touched_bodies.h). */

#pragma once

#include "carom/core/pic/driven_path.h"

/* Return the disc that disc `i` hit last, if the present paths of both discs began at their impact. If one path began
   elsewhere, return NOBODY.

   The two discs never collide again on paths that began at their impact. Rounding can leave a small speed of approach:
   with restitution 0, the whole remaining normal speed is a rounding error. A speed due to rounding must not cause an
   impact, because further impacts would follow without end. A disc that never moves always has the same path. */
static inline Index last_partner(const State *s, Index i) {
    Index last = s->discs[i].last;
    if (last < 0)
        return NOBODY;
    return s->discs[last].inverse_mass == 0.0 || s->discs[last].last == i ? last : NOBODY;
}

/* Return whether disc `i` does not approach a body on its present path. Either the disc's last impact was with that
   body, or the two touch without normal speed. */
static inline bool is_parting_from(const State *s, Index i, Index body) {
    return s->discs[i].inverse_mass == 0.0 || s->discs[i].last == body || is_touched(&s->touched[i], body);
}

/* Return whether two discs touch without normal speed, or whether the present paths of both began at their impact. */
static inline bool are_parting(const State *s, Index i, Index j) {
    return is_parting_from(s, i, j) && is_parting_from(s, j, i);
}

/* Return the times until which a contact of disc `i` and a body lasts. Feature k has the body number -1 - k. `speed` is
   `NewContact.speed`. */
static inline TouchEnd touch_end(const State *s, Index i, Index body, double nx, double ny, double speed) {
    const Feature *f = body < 0 && s->feature_count > 0 ? &s->features[-1 - body] : NULL;
    const Driven *row = driven_row(&s->driving, f != NULL ? -1 - (Index)f->wall : body);
    if (row == NULL || row->leg_count == 0)
        return (TouchEnd){CAROM_INF, CAROM_INF};
    const Disc *a = &s->discs[i];
    const Leg *leg = &s->driving.legs[leg_at(&s->driving, row, s->clock.now)];
    NewContact t = {FLAT, nx, ny, a->vx, a->vy, speed, s->clock.reported, 1.0, 0.0};
    double sizes = size_of(a->x, a->y, a->radius);
    if (body >= 0) {
        const Disc *b = &s->discs[body];
        sizes += size_of(b->x, b->y, b->radius);
        t.reach = a->radius + b->radius;
    } else if (f != NULL && f->kind > FACE) {
        Mover disc = mover_of(a);
        sizes += size_of(f->x.high, f->y.high, f->size.high + f->half_width);
        t.reach = fabs(reach_of(&disc, f).high);
    } else {
        return contact_end(&t, leg);
    }
    t.shape = (f != NULL && f->kind == INNER_ARC) || s->accelerated.paths != NULL ? OTHER_SHAPE : CONVEX;
    t.resolution = gap_resolution(sizes);
    return contact_end(&t, leg);
}

/* Return whether disc `i` touches feature `k` without normal speed at `time`, in seconds since the start. If the
   feature's wall is not driven, the time does not matter. */
static inline bool touches_feature(const State *s, Index i, Index k, double time) {
    return CAROM_UNLIKELY(s->touched != NULL) && find_touched(&s->touched[i], -1 - k, time) != NULL;
}

/* Return whether disc `i` does not hit feature `k` on its present path, because the two touch without normal speed. The
   inside of an arc is an exception, because a disc that moves along an arc is pressed against its inside. */
static inline bool is_left_for_good(const State *s, Index i, Index k, double time) {
    return touches_feature(s, i, k, time) && s->features[k].kind != INNER_ARC;
}

/* Return whether the path of disc `i` begins at feature `k`, and if so, whether the disc stopped there or left it.
   `last` is the body or feature that the disc hit last. */
static inline PathStart path_start(const State *s, Index i, Index k, Index last) {
    if (last != -1 - k)
        return ELSEWHERE;
    return touches_feature(s, i, k, 0.0) ? JUST_STOPPED : JUST_LEFT;
}

/* For discs `i` and `j` with the same radius, return a contact of disc `i` with a flat wall that disc `j` also touches,
   or NULL if there is none.

   The centres of both discs are at the same distance from the wall. So the normal of the impact of the two discs is
   exactly parallel to the wall, although rounded centres give a slightly different normal. If discs accelerate, return
   NULL, because gravity or friction may change a disc's distance from the wall between impacts. */
static inline const Touched *find_common_wall(const State *s, Index i, Index j) {
    const TouchedBodies *t = &s->touched[i];
    if (s->accelerated.paths != NULL || s->discs[i].radius != s->discs[j].radius)
        return NULL;
    for (int k = 0; k < t->count; k++) {
        Index body = t->bodies[k].body;
        bool is_flat = body < 0 && (s->feature_count == 0 || s->features[-1 - body].kind <= FACE);
        if (is_flat && find_touched(&s->touched[j], body, s->clock.reported) != NULL)
            return find_touched(t, body, s->clock.reported);
    }
    return NULL;
}

/* Give a disc's velocity the same component along the unit vector n as the earlier velocity `before`. */
static inline void keep_speed_along(Disc *a, const double *before, double nx, double ny) {
    double change = (a->vx - before[0]) * nx + (a->vy - before[1]) * ny;
    a->vx -= change * nx;
    a->vy -= change * ny;
}

/* After an impact of two discs, update the lists of bodies that they touch. The normal is the unit vector from one disc
   to the other. `before` contains the velocities of both discs before the impact.

   If both discs touch a flat wall and there is no friction, their velocities along the wall's normal do not change. */
static CAROM_NOINLINE void note_touching_discs(State *s, Index i, Index j, double nx, double ny, const double *before,
                                               bool is_elastic) {
    bool slides = can_rub(&s->law.contact) && !is_elastic, stops = s->law.restitution == 0.0 && !is_elastic;
    const Touched *wall = slides ? NULL : find_common_wall(s, i, j);
    if (wall != NULL) {
        keep_speed_along(&s->discs[i], before, wall->nx, wall->ny);
        keep_speed_along(&s->discs[j], before + 2, wall->nx, wall->ny);
        nx = wall->ny;
        ny = -wall->nx;
    }
    Index pair[2] = {i, j};
    for (int k = 0; k < 2; k++) {
        Index other = pair[1 - k];
        double speed = fabs(before[2 * k]) + fabs(before[2 * k + 1]);
        Touched touched = {(int)other, nx, ny, touch_end(s, pair[k], other, nx, ny, speed)};
        note_touched(&s->touched[pair[k]], touched, s->clock.reported, slides, stops);
    }
}

/* After an impact of disc `i` on wall or feature `k`, update the list of bodies that the disc touches. The unit normal
   is n. `speed` has the meaning of `NewContact.speed`. */
static CAROM_NOINLINE void note_touching_wall(State *s, Index i, Index k, double nx, double ny, double speed,
                                              bool is_elastic) {
    const Law *law = s->feature_count > 0 ? &s->wall_laws[s->features[k].wall] : &s->law;
    bool slides = can_rub(&law->wall_contact) && !is_elastic;
    bool stops = law->wall_restitution == 0.0 && !is_elastic;
    Touched touched = {(int)(-1 - k), nx, ny, touch_end(s, i, -1 - k, nx, ny, speed)};
    note_touched(&s->touched[i], touched, s->clock.reported, slides, stops);
}

/* From the candidates of a scan, remove the discs that disc `i` does not approach. Return the number of remaining
   candidates. */
static CAROM_NOINLINE Index remove_touching(State *s, Index i, Index count) {
    Index kept = 0;
    for (Index k = 0; k < count; k++) {
        Index j = s->candidates.disc[k];
        if (!are_parting(s, i, j))
            s->candidates.disc[kept++] = (int)j;
    }
    return kept;
}
