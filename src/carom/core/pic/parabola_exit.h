/* Prediction of when a disc that accelerates leaves its cell, hits a feature of a wall, or changes its motion without
   an impact. */

#pragma once

#include "carom/core/parabola/fall_bounds.h"
#include "carom/core/pic/straight_exit.h"

/* ---- edges of the cell ---- */

typedef struct AxisExit { /* when a coordinate (x or y) of a disc leaves the disc's cell */
    double wait;          /* seconds after the start of the disc's path; INF for never */
    bool is_upper;        /* whether the coordinate leaves the cell at the upper limit */
} AxisExit;

/* Return the later root t of v t + a t^2 / 2 = d. Here d is the signed distance from the disc to an edge, v the
   velocity, and a the acceleration, which points towards the edge. */
static inline double later_edge_root(double d, double v, double a) {
    double sign = a > 0.0 ? 1.0 : -1.0;
    double square = v * v + 2.0 * a * d;
    /* if the disc reverses at the edge, rounding may make the square negative */
    double root = sqrt(square > 0.0 ? square : 0.0);
    double outwards = v * sign;
    if (outwards >= 0.0) {
        return outwards + root > 0.0 ? 2.0 * fabs(d) * (d * sign >= 0.0) / (outwards + root) : 0.0;
    }
    return (root - outwards) / fabs(a);
}

/* Return when a coordinate (x or y) of a disc leaves the disc's cell. `place` is the coordinate's distance from the
   lower edge. The disc entered the cell at the time `since`. `since` and the result are in seconds after the start of
   the disc's path.

   The velocity v reverses once, at the time -v/a. Before the reversal, the disc can cross only the edge towards which
   it moves, and afterwards only the other edge. So rounding never makes a disc cross an edge repeatedly. */
static inline AxisExit axis_exit(double place, double v, double a, double width, double since) {
    if (a == 0.0) {
        bool is_upper = v > 0.0;
        double wait = v != 0.0 ? ((is_upper ? width : 0.0) - place) / v : CAROM_INF;
        return (AxisExit){greater(wait, since), is_upper};
    }
    bool falls_up = a > 0.0;
    if (v != 0.0 && (v > 0.0) != falls_up && since < -v / a) { /* before the velocity reverses */
        double d = falls_up ? -place : width - place;
        double square = v * v + 2.0 * a * d;
        if (square >= 0.0) {
            double closing = fabs(v) + sqrt(square);
            return (AxisExit){greater(2.0 * fabs(d) * (d * v > 0.0) / closing, since), !falls_up};
        }
    }
    return (AxisExit){greater(later_edge_root(falls_up ? width - place : -place, v, a), since), falls_up};
}

/* Return when a coordinate leaves a cell, like `axis_exit`. `cell` is the number of the cell in a row or column of
   `cells` cells.

   A cell at the border of the grid extends outwards without limit, so it has no outer edge. A disc that moves outwards
   in this cell may reverse and leave the cell over the opposite edge. */
static inline AxisExit grid_axis_exit(double place, double v, double a, double width, double since, Index cell,
                                      Index cells) {
    AxisExit exit = axis_exit(place, v, a, width, since);
    if (cell == (exit.is_upper ? cells - 1 : 0)) {
        exit.wait = CAROM_INF;
        if (cells > 1 && a != 0.0 && (a > 0.0) != exit.is_upper) {
            exit.is_upper = !exit.is_upper;
            exit.wait = greater(later_edge_root((exit.is_upper ? width : 0.0) - place, v, a), since);
        }
    }
    return exit;
}

/* Return the edge of its cell that a disc crosses first, and when. `row` and `column` do not count the ring of empty
   cells around the grid. */
