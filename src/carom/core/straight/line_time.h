/* Time of impact of a disc in straight uniform motion on the line of a half-plane, or on a face.

   HALF-PLANES. Points p on the free side of the wall have (p - q).n >= 0, with a point q and a unit normal n. q and n
   are used exactly as given in floats. Let r, p and v be the radius, position and velocity of a disc. Its rim has the
   gap g = (p - q).n - r, which closes at the speed -v.n. The time of impact is gap over speed. The gap is a small
   difference near contact. In plain floats, the error of the gap could be 1e14 units in the last place. So offsets and
   products are pairs of floats without rounding errors. The time is accurate to 2 units in the last place, for lengths
   and speeds between 1e-250 and 1e290.

   FACES. A face is one side of a straight edge of a finite wall. Let e be the vector from the face's start to its end,
   l the length of e, d the offset of the disc's centre from the start, u the disc's velocity, and R the half width plus
   the disc's radius. The gap between rim and face, and the speed at which it changes, satisfy

       gap l = e x d - R l,   speed l = e x u.

   The time of impact is -gap / speed, accurate to 1 unit in the last place. The vector e is not normalised, so no
   rounded normal is involved. The foot of a disc is the point of the face's line that is nearest to the disc's centre.
   The disc touches the face if the disc's foot is on the edge at the time of impact. At its end, a face continues
   without a kink as the rounded vertex. So rounding near the end of a face does not matter: an impact on the face and
   an impact on the vertex are the same. The signs of gap and speed are exact.

   Lengths are in metres, velocities in m/s, times in seconds. */

#pragma once

#include "carom/core/feature.h"
#include "carom/core/straight/pair_time.h"

/* ---- half-planes ---- */

/* Add `a` times a component of a normal to a sum. A component of 0 or 1 takes less time. Most walls are parallel to an
   axis, and have normals with the components 0 and 1. */
static inline TripleDouble add_along(TripleDouble total, double a, double component) {
    if (component == 0.0)
        return total;
    if (fabs(component) == 1.0)
        return add_term(total, a * component);
    return add_product(total, a, component);
}

/* Return the distance of a disc's rim from a wall, negative inside the wall. */
static inline DoubleDouble wall_gap(double x, double y, double radius, double qx, double qy, double nx, double ny) {
    DoubleDouble dx = two_diff(x, qx);
    DoubleDouble dy = two_diff(y, qy);
    TripleDouble total = add_along(add_along(empty_sum(), dx.high, nx), dx.low, nx);
    total = add_along(add_along(total, dy.high, ny), dy.low, ny);
    return round_sum(add_term(total, -radius));
}

/* Return the component of a velocity along a wall's normal, negative towards the wall. */
static inline DoubleDouble wall_speed(double vx, double vy, double nx, double ny) {
    return round_sum(add_along(add_along(empty_sum(), vx, nx), vy, ny));
}

/* Return the root t of `gap + speed * t = 0`, corrected once by the remainder of the division. */
static inline double linear_root(DoubleDouble gap, DoubleDouble speed) {
    double t = -gap.high / speed.high;
    DoubleDouble product = two_prod(t, speed.high);
    return t - (((gap.high + product.high) + product.low) + (gap.low + t * speed.low)) / speed.high;
}

/* Return the seconds until a disc touches a wall; infinity for never. The result is 0 if the disc touches or overlaps
   the wall and approaches it. */
static inline double wall_time(double x, double y, double vx, double vy, double radius, double qx, double qy, double nx,
                               double ny) {
    Bounded toward = approach(vx, vy, nx, ny);
    if (toward.value > toward.error)
        return CAROM_INF;
    DoubleDouble speed = wall_speed(vx, vy, nx, ny);
    if (!(speed.high < 0.0))
        return CAROM_INF;
    DoubleDouble gap = wall_gap(x, y, radius, qx, qy, nx, ny);
    if (gap.high <= 0.0)
        return 0.0;
    return linear_root(gap, speed);
}

/* ---- faces ---- */

/* Return the difference of two coordinates, each of which is a pair of floats. */
static inline DoubleDouble offset_between(DoubleDouble a, DoubleDouble q) {
    DoubleDouble d = two_diff(a.high, q.high);
    return two_sum(d.high, d.low + (a.low - q.low));
}

/* Return the cross product e x d, whose sign is exact. */
static inline DoubleDouble cross_product(DoubleDouble ex, DoubleDouble ey, DoubleDouble x, DoubleDouble y) {
    return inner_product(ex, negate(ey), y, x);
}

