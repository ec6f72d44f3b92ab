/* Distance from a chain (finite wall) in PIT: the point of the chain's centre line that is nearest to a disc's centre.

   The functions use the same floating-point operations, in the same order, as `carom.model.chain_geometry`. */

#pragma once

#include "carom/core/arithmetic/double_double.h"
#include "carom/core/carom_core.h"

typedef struct ChainEdge { /* an edge of a chain, or a circle */
    double ax;             /* start point */
    double ay;
    double bx; /* end point; for a whole circle the same as the start */
    double by;
    double bulge;
    double cx; /* for an arc: centre of its circle */
    double cy;
    double radius;
    bool is_arc;
    bool is_whole; /* whether the edge is a whole circle or a point */
    double mx;     /* `mx`, `my`, `extent`: centre and radius of a circle that encloses the edge */
    double my;
    double extent;
} ChainEdge;

typedef struct Chain { /* a finite wall; a half-plane has no edges */
    ChainEdge *edges;
    Index edge_count;
    double half_width;
    double size; /* an upper bound of all coordinates and radii of the chain, in metres */
} Chain;

typedef struct Nearest { /* point of a chain */
    double x;
    double y;
    Index edge;
} Nearest;

typedef enum ChainPart { /* the part of an edge that is nearest to a point */
    AT_BEGIN = 0,
    AT_END = 1,
    ON_LEFT = 2,  /* left side of a segment, or outside of an arc */
    ON_RIGHT = 3, /* right side of a segment, or inside of an arc */
} ChainPart;

enum {
    CHAIN_PARTS = 4,
    EDGE_KINDS = 4, /* upper bound of the number of values of `carom.model.trace.EdgeKind` */
};

/* Return the power of a point with respect to an arc's circle. The power is d^2 - r^2, where d is the distance from the
   centre and r the radius. */
static inline double power_of(const ChainEdge *e, double x, double y) {
    double across = (e->bx - e->ax) * (y - e->ay) - (e->by - e->ay) * (x - e->ax);
    double chord = (x - e->ax) * (x - e->bx) + (y - e->ay) * (y - e->by);
    return chord - across * (0.5 * (1.0 / e->bulge - e->bulge));
}

/* Positions are relative to an end of the arc, because the centre of a flat arc is far away. Positions relative to the
   centre would have large rounding errors. */
static inline bool is_in_sector(const ChainEdge *e, double x, double y) {
    bool begun = ((e->ax - e->cx) * (y - e->ay) - (e->ay - e->cy) * (x - e->ax)) * e->bulge > 0.0;
    bool not_ended = ((e->bx - e->cx) * (y - e->by) - (e->by - e->cy) * (x - e->bx)) * e->bulge < 0.0;
    return fabs(e->bulge) > 1.0 ? begun || not_ended : begun && not_ended;
}

/* Return whether a point is at least as near to the start of an edge as to its end. */
static inline bool is_nearer_to_begin(const ChainEdge *e, double x, double y) {
    double to_a = (x - e->ax) * (x - e->ax) + (y - e->ay) * (y - e->ay);
    double to_b = (x - e->bx) * (x - e->bx) + (y - e->by) * (y - e->by);
    return to_a <= to_b;
}

static inline Point find_nearest_on_arc(const ChainEdge *e, double x, double y) {
    double dx = x - e->cx;
    double dy = y - e->cy;
    double distance = sqrt(dx * dx + dy * dy);
    if (e->is_whole) {
        if (distance == 0.0)
            return (Point){e->ax, e->ay};
        return (Point){e->cx + e->radius * dx / distance, e->cy + e->radius * dy / distance};
    }
    if (is_in_sector(e, x, y)) {
        if (distance == 0.0)
            return (Point){e->ax, e->ay};
        double out = power_of(e, x, y) / (distance + e->radius);
        return (Point){x - out * dx / distance, y - out * dy / distance};
    }
    return is_nearer_to_begin(e, x, y) ? (Point){e->ax, e->ay} : (Point){e->bx, e->by};
}

/* Return where the perpendicular from a point meets a segment's line: 0 at the start of the segment, 1 at its end. */
static inline double foot_on_segment(const ChainEdge *e, double x, double y) {
    double ex = e->bx - e->ax;
    double ey = e->by - e->ay;
    return ((x - e->ax) * ex + (y - e->ay) * ey) / (ex * ex + ey * ey);
}

static inline Point find_nearest_on_segment(const ChainEdge *e, double x, double y) {
    double part = foot_on_segment(e, x, y);
    if (0.0 < part && part < 1.0)
        return (Point){e->ax + part * (e->bx - e->ax), e->ay + part * (e->by - e->ay)};
    return part <= 0.0 ? (Point){e->ax, e->ay} : (Point){e->bx, e->by};
}

