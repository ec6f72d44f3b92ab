/* Times at which a disc on a parabola hits a fixed disc, a half-plane, or a face, vertex or arc of a wall.

   The gap to a line is a quadratic in time, w + s t + a t^2/2, with the gap w, its rate of change s and its
   acceleration a. The time of impact is the root at which the gap closes. The three coefficients are pairs of floats,
   so that their signs are accurate enough to select the right root. The gap to a circle has the degree 4: see falls.h.
   If the gap to an arc's circle closes outside of the arc's sector, there is no contact, and the next time at which the
   gap closes is tried.

   Times are in seconds from now. The result is 0 for bodies that touch and approach. The result is also 0 for bodies
   that touch, do not separate and accelerate towards each other. If there is no impact, the result is infinity. If the
   disc's current path begins with an impact on the same body (`has_just_left`), the gap is exactly 0 now, although the
   rounded value may differ. The gap then opens at the speed `leaving`, 0 or more. The functions of this file are also
   used for two discs on a decelerating table. The path is then the path of one disc relative to the other disc.
   docs/theory/contact.md derives the formulas. */

#pragma once

#include "carom/core/parabola/gap_polynomial.h"
#include "carom/core/quartic/falls.h"
#include "carom/core/straight/feature_time.h"

/* ---- lines ---- */

/* Return the seconds until a disc returns to a wall that it leaves at `speed` > 0, with the acceleration `pull` < 0. */
static inline double return_time(DoubleDouble speed, DoubleDouble pull) {
    return linear_root((DoubleDouble){2.0 * speed.high, 2.0 * speed.low}, pull);
}

/* Return the seconds until a gap with the rate of change `speed` and the acceleration `pull` closes.

   The error is at most 4 units in the last place if `speed`^2 and `pull` * `gap` are between 1e-250 and 1e290. The
   error may be larger if the apex of the path is nearer to the wall than 2^-80 times the path's height. */
static inline double descent_time(DoubleDouble gap, DoubleDouble speed, DoubleDouble pull) {
    const double w = gap.high, s = speed.high, a = pull.high;
    if (w <= 0.0) {
        if (s < 0.0)
            return 0.0;
        if (!(a < 0.0))
            return CAROM_INF;
        if (s == 0.0)
            return 0.0;
        if (w == 0.0)
            return return_time(speed, pull);
    } else if (a == 0.0) {
        return s < 0.0 ? linear_root(gap, speed) : CAROM_INF;
    } else if (a > 0.0 && !(s < 0.0)) {
        return CAROM_INF;
    }
    DoubleDouble twice = {2.0 * gap.high, 2.0 * gap.low};
    DoubleDouble d = discriminant_from_gap(speed, twice, pull);
    if (!(d.high > 0.0)) {
        /* Either the disc is pulled back before it reaches the wall, or rounding has placed the disc inside the wall,
           and the disc is pulled back before it leaves the wall. */
        return a > 0.0 ? CAROM_INF : linear_root(speed, pull);
    }
    if (w > 0.0 && !(s > 0.0))
        return exact_root(speed, twice, d);
    DoubleDouble root = pair_root(d), sum = two_sum(s, root.high);
    return linear_root((DoubleDouble){sum.high, sum.low + (speed.low + root.low)}, pull);
}

/* Return the seconds until a disc touches the line of a half-plane. */
static inline double plane_fall_time(const Mover *disc, const Feature *plane, double ax, double ay, bool has_just_left,
                                     double leaving) {
    DoubleDouble pull = wall_speed(ax, ay, plane->nx, plane->ny);
    if (has_just_left)
        return pull.high < 0.0 ? return_time((DoubleDouble){leaving, 0.0}, pull) : CAROM_INF;
    DoubleDouble gap =
        wall_gap(disc->x.high, disc->y.high, disc->radius, plane->x.high, plane->y.high, plane->nx, plane->ny);
    return descent_time(gap, wall_speed(disc->ux.high, disc->uy.high, plane->nx, plane->ny), pull);
}

/* Return whether the point of a face's line that is nearest to a disc at a time is on the face. Rounding errors do not
   matter here, because an impact on the end of the face and an impact on its vertex are the same. */
static inline bool foot_is_on_face(const Mover *disc, const Feature *face, double time, double ax, double ay) {
    double moved_x = time * (disc->ux.high + 0.5 * ax * time), moved_y = time * (disc->uy.high + 0.5 * ay * time);
    double x = offset_between(disc->x, face->x).high + moved_x;
    double y = offset_between(disc->y, face->y).high + moved_y;
    double x_from_end = offset_between(disc->x, face->fx).high + moved_x;
    double y_from_end = offset_between(disc->y, face->fy).high + moved_y;
    return face->ex.high * x + face->ey.high * y >= 0.0 &&
           0.0 >= face->ex.high * x_from_end + face->ey.high * y_from_end;
}

