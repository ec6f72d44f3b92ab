/* Interference tests and impacts of PIT.

   Two bodies interfere if they approach while they touch or overlap. `carom.solvers.reference.algorithm_1` makes the
   same operations in the same order. The time of an impact is the time of its frame. */

#pragma once

#include "carom/core/wall_contact_law.h"
#include "carom/core/impact_record.h"
#include "carom/core/pit/contact.h"
#include "carom/core/pit/motion.h"
#include "carom/core/pit/separation.h"

/* ---- two discs ---- */

/* Return whether two discs approach while they touch or overlap. */
static inline bool discs_interfere(const Disc *a, const Disc *b) {
    double dx = b->x - a->x;
    double dy = b->y - a->y;
    double along = dx * (b->vx - a->vx) + dy * (b->vy - a->vy);
    double squared = dx * dx + dy * dy;
    double contact = a->radius + b->radius;
    /* Approach and overlap are first tested together and without a root, because a processor cannot predict a branch on
       the direction of motion alone. */
    if (greater(along, squared - contact * contact * (1.0 + CAROM_ROOT_ROOM)) > 0.0)
        return false;
    return along < 0.0 && sqrt(squared) <= contact;
}

/* Return whether both discs are immovable, so that no impact changes their velocities. */
static inline bool are_immovable(const Disc *a, const Disc *b) {
    return a->inverse_mass == 0.0 && b->inverse_mass == 0.0;
}

/* Return whether discs i < j have an impact at this frame. */
static inline bool pair_interferes(const State *s, Index i, Index j) {
    const Disc *a = &s->discs[i];
    const Disc *b = &s->discs[j];
    return discs_interfere(a, b) && !are_separating(s, i, j) && !are_immovable(a, b) && !are_in_contact(s, i, j);
}

/* ---- a disc and a wall ---- */

/* Return whether a disc approaches a half-plane while the disc touches or overlaps the half-plane. */
static inline bool plane_interferes(const Disc *a, const Wall *wall) {
    double along = a->vx * wall->nx + a->vy * wall->ny;
    double depth = (a->x - wall->x) * wall->nx + (a->y - wall->y) * wall->ny;
    /* the depth is tested first, because few discs are at a wall. A processor cannot predict a branch on the direction
       of motion */
    return depth <= a->radius && along < 0.0;
}

/* Return whether a disc approaches a chain (finite wall) while the disc touches or overlaps the chain. `a` is the
   motion of disc i relative to chain k. */
static inline bool chain_interferes(const State *s, const Disc *a, Index i, Index k) {
    const Chain *chain = &s->chains[k];
    Nearest nearest = find_nearest(chain, a->x, a->y, near_edge(s, i, k));
    double dx = a->x - nearest.x;
    double dy = a->y - nearest.y;
    double reach = chain->half_width + a->radius;
    double distance = sqrt(dx * dx + dy * dy);
    if (distance == 0.0 || !(a->vx * dx + a->vy * dy < 0.0 && dx * dx + dy * dy <= reach * reach))
        return false;
    ChainHit hit = {dx / distance, dy / distance, feature_at(s, k, &nearest, a->x, a->y)};
    return !is_leaving_chain(s, i, k, &hit) && !is_in_contact(s, i, k, a, hit.feature);
}

/* Return the part of chain k that is nearest to disc i, and the normal there. `a` is the motion of the disc relative to
   the chain. */
static inline ChainHit find_hit(const State *s, const Disc *a, Index i, Index k) {
    Nearest nearest = find_nearest(&s->chains[k], a->x, a->y, near_edge(s, i, k));
    double dx = a->x - nearest.x;
    double dy = a->y - nearest.y;
    double distance = sqrt(dx * dx + dy * dy);
    return (ChainHit){dx / distance, dy / distance, feature_at(s, k, &nearest, a->x, a->y)};
}

/* Return whether disc i and wall k have an impact at this frame. */
static inline bool wall_interferes(const State *s, Index i, Index k) {
    Disc relative;
    if (s->discs[i].inverse_mass == 0.0)
        return false;
    const Disc *a = relative_to_wall(s, &s->discs[i], k, &relative);
    if (is_chain(s, k))
        return chain_interferes(s, a, i, k);
    return plane_interferes(a, &s->walls[k]) && !is_leaving_plane(s, i, k) && !is_in_contact(s, i, k, a, NO_FEATURE);
}

/* ---- impacts ---- */

static inline Body body_of(const State *s, Index i) {
    Disc *a = &s->discs[i];
    return (Body){&a->vx, a->inverse_mass, a->radius, &s->turning[s->record.has_spins ? i : 0]};
}

/* Record an impact that was just applied at this frame. With damping, convert the undamped velocities and spins to
   damped ones. */
