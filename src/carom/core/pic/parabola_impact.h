/* Impacts of discs that accelerate, contacts that begin at an impact, and contacts that end a run.

   A disc that leaves a flat feature may return to the feature without another event in between. The normal speed at the
   disc's return is set to exactly the speed at which the disc left. The page docs/theory/contact.md explains why a ball
   on a slope would otherwise never come to rest. */

#pragma once

#include "carom/core/pic/crush.h"
#include "carom/core/pic/lasting_contact.h"
#include "carom/core/pic/parabola_exit.h"
#include "carom/core/pic/parabola_partner.h"
#include "carom/core/pic/straight_impact.h"

typedef struct Encountered { /* motion of two colliding bodies along their normal */
    double approach;         /* speed at which the bodies approach, in metres per second */
    double pull; /* acceleration of the gap between the bodies; negative if the acceleration closes the gap */
    double resolution;       /* resolution (bound of the rounding error) of the gap, in metres */
} Encountered;

static inline void set_instant(State *s, Instant at) {
    Instant now = now_instant(s);
    set_clock(s, at.high);
    s->clock.now_low = later_of(now, at).low;
}

/* Count a change of a disc's motion without an impact, so that earlier predictions of impacts with the disc become
   stale. */
static inline void change_motion(State *s, Index i) {
    s->discs[i].impacts += 1;
    s->accelerated.paths[i].changes += 1;
}

/* Return whether a disc rests on another body, so that the predicted impact of the two must not be applied.

   The result is true if `pull` is below 0 and one of three conditions is true. The first condition is that the disc
   does not approach the other body. The second condition is that the disc left the same body at the instant `last`, and
   has flown too briefly for the clock to resolve. The third condition is that `last` is NULL (the disc's path began
   elsewhere), and a hop at the speed of approach would be lower than the resolution of the gap. */
static inline bool is_at_rest(const State *s, const Encountered *met, const Instant *last) {
    if (!(met->pull < 0.0) || !(met->approach > 0.0)) {
        return met->pull < 0.0;
    }
    return last != NULL ? last->high == s->clock.now
                        : met->approach * met->approach <= -2.0 * met->pull * met->resolution;
}

/* End the run, because a disc stays in contact with a body and PIC does not solve this contact. */
static inline void end_in_contact(State *s, Index i, Index other, Index obstacle, double approach, double restitution) {
    int held_by = s->accelerated.paths[i].ground;
    bool is_free_disc = other >= 0 && s->discs[other].inverse_mass > 0.0;
    bool after_bounces = approach > 0.0 && restitution > 0.0 && restitution < 1.0;
    s->accelerated.end = (ContactEnd){i, other, (int)obstacle, held_by, after_bounces};
    s->stopped = is_free_disc ? PRESSED : held_by != NO_OBSTACLE ? CORNER : AT_REST;
    if (s->accelerated.deceleration > 0.0 && other < 0) {
        s->stopped = GLIDES;
        s->gliding = i;
    }
}

/* Complete an impact: record the impact if `is_wanted`, and update the contacts of both bodies with the ground. Return
   false if the run ends with `STANDSTILL`, because too many successive impacts were too close in time. */
static inline bool finish_impact(State *s, bool is_wanted, const Impact *impact, const Spins *spins, Point place,
                                 Index feature, const Ambiguity *ambiguity) {
    Record *r = &s->record;
    bool is_ambiguous = note_impact(r, impact, ambiguity);
    if (is_wanted) {
        if (is_ambiguous) {
            mark_ambiguous(r);
        }
        write_impact_row(r, impact, spins, (Contact){place.x, place.y, feature});
    }
    Index struck[2] = {(Index)impact->first, (Index)impact->second};
    for (int k = 0; k < 2; k++) {
        ModeRow row;
        Index other = feature != NO_OBSTACLE ? -1 - feature : struck[1 - k];
        if (struck[k] >= 0 && s->discs[struck[k]].inverse_mass > 0.0 && s->accelerated.deceleration == 0.0 &&
            update_contact_after_impact(s, struck[k], other, impact->normal, &row)) {
            record_mode(s, &row);
        }
    }
    /* Two bodies that other bodies press together collide infinitely often, at intervals that soon become too short to
       resolve. */
    s->counts.ambiguous_in_row = is_ambiguous ? s->counts.ambiguous_in_row + 1 : 0;
    if (s->counts.at_instant > s->standstill || s->counts.ambiguous_in_row > s->standstill) {
        s->stopped = STANDSTILL;
        return false;
    }
    return true;
}