static inline CellExit parabola_cell_exit(const State *s, Index i, Index row, Index column) {
    const Grid *g = &s->grid;
    const Disc *a = &s->discs[i];
    const Parabola *p = &s->accelerated.paths[i];
    double since = greater(p->entered - a->time, 0.0);
    AxisExit x = grid_axis_exit(a->x - (g->x0 + (double)column * g->width), a->vx, p->ax, g->width, since, column,
                                g->columns);
    AxisExit y = grid_axis_exit(a->y - (g->y0 + (double)row * g->width), a->vy, p->ay, g->width, since, row, g->rows);
    return y.wait < x.wait ? (CellExit){y.wait, y.is_upper ? UP : DOWN} : (CellExit){x.wait, x.is_upper ? RIGHT : LEFT};
}

/* Return whether a coordinate with velocity v and acceleration a stays between two bounds for `wait` seconds. */
static inline bool stays_between(double low, double high, double x, double v, double a, double wait) {
    if (v == 0.0 && a == 0.0) {
        return low <= x && x <= high;
    }
    double end = x + wait * (v + 0.5 * a * wait);
    /* if `wait` is infinite, `end` may be NaN, and `stays` is then false */
    bool stays = low <= x && x <= high && low <= end && end <= high;
    double turn = a != 0.0 ? -v / a : -1.0;
    if (stays && turn > 0.0 && turn < wait) {
        double extreme = x + turn * (v + 0.5 * a * turn);
        stays = low <= extreme && extreme <= high;
    }
    return stays;
}

/* Return whether a disc stays in the area in which lists of obstacles are valid, for `wait` seconds after the start of
   its path. */
static inline bool parabola_stays_in_area(const State *s, Index i, double wait) {
    const Disc *a = &s->discs[i];
    const Parabola *p = &s->accelerated.paths[i];
    const Box *area = &s->grid.area;
    return stays_between(area->left, area->right, a->x, a->vx, p->ax, wait) &&
           stays_between(area->low, area->high, a->y, a->vy, p->ay, wait);
}

/* ---- features ---- */

/* Return whether the disc's present or last contact excludes an impact on feature k on the present path: see
   `NeverMet`. */
static inline bool is_never_met(const State *s, Index i, Index k) {
    const Parabola *p = &s->accelerated.paths[i];
    if (p->never_met == NEVER_NOTHING) {
        return false;
    }
    if (p->ground == k) {
        return true;
    }
    const Ground *g = &s->accelerated.grounds[p->never_of];
    const Feature *f = &s->features[k];
    if (p->never_met == NEVER_FLAT && (k == p->never_but || !(f->kind == FACE || f->whole))) {
        return false;
    }
    for (int n = g->never_first; n < g->never_first + g->never_count; n++) {
        if (s->accelerated.never_lists[n] == k) {
            return true;
        }
    }
    return false;
}

/* Return whether a disc touches a straight feature without normal speed, and nothing pulls it towards the feature. For
   a driven wall, `time` is the start of the present straight part (leg) of the wall's path, in seconds since the start
   of the run. */
static inline bool keeps_touching(const State *s, Index i, Index k, double time) {
    if (s->touched == NULL || find_touched(&s->touched[i], -1 - k, time) == NULL) {
        return false;
    }
    const Parabola *p = &s->accelerated.paths[i];
    const Feature *f = &s->features[k];
    return s->accelerated.deceleration > 0.0 || wall_speed(p->ax, p->ay, f->nx, f->ny).high == 0.0;
}

/* Return how many seconds a disc takes to reach feature k; infinity for never. */
static CAROM_NOINLINE double solve_parabola_feature(const State *s, Index i, Index k, const Mover *disc,
                                                    bool has_just_left, bool touches) {
    const Accelerated *run = &s->accelerated;
    const Parabola *p = &run->paths[i];
    const Feature *f = &s->features[k];
    /* On a decelerating table the path is straight, so the disc does not return to a flat feature. */
    if (f->kind <= FACE && (touches || (has_just_left && run->deceleration > 0.0))) {
        return CAROM_INF;
    }
    return feature_fall_time(&run->exact, disc, f, p->ax, p->ay, has_just_left, p->leaving);
}

