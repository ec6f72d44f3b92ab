/* Lower bounds of times of impact on a parabola: times before which a disc certainly does not touch a given body.

   For most features near a disc, a bound makes the exact solution unnecessary. Each bound is decreased by more than the
   sum of its rounding errors, which are below CAROM_BOUND_ERROR times its terms. If numbers exceed the range of floats,
   the bound is 0. Times are in seconds from now. CAROM_INF means never. */

#pragma once

#include "carom/core/parabola/fall_time.h"

/* Return a time before which a gap certainly does not close, from lower bounds of the gap, of its rate of change and of
   its acceleration. */
static inline double closing_lower_bound(double gap, double speed, double pull) {
    if (!(gap > 0.0))
        return 0.0;
    if (speed >= 0.0 && pull >= 0.0)
        return CAROM_INF;
    double square = speed * speed, product = 2.0 * pull * gap;
    double d = square - product;
    double error = CAROM_BOUND_ERROR * (square + fabs(product)) + CAROM_BOUND_UNDERFLOW;
    if (d < -error)
        return CAROM_INF;
    if (!(d + error < CAROM_INF))
        return 0.0;
    double time = speed > 0.0 ? (speed + sqrt(greater(d - error, 0.0))) / -pull
                              : 2.0 * gap / (sqrt(greater(d + error, 0.0)) - speed);
    return (1.0 - CAROM_BOUND_ERROR) * time;
}

/* Return whether a lower bound is later than the time `within`. If `within` is infinite, return whether the bound is
   infinite, too. */
static inline bool is_bound_after(double bound, double within) {
    return bound > within || bound == CAROM_INF;
}

/* Return a time before which a disc is certainly farther from a point than `reach`.

   The disc's centre has the position (x, y) relative to the point, with an error of at most `error`, and the velocity
   (ux, uy). Consider the circle of radius `reach` around the point, and the tangent at its point nearest to the disc.
   The centre is outside the circle as long as it has not crossed this tangent. */
static inline double circle_lower_bound(double x, double y, double ux, double uy, double ax, double ay, double reach,
                                        double error) {
    double distance = sqrt(x * x + y * y);
    double nx = x / distance, ny = y / distance;
    double gap = distance - reach - (error + CAROM_BOUND_ERROR * (distance + reach) + CAROM_BOUND_LENGTH_UNDERFLOW);
    double speed = nx * ux + ny * uy - CAROM_BOUND_ERROR * (fabs(ux) + fabs(uy));
    double pull = nx * ax + ny * ay - CAROM_BOUND_ERROR * (fabs(ax) + fabs(ay));
    return closing_lower_bound(gap, speed, pull);
}

/* Return a time before which a disc certainly does not touch a fixed disc. The two discs must not be in contact now. */
static inline double fall_pair_lower_bound(const FallingDisc *disc, double fixed_x, double fixed_y,
                                           double fixed_radius, double ax, double ay) {
    double size = fabs(disc->x) + fabs(fixed_x) + fabs(disc->y) + fabs(fixed_y);
    return circle_lower_bound(disc->x - fixed_x, disc->y - fixed_y, disc->vx, disc->vy, ax, ay,
                              disc->radius + fixed_radius, CAROM_BOUND_ERROR * size);
}

typedef struct Range {
    double least;
    double most;
} Range;

/* Return the range of a coordinate from now until the time `within`, with the velocity u and the acceleration a. If the
   time is infinite, the ends of the range are NaN. */
static inline Range parabola_range(double x, double u, double a, double within) {
    double end = x + within * (u + 0.5 * a * within);
    Range range = {lesser(x, end), greater(x, end)};
    if (u * a < 0.0 && -u / a < within) {
        double apex = x - 0.5 * u * (u / a);
        range.least = lesser(range.least, apex);
        range.most = greater(range.most, apex);
    }
    double error = CAROM_BOUND_ERROR * (fabs(x) + within * (fabs(u) + fabs(a) * within));
    return (Range){range.least - error, range.most + error};
}

/* Write the ranges of the coordinates of a feature's points, relative to `Feature.x` and `Feature.y`. The feature must
   not be a half-plane. */