/* Return the seconds until a disc touches a face. */
static inline double face_fall_time(const Mover *disc, const Feature *face, double ax, double ay, bool has_just_left,
                                    double leaving) {
    /* `pull`, `gap` and `speed` are multiplied by the face's length. */
    DoubleDouble pull = cross_product(face->ex, face->ey, (DoubleDouble){ax, 0.0}, (DoubleDouble){ay, 0.0});
    double wait;
    if (has_just_left) {
        if (!(pull.high < 0.0))
            return CAROM_INF;
        wait = return_time(pair_product((DoubleDouble){leaving, 0.0}, face->size), pull);
        return foot_is_on_face(disc, face, wait, ax, ay) ? wait : CAROM_INF;
    }
    DoubleDouble gap = face_gap(disc, face);
    DoubleDouble speed = cross_product(face->ex, face->ey, disc->ux, disc->uy);
    const bool is_on_face = gap.high <= 0.0 && is_before_face(disc, face);
    if (gap.high <= 0.0 && !is_on_face) {
        /* The disc is behind the face's line or beyond an end of the face. The disc can hit the face only if it first
           moves in front of the line and then falls back. */
        if (!(speed.high > 0.0 && pull.high < 0.0))
            return CAROM_INF;
        DoubleDouble twice = {2.0 * gap.high, 2.0 * gap.low};
        if (!(discriminant_from_gap(speed, twice, pull).high > 0.0))
            return CAROM_INF;
    }
    wait = descent_time(gap, speed, pull);
    if (wait == 0.0 && is_on_face)
        return 0.0;
    return wait < CAROM_INF && foot_is_on_face(disc, face, wait, ax, ay) ? wait : CAROM_INF;
}

/* ---- circles ---- */

static inline Gap circle_form(const CircleGap *gap) {
    return (Gap){write_circle_pairs, write_circle_products, gap};
}

static inline Gap line_form(const LineGap *gap) {
    return (Gap){write_line_pairs, write_line_products, gap};
}

/* Prepare `falls` for a search for the instants at which the gap to a circle becomes negative (see falls.h). Return the
   current sign of the gap. The sign is 0 if the disc has just left the circle. */
static inline int begin_circle_falls(Falls *falls, const ExactQuartic *exact, const CircleGap *gap, const Gap *form) {
    begin_falls(falls, exact, form);
    write_circle_floats(gap, &falls->floats);
    return gap->has_left ? 0 : sign_of_gap(falls);
}

/* Set the current sign of the gap in `falls`. If `is_closed`, the sign is set to 0. */
static inline void start_falls(Falls *falls, CircleGap *gap, int sign, bool is_closed) {
    if (is_closed) {
        gap->is_closed = falls->is_closed = true;
        sign = 0;
    }
    set_start(falls, sign);
}

/* a disc on a parabola: position, and velocity relative to a body that does not accelerate */
typedef struct FallingDisc {
    double x;
    double y;
    double vx;
    double vy;
    double radius;
} FallingDisc;

/* Return the seconds until a disc touches a fixed disc. */
static inline double disc_fall_time(const ExactQuartic *exact, const FallingDisc *disc, double fixed_x, double fixed_y,
                                    double fixed_radius, double ax, double ay, bool has_just_left, double leaving) {
    CircleGap gap = {
        .path = {{disc->x, 0.0},
                 {disc->y, 0.0},
                 {disc->vx, 0.0},
                 {disc->vy, 0.0},
                 ax,
                 ay,
                 {fixed_x, 0.0},
                 {fixed_y, 0.0}},
        .reach = two_sum(disc->radius, fixed_radius),
        .leaving = has_just_left ? leaving : 0.0,
        .has_left = has_just_left,
    };
    Gap form = circle_form(&gap);
    Falls falls;
    int sign = begin_circle_falls(&falls, exact, &gap, &form);
    start_falls(&falls, &gap, sign, sign <= 0);
    return next_fall(&falls);
}

/* ---- arcs ---- */

/* Return a coordinate after a time, with the velocity u and the acceleration a. Also return an upper bound of the
   magnitude of the coordinate's change. */
static inline MovedCoordinate fallen_coordinate(DoubleDouble x, DoubleDouble u, double a, double time) {
    double flown = time * u.high, fallen = 0.5 * a * time * time;
    DoubleDouble sum = two_sum(x.high, flown + fallen);
    return (MovedCoordinate){two_sum(sum.high, sum.low + x.low), fabs(flown) + fabs(fallen)};
}

/* Return whether a disc is in an arc's sector at a time. If rounding errors leave this undecided, return true. */
static inline bool falls_into_sector(const Feature *arc, const Mover *disc, double time, double ax, double ay) {
    if (arc->whole)
        return true;
    MovedCoordinate x = fallen_coordinate(offset_between(disc->x, arc->x), disc->ux, ax, time);
    MovedCoordinate y = fallen_coordinate(offset_between(disc->y, arc->y), disc->uy, ay, time);
    return is_in_sector(arc, x.coordinate, y.coordinate, x.change, y.change);
}