/* Return the distance of a disc's rim from a face's line, multiplied by the face's length. */
static inline DoubleDouble face_gap(const Mover *disc, const Feature *face) {
    DoubleDouble x = offset_between(disc->x, face->x);
    DoubleDouble y = offset_between(disc->y, face->y);
    DoubleDouble reach = two_sum(disc->radius, face->half_width);
    TripleDouble total = add_pair_product(add_pair_product(empty_sum(), face->ex, y), negate(face->ey), x);
    DoubleDouble gap = round_sum(add_pair_product(total, negate(face->size), reach));
    if (fabs(gap.high) > CAROM_DOUBTFUL_GAP * (face->size.high * reach.high))
        return gap;
    /* The gap is ((e x d)^2 - R^2 e.e) / (e x d + R l). The numerator contains no rounded root, and the denominator is
       not near 0. */
    DoubleDouble squares = negate(exact_discriminant((Encounter){x, y, face->ex, face->ey, reach}));
    DoubleDouble cross = cross_product(face->ex, face->ey, x, y);
    DoubleDouble root = pair_product(face->size, reach);
    DoubleDouble total_root = two_sum(cross.high, root.high);
    return pair_quotient(squares, (DoubleDouble){total_root.high, total_root.low + (cross.low + root.low)});
}

/* Return whether a disc's centre is on a face's free side and the disc's foot (the nearest point of the face's line) is
   on the edge. */
static inline bool is_before_face(const Mover *disc, const Feature *face) {
    DoubleDouble x = offset_between(disc->x, face->x);
    DoubleDouble y = offset_between(disc->y, face->y);
    if (!(cross_product(face->ex, face->ey, x, y).high > 0.0 && inner_product(face->ex, face->ey, x, y).high >= 0.0))
        return false;
    DoubleDouble x_from_end = offset_between(disc->x, face->fx);
    DoubleDouble y_from_end = offset_between(disc->y, face->fy);
    return inner_product(face->ex, face->ey, x_from_end, y_from_end).high <= 0.0;
}

/* Return the distance, along a face's line, from a given point of the line to the disc's foot when the disc touches the
   line. The foot is the point of the line nearest to the disc's centre. The distance has a sign, is multiplied by the
   face's length and the speed of approach, and is computed in double precision. */
static inline Bounded foot_beyond(const Mover *disc, const Feature *face, double x, double y) {
    double size = face->size.high, reach = disc->radius + face->half_width;
    double ux = disc->ux.high, uy = disc->uy.high;
    double across_x = ((disc->x.high - x) + disc->x.low) * uy, across_y = ((disc->y.high - y) + disc->y.low) * ux;
    double along_x = face->ex.high * ux, along_y = face->ey.high * uy;
    double terms = size * (fabs(across_x) + fabs(across_y)) + reach * (fabs(along_x) + fabs(along_y));
    return (Bounded){-(size * (across_x - across_y) + reach * (along_x + along_y)),
                     2.0 * CAROM_ERROR * terms + CAROM_NEGLIGIBLE};
}

/* Return whether a disc that approaches a face's line certainly touches the line outside of the edge. */
static inline bool is_certainly_beside(const Mover *disc, const Feature *face) {
    Bounded from_start = foot_beyond(disc, face, face->x.high, face->y.high);
    Bounded from_end = foot_beyond(disc, face, face->fx.high, face->fy.high);
    return from_start.value < -from_start.error || from_end.value > from_end.error;
}

/* Return whether a disc that approaches a face's line touches the line between the ends of the edge. */
static inline bool is_between_ends(const Mover *disc, const Feature *face) {
    Bounded near_start = foot_beyond(disc, face, face->x.high, face->y.high);
    Bounded near_end = foot_beyond(disc, face, face->fx.high, face->fy.high);
    if (fabs(near_start.value) > near_start.error && fabs(near_end.value) > near_end.error)
        return near_start.value > 0.0 && 0.0 > near_end.value;
    DoubleDouble reach = two_sum(disc->radius, face->half_width);
    DoubleDouble along = inner_product(face->ex, face->ey, disc->ux, disc->uy);
    DoubleDouble from_start =
        cross_product(offset_between(disc->x, face->x), offset_between(disc->y, face->y), disc->ux, disc->uy);
    DoubleDouble from_end =
        cross_product(offset_between(disc->x, face->fx), offset_between(disc->y, face->fy), disc->ux, disc->uy);
    TripleDouble past_start = add_pair_product(add_pair_product(empty_sum(), face->size, from_start), reach, along);
    TripleDouble past_end = add_pair_product(add_pair_product(empty_sum(), face->size, from_end), reach, along);
    return round_sum(past_start).high <= 0.0 && 0.0 <= round_sum(past_end).high;
}

/* Return the seconds until a disc touches a face; infinity for never. */
static inline double face_time(const Mover *disc, const Feature *face) {
    double one = face->ex.high * disc->uy.high;
    double other = face->ey.high * disc->ux.high;
    if (one - other > CAROM_ERROR * (fabs(one) + fabs(other)) + CAROM_NEGLIGIBLE)
        return CAROM_INF;
    DoubleDouble speed = cross_product(face->ex, face->ey, disc->ux, disc->uy);
    if (!(speed.high < 0.0))
        return CAROM_INF;
    DoubleDouble gap = face_gap(disc, face);
    if (gap.high <= 0.0)
        return is_before_face(disc, face) ? 0.0 : CAROM_INF;
    return is_between_ends(disc, face) ? linear_root(gap, speed) : CAROM_INF;
}
