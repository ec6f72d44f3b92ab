/* Interference tests and impacts of PIT.

   The operations and their order are those of `carom.solvers.plain.bodies`. A frame is the time of all its impacts, and
   of no others: it is known without an error. */

#ifndef CAROM_PIT_IMPACTS_H
#define CAROM_PIT_IMPACTS_H

#include <math.h>

#include "carom/core/constants.h"
#include "carom/core/impact.h"
#include "carom/core/pit_state.h"
#include "carom/core/record.h"
#include "carom/core/resolution.h"

/* ---- two discs ---- */

/* Return whether two discs approach and touch or overlap. Two that never move do not approach. */
static inline bool discs_interfere(const Disc *a, const Disc *b) {
    double dx = b->x - a->x;
    double dy = b->y - a->y;
    double along = dx * (b->vx - a->vx) + dy * (b->vy - a->vy);
    double squared = dx * dx + dy * dy;
    double contact = a->radius + b->radius;
    /* First both at once and without a root: whether two discs approach is as hard to predict as a coin. */
    if (greater(along, squared - contact * contact * (1.0 + CAROM_ROOT_ROOM)) > 0.0)
        return false;
    return along < 0.0 && sqrt(squared) <= contact;
}

/* Return whether two discs are on the paths that their own impact gave them. One that never moves always is.

   A disc that falls onto one that does not fall comes back. */
static inline bool are_separating(const State *s, Index i, Index j) {
    const Disc *a = &s->discs[i];
    const Disc *b = &s->discs[j];
    if (s->falls && (a->inverse_mass == 0.0 || b->inverse_mass == 0.0))
        return false;
    return (a->last == j || a->inverse_mass == 0.0) && (b->last == i || b->inverse_mass == 0.0);
}

/* Return whether discs i < j have an impact at this frame. */
static inline bool pair_interferes(const State *s, Index i, Index j) {
    return discs_interfere(&s->discs[i], &s->discs[j]) && !are_separating(s, i, j);
}

/* Return disc i as the law sees it. */
static inline Body body_of(const State *s, Index i, bool has_spins) {
    Disc *a = &s->discs[i];
    return (Body){&a->vx, a->inverse_mass, a->radius, &s->turning[has_spins ? i : 0]};
}

/* Give two discs that interfere their velocities after the impact, along the line of centres as it is. */
static inline void apply_pair_impact(State *s, Index i, Index j) {
    Disc *a = &s->discs[i];
    Disc *b = &s->discs[j];
    bool has_spins = s->record.has_spins;
    if (!reserve_row(&s->record)) {
        s->is_out_of_memory = true;
        return;
    }
    if (!are_distinguishable(a->x, a->y, b->x, b->y, a->radius + b->radius)) {
        s->is_too_far = true;
        return;
    }
    double dx = b->x - a->x;
    double dy = b->y - a->y;
    Before before = {{a->vx, a->vy}, {b->vx, b->vy}};
    Body first = body_of(s, i, has_spins);
    Body second = body_of(s, j, has_spins);
    Spins spins;
    collide_discs(&s->law, dx, dy, &first, &second, false, has_spins, &spins);
    a->last = (int)j;
    b->last = (int)i;
    double distance = sqrt(dx * dx + dy * dy);
    record_impact(&s->record, s->now, i, j, dx / distance, dy / distance, &before, &a->vx, &b->vx, &spins, a->x, a->y,
                  NO_FEATURE,
                  &(Ambiguity){0.0, s->law.contact.friction > 0.0, a->inverse_mass > 0.0, b->inverse_mass > 0.0,
                               NO_FEATURE, false});
}

/* ---- a disc and a wall ---- */

static inline bool is_chain(const State *s, Index k) {
    return s->chains != NULL && s->chains[k].edge_count > 0;
}

/* Return whether a disc approaches a half-plane and touches or overlaps it. */
static inline bool plane_interferes(const Disc *a, const Wall *wall) {
    double along = a->vx * wall->nx + a->vy * wall->ny;
    double depth = (a->x - wall->x) * wall->nx + (a->y - wall->y) * wall->ny;
    return along < 0.0 && depth <= a->radius;
}

/* Return the unit vector from the nearest point of a chain to a disc's centre; NaN for a centre on the chain's line. */
static inline Normal chain_normal(const Chain *chain, const Disc *a) {
    Point nearest = find_nearest(chain, a->x, a->y);
    double dx = a->x - nearest.x;
    double dy = a->y - nearest.y;
    double distance = sqrt(dx * dx + dy * dy);
    return (Normal){dx / distance, dy / distance};
}

/* Return whether disc i approaches chain k and touches or overlaps it, and is not on its path from there.

   A path from a chain can lead back to it, since it bends or has another side. The normal tells the two cases apart. */
static inline bool chain_interferes(const State *s, Index i, Index k) {
    const Disc *a = &s->discs[i];
    const Chain *chain = &s->chains[k];
    Point nearest = find_nearest(chain, a->x, a->y);
    double dx = a->x - nearest.x;
    double dy = a->y - nearest.y;
    double reach = chain->half_width + a->radius;
    double distance = sqrt(dx * dx + dy * dy);
    if (distance == 0.0 || !(a->vx * dx + a->vy * dy < 0.0 && dx * dx + dy * dy <= reach * reach))
        return false;
    return s->falls || a->last != ON_WALL - k || dx / distance != s->normals[i].x || dy / distance != s->normals[i].y;
}

/* Return whether disc i and wall k have an impact at this frame. */
static inline bool wall_interferes(const State *s, Index i, Index k) {
    if (is_chain(s, k))
        return chain_interferes(s, i, k);
    return plane_interferes(&s->discs[i], &s->walls[k]) && (s->falls || s->discs[i].last != ON_WALL - k);
}

/* Give a disc that interferes with a wall, and so moves, its velocity after the impact. */
static inline void apply_wall_impact(State *s, Index i, Index k) {
    Disc *a = &s->discs[i];
    Wall *wall = &s->walls[k];
    const Law *law = &s->wall_laws[k];
    bool has_spins = s->record.has_spins;
    if (!reserve_row(&s->record)) {
        s->is_out_of_memory = true;
        return;
    }
    a->last = (int)(ON_WALL - k);
    if (is_chain(s, k)) {
        s->normals[i] = chain_normal(&s->chains[k], a);
        wall->nx = s->normals[i].x;
        wall->ny = s->normals[i].y;
    }
    Before before = {{a->vx, a->vy}, {0.0, 0.0}};
    Body body = body_of(s, i, has_spins);
    Spins spins;
    collide_wall(law, wall, NULL, &body, false, has_spins, &spins);
    record_impact(&s->record, s->now, i, -1 - k, -wall->nx, -wall->ny, &before, &a->vx, before.second, &spins, a->x,
                  a->y, k, &(Ambiguity){0.0, law->wall_contact.friction > 0.0, true, false, NO_FEATURE, false});
}

#endif
