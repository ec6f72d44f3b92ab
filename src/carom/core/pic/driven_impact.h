/* Times at which discs hit driven bodies. This file also applies impacts in runs with driven bodies, features or spins.

   Driven bodies are not in the grid's cells or lists of obstacles. There are few driven bodies, so all of them are
   checked when a disc's path changes. Driven walls are also checked when a disc crosses an edge of its cell. A
   prediction goes through the legs (straight parts) of a driven body's path, up to the time of the disc's next known
   event.

   `predict_special` and `apply_special_impact` are not inlined, because inlining would slow down all other runs. */

#pragma once

#include "carom/core/pic/crush.h"
#include "carom/core/pic/motion_changes.h"
#include "carom/core/pic/next_event.h"
#include "carom/core/pic/straight_exit.h"
#include "carom/core/pic/straight_impact.h"
#include "carom/core/pic/straight_partner.h"

/* ---- driven walls ---- */

typedef struct FeatureImpact { /* impact of a disc with one of a wall's features */
    double wait;               /* seconds until the impact; INF for never */
    Index feature;
} FeatureImpact;

/* Return the feature of a wall that a disc hits first. `seen` is the disc's motion relative to the wall, and `leg` is
   the present straight part of the wall's path. Impacts that are certainly later than `wait` are ignored.

   If two features are hit at the same time, the feature with the lower number is first. `is_on_path` is true if neither
   the disc nor the wall has changed its path since the disc hit `seen->last`. */
static inline FeatureImpact first_impact_on_wall(const State *s, Index i, const Disc *seen, const Driven *wall,
                                                 const Leg *leg, bool is_on_path, double wait) {
    Mover mover = mover_of(seen);
    FeatureImpact first = {CAROM_INF, NO_OBSTACLE};
    for (Index k = wall->first_feature; k < wall->first_feature + wall->feature_count; k++) {
        if (is_left_for_good(s, i, k, leg->begins))
            continue;
        PathStart start = path_start(s, i, k, is_on_path ? seen->last : NO_BODY);
        double found = feature_impact_wait(seen, &mover, &s->features[k], start, wait);
        if (found < first.wait)
            first = (FeatureImpact){found, k};
    }
    return first;
}

/* If disc `i` hits a driven wall before it leaves its cell, predict the impact on the wall. If the disc hits several
   walls at the same time, predict the impact on the wall with the highest number. */
static inline void predict_driven_wall(State *s, Index i, const Driven *wall) {
    const Disc *a = &s->discs[i];
    Prediction *p = &s->predictions[i];
    Index first = leg_at(&s->driving, wall, a->time);
    for (Index n = first; n < wall->first_leg + wall->leg_count; n++) {
        const Leg *leg = &s->driving.legs[n];
        double begin = n == first ? a->time : leg->begin;
        if (begin > p->exit_time)
            return;
        Disc seen = seen_from_leg(a, leg, begin);
        double within = lesser(leg->end, p->exit_time) - begin;
        FeatureImpact impact =
            first_impact_on_wall(s, i, &seen, wall, leg, n == first, within + CAROM_TIME_ERROR * (begin + within));
        double at = begin + impact.wait;
        if (at < leg->end) {
            if (at < p->exit_time || (at == p->exit_time && p->edge == NO_EDGE && p->obstacle != NO_OBSTACLE &&
                                      s->features[p->obstacle].wall < -1 - wall->body)) {
                p->exit_time = at;
                p->obstacle = (int)impact.feature;
                p->edge = NO_EDGE;
            }
            return;
        }
    }
}

/* Return whether disc `i` glides along feature `k` instead of hitting it. Gliding is motion along an arc in contact
   without an impact. The disc reaches the feature at `time`. */
static inline bool begins_to_glide(const State *s, Index i, Index k, double time) {
    const Feature *f = &s->features[k];
    if (f->kind != INNER_ARC)
        return false;
    Disc seen = s->discs[i];
    PathStart start = path_start(s, i, k, seen.last);
    const Driven *row = driven_row(&s->driving, -1 - (Index)f->wall);
    if (row != NULL && row->leg_count > 0) {
        const Leg *leg = &s->driving.legs[leg_at(&s->driving, row, time)];
        start = leg->begin <= seen.time ? start : ELSEWHERE;
        seen = seen_from_leg(&s->discs[i], leg, greater(seen.time, leg->begin));
    }
    Mover disc = mover_of(&seen);
    return feature_time(&disc, f, start).glides;
}

/* ---- driven discs ---- */

/* Return the time at which disc `i` hits a driven disc on its present path. If the time is after `latest`, the function
   may return infinity instead. */