static inline void write_feature_ranges(const Feature *f, Range *x, Range *y) {
    double size = f->size.high;
    if (f->kind == FACE) {
        *x = (Range){lesser(f->ex.high, 0.0), greater(f->ex.high, 0.0)};
        *y = (Range){lesser(f->ey.high, 0.0), greater(f->ey.high, 0.0)};
        return;
    }
    *x = *y = (Range){-size, size};
    if (f->whole)
        return;
    /* If the sector contains the direction of an axis, the arc extends as far in that direction as its whole circle. */
    double ex = f->ex.high, ey = f->ey.high, fx = f->fx.high, fy = f->fy.high;
    bool has_right = f->reflex ? ey <= 0.0 || fy >= 0.0 : ey <= 0.0 && fy >= 0.0;
    bool has_left = f->reflex ? ey >= 0.0 || fy <= 0.0 : ey >= 0.0 && fy <= 0.0;
    bool has_top = f->reflex ? ex >= 0.0 || fx <= 0.0 : ex >= 0.0 && fx <= 0.0;
    bool has_bottom = f->reflex ? ex <= 0.0 || fx >= 0.0 : ex <= 0.0 && fx >= 0.0;
    x->most = has_right ? size : greater(ex, fx);
    x->least = has_left ? -size : lesser(ex, fx);
    y->most = has_top ? size : greater(ey, fy);
    y->least = has_bottom ? -size : lesser(ey, fy);
}

/* Return whether a gap certainly keeps its sign until the time `within`. For a negative gap, return false unless
   `is_behind`. The gap, its speed and its acceleration `pull` have errors of at most CAROM_BOUND_ERROR times their
   sizes. */
static inline bool misses_line(double gap, double gap_size, double speed, double speed_size, double pull,
                               double pull_size, bool is_behind, double within) {
    double gap_error = CAROM_BOUND_ERROR * gap_size + CAROM_BOUND_UNDERFLOW;
    double speed_error = CAROM_BOUND_ERROR * speed_size + CAROM_BOUND_UNDERFLOW;
    double pull_error = CAROM_BOUND_ERROR * pull_size + CAROM_BOUND_UNDERFLOW;
    if (gap > gap_error)
        return is_bound_after(closing_lower_bound(gap - gap_error, speed - speed_error, pull - pull_error), within);
    return is_behind &&
           is_bound_after(closing_lower_bound(-gap - gap_error, -speed - speed_error, -pull - pull_error), within);
}

/* Return whether a disc certainly does not touch a face within a time. (x, y) is the position of the disc's centre
   relative to the start of the face. `way` is an upper bound of the centre's displacement within this time.

   Let w, s and p be the gap to the face's line, its rate of change and its acceleration. Let f, g and h be the position
   along the face, its rate of change and its acceleration. All six quantities are multiplied by the face's length. The
   first two tests use a bound of the change of the gap, s t + p t^2/2. The third test uses the position along the face
   when the gap closes. When the gap closes, w + s t + p t^2/2 = 0, so the position multiplied by -s is f (-s) + g w
   plus terms with p and h. If the disc's position when the gap closes is not between the face's ends, the disc misses
   the face. */
