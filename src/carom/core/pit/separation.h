/* Separation: the bodies that a disc does not approach on its present path, regardless of rounding.

   After an impact, two bodies separate until another impact changes one of the paths. On straight paths, the two bodies
   cannot approach again. A chain (finite wall) is an exception if it bends, or if the disc reaches it from the other
   side: the disc then approaches another feature of the chain, or the inside of an arc. A falling disc can come
   back. */

#pragma once

#include "carom/core/pit/motion.h"

static inline bool is_chain(const State *s, Index k) {
    return s->chains != NULL && s->chains[k].edge_count > 0;
}

/* ---- two discs ---- */

/* Return whether disc i does not approach disc j on its present path. The two discs separate only if disc j does not
   approach disc i either. */
static inline bool is_separating_from(const State *s, Index i, Index j) {
    const Disc *a = &s->discs[i];
    return a->inverse_mass == 0.0 || (a->last == j && s->motion != SLOWING);
}

/* Return whether two discs do not approach on their present paths.

   A disc that falls onto an immovable disc comes back. On a table, two discs that are slowed in different directions
   may approach. */
static inline bool are_separating(const State *s, Index i, Index j) {
    if (s->motion == FALLING && (s->discs[i].inverse_mass == 0.0 || s->discs[j].inverse_mass == 0.0))
        return false;
    return is_separating_from(s, i, j) && is_separating_from(s, j, i);
}

/* ---- a disc and a wall ---- */

/* Return whether disc i does not approach half-plane k on its present path. */
static inline bool is_leaving_plane(const State *s, Index i, Index k) {
    return s->motion != FALLING && s->discs[i].last == ON_WALL - k;
}

/* Return an edge of chain k that is probably near disc i. */
static inline Index near_edge(const State *s, Index i, Index k) {
    Index edge = s->clearances[i].edge - (s->chains[k].edges - s->edges);
    return edge >= 0 && edge < s->chains[k].edge_count ? edge : 0;
}

/* Return the number of the feature of chain k that is nearest to a position. Features are the sides and ends of
   edges. */
static inline Index feature_at(const State *s, Index k, const Nearest *nearest, double x, double y) {
    const ChainEdge *edge = &s->chains[k].edges[nearest->edge];
    return CHAIN_PARTS * (edge - s->edges) + find_part(edge, x, y);
}

/* Return the number with which recorded contacts encode a feature: EDGE_KINDS times the number of the edge in its
   chain, plus the feature's kind in `carom.model.trace.EdgeKind`. */
static inline Index recorded_edge(const State *s, Index k, Index feature) {
    const ChainEdge *edge = &s->edges[feature / CHAIN_PARTS];
    int part = (int)(feature % CHAIN_PARTS);
    int kind = part == AT_BEGIN || part == AT_END ? 1 : edge->is_arc ? 2 : 0;
    return EDGE_KINDS * (edge - s->chains[k].edges) + kind;
}

static inline bool is_inside_arc(const State *s, Index feature) {
    return s->edges[feature / CHAIN_PARTS].is_arc && feature % CHAIN_PARTS == ON_RIGHT;
}

/* Return whether disc i does not approach its nearest feature of chain k on its present path. `hit` describes the
   nearest feature. A disc that has moved can hit the inside of an arc again. */
static inline bool is_leaving_chain(const State *s, Index i, Index k, const ChainHit *hit) {
    const ChainHit *last = &s->hits[i];
    return s->motion != FALLING && s->discs[i].last == ON_WALL - k && last->feature == hit->feature &&
           (!is_inside_arc(s, hit->feature) || (last->nx == hit->nx && last->ny == hit->ny));
}