/* ---- two discs ---- */

/* Return the motion of disc `i` relative to disc `j` along their normal. Disc `i` is movable, and both discs are at
   their positions at the present instant. */
static inline Encountered encounter_disc(const State *s, Index i, Index j) {
    const Disc *a = &s->discs[i], *b = &s->discs[j];
    const Parabola *p = &s->accelerated.paths[i], *q = &s->accelerated.paths[j];
    double dx = a->x - b->x, dy = a->y - b->y, ux = a->vx - b->vx, uy = a->vy - b->vy;
    double ax = p->ax - q->ax, ay = p->ay - q->ay;
    double distance = nearest_length(dx, dy);
    double opening = (dx * ux + dy * uy) / distance;
    double across = (dx * uy - dy * ux) / distance;
    double pull = (dx * ax + dy * ay) / distance + across * across / distance;
    return (Encountered){
        -opening, pull, gap_resolution(size_of(a->x, a->y, a->radius) + size_of(b->x, b->y, b->radius))};
}

/* Remove the rounding error of the gap between a disc and the immovable disc that it has hit now. The gap is computed
   from a difference of squared distances, because for large radii a difference of distances would have a large rounding
   error. */
static inline void set_on_rim(State *s, Index i, Index fixed) {
    Disc *a = &s->discs[i];
    const Disc *b = &s->discs[fixed];
    double dx = a->x - b->x, dy = a->y - b->y, distance = nearest_length(dx, dy);
    DoubleDouble reach = two_sum(a->radius, b->radius);
    double beyond = excess(two_diff(a->x, b->x), two_diff(a->y, b->y), reach).high;
    double part = beyond / ((distance + reach.high) * distance);
    a->x -= part * dx;
    a->y -= part * dy;
}

