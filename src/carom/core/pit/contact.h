/* Contacts after impacts with restitution 0, and approaches that are only rounding errors.

   An impact with restitution 0 makes the normal speed 0. In floats, a rounding error of the normal speed remains. The
   error must not cause another impact, even if a driven body begins a leg (straight part of its path) along the
   contact. So PIT stores the impact (`StoredImpact`). After the impact, the two bodies have another impact only if they
   approach faster than rounding errors explain (`is_rounding`):

   - The velocities are rounded, both at this frame and just after the impact. In a time t, the rounding errors of
     velocities shrink the gap by no more than other rounding errors do. All other errors below only count until the gap
     has shrunk by more than its rounding error d since the impact.
   - The positions are rounded. Let R be the distance between the two centres of curvature. Rounding turns the normal
     by up to d / R (`turn_of`). So up to d / R times the slip becomes speed along the normal, which exact arithmetic
     does not have.
   - The impact itself has left errors of up to d / R times its slip along its normal, and of up to d / R times its
     speed of approach along its tangent. Later frames and impacts have also rounded the velocities. The errors of later
     frames and impacts count only by their components along the present normal.

   If a driven body pushes faster than rounding errors explain, the first frame of the push has an impact. Slower pushes
   cannot cause more overlap than rounding errors do. */

#pragma once

#include "carom/core/pit/separation.h"

typedef struct Encounter { /* a disc and another body that it may touch, at a frame */
    Index body;      /* number of the other body: see `StoredImpact` */
    double nx;       /* unit normal, from the disc to the body */
    double ny;
    /* relative speed along the normal, in metres per second; negative if the bodies separate */
    double approach;
    /* relative speed along the tangent */
    double slip;
    /* |vx| + |vy| of the disc plus |vx| + |vy| of the body */
    double speeds;
    /* sum of `size_of` for both bodies */
    double sizes;
    /* for two discs, the magnitudes of the centres' coordinates, projected on the tangent; otherwise `sizes` */
    double sizes_across;
    /* distance of the two centres of curvature, in metres; infinity for a straight surface */
    double reach;
    /* whether a driven body may turn the normal while the bodies are in contact; otherwise, only another impact changes
       the slip, and Algorithm 1 uses the computed normal of that impact */
    bool is_turned;
    double gap; /* distance of the two surfaces, in metres; negative if they overlap */
} Encounter;

/* Return the `Encounter` of a disc with the velocity v and a body with the velocity w. The vector (dx, dy) points from
   the disc to the body along the normal. If the vector (dx, dy) ends at the centre of the body's curvature, `radii` is
   the sum of both radii. */
static inline Encounter encounter_of(Index body, double dx, double dy, double radii, const double *v, const double *w,
                                     double sizes) {
    double length = sqrt(dx * dx + dy * dy), nx = dx / length, ny = dy / length;
    double ux = w[0] - v[0], uy = w[1] - v[1];
    double speeds = fabs(v[0]) + fabs(v[1]) + fabs(w[0]) + fabs(w[1]);
    return (Encounter){body, nx, ny, -(nx * ux + ny * uy), fabs(nx * uy - ny * ux), speeds, sizes, sizes, length,
                       true, length - radii};
}

/* Return the `Encounter` of disc i, which has the velocity v, and disc j, which has the velocity w. */
static inline Encounter meet_disc(const State *s, Index i, Index j, const double *v, const double *w) {
    const Disc *a = &s->discs[i];
    const Disc *b = &s->discs[j];
    double sizes = size_of(a->x, a->y, a->radius) + size_of(b->x, b->y, b->radius);
    Encounter m = encounter_of(j, b->x - a->x, b->y - a->y, a->radius + b->radius, v, w, sizes);
    m.sizes_across = fabs(m.ny) * (fabs(a->x) + fabs(b->x)) + fabs(m.nx) * (fabs(a->y) + fabs(b->y));
    m.is_turned = disc_path(s, i) != NULL || disc_path(s, j) != NULL;
    return m;
}

/* Return the `Encounter` of a disc and a part of chain k. `a` is the motion of the disc relative to the chain.

   The inside of an arc presses a disc that slides along it, so a turned normal does not explain an approach. */
static inline Encounter meet_feature(const State *s, Index k, const Disc *a, Index feature, const double *v,
                                     const double *w, double sizes) {
    const ChainEdge *e = &s->edges[feature / CHAIN_PARTS];
    Index body = -1 - s->wall_count - feature, part = feature % CHAIN_PARTS;
    double sign = part == ON_RIGHT ? -1.0 : 1.0, radii = a->radius + s->chains[k].half_width;
    if (part == AT_BEGIN)
        return encounter_of(body, e->ax - a->x, e->ay - a->y, radii, v, w, sizes);
    if (part == AT_END)
        return encounter_of(body, e->bx - a->x, e->by - a->y, radii, v, w, sizes);
    if (e->is_arc) {
        Encounter m = encounter_of(body, sign * (e->cx - a->x), sign * (e->cy - a->y), e->radius + radii, v, w, sizes);
        if (part == ON_RIGHT) {
            m.gap = e->radius - m.reach - radii;
            m.is_turned = false;
        }
        return m;
    }
    Encounter m = encounter_of(body, sign * (e->by - e->ay), sign * (e->ax - e->bx), 0.0, v, w, sizes);
    m.gap = m.nx * (e->ax - a->x) + m.ny * (e->ay - a->y) - radii;
    m.reach = CAROM_INF;
    m.is_turned = false;
    return m;
}