static inline void enclose_edge(ChainEdge *e) {
    double ex = e->bx - e->ax;
    double ey = e->by - e->ay;
    double length = sqrt(ex * ex + ey * ey);
    e->mx = e->is_arc ? e->cx : e->ax + 0.5 * ex;
    e->my = e->is_arc ? e->cy : e->ay + 0.5 * ey;
    e->extent = e->is_arc ? e->radius : 0.5 * length;
}

/* Return whether the distance of an edge from a point certainly exceeds `distance`. `slack` must be an upper bound of
   the sum of all rounding errors, in metres. */
static inline bool is_farther(const ChainEdge *e, double x, double y, double distance, double slack) {
    double dx = x - e->mx;
    double dy = y - e->my;
    double reach = distance + e->extent + slack;
    return dx * dx + dy * dy > reach * reach;
}

/* Return an upper bound of the rounding error of a point's distance from an edge, in metres. */
static inline double distance_slack(const Chain *chain, double x, double y) {
    return CAROM_REACH_SLACK * (fabs(x) + fabs(y) + chain->size);
}

static inline Point find_nearest_on_edge(const ChainEdge *e, double x, double y) {
    return e->is_arc ? find_nearest_on_arc(e, x, y) : find_nearest_on_segment(e, x, y);
}

static inline ChainPart find_part(const ChainEdge *e, double x, double y) {
    if (e->is_arc) {
        double dx = x - e->cx;
        double dy = y - e->cy;
        if (e->is_whole && e->radius == 0.0)
            return AT_BEGIN;
        if (e->is_whole || is_in_sector(e, x, y))
            return sqrt(dx * dx + dy * dy) < e->radius ? ON_RIGHT : ON_LEFT;
        return is_nearer_to_begin(e, x, y) ? AT_BEGIN : AT_END;
    }
    double part = foot_on_segment(e, x, y);
    if (part <= 0.0 || part >= 1.0)
        return part <= 0.0 ? AT_BEGIN : AT_END;
    return (e->bx - e->ax) * (y - e->ay) - (e->by - e->ay) * (x - e->ax) > 0.0 ? ON_LEFT : ON_RIGHT;
}

/* Return the point of a chain's line that is nearest to a given point. If points of several edges are equally near, a
   point between the ends of its edge is preferred: near a joint, rounding hides that this point is nearer than the
   joint. If several such points remain, the point of the edge with the lowest number is returned.

   `hint` is the number of an edge that is probably near the point. The nearer the edge `hint` is to the point, the more
   other edges are skipped. */
static inline Nearest find_nearest(const Chain *chain, double x, double y, Index hint) {
    Nearest best = {0.0, 0.0, chain->edge_count};
    double slack = distance_slack(chain, x, y);
    double least = CAROM_INF;
    double distance = CAROM_INF;
    bool is_end = true;
    for (Index n = -1; n < chain->edge_count; n++) {
        Index k = n < 0 ? hint : n;
        const ChainEdge *e = &chain->edges[k];
        if (is_farther(e, x, y, distance, slack))
            continue;
        Point point = find_nearest_on_edge(e, x, y);
        double dx = point.x - x;
        double dy = point.y - y;
        double square = dx * dx + dy * dy;
        if (n >= 0 && square > least)
            continue;
        bool is_this_end = find_part(e, x, y) <= AT_END;
        if (n < 0 || square < least || (is_this_end == is_end ? k < best.edge : is_end)) {
            least = square;
            distance = sqrt(square);
            best = (Nearest){point.x, point.y, k};
            is_end = is_this_end;
        }
    }
    return best;
}

/* Return a lower bound of the distance of a point from an edge, apart from rounding errors. For an arc, the bound is
   the point's distance from the whole circle. */
static inline double bound_edge_distance(const ChainEdge *e, double x, double y) {
    if (e->is_arc) {
        double dx = x - e->cx;
        double dy = y - e->cy;
        return fabs(sqrt(dx * dx + dy * dy) - e->radius);
    }
    Point point = find_nearest_on_segment(e, x, y);
    double dx = point.x - x;
    double dy = point.y - y;
    return sqrt(dx * dx + dy * dy);
}

/* Return a lower bound of the distance of a point from a chain's line, apart from rounding errors. `edge` is the number
   of an edge that is probably near the point. The function sets `edge` to the edge with the smallest bound. */
static inline double bound_distance(const Chain *chain, double x, double y, Index *edge) {
    double slack = distance_slack(chain, x, y);
    double least = bound_edge_distance(&chain->edges[*edge], x, y);
    for (Index k = 0; k < chain->edge_count; k++) {
        if (is_farther(&chain->edges[k], x, y, least, slack))
            continue;
        double distance = bound_edge_distance(&chain->edges[k], x, y);
        if (distance < least) {
            least = distance;
            *edge = k;
        }
    }
    return least;
}