/* Return how many seconds disc `i` takes to reach feature k. `disc` is the disc's motion relative to the feature's
   wall. If the disc never reaches the feature, or certainly takes longer than `within`, return infinity.
   `has_just_left` is true if the disc's path begins with an impact on feature k. `touches` is true if the disc touches
   feature k without normal speed. */
static inline double parabola_feature_wait(const State *s, Index i, Index k, const Mover *disc, bool has_just_left,
                                           bool touches, double within) {
    const Parabola *p = &s->accelerated.paths[i];
    if (!has_just_left && fall_misses_feature(disc, &s->features[k], p->ax, p->ay, within)) {
        return CAROM_INF;
    }
    return solve_parabola_feature(s, i, k, disc, has_just_left, touches);
}

/* Return when a disc returns to `Parabola.left_ground`, from which an impact on another body has lifted the disc. */
static inline Instant return_to_left_ground(const State *s, Index i) {
    const Disc *a = &s->discs[i];
    const Parabola *p = &s->accelerated.paths[i];
    const Feature *f = &s->features[p->left_ground];
    DoubleDouble pull = wall_speed(p->ax, p->ay, f->nx, f->ny);
    if (!(pull.high < 0.0)) {
        return NEVER;
    }
    Instant met = instant_after(p->left, return_time((DoubleDouble){p->left_speed, 0.0}, pull));
    Mover disc = mover_of(a);
    double wait = seconds_between(own_instant(a, p), met);
    return f->kind == PLANE || foot_is_on_face(&disc, f, wait, p->ax, p->ay) ? met : NEVER;
}

/* Return when disc `i` hits feature k of a wall that does not move. If the disc certainly takes longer than `within`
   seconds, the function may return NEVER instead. */
static inline Instant parabola_feature_meeting(const State *s, Index i, Index k, const Mover *disc, double within) {
    const Disc *a = &s->discs[i];
    const Parabola *p = &s->accelerated.paths[i];
    if (CAROM_UNLIKELY(p->left_ground == k)) {
        return return_to_left_ground(s, i);
    }
    if (CAROM_UNLIKELY(is_in_corner_with(p, -1 - k))) {
        Direction n = normal_at(&s->features[k], disc);
        return return_to_corner(s, i, n.x, n.y);
    }
    if (CAROM_UNLIKELY(lands_at_corner_of(s, i, -1 - k))) {
        return NEVER;
    }
    double wait = parabola_feature_wait(s, i, k, disc, a->last == -1 - k, keeps_touching(s, i, k, 0.0), within);
    return wait < CAROM_INF ? instant_after(own_instant(a, p), wait) : NEVER;
}

typedef struct NextObstacle {
    Instant time;
    Index feature; /* the feature that is hit at `time`, or NO_OBSTACLE if no feature is hit before `time` */
} NextObstacle;

/* Return the first of the listed features that a disc hits, or `next` if no feature is hit before `next`.

   If two features of one wall are hit at the same instant, the first one in the list is returned. If features of two
   walls are hit at the same instant, the last one in the list is returned. The last one belongs to the wall with the
   higher number k, which is the lower body number -1 - k. */
static inline NextObstacle first_of_features(const State *s, Index i, const int *numbers, NextObstacle next) {
    const Mover disc = mover_of(&s->discs[i]);
    for (; *numbers != NO_OBSTACLE; numbers++) {
        Index k = *numbers;
        if (is_never_met(s, i, k)) {
            continue;
        }
        /* `within` is enlarged, because instants after `next` may round to the same time. */
        double within = next.time.high - s->discs[i].time + CAROM_TIME_ERROR * next.time.high;
        Instant met = parabola_feature_meeting(s, i, k, &disc, within);
        bool is_tie = next.feature != NO_OBSTACLE && s->features[next.feature].wall != s->features[k].wall &&
                      is_same_instant(met, next.time);
        if (is_before(met, next.time) || is_tie) {
            next = (NextObstacle){met, k};
        }
    }
    return next;
}

