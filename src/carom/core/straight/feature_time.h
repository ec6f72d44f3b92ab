/* Time of impact of a disc on any feature (part of a wall) in straight uniform motion. The file also computes the gap
   between a disc and a feature, and the normal of a disc that touches a feature.

   line_time.h computes the times for half-planes and faces. A vertex is a full circle of radius 0. A disc hits a vertex
   or the outside of an arc like a fixed disc: at the earlier root of |d + u t| = R. Here d is the position of the disc
   relative to the arc's centre, u is its velocity, and R is the sum of the arc's radius, its half width and the disc's
   radius. The inside of an arc is hit at the later root, where R is the arc's radius minus the half width and the
   disc's radius:

       a = u.u,   b = d.u,   c = d.d - R^2,   D = b^2 - a c,
       t = (-b + sqrt(D)) / a    for b <= 0,        t = -c / (b + sqrt(D))    for b > 0.

   In the formulas for the later root, no terms cancel, because c <= 0 inside. For a disc that has just left the inside,
   c is exactly 0, although the rounded value may differ. The next impact is then at t = -2 b / a, at the other end of
   the disc's straight path through the arc. Each result is one of the two floats next to the exact value. If the disc
   also has no normal speed, b is exactly 0. The disc then glides along the arc: it stays in contact without an impact.

   The disc hits the arc if the point of contact is in the arc's sector. If rounding errors leave this undecided, the
   disc hits the arc. The decision does not matter, because the disc then touches the arc at the same time as the arc's
   end or the adjoining edge.

   If a disc touches the inside of an arc, or moves from a straight edge onto it, rounding may place its centre outside
   the circle of radius R by one unit in the last place. If the disc's path then never enters the circle (D < 0), the
   path is the arc's tangent up to rounding, and the disc glides along the arc. The disc also glides if its path
   through the circle is so short that it may result from rounding errors of the velocity. */

#pragma once

#include "carom/core/straight/line_time.h"

/* ---- arcs and vertices ---- */

typedef struct Touch {
    double time; /* seconds until the disc touches the feature; CAROM_INF for never */
    bool glides; /* whether the disc then glides along the arc: contact without an impact */
} Touch;

/* Where a disc's path begins, relative to a feature. */
typedef enum PathStart {
    ELSEWHERE = 0,
    JUST_LEFT = 1,   /* the path begins with an impact on this feature */
    JUST_STOPPED = 2 /* the path begins with an impact on this feature, after which the disc has no normal speed */
} PathStart;

/* A coordinate at a later time, and the rounded change of the coordinate until this time. */
typedef struct MovedCoordinate {
    DoubleDouble coordinate;
    double change;
} MovedCoordinate;

/* Return the distance between the centres of a disc and an arc when the disc touches the arc. If the disc does not fit
   inside, the result is 0 or less. */
static inline DoubleDouble reach_of(const Mover *disc, const Feature *arc) {
    DoubleDouble thick = two_sum(disc->radius, arc->half_width);
    if (arc->kind == INNER_ARC)
        thick = negate(thick);
    DoubleDouble total = two_sum(arc->size.high, thick.high);
    return two_sum(total.high, total.low + (arc->size.low + thick.low));
}

/* Return the cross product of the vector from an arc's centre to its end (fx, fy) and the position (x, y), with a bound
   of its error. The position was computed from an earlier position and the changes `moved_x` and `moved_y`. */
static inline Bounded turn_to(DoubleDouble fx, DoubleDouble fy, DoubleDouble x, DoubleDouble y, double moved_x,
                              double moved_y) {
    double moved = fabs(fx.high * moved_y) + fabs(fy.high * moved_x);
    double placed = fabs(fx.high * y.high) + fabs(fy.high * x.high);
    double error = CAROM_ERROR * moved + CAROM_PAIR_ERROR * placed + CAROM_NEGLIGIBLE;
    return (Bounded){cross_product(fx, fy, x, y).high, error};
}

/* Return whether a position, relative to an arc's centre, is in the arc's sector. If rounding errors leave this
   undecided, return true. */
static inline bool is_in_sector(const Feature *arc, DoubleDouble x, DoubleDouble y, double moved_x, double moved_y) {
    if (arc->whole)
        return true;
    Bounded from_start = turn_to(arc->ex, arc->ey, x, y, moved_x, moved_y);
    Bounded from_end = turn_to(arc->fx, arc->fy, x, y, moved_x, moved_y);
    bool is_past_start = from_start.value >= -from_start.error;
    bool is_before_end = from_end.value <= from_end.error;
    return arc->reflex ? (is_past_start || is_before_end) : (is_past_start && is_before_end);
}