/* Apply the impact of discs i < j. Return false and set `State.stopped` if the run ends. */
static inline bool apply_parabola_pair_impact(State *s, Index i, Index j, Instant at, bool is_wanted) {
    Disc *a = &s->discs[i], *b = &s->discs[j];
    Parabola *p = &s->accelerated.paths[i], *q = &s->accelerated.paths[j];
    bool is_first_fixed = a->inverse_mass == 0.0, has_fixed = is_first_fixed || b->inverse_mass == 0.0;
    Index one = is_first_fixed ? j : i, other = is_first_fixed ? i : j;
    const Parabola *path = &s->accelerated.paths[one];
    bool is_in_corner = has_fixed && is_in_corner_with(path, other);
    Instant last = is_in_corner ? path->left : own_instant(a, p);
    bool has_just_met = !has_fixed && a->last == j && b->last == i;
    set_instant(s, at);
    Instant now = now_instant(s);
    move_on_parabola(s, i, now);
    move_on_parabola(s, j, now);
    Encountered met = encounter_disc(s, one, other);
    /* Two discs can rest on each other only if their accelerations differ. */
    bool presses = has_fixed || p->ax != q->ax || p->ay != q->ay;
    if (presses && is_at_rest(s, &met, has_just_met || is_in_corner ? &last : NULL)) {
        end_in_contact(s, one, other, NO_OBSTACLE, met.approach, s->law.restitution);
        return false;
    }
    count_impact(s, now.high);
    a->last = (int)j;
    b->last = (int)i;
    p->leaving = q->leaving = s->law.restitution * greater(0.0, met.approach);
    double dx = b->x - a->x, dy = b->y - a->y, distance = sqrt(dx * dx + dy * dy);
    double reach = a->radius + b->radius;
    s->counts.too_far += !are_distinguishable(a->x, a->y, b->x, b->y, reach);
    Impact impact = {
        .time = s->clock.reported,
        .first = i,
        .second = j,
        .normal = {dx / distance, dy / distance},
        .first_before = {a->vx, a->vy},
        .second_before = {b->vx, b->vy},
    };
    Body first = body_of(s, i, true), second = body_of(s, j, true);
    Spins spins;
    collide_discs(&s->law, dx, dy, &first, &second, false, true, &spins);
    if (s->touched != NULL) {
        double before[] = {impact.first_before[0], impact.first_before[1], impact.second_before[0],
                           impact.second_before[1]};
        note_touching_discs(s, i, j, impact.normal[0], impact.normal[1], before, false);
    }
    impact.first_after[0] = a->vx;
    impact.first_after[1] = a->vy;
    impact.second_after[0] = b->vx;
    impact.second_after[1] = b->vy;
    double ux = impact.first_before[0] - impact.second_before[0], uy = impact.first_before[1] - impact.second_before[1];
    double sizes = size_of(a->x, a->y, a->radius) + size_of(b->x, b->y, b->radius);
    double speed = ux * impact.normal[0] + uy * impact.normal[1];
    double resolution =
        is_in_corner ? 0.0 : pair_resolution(sizes, reach, ux, uy, speed) + clock_resolution(impact.time);
    Point place = {a->x, a->y};
    if (has_fixed) {
        set_on_rim(s, one, other);
    }
    a->impacts += 1;
    b->impacts += 1;
    s->counts.predictions += (Index)(a->inverse_mass > 0.0) + (Index)(b->inverse_mass > 0.0);
    if (s->accelerated.deceleration > 0.0) {
        slow_down(s, i);
        slow_down(s, j);
    }
    Ambiguity ambiguity = {resolution, s->law.contact.friction > 0.0, a->inverse_mass > 0.0, b->inverse_mass > 0.0,
                           NO_FEATURE, false};
    if (!finish_impact(s, is_wanted, &impact, &spins, place, NO_OBSTACLE, &ambiguity)) {
        return false;
    }
    s->stopped = CRUSHED;
    return s->to_and_fro == NULL || !is_one_crushed(s, i, j);
}

/* ---- a disc and a wall ---- */

/* Disc `i` hits feature k. Return whether the disc's normal speed is exactly the speed at which it left the feature.
   The result is true if feature k is flat, the disc's last impact was on feature k, and the wall has not begun another
   leg (straight part of its path) since that impact. */
static inline bool returns_to(const State *s, Index i, Index k, double time) {
    const Disc *a = &s->discs[i];
    const Feature *f = &s->features[k];
    if (a->last != -1 - k || f->kind > FACE) {
        return false;
    }
    const Driven *row = driven_row(&s->driving, -1 - (Index)f->wall);
    return row == NULL || row->leg_count == 0 || s->driving.legs[leg_at(&s->driving, row, a->time)].end > time;
}

/* Return the motion of disc `i` along the normal `n` of feature k. The disc is at its position at the present instant,
   and `seen` is its motion relative to the wall. */