/* Return the first instant at which the gap becomes negative while the disc is in an arc's sector; infinity for never.
   `falls` counts time from the instant `from`. */
static inline double first_in_sector(Falls *falls, double from, const Feature *arc, const Mover *disc, double ax,
                                     double ay) {
    for (;;) {
        double wait = next_fall(falls);
        if (wait == CAROM_INF)
            return CAROM_INF;
        if (falls_into_sector(arc, disc, from + wait, ax, ay))
            return from + wait;
    }
}

/* Prepare `falls` for a gap: compute the coefficients in pairs of floats, and then round them to floats. */
static inline void begin_with_pairs(Falls *falls, const ExactQuartic *exact, const Gap *form) {
    begin_falls(falls, exact, form);
    need_pairs(falls);
    falls->floats = round_polynomial(&falls->pairs);
}

/* Return the exact sign of a gap at its instant t = 0. */
static inline int sign_of_form(const ExactQuartic *exact, Gap form) {
    Falls falls;
    begin_with_pairs(&falls, exact, &form);
    return sign_of_gap(&falls);
}

/* Return the first time of contact after a disc that touches or overlaps an arc from inside enters the arc's sector;
   infinity for never. `gap` is the gap to the arc. When the disc enters the sector, the gap is set to 0, because it
   differs from 0 only by rounding errors: see feature_time.h. */
static CAROM_NOINLINE double sector_entry_fall_time(const ExactQuartic *exact, const CircleGap *gap, const Mover *disc,
                                                    const Feature *arc) {
    const double ax = gap->path.ax, ay = gap->path.ay;
    double first = CAROM_INF;
    for (int k = 0; k < 2; k++) {
        LineGap edge = {gap->path, k == 0 ? arc->ex : arc->fx, k == 0 ? arc->ey : arc->fy, 0.0, k == 0 ? 1.0 : -1.0,
                        ACROSS};
        Gap edge_form = line_form(&edge);
        Falls entries;
        begin_falls(&entries, exact, &edge_form);
        if (!write_line_floats(&edge, &entries.floats))
            begin_with_pairs(&entries, exact, &edge_form);
        set_start(&entries, sign_of_gap(&entries));
        for (double time = next_fall(&entries); time < CAROM_INF; time = next_fall(&entries)) {
            CircleGap there = *gap;
            LineGap ahead = edge;
            CircleGap circle = {.path = gap->path, .reach = arc->size, .from = time, .is_inside = true};
            there.from = ahead.from = time;
            ahead.sense = 1.0;
            ahead.kind = ALONG;
            if (sign_of_form(exact, circle_form(&there)) > 0 || sign_of_form(exact, line_form(&ahead)) <= 0 ||
                sign_of_form(exact, circle_form(&circle)) <= 0)
                continue;
            Gap form = circle_form(&there);
            Falls later;
            begin_with_pairs(&later, exact, &form);
            later.is_closed = true;
            set_start(&later, 0);
            first = lesser(first, first_in_sector(&later, time, arc, disc, ax, ay));
        }
    }
    return first;
}

/* Return the seconds until a disc touches an arc or a vertex. */
static inline double arc_fall_time(const ExactQuartic *exact, const Mover *disc, const Feature *arc, double ax,
                                   double ay, bool has_just_left, double leaving) {
    const bool is_inside = arc->kind == INNER_ARC;
    if ((disc->radius < arc->fits_below) != is_inside)
        return CAROM_INF;
    CircleGap gap = {
        .path = {disc->x, disc->y, disc->ux, disc->uy, ax, ay, arc->x, arc->y},
        .reach = reach_of(disc, arc),
        .leaving = has_just_left ? leaving : 0.0,
        .has_left = has_just_left,
        .is_inside = is_inside,
    };
    Gap form = circle_form(&gap);
    Falls falls;
    int sign = begin_circle_falls(&falls, exact, &gap, &form);
    start_falls(&falls, &gap, sign, has_just_left || (sign <= 0 && is_before_arc(disc, arc)));
    double found = first_in_sector(&falls, 0.0, arc, disc, ax, ay);
    if (!is_inside || arc->whole || sign > 0)
        return found;
    return lesser(sector_entry_fall_time(exact, &gap, disc, arc), found);
}

/* ---- features ---- */

/* Return the seconds until a disc touches a feature. */
static inline double feature_fall_time(const ExactQuartic *exact, const Mover *disc, const Feature *feature, double ax,
                                       double ay, bool has_just_left, double leaving) {
    if (feature->kind == FACE)
        return face_fall_time(disc, feature, ax, ay, has_just_left, leaving);
    if (feature->kind == PLANE)
        return plane_fall_time(disc, feature, ax, ay, has_just_left, leaving);
    return arc_fall_time(exact, disc, feature, ax, ay, has_just_left, leaving);
}
