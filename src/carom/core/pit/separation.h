/* Separation: the bodies that a disc does not approach on its present path, regardless of rounding.

   - After an impact, two bodies separate until another impact changes one of the paths. On straight paths they cannot
     approach again, except for a chain that bends or that the disc reaches from its other side. Then the disc
     approaches another feature of the chain, or the inside of an arc. A falling disc can come back.
   - An impact with restitution 0 makes the normal speed 0, but in floats a rounding error remains. touched_bodies.h
     stores that this speed is 0 until it is changed by an impact that is not perpendicular to it. */

#pragma once

#include "carom/core/pit/motion.h"

static inline bool is_chain(const State *s, Index k) {
    return s->chains != NULL && s->chains[k].edge_count > 0;
}

/* ---- contacts without normal speed ---- */

/* Return the contact without normal speed of disc i and a body, or NULL. Half-plane k has the number -1 - k. Feature f
   of a chain has the number -1 - wall_count - f. */
static inline const Touched *find_contact(const State *s, Index i, Index body) {
    return s->touched != NULL ? find_touched(&s->touched[i], body, s->now) : NULL;
}

/* Return the rounding error of the distance of two bodies, in metres. `sizes` is the sum of `size_of` for both bodies.
   Each frame rounds their positions once more. */
static inline double distance_resolution(const State *s, double sizes) {
    double frames = s->now * s->clock.rate / s->clock.step;
    return gap_resolution(sizes) + frames * CAROM_ULP * sizes;
}

/* Return up to which times a contact of disc i and a body lasts. n is the normal. For a flat body, `reach` is 0. For
   any other body it is the distance from the disc's centre to the centre of the body's curvature, and `sizes` is the sum
   of `size_of` for both bodies. `NewContact` explains `speed`. */
static inline TouchEnd touch_end(const State *s, Index i, const Path *path, double nx, double ny, double speed,
                                 double reach, double sizes) {
    if (path == NULL)
        return (TouchEnd){CAROM_INF, CAROM_INF};
    const Disc *a = &s->discs[i];
    NewContact t = {FLAT, nx, ny, a->vx, a->vy, speed, s->now, 1.0, 0.0};
    if (reach > 0.0) {
        t.shape = s->motion == STRAIGHT ? CONVEX : OTHER_SHAPE;
        t.reach = reach;
        t.resolution = distance_resolution(s, sizes);
    }
    return contact_end(&t, &path->legs[path->leg]);
}

/* Return the speed at which disc j moves past disc i, to the left of a normal. */
static inline double slip_past(const State *s, Index i, Index j, double nx, double ny) {
    const Disc *a = &s->discs[i];
    const Disc *b = &s->discs[j];
    return nx * (b->vy - a->vy) - ny * (b->vx - a->vx);
}

/* Return whether disc i touches disc j without normal speed, and does not move back past it.

   PIT finds impacts late, with overlap. A disc that has moved past another one therefore approaches it on its way
   back. */
static inline bool is_touching_disc(const State *s, Index i, Index j) {
    const Touched *t = find_contact(s, i, j);
    if (t == NULL)
        return false;
    double moved = t->nx * (s->discs[j].y - s->discs[i].y) - t->ny * (s->discs[j].x - s->discs[i].x);
    return !(moved * slip_past(s, i, j, t->nx, t->ny) < 0.0);
}

/* Remove the contacts with discs that a table slows in another direction than disc i. */
static inline void forget_slipping(State *s, Index i) {
    TouchedBodies *t = &s->touched[i];
    int kept = 0;
    for (int k = 0; k < t->count; k++) {
        const Touched *one = &t->bodies[k];
        if (one->body < 0 || slip_past(s, i, one->body, one->nx, one->ny) == 0.0)
            t->bodies[kept++] = *one;
    }
    t->count = kept;
}

/* Store an applied impact of disc i on a body. `stops` is true if the impact leaves no normal speed. */
static inline void note_contact(State *s, Index i, Touched body, bool slides, bool stops) {
    note_touched(&s->touched[i], body, s->now, slides, stops);
    if (s->motion == SLOWING)
        forget_slipping(s, i);
}

/* Store an impact of two discs that was just applied. n is the unit normal. */
static inline void note_pair_contact(State *s, Index i, Index j, const Impact *impact) {
    double nx = impact->normal[0], ny = impact->normal[1];
    Index pair[2] = {i, j};
    bool stops = s->law.restitution == 0.0;
    if (s->touched == NULL)
        return;
    if (s->motion == FALLING)
        stops = stops && s->discs[i].inverse_mass > 0.0 && s->discs[j].inverse_mass > 0.0;
    const Disc *a = &s->discs[i];
    const Disc *b = &s->discs[j];
    double sizes = size_of(a->x, a->y, a->radius) + size_of(b->x, b->y, b->radius), reach = a->radius + b->radius;
    for (int k = 0; k < 2; k++) {
        const double *before = k == 0 ? impact->first_before : impact->second_before;
        double speed = fabs(before[0]) + fabs(before[1]);
        TouchEnd end = touch_end(s, pair[k], disc_path(s, pair[1 - k]), nx, ny, speed, reach, sizes);
        if (s->discs[pair[k]].inverse_mass > 0.0)
            note_contact(s, pair[k], (Touched){(int)pair[1 - k], nx, ny, end}, can_rub(&s->law.contact), stops);
    }
}