static inline Encountered encounter_feature(const State *s, Index i, Index k, const Motion *seen, Direction n) {
    const Disc *a = &s->discs[i];
    const Parabola *p = &s->accelerated.paths[i];
    const Feature *f = &s->features[k];
    double approach = -wall_speed(seen->vx, seen->vy, n.x, n.y).high;
    double size = size_of(a->x, a->y, a->radius);
    if (f->kind == PLANE) {
        /* On a decelerating table, the acceleration along the normal of a flat feature is set to 0, because the table
           does not press discs against walls. */
        double pull = s->accelerated.deceleration > 0.0 ? 0.0 : wall_speed(p->ax, p->ay, n.x, n.y).high;
        return (Encountered){approach, pull, gap_resolution(size + size_of(f->x.high, f->y.high, 0.0))};
    }
    double across = seen->vx * n.y - seen->vy * n.x, bend = 0.0;
    double sizes = size_of(f->x.high, f->y.high, f->size.high + f->half_width);
    if (f->kind == FACE) {
        sizes = size_of(f->x.high, f->y.high, f->half_width);
    } else {
        double x = seen->x - f->x.high, y = seen->y - f->y.high, away = sqrt(x * x + y * y);
        bend = f->kind == INNER_ARC ? -1.0 / away : 1.0 / away;
        if (f->size.high != 0.0) { /* an arc's centre and radius are pairs of floats */
            sizes = f->half_width + CAROM_ULP * sizes;
        }
    }
    double pull = p->ax * n.x + p->ay * n.y + across * across * bend;
    if (s->accelerated.deceleration > 0.0 && f->kind == FACE) {
        pull = 0.0;
    }
    return (Encountered){approach, pull, gap_resolution(size + sizes)};
}

/* Set the normal speed of a disc relative to a wall to the speed at which it leaves the wall. For a disc that rests on
   the wall, `speed` is 0. */
static inline void leave_wall(State *s, Index i, Index k, Direction n, double speed) {
    Disc *a = &s->discs[i];
    Motion seen = motion_seen_from_wall(s, i, s->features[k].wall);
    double change = speed - wall_speed(seen.vx, seen.vy, n.x, n.y).high;
    a->vx += change * n.x;
    a->vy += change * n.y;
    s->accelerated.paths[i].leaving = speed;
}

/* Apply friction and rolling resistance in an impact of a disc on a wall. `seen` is the disc's motion relative to the
   wall. */
static inline void slide_on_wall(State *s, Index i, const Law *law, double belt, Direction n, const Motion *seen,
                                 double pressed) {
    Body body = body_of(s, i, true);
    Frictions by = rub_on_wall(&law->wall_contact, s->accelerated.rolling_resistance, belt, n.x, n.y, seen->vx,
                               seen->vy, pressed, &body);
    s->accelerated.paths[i].sticks = by.sticks;
    s->accelerated.paths[i].rubs = by.friction != 0.0;
}

/* Begin the contact of disc `i` with feature k, if the disc is in flight and PIC solves lasting contact with this
   feature. If one condition is false, the run ends: set `State.stopped` and return false. */
static inline bool begin_contact(State *s, Index i, Index k, Direction n, double approach) {
    Parabola *p = &s->accelerated.paths[i];
    const Law *law = &s->wall_laws[s->features[k].wall];
    if (p->ground != NO_OBSTACLE || !s->accelerated.grounds[k].is_ground || s->accelerated.deceleration > 0.0) {
        leave_wall(s, i, k, n, 0.0);
        end_in_contact(s, i, -1 - (Index)s->features[k].wall, k, approach, law->wall_restitution);
        return false;
    }
    ModeRow row = land(s, i, k, approach);
    change_motion(s, i);
    record_mode(s, &row);
    return true;
}

/* Apply the impact of disc `i` on feature k. Return false and set `State.stopped` if the run ends.

   At the impact, the gap between the disc and the feature should be exactly 0. The rounding error of the gap is
   removed, so that errors do not accumulate over many bounces. */