/* Return whether a disc's centre is in an arc's sector, on the side of the arc that the feature faces. */
static inline bool is_before_arc(const Mover *disc, const Feature *arc) {
    DoubleDouble x = offset_between(disc->x, arc->x);
    DoubleDouble y = offset_between(disc->y, arc->y);
    double beyond = excess(x, y, arc->size).high;
    return (arc->kind == INNER_ARC ? beyond < 0.0 : beyond > 0.0) && is_in_sector(arc, x, y, 0.0, 0.0);
}

static inline MovedCoordinate coordinate_after(DoubleDouble x, DoubleDouble u, double time) {
    DoubleDouble way = two_prod(time, u.high);
    DoubleDouble total = two_sum(x.high, way.high);
    return (MovedCoordinate){two_sum(total.high, total.low + (x.low + (way.low + time * u.low))), way.high};
}

/* Return whether a disc, now at (x, y) relative to an arc's centre, is in the arc's sector after a time. Return false
   for a gliding disc at the end of the arc at which it leaves the sector. */
static inline bool is_in_sector_at(const Feature *arc, DoubleDouble x, DoubleDouble y, const Mover *disc, double time,
                                   bool glides) {
    if (arc->whole)
        return true;
    MovedCoordinate px = coordinate_after(x, disc->ux, time);
    MovedCoordinate py = coordinate_after(y, disc->uy, time);
    DoubleDouble end_x = arc->ex;
    DoubleDouble end_y = arc->ey;
    if (glides) {
        if (px.coordinate.high * disc->uy.high - py.coordinate.high * disc->ux.high > 0.0) {
            end_x = arc->fx;
            end_y = arc->fy;
        }
        Bounded turn = turn_to(end_x, end_y, px.coordinate, py.coordinate, px.change, py.change);
        if (fabs(turn.value) <= turn.error && end_x.high * px.coordinate.high + end_y.high * py.coordinate.high > 0.0)
            return false;
    }
    return is_in_sector(arc, px.coordinate, py.coordinate, px.change, py.change);
}

/* Return the seconds until a disc touches a vertex or the outside of an arc; infinity for never. */
static inline double outer_arc_time(const Mover *disc, const Feature *arc) {
    if (disc->radius < arc->fits_below)
        return CAROM_INF;
    DoubleDouble x = offset_between(disc->x, arc->x);
    DoubleDouble y = offset_between(disc->y, arc->y);
    double time = meeting_time((Encounter){x, y, disc->ux, disc->uy, reach_of(disc, arc)});
    if (time == CAROM_INF)
        return time;
    if (time == 0.0)
        return is_before_arc(disc, arc) ? time : CAROM_INF;
    return is_in_sector_at(arc, x, y, disc, time, false) ? time : CAROM_INF;
}

/* Return the later time at which the disc's centre is on the circle of radius `reach`, and whether the path only
   touches this circle (`glides`). If the later time is not in the future, return infinity. */
static inline Touch later_root(DoubleDouble x, DoubleDouble y, const Mover *disc, DoubleDouble reach, DoubleDouble a,
                               DoubleDouble b, DoubleDouble c) {
    DoubleDouble d = accurate_discriminant((Encounter){x, y, disc->ux, disc->uy, reach}, b, c, a);
    if (d.high == 0.0)
        return (Touch){linear_root(b, a), true};
    if (d.high < 0.0)
        return (Touch){CAROM_INF, false};
    if (b.high > 0.0)
        return (Touch){exact_root(negate(b), negate(c), d), false};
    DoubleDouble root = pair_root(d), total = two_sum(root.high, -b.high);
    return (Touch){-linear_root((DoubleDouble){total.high, total.low + (root.low - b.low)}, a), false};
}

/* Return when a disc that overlaps an arc from inside enters the arc's sector; infinity for never. The disc's centre
   never enters the circle of radius `reach`. */
static inline Touch sector_entry(const Feature *arc, DoubleDouble x, DoubleDouble y, const Mover *disc,
                                 DoubleDouble reach) {
    DoubleDouble fx = arc->ex;
    DoubleDouble fy = arc->ey;
    double first = CAROM_INF;
    double sense = 1.0;
    for (int k = 0; k < 2; k++) {
        if (k == 1) {
            fx = arc->fx;
            fy = arc->fy;
            sense = -1.0;
        }
        DoubleDouble turn = cross_product(fx, fy, x, y);
        DoubleDouble rate = cross_product(fx, fy, disc->ux, disc->uy);
        if (!(sense * turn.high < 0.0 && 0.0 < sense * rate.high))
            continue;
        double time = linear_root(turn, rate);
        DoubleDouble px = coordinate_after(x, disc->ux, time).coordinate;
        DoubleDouble py = coordinate_after(y, disc->uy, time).coordinate;
        bool is_ahead = fx.high * px.high + fy.high * py.high > 0.0;
        if (time < first && is_ahead && excess(px, py, reach).high > 0.0 && 0.0 > excess(px, py, arc->size).high)
            first = time;
    }
    return (Touch){first, first < CAROM_INF};
}