/* ---- two discs ---- */

/* Return whether disc i does not approach disc j on its present path. The same must be true of disc j for the two to
   separate. */
static inline bool is_separating_from(const State *s, Index i, Index j) {
    const Disc *a = &s->discs[i];
    return a->inverse_mass == 0.0 || (a->last == j && s->motion != SLOWING) || is_touching_disc(s, i, j);
}

/* Return whether two discs do not approach on their present paths.

   A disc that falls onto a disc that does not fall comes back. On a table two discs that are slowed in different
   directions may approach. */
static inline bool are_separating(const State *s, Index i, Index j) {
    if (s->motion == FALLING && (s->discs[i].inverse_mass == 0.0 || s->discs[j].inverse_mass == 0.0))
        return false;
    return is_separating_from(s, i, j) && is_separating_from(s, j, i);
}

/* ---- a disc and a wall ---- */

/* Return whether disc i does not approach half-plane k on its present path. */
static inline bool is_leaving_plane(const State *s, Index i, Index k) {
    return (s->motion != FALLING && s->discs[i].last == ON_WALL - k) || find_contact(s, i, -1 - k) != NULL;
}

/* Return an edge of chain k that is probably near disc i. */
static inline Index near_edge(const State *s, Index i, Index k) {
    Index edge = s->clearances[i].edge - (s->chains[k].edges - s->edges);
    return edge >= 0 && edge < s->chains[k].edge_count ? edge : 0;
}

/* Return the number of the feature of chain k, a side or an end of an edge, that is nearest to a position. */
static inline Index feature_at(const State *s, Index k, const Nearest *nearest, double x, double y) {
    const ChainEdge *edge = &s->chains[k].edges[nearest->edge];
    return CHAIN_PARTS * (edge - s->edges) + find_part(edge, x, y);
}

/* Return a feature as recorded contacts encode it: EDGE_KINDS times the number of the edge in its chain, plus the
   part's kind in `carom.model.trace.EdgeKind`. */
static inline Index recorded_edge(const State *s, Index k, Index feature) {
    const ChainEdge *edge = &s->edges[feature / CHAIN_PARTS];
    int part = (int)(feature % CHAIN_PARTS);
    int kind = part == AT_BEGIN || part == AT_END ? 1 : edge->is_arc ? 2 : 0;
    return EDGE_KINDS * (edge - s->chains[k].edges) + kind;
}

static inline bool is_inside_arc(const State *s, Index feature) {
    return s->edges[feature / CHAIN_PARTS].is_arc && feature % CHAIN_PARTS == ON_RIGHT;
}

/* Return whether disc i does not approach its nearest feature of chain k on its present path. n is the unit normal
   there. The disc can hit the inside of an arc again, unless it has not moved. */
static inline bool is_leaving_chain(const State *s, Index i, Index k, Index feature, double nx, double ny) {
    const ChainHit *hit = &s->hits[i];
    if (s->motion != FALLING && s->discs[i].last == ON_WALL - k && hit->feature == feature &&
        (!is_inside_arc(s, feature) || (nx == hit->nx && ny == hit->ny)))
        return true;
    return find_contact(s, i, -1 - s->wall_count - feature) != NULL;
}

/* Return whether a feature is a side of a straight edge. */
static inline bool is_flat_part(const State *s, Index feature) {
    Index part = feature % CHAIN_PARTS;
    return !s->edges[feature / CHAIN_PARTS].is_arc && (part == ON_LEFT || part == ON_RIGHT);
}

/* Store an impact of disc i on wall k that was just applied. n is the unit normal, and `speed` is explained in
   `NewContact`.

   On a straight edge, n is the direction between the disc and the nearest point. Its roundings grow with the
   coordinates, so the normal of the edge itself is stored instead. */
static inline void note_wall_contact(State *s, Index i, Index k, double nx, double ny, double speed) {
    const Law *law = &s->wall_laws[k];
    if (s->touched == NULL)
        return;
    Index body = -1 - k;
    bool is_flat = true, is_curved_inwards = false;
    double reach = 0.0, sizes = 0.0;
    if (is_chain(s, k)) {
        Index feature = s->hits[i].feature;
        body = -1 - s->wall_count - feature;
        is_flat = is_flat_part(s, feature);
        is_curved_inwards = is_inside_arc(s, feature);
        if (is_flat) {
            const ChainEdge *edge = &s->edges[feature / CHAIN_PARTS];
            double dx = edge->bx - edge->ax, dy = edge->by - edge->ay, length = sqrt(dx * dx + dy * dy);
            nx = -dy / length;
            ny = dx / length;
        } else {
            const Disc *a = &s->discs[i];
            const ChainEdge *edge = &s->edges[feature / CHAIN_PARTS];
            bool is_arc = edge->is_arc && feature % CHAIN_PARTS == ON_LEFT;
            reach = a->radius + s->chains[k].half_width + (is_arc ? edge->radius : 0.0);
            sizes = size_of(a->x, a->y, a->radius) + s->chains[k].size;
        }
    }
    bool stops = law->wall_restitution == 0.0 && !is_curved_inwards && s->gx * nx + s->gy * ny == 0.0;
    TouchEnd end = touch_end(s, i, wall_path(s, k), nx, ny, speed, reach, sizes);
    note_contact(s, i, (Touched){(int)body, nx, ny, end}, can_rub(&law->wall_contact), stops);
}