static inline bool apply_parabola_feature_impact(State *s, Index i, Index k, Instant at, bool is_wanted) {
    Disc *a = &s->discs[i];
    Parabola *p = &s->accelerated.paths[i];
    const Feature *f = &s->features[k];
    const Law *law = &s->wall_laws[f->wall];
    const Driven *row = driven_row(&s->driving, -1 - (Index)f->wall);
    set_instant(s, at);
    Instant now = now_instant(s), last = own_instant(a, p);
    bool returns = returns_to(s, i, k, now.high), is_same_feature = a->last == -1 - k;
    bool is_in_corner = is_in_corner_with(p, -1 - k);
    double return_speed = p->leaving;
    if (p->left_ground == k) {
        returns = true;
        last = p->left;
        return_speed = p->left_speed;
    } else if (is_in_corner) {
        last = p->left;
    }
    move_on_parabola(s, i, now);
    extend_box(&s->visited, a->x, a->y);
    Motion seen = motion_seen_from_wall(s, i, f->wall);
    Mover disc = mover_at(seen.x, seen.y, seen.vx, seen.vy, a->radius);
    Direction n = normal_at(f, &disc);
    Encountered met = encounter_feature(s, i, k, &seen, n);
    if (returns) {
        met.approach = return_speed;
    }
    if (is_at_rest(s, &met, returns || is_in_corner ? &last : NULL)) {
        return begin_contact(s, i, k, n, met.approach);
    }
    count_impact(s, now.high);
    Surface surface = row != NULL ? surface_at(s, row, a->time) : (Surface){0.0, 0.0, 0.0};
    Impact impact = {
        .time = s->clock.reported,
        .first = i,
        .second = -1 - (Index)f->wall,
        .normal = {-n.x, -n.y},
        .first_before = {a->vx, a->vy},
        .second_before = {surface.vx, surface.vy},
        .second_after = {surface.vx, surface.vy},
    };
    Spins spins = {s->turning[i].spin, 0.0, 0.0, 0.0};
    Point place = {seen.x, seen.y};
    double gap = feature_gap(&disc, f);
    a->x -= gap * n.x;
    a->y -= gap * n.y;
    p->sticks = p->rubs = false;
    double restitution = law->wall_restitution;
    /* rounding can turn a very weak impact into a separation. A separation has no impulse, because an impact never
       pulls bodies together */
    if (met.approach > 0.0) {
        leave_wall(s, i, k, n, restitution * met.approach);
        if (law->wall_contact.friction > 0.0 || s->accelerated.rolling_resistance > 0.0) {
            slide_on_wall(s, i, law, surface.belt, n, &seen, (1.0 + restitution) * met.approach);
        }
    }
    a->last = (int)(-1 - k);
    spins.first_after = s->turning[i].spin;
    impact.first_after[0] = a->vx;
    impact.first_after[1] = a->vy;
    double ux = impact.first_before[0] - surface.vx, uy = impact.first_before[1] - surface.vy;
    /* the time of a return to the same feature is computed without a rounded gap, so its resolution is 0 */
    double resolution = 0.0;
    if (!returns && !is_in_corner) {
        double speed = ux * impact.normal[0] + uy * impact.normal[1];
        resolution = feature_resolution(f, a, ux, uy, speed, is_same_feature) + clock_resolution(impact.time);
    }
    a->impacts += 1;
    s->counts.wall_impacts += 1;
    s->counts.predictions += 1;
    if (s->touched != NULL) {
        note_touching_wall(s, i, k, n.x, n.y, fabs(impact.first_before[0]) + fabs(impact.first_before[1]), false);
    }
    if (s->accelerated.deceleration > 0.0) {
        slow_down(s, i);
    }
    Ambiguity ambiguity = {resolution, law->wall_contact.friction > 0.0, true, false,
                           f->kind == PLANE ? NO_FEATURE : (int)k, restitution == 1.0};
    if (!finish_impact(s, is_wanted, &impact, &spins, place, k, &ambiguity)) {
        return false;
    }
    s->stopped = CRUSHED;
    return s->to_and_fro == NULL || !is_crushed_by(s, i, -1 - (Index)f->wall, (int)k, n.x, n.y);
}