/* Return the `Encounter` of disc i, which has the velocity v, and wall k. `a` is the motion of the disc relative to the
   wall. If the wall is a chain, `feature` is its nearest part. */
static inline Encounter meet_wall(const State *s, Index i, Index k, const Disc *a, Index feature, const double *v) {
    const Disc *disc = &s->discs[i];
    const Wall *wall = &s->walls[k];
    const double still[2] = {0.0, 0.0};
    const double *w = s->wall_motions != NULL ? &s->wall_motions[k].surface.vx : still;
    double sizes = size_of(disc->x, disc->y, disc->radius) + fabs(disc->x - a->x) + fabs(disc->y - a->y);
    if (is_chain(s, k))
        return meet_feature(s, k, a, feature, v, w, sizes + s->chains[k].size);
    Encounter m = encounter_of(-1 - k, -wall->nx, -wall->ny, 0.0, v, w, sizes + size_of(wall->x, wall->y, 0.0));
    m.gap = (a->x - wall->x) * wall->nx + (a->y - wall->y) * wall->ny - a->radius;
    m.reach = CAROM_INF;
    m.is_turned = false;
    return m;
}

/* ---- rounding errors ---- */

/* Return the number of frames up to now. Each frame rounds the positions once more, and on curved paths also the
   velocities. */
static inline double count_roundings(const State *s) {
    return s->now * s->clock.rate / s->clock.step;
}

/* Return the rounding error of the distance between two bodies, in metres, along a direction in which the sum of the
   magnitudes of their coordinates is `sizes`. `speeds` is the sum of the bodies' speeds. At earlier frames, the
   coordinates exceeded the present ones by at most the length of the path since then. */
static inline double position_error(const State *s, double speeds, double sizes) {
    return gap_resolution(sizes) + count_roundings(s) * CAROM_ULP * (sizes + speeds * s->now);
}

/* Return the rounding error of the direction of the normal, in radians. Return 0 if the direction is too uncertain for
   a contact. */
static inline double turn_of(const State *s, const Encounter *m, double speeds) {
    double turn = position_error(s, speeds, m->sizes_across) / m->reach;
    return turn <= CAROM_COARSEST_CONTACT ? turn : 0.0;
}

/* Return the rounding error of the velocities due to all frames up to now, in metres per second. */
static inline double velocity_error(const State *s, double speeds) {
    return s->motion == STRAIGHT ? 0.0 : count_roundings(s) * CAROM_ULP * speeds;
}

/* Return whether a disc and a body approach only by a rounding error. `t` is the last impact of the disc with the
   body. */
static inline bool is_rounding(const State *s, const StoredImpact *t, const Encounter *m) {
    double cosine = greater(t->nx * m->nx + t->ny * m->ny, 0.0), sine = fabs(t->nx * m->ny - t->ny * m->nx);
    double error = CAROM_ERROR * m->speeds + t->left * cosine;
    if (m->approach <= error)
        return true;
    double speeds = greater(m->speeds, t->speeds);
    if (m->gap < t->gap - position_error(s, speeds, m->sizes))
        return false;
    double turn = m->is_turned ? greater(turn_of(s, m, speeds), t->turn) : 0.0;
    double past_error = velocity_error(s, speeds) + t->normal_error * cosine + t->tangent_error * sine;
    return m->approach <= error + turn * m->slip + past_error;
}

/* ---- stored impacts ---- */

/* Return the stored last impact of disc i with a body, or NULL if no such impact is stored. */
static inline const StoredImpact *find_stored_impact(const State *s, Index i, Index body) {
    const StoredImpacts *t = &s->stored[i];
    for (int k = 0; k < t->count; k++) {
        if (t->last[k].body == body)
            return &t->last[k];
    }
    return NULL;
}

/* Return the stored impact of disc i with a part of chain k that has the same normal as the part in `m`, or NULL. */
static inline const StoredImpact *find_on_same_line(const State *s, Index i, Index k, const Encounter *m) {
    const StoredImpacts *t = &s->stored[i];
    Index first = CHAIN_PARTS * (s->chains[k].edges - s->edges), count = CHAIN_PARTS * s->chains[k].edge_count;
    for (int n = 0; n < t->count; n++) {
        const StoredImpact *one = &t->last[n];
        Index part = -1 - s->wall_count - one->body - first;
        bool is_parallel = fabs(one->nx * m->ny - one->ny * m->nx) <= CAROM_ERROR;
        if (part >= 0 && part < count && is_parallel && one->nx * m->nx + one->ny * m->ny > 0.0)
            return one;
    }
    return NULL;
}