static inline void record_at_frame(State *s, const Impact *impact, const Spins *spins, Contact contact,
                                   const Ambiguity *ambiguity) {
    Record *r = &s->record;
    s->is_settled = false;
    record_impact(r, impact, spins, contact, ambiguity);
    if (s->damping.rate > 0.0) {
        double kept = 1.0 - s->damping.rate * s->now;
        slow_impact(&r->rows[r->count - 1], kept);
        r->rows[r->count - 1].time = s->reported;
        if (r->has_spins)
            slow_spin(&r->spins[r->count - 1], kept);
    }
}

/* Apply and record the impact of two interfering discs. The normal of the impact is along the line through the discs'
   present centres. */
static inline void apply_pair_impact(State *s, Index i, Index j) {
    Disc *a = &s->discs[i];
    Disc *b = &s->discs[j];
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
    double distance = sqrt(dx * dx + dy * dy), nx = dx / distance, ny = dy / distance;
    Impact impact = {s->now, i, j, {nx, ny}, {a->vx, a->vy}, {b->vx, b->vy}, {0.0}, {0.0}};
    Body first = body_of(s, i);
    Body second = body_of(s, j);
    Spins spins;
    collide_discs(&s->law, dx, dy, &first, &second, false, s->record.has_spins, &spins);
    a->last = (int)j;
    b->last = (int)i;
    write_velocity(impact.first_after, a->vx, a->vy);
    write_velocity(impact.second_after, b->vx, b->vy);
    record_at_frame(s, &impact, &spins, (Contact){a->x, a->y, NO_FEATURE},
                    &(Ambiguity){0.0, s->law.contact.friction > 0.0, a->inverse_mass > 0.0, b->inverse_mass > 0.0,
                                 NO_FEATURE, false});
    slow_disc(s, i);
    slow_disc(s, j);
    store_impact_of_discs(s, i, j, &impact);
}

/* Apply the impact of a falling disc on a wall, like `collide_wall`, but with rolling resistance. */
static inline void collide_falling(const State *s, const Law *law, const Wall *wall, const Surface *surface, Body *a,
                                   Spins *spins) {
    Law smooth = *law;
    smooth.wall_contact.friction = 0.0;
    double ux = a->velocity[0] - (surface != NULL ? surface->vx : 0.0);
    double uy = a->velocity[1] - (surface != NULL ? surface->vy : 0.0);
    double along = collide_wall(&smooth, wall, surface, a, false, true, spins);
    if (along < 0.0 && (law->wall_contact.friction > 0.0 || s->rolling_resistance > 0.0))
        rub_on_wall(&law->wall_contact, s->rolling_resistance, surface != NULL ? surface->belt : 0.0, wall->nx,
                    wall->ny, ux, uy, -((1.0 + law->wall_restitution) * along), a);
    spins->first_after = a->turning->spin;
}

/* Apply and record the impact of disc i on wall k. The disc must interfere with the wall. */
static inline void apply_wall_impact(State *s, Index i, Index k) {
    Disc *a = &s->discs[i];
    Disc relative;
    const Disc *seen = relative_to_wall(s, a, k, &relative);
    const Surface *surface = s->wall_motions != NULL ? &s->wall_motions[k].surface : NULL;
    const Law *law = &s->wall_laws[k];
    Wall wall = s->walls[k];
    if (!reserve_row(&s->record)) {
        s->is_out_of_memory = true;
        return;
    }
    Index edge = NO_FEATURE;
    a->last = (int)(ON_WALL - k);
    if (is_chain(s, k)) {
        s->hits[i] = find_hit(s, seen, i, k);
        wall.nx = s->hits[i].nx;
        wall.ny = s->hits[i].ny;
        edge = recorded_edge(s, k, s->hits[i].feature);
    }
    double vx = surface != NULL ? surface->vx : 0.0, vy = surface != NULL ? surface->vy : 0.0;
    Impact impact = {s->now, i, -1 - k, {-wall.nx, -wall.ny}, {a->vx, a->vy}, {vx, vy}, {0.0}, {vx, vy}};
    Body body = body_of(s, i);
    Spins spins;
    if (s->motion == FALLING && s->record.has_spins)
        collide_falling(s, law, &wall, surface, &body, &spins);
    else
        collide_wall(law, &wall, surface, &body, false, s->record.has_spins, &spins);
    write_velocity(impact.first_after, a->vx, a->vy);
    record_at_frame(s, &impact, &spins, (Contact){seen->x, seen->y, edge},
                    &(Ambiguity){0.0, law->wall_contact.friction > 0.0, true, false, NO_FEATURE, false});
    slow_disc(s, i);
    store_impact_on_wall(s, i, k, seen, is_chain(s, k) ? s->hits[i].feature : NO_FEATURE, &impact);
}
