/* Chains as PIT sees them: the point of a finite wall's line that is nearest to a disc's centre.

   The operations and their order are those of `carom.outline`. */

#ifndef CAROM_CHAIN_DISTANCE_H
#define CAROM_CHAIN_DISTANCE_H

#include <math.h>

#include "carom/core/carom_core.h"
#include "carom/core/constants.h"
#include "carom/core/double_double.h"

typedef struct ChainEdge { /* an edge of a chain, or a circle */
    double ax;             /* where it begins */
    double ay;
    double bx; /* where it ends; of a whole circle the same */
    double by;
    double bulge;
    double cx; /* of an arc, the centre of its circle */
    double cy;
    double radius;
    bool is_arc;
    bool is_whole; /* whether it is a whole circle, or a point */
} ChainEdge;

typedef struct Chain { /* a finite wall; a half-plane has no edges */
    ChainEdge *edges;
    Index edge_count;
    double half_width;
    double size; /* more than any of its coordinates and radii */
} Chain;

typedef struct Point {
    double x;
    double y;
} Point;

/* Return the power of a point with respect to the circle of an arc. */
static inline double power_of(const ChainEdge *e, double x, double y) {
    double across = (e->bx - e->ax) * (y - e->ay) - (e->by - e->ay) * (x - e->ax);
    double chord = (x - e->ax) * (x - e->bx) + (y - e->ay) * (y - e->by);
    return chord - across * (0.5 * (1.0 / e->bulge - e->bulge));
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
    bool begun = ((e->ax - e->cx) * (y - e->ay) - (e->ay - e->cy) * (x - e->ax)) * e->bulge > 0.0;
    bool not_ended = ((e->bx - e->cx) * (y - e->by) - (e->by - e->cy) * (x - e->bx)) * e->bulge < 0.0;
    if (fabs(e->bulge) > 1.0 ? begun || not_ended : begun && not_ended) {
        if (distance == 0.0)
            return (Point){e->ax, e->ay};
        double out = power_of(e, x, y) / (distance + e->radius);
        return (Point){x - out * dx / distance, y - out * dy / distance};
    }
    double to_a = (x - e->ax) * (x - e->ax) + (y - e->ay) * (y - e->ay);
    double to_b = (x - e->bx) * (x - e->bx) + (y - e->by) * (y - e->by);
    return to_a <= to_b ? (Point){e->ax, e->ay} : (Point){e->bx, e->by};
}

static inline Point find_nearest_on_segment(const ChainEdge *e, double x, double y) {
    double ex = e->bx - e->ax;
    double ey = e->by - e->ay;
    double part = ((x - e->ax) * ex + (y - e->ay) * ey) / (ex * ex + ey * ey);
    if (0.0 < part && part < 1.0)
        return (Point){e->ax + part * ex, e->ay + part * ey};
    return part <= 0.0 ? (Point){e->ax, e->ay} : (Point){e->bx, e->by};
}

/* Return the point of a chain's line that is nearest to another; of several, that of the first edge. */
static inline Point find_nearest(const Chain *chain, double x, double y) {
    Point best = {0.0, 0.0};
    double least = CAROM_INF;
    for (Index k = 0; k < chain->edge_count; k++) {
        const ChainEdge *e = &chain->edges[k];
        Point point = e->is_arc ? find_nearest_on_arc(e, x, y) : find_nearest_on_segment(e, x, y);
        double dx = point.x - x;
        double dy = point.y - y;
        double square = dx * dx + dy * dy;
        if (k == 0 || square < least) {
            least = square;
            best = point;
        }
    }
    return best;
}

/* Return a lower bound, except for rounding, of the distance of a point from an edge: an arc is no nearer than its
   circle. */
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

/* Return a lower bound, except for rounding, of the distance of a point from a chain's line. */
static inline double bound_distance(const Chain *chain, double x, double y) {
    double least = CAROM_INF;
    for (Index k = 0; k < chain->edge_count; k++)
        least = lesser(bound_edge_distance(&chain->edges[k], x, y), least);
    return least;
}

#endif