/* Return the first feature of a driven wall that a disc hits, or `next` if no feature is hit before `next`. */
static inline NextObstacle first_of_driven_wall(const State *s, Index i, const Driven *wall, NextObstacle next) {
    const Disc *a = &s->discs[i];
    Index first = leg_at(&s->driving, wall, a->time);
    for (Index n = first; n < wall->first_leg + wall->leg_count; n++) {
        const Leg *leg = &s->driving.legs[n];
        Instant begin = {n == first ? a->time : leg->begin, 0.0};
        if (begin.high > next.time.high) {
            break;
        }
        Motion seen = motion_at(s, i, begin);
        Point moved = displacement_on(leg, begin.high);
        Mover disc = mover_at(seen.x - moved.x, seen.y - moved.y, seen.vx - leg->vx, seen.vy - leg->vy, a->radius);
        if (n == first) {
            begin = own_instant(a, &s->accelerated.paths[i]);
        }
        double latest = lesser(leg->end, next.time.high);
        double within = latest - begin.high + CAROM_TIME_ERROR * latest, wait = CAROM_INF;
        Index met_feature = NO_OBSTACLE;
        for (Index k = wall->first_feature; k < wall->first_feature + wall->feature_count; k++) {
            if (is_never_met(s, i, k)) {
                continue;
            }
            bool is_table_plane = s->accelerated.deceleration > 0.0 && s->features[k].kind == PLANE;
            bool has_just_left = (n == first || is_table_plane) && a->last == -1 - k;
            bool touches = keeps_touching(s, i, k, leg->begins);
            double found = parabola_feature_wait(s, i, k, &disc, has_just_left, touches, within);
            if (found < wait) {
                wait = found;
                met_feature = k;
            }
        }
        Instant met = instant_after(begin, wait);
        if (met.high < leg->end) {
            bool is_tie = next.feature != NO_OBSTACLE && is_same_instant(met, next.time) &&
                          s->features[next.feature].wall < -1 - wall->body;
            return is_before(met, next.time) || is_tie ? (NextObstacle){met, met_feature} : next;
        }
    }
    return next;
}

/* Predict which of three events of disc `i` is first: it crosses an edge of its cell, it hits a feature, or its motion
   ends without an impact. */
static inline void predict_parabola_exit(State *s, Index i) {
    const Grid *g = &s->grid;
    Prediction *p = &s->predictions[i];
    Parabola *path = &s->accelerated.paths[i];
    const Disc *a = &s->discs[i];
    Index row = p->cell >> COLUMN_BITS, column = p->cell & COLUMN_MASK;
    CellExit crossing = parabola_cell_exit(s, i, row - 1, column - 1);
    Instant leaves = {a->time + crossing.wait, 0.0};
    bool ends_first = path->ends.high < CAROM_INF && !is_before(leaves, path->ends);
    NextObstacle none = {ends_first ? path->ends : leaves, NO_OBSTACLE}, next = none;
    unsigned int list = g->list_of[tile_of(g, row, column)];
    if (list != 0) {
        next = first_of_features(s, i, g->lists + (list >> 1), none);
        if ((list & 1) && !parabola_stays_in_area(s, i, next.time.high - a->time)) {
            next = first_of_features(s, i, g->lists + FULL_LIST, none);
            s->counts.beyond += 1;
        }
    }
    for (Index k = 0; k < s->driving.count; k++) {
        if (s->driving.rows[k].body < 0 && s->driving.rows[k].leg_count > 0) {
            next = first_of_driven_wall(s, i, &s->driving.rows[k], next);
        }
    }
    int edge = next.feature != NO_OBSTACLE ? NO_EDGE : ends_first ? MOTION_END : (int)crossing.edge;
    p->exit_time = next.time.high;
    path->exit_low = next.time.low;
    p->obstacle = (int)next.feature;
    p->edge = edge;
}