static inline double driven_disc_time(const State *s, Index i, const Driven *row, double latest) {
    Index j = row->body;
    double start = s->discs[i].time;
    Index first = leg_at(&s->driving, row, start);
    for (Index n = first; n < row->first_leg + row->leg_count; n++) {
        const Leg *leg = &s->driving.legs[n];
        double begin = greater(start, leg->begin);
        if (begin > latest)
            break;
        bool touches = s->touched != NULL && find_touched(&s->touched[i], j, leg->begins) != NULL;
        /* on this leg (straight part of its path), the driven disc only separates from disc i: see `last_partner` */
        if (touches || (n == first && s->discs[i].last == j))
            continue;
        Disc a = s->discs[i];
        move_to(&a, begin);
        Disc b = driven_disc_on(row, &s->discs[j], leg, begin);
        b.time = begin;
        double at = i < j ? pair_impact_time(&a, &b) : pair_impact_time(&b, &a);
        if (at < leg->end)
            return at;
    }
    return CAROM_INF;
}

/* If disc `i` hits a driven disc before its predicted impact, predict the impact on the driven disc instead. If both
   impacts are at the same time, predict the impact on the partner with the lower number. */
static inline void predict_driven_disc(State *s, Index i, const Driven *row) {
    Prediction *p = &s->predictions[i];
    double latest = predicted_impact(p).high;
    double at = driven_disc_time(s, i, row, latest);
    if (!(at < CAROM_INF) || at > latest)
        return;
    if (at >= p->impact_time && !p->exact)
        solve_impact(s, i);
    if (at < p->impact_time || (at == p->impact_time && row->body < p->partner)) {
        p->impact_time = at;
        p->exact = true;
        p->partner = (int)row->body;
        p->partner_impacts = s->discs[row->body].impacts;
    }
}

/* ---- functions for the event loop ---- */

/* Predict the next events of a disc that accelerates, as far as `change` affects them. */
static CAROM_NOINLINE void predict_accelerated(State *s, Index i, Change change) {
    predict_parabola_partner(s, i, change);
    if (change != OF_PARTNER)
        predict_parabola_exit(s, i);
}

/* Apply the event of a disc that accelerates. The event is an impact, or the end of the disc's motion if `second` is
   the disc itself. Return false and set `State.stopped` if the run ends. */
static CAROM_NOINLINE bool apply_accelerated(State *s, Index first, Index second, Instant at, bool is_wanted) {
    if (is_wanted && !reserve_modes(s)) {
        s->stopped = NO_MEMORY;
        return false;
    }
    if (first == second)
        return apply_motion_end(s, first, at);
    if (second >= 0)
        return apply_parabola_pair_impact(s, first, second, at, is_wanted);
    return apply_parabola_feature_impact(s, first, -1 - second, at, is_wanted);
}

/* In a run with features or driven bodies, predict the next events of disc `i` that `change` affects. `predict_partner`
   must have been called before, to predict the next impact on a disc that is not driven. */
static CAROM_NOINLINE void predict_special(State *s, Index i, Change change) {
    if (change != OF_CELL) {
        for (Index k = 0; k < s->driving.count; k++) {
            if (s->driving.rows[k].body >= 0)
                predict_driven_disc(s, i, &s->driving.rows[k]);
        }
    }
    if (change != OF_PARTNER) {
        predict_exit(s, i, s->feature_count > 0);
        for (Index k = 0; k < s->driving.count; k++) {
            if (s->driving.rows[k].body < 0 && s->driving.rows[k].leg_count > 0)
                predict_driven_wall(s, i, &s->driving.rows[k]);
        }
    }
}

/* Apply an impact in a run with spins, features or driven bodies. Return false and set `State.stopped` if the run
   ends. */
static CAROM_NOINLINE bool apply_special_impact(State *s, Index first, Index second, double time, bool is_wanted) {
    bool is_crushed = false;
    if (second >= 0) {
        if (s->driving.count > 0) {
            move_driven_disc(s, first, greater(time, s->clock.now));
            move_driven_disc(s, second, greater(time, s->clock.now));
        }
        apply_pair_impact(s, first, second, time, is_wanted, s->record.has_spins);
        is_crushed = s->to_and_fro != NULL && is_one_crushed(s, first, second);
    } else if (s->feature_count == 0) {
        apply_wall_impact(s, first, -1 - second, time, is_wanted, true);
    } else if (begins_to_glide(s, first, -1 - second, time)) {
        set_clock(s, time);
        s->gliding = first;
        s->stopped = GLIDES;
        return false;
    } else {
        Direction normal = apply_feature_impact(s, first, -1 - second, time, is_wanted);
        if (s->to_and_fro != NULL) {
            Index wall = s->features[-1 - second].wall;
            is_crushed = is_crushed_by(s, first, -1 - wall, (int)(-1 - second), normal.x, normal.y);
        }
    }
    s->stopped = CRUSHED;
    return !is_crushed;
}