/* Return when a disc touches an arc from inside. The time is 0 if the disc touches or overlaps the arc and does not
   move away. */
static inline Touch inner_arc_time(const Mover *disc, const Feature *arc, PathStart start) {
    Touch touch = {CAROM_INF, false};
    Touch never = {CAROM_INF, false};
    DoubleDouble reach = reach_of(disc, arc);
    DoubleDouble a = round_sum(add_square(add_square(empty_sum(), disc->ux, 1.0), disc->uy, 1.0));
    if (!(disc->radius < arc->fits_below) || a.high == 0.0)
        return never;
    DoubleDouble x = offset_between(disc->x, arc->x);
    DoubleDouble y = offset_between(disc->y, arc->y);
    const DoubleDouble zero = {0.0, 0.0};
    DoubleDouble b = start == JUST_STOPPED ? zero : inner_product(x, y, disc->ux, disc->uy);
    DoubleDouble c = start != ELSEWHERE ? zero : excess(x, y, reach);
    if (c.high == 0.0 && 0.0 > b.high) {
        double chord = linear_root((DoubleDouble){2.0 * b.high, 2.0 * b.low}, a);
        if (chord * (fabs(disc->ux.high) + fabs(disc->uy.high)) > 2.0 * CAROM_ERROR * reach.high)
            touch = (Touch){chord, false};
    } else if (c.high < 0.0 || b.high < 0.0) {
        touch = later_root(x, y, disc, reach, a, b, c);
    }
    if (touch.time < CAROM_INF && is_in_sector_at(arc, x, y, disc, touch.time, touch.glides))
        return touch;
    bool stays_out = b.high < 0.0 && touch.time == CAROM_INF;
    if (c.high >= 0.0 && (stays_out || b.high >= 0.0) && (start != ELSEWHERE || is_before_arc(disc, arc))) {
        touch = (Touch){0.0, stays_out || start != ELSEWHERE || b.high == 0.0};
        if (!touch.glides || is_in_sector_at(arc, x, y, disc, 0.0, true))
            return touch;
    }
    return stays_out && !arc->whole ? sector_entry(arc, x, y, disc, reach) : never;
}

/* ---- any feature ---- */

/* A unit vector. */
typedef struct Direction {
    double x;
    double y;
} Direction;

/* Return when a disc touches a feature. A disc on a straight path can return to the feature at which the path begins
   only if this feature is the inside of an arc. */
static inline Touch feature_time(const Mover *disc, const Feature *feature, PathStart start) {
    if (feature->kind == INNER_ARC)
        return inner_arc_time(disc, feature, start);
    if (start != ELSEWHERE)
        return (Touch){CAROM_INF, false};
    if (feature->kind == FACE)
        return (Touch){face_time(disc, feature), false};
    if (feature->kind == PLANE) {
        double time = wall_time(disc->x.high, disc->y.high, disc->ux.high, disc->uy.high, disc->radius, feature->x.high,
                                feature->y.high, feature->nx, feature->ny);
        return (Touch){time, false};
    }
    return (Touch){outer_arc_time(disc, feature), false};
}

/* Return the unit vector from a feature to a disc that touches it. */
static inline Direction normal_at(const Feature *feature, const Mover *disc) {
    if (feature->kind == FACE || feature->kind == PLANE)
        return (Direction){feature->nx, feature->ny};
    double x = offset_between(disc->x, feature->x).high;
    double y = offset_between(disc->y, feature->y).high;
    double distance = sqrt(x * x + y * y);
    if (feature->kind == INNER_ARC)
        return (Direction){-x / distance, -y / distance};
    return (Direction){x / distance, y / distance};
}

/* Return the distance of a disc's rim from a feature, along the normal.

   The radius of an arc may be far larger than all other lengths. The difference of two distances from the arc's centre
   would have a large rounding error. So the gap is computed from the difference of the squares of these distances. */
static inline double feature_gap(const Mover *disc, const Feature *f) {
    if (f->kind == PLANE) {
        return wall_gap(disc->x.high, disc->y.high, disc->radius, f->x.high, f->y.high, f->nx, f->ny).high;
    }
    if (f->kind == FACE) {
        return face_gap(disc, f).high / f->size.high;
    }
    DoubleDouble reach = reach_of(disc, f);
    double x = disc->x.high - f->x.high, y = disc->y.high - f->y.high;
    double away = sqrt(x * x + y * y);
    double gap = excess(offset_between(disc->x, f->x), offset_between(disc->y, f->y), reach).high / (away + reach.high);
    return f->kind == INNER_ARC ? -gap : gap;
}