static inline bool fall_misses_face(double x, double y, double ux, double uy, const Feature *f, double ax, double ay,
                                    double place_size, double thick, double way, double within) {
    const double ex = f->ex.high, ey = f->ey.high, length = f->size.high;
    const double cross = ex * y - ey * x, gap = cross - length * thick;
    const double speed = ex * uy - ey * ux, pull = ex * ay - ey * ax, half = 0.5 * within;
    const double sides = fabs(ex) + fabs(ey), gap_size = sides * place_size + length * thick;
    const double size = gap_size + sides * way, error = CAROM_BOUND_ERROR * size + CAROM_BOUND_UNDERFLOW;
    if (gap + within * (lesser(speed, 0.0) + half * lesser(pull, 0.0)) > error)
        return true;
    const bool is_behind = cross < -CAROM_BOUND_ERROR * gap_size - CAROM_BOUND_UNDERFLOW;
    if (is_behind && gap + within * (greater(speed, 0.0) + half * greater(pull, 0.0)) < -error)
        return true;
    const double speed_size = fabs(ex * uy) + fabs(ey * ux), closing = -speed;
    if (gap > error && closing > CAROM_BOUND_ERROR * speed_size) {
        const double foot = ex * x + ey * y, foot_speed = ex * ux + ey * uy, foot_pull = ex * ax + ey * ay;
        const double bend = half * within * (fabs(foot_speed * pull) + closing * fabs(foot_pull));
        const double sizes = size * (speed_size + fabs(ex * ux) + fabs(ey * uy)) + bend;
        const double room = bend + 8.0 * CAROM_BOUND_ERROR * sizes + CAROM_BOUND_UNDERFLOW;
        const double at = foot * closing + foot_speed * gap, end = (ex * ex + ey * ey) * closing;
        if (at < -room || at - end > room + CAROM_BOUND_ERROR * end)
            return true;
    }
    return misses_line(gap, gap_size, speed, speed_size, pull, fabs(ex * ay) + fabs(ey * ax), is_behind, within);
}

/* Return whether a disc certainly does not touch a feature within a time. The disc's path must not begin with an impact
   on this feature. */
static inline bool fall_misses_feature(const Mover *disc, const Feature *f, double ax, double ay, double within) {
    const double ux = disc->ux.high, uy = disc->uy.high;
    const double x = disc->x.high - f->x.high, y = disc->y.high - f->y.high;
    const double place_size = fabs(disc->x.high) + fabs(f->x.high) + fabs(disc->y.high) + fabs(f->y.high);
    const double thick = disc->radius + f->half_width;
    if (f->kind == PLANE) {
        double size = place_size + disc->radius;
        return misses_line(x * f->nx + y * f->ny - disc->radius, size, ux * f->nx + uy * f->ny, fabs(ux) + fabs(uy),
                           ax * f->nx + ay * f->ny, fabs(ax) + fabs(ay), false, within);
    }
    const double fallen = within * (fabs(ax) + fabs(ay)), way = within * (fabs(ux) + fabs(uy) + fallen);
    if (f->kind == FACE && fall_misses_face(x, y, ux, uy, f, ax, ay, place_size, thick, way, within))
        return true;
    const double error = CAROM_BOUND_ERROR * place_size;
    if (f->kind == VERTEX || f->kind == OUTER_ARC) {
        /* The path differs from a straight path by at most `fallen` * `within` / 2. */
        double touch = f->size.high + thick + (0.5 + CAROM_BOUND_ERROR) * fallen * within + error;
        Bounded apart = separation(x, y, touch);
        if (apart.value > apart.error && is_passed(x, y, ux, uy, touch, within))
            return true;
    }
    /* When a disc touches a feature, its centre is at most `thick` from the feature. Rounding errors of the disc's
       displacement are added, because they matter at the ends of the feature. */
    const double room_error = CAROM_BOUND_ERROR * (place_size + thick + f->size.high + way);
    const double room = thick + (room_error + CAROM_BOUND_LENGTH_UNDERFLOW);
    Range path_x = parabola_range(x, ux, ax, within), path_y = parabola_range(y, uy, ay, within), at_x, at_y;
    write_feature_ranges(f, &at_x, &at_y);
    if (path_x.least > at_x.most + room || path_x.most < at_x.least - room || path_y.least > at_y.most + room ||
        path_y.most < at_y.least - room)
        return true;
    if (f->kind != INNER_ARC)
        return is_bound_after(circle_lower_bound(x, y, ux, uy, ax, ay, f->size.high + thick, error), within);
    double most_x = greater(path_x.most, -path_x.least), most_y = greater(path_y.most, -path_y.least);
    double most = sqrt(most_x * most_x + most_y * most_y);
    double most_error = error + CAROM_BOUND_ERROR * (most + f->size.high + thick) + CAROM_BOUND_LENGTH_UNDERFLOW;
    return most + most_error < f->size.high - thick;
}