/* Return whether two discs are in contact, and approach only by a rounding error. */
static inline bool are_in_contact(const State *s, Index i, Index j) {
    if (s->stored == NULL)
        return false;
    bool is_first_fixed = s->discs[i].inverse_mass == 0.0, is_second_fixed = s->discs[j].inverse_mass == 0.0;
    const StoredImpact *first = find_stored_impact(s, i, j), *second = find_stored_impact(s, j, i);
    if ((first == NULL && !is_first_fixed) || (second == NULL && !is_second_fixed))
        return false;
    StoredImpact both = is_first_fixed ? *second : *first;
    if (!is_first_fixed && !is_second_fixed) /* each disc has stored the errors that its own later impacts have left */
        both.normal_error += second->normal_error;
    Encounter m = meet_disc(s, i, j, &s->discs[i].vx, &s->discs[j].vx);
    return is_rounding(s, &both, &m);
}

/* Return whether disc i is in contact with wall k, and approaches the wall only by a rounding error. */
static inline bool is_in_contact(const State *s, Index i, Index k, const Disc *a, Index feature) {
    if (s->stored == NULL || s->stored[i].count == 0)
        return false;
    Encounter m = meet_wall(s, i, k, a, feature, &s->discs[i].vx);
    const StoredImpact *t = find_stored_impact(s, i, m.body);
    if (t == NULL && is_chain(s, k))
        t = find_on_same_line(s, i, k, &m);
    return t != NULL && is_rounding(s, t, &m);
}

/* After an impact of disc i with a body, update the stored impacts of the disc. `is_inelastic` is true if the impact
   had restitution 0.

   If the impact is along the tangent of an earlier contact, it leaves a rounding error in that contact. Any other
   impact ends the earlier contact. If there are too many contacts, the oldest contact is dropped. */
static inline void store_impact(State *s, Index i, Index body, const Encounter *before, const Encounter *after,
                                bool is_inelastic) {
    StoredImpacts *t = &s->stored[i];
    double rounded = CAROM_ERROR * (before->speeds + after->speeds);
    double turn = turn_of(s, before, before->speeds);
    double slide_turn = before->is_turned ? turn : 0.0;
    int kept = 0;
    for (int k = 0; k < t->count; k++) {
        StoredImpact one = t->last[k];
        double tilt = CAROM_ERROR + one.turn + turn;
        one.normal_error += rounded + tilt * before->approach;
        if (one.body != body && fabs(one.nx * before->nx + one.ny * before->ny) <= tilt)
            t->last[kept++] = one;
    }
    if (is_inelastic && kept == MOST_STORED) {
        for (int k = 1; k < kept; k++)
            t->last[k - 1] = t->last[k];
        kept -= 1;
    }
    if (is_inelastic) {
        double left = CAROM_ERROR * after->speeds + greater(after->approach, 0.0);
        t->last[kept++] = (StoredImpact){
            .body = (int)body,
            .nx = before->nx,
            .ny = before->ny,
            .gap = before->gap,
            .turn = turn,
            .speeds = before->speeds,
            .left = left,
            .normal_error = CAROM_ERROR * before->speeds + slide_turn * (before->slip + after->slip),
            .tangent_error = slide_turn * before->approach,
        };
    }
    t->count = kept;
}

/* After an impact of discs i and j, update the stored impacts of both. */
static inline void store_impact_of_discs(State *s, Index i, Index j, const Impact *impact) {
    if (s->stored == NULL)
        return;
    bool is_inelastic = s->law.restitution == 0.0;
    Encounter before = meet_disc(s, i, j, impact->first_before, impact->second_before);
    Encounter after = meet_disc(s, i, j, impact->first_after, impact->second_after);
    if (s->discs[i].inverse_mass > 0.0)
        store_impact(s, i, j, &before, &after, is_inelastic);
    if (s->discs[j].inverse_mass > 0.0)
        store_impact(s, j, i, &before, &after, is_inelastic);
}

/* After an impact of disc i with wall k, update the disc's stored impacts. */
static inline void store_impact_on_wall(State *s, Index i, Index k, const Disc *a, Index feature,
                                        const Impact *impact) {
    if (s->stored == NULL)
        return;
    Encounter before = meet_wall(s, i, k, a, feature, impact->first_before);
    Encounter after = meet_wall(s, i, k, a, feature, impact->first_after);
    store_impact(s, i, before.body, &before, &after, s->wall_laws[k].wall_restitution == 0.0);
}
