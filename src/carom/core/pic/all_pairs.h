/* All-pairs loop: each iteration computes the next event of every pair of bodies, and applies the earliest of these
   events.

   The loop uses no cells, bounds, queue or stored predictions. Tests compare this loop with the event loop: the results
   are bit-identical for every kind of motion. An iteration takes time proportional to the square of the number of
   discs. */

#pragma once

#include "carom/core/pic/clock.h"
#include "carom/core/pic/driven_impact.h"
#include "carom/core/pic/parabola_exit.h"
#include "carom/core/pic/separation.h"
#include "carom/core/pic/straight_impact.h"
#include "carom/core/pic/straight_partner.h"

typedef struct NextEvent { /* events are sorted by `at`, then by `first`, then by `second` */
    Instant at;
    Index first; /* number of a disc; -1 for the end of a motion, which comes before all impacts at the same instant */
    Index second; /* number of a disc, or -1 - k for obstacle k */
} NextEvent;

static inline bool is_sooner(const NextEvent *one, const NextEvent *other) {
    if (!is_same_instant(one->at, other->at))
        return is_before(one->at, other->at);
    return one->first < other->first || (one->first == other->first && one->second < other->second);
}

static inline void keep_sooner(NextEvent *least, NextEvent event) {
    if (event.at.high < CAROM_INF && is_sooner(&event, least))
        *least = event;
}

/* ---- two discs ---- */

/* Return when discs i < j collide on their present paths, or NEVER. At least one of the two discs must move freely. */
static inline Instant pair_meeting(const State *s, Index i, Index j) {
    if (s->accelerated.paths != NULL) {
        bool are_free = s->discs[i].inverse_mass > 0.0 && s->discs[j].inverse_mass > 0.0;
        bool touches = s->touched != NULL && are_free && accelerate_alike(s, i, j) && are_parting(s, i, j);
        return touches ? NEVER : parabola_pair_time(s, i, j);
    }
    bool is_first_free = s->discs[i].inverse_mass > 0.0;
    Index one = is_first_free ? i : j, other = is_first_free ? j : i;
    const Driven *row = driven_row(&s->driving, other);
    if (row != NULL)
        return (Instant){driven_disc_time(s, one, row, CAROM_INF), 0.0};
    bool is_parting = last_partner(s, one) == other || (s->touched != NULL && are_parting(s, i, j));
    return is_parting ? NEVER : (Instant){pair_event_time(s, i, j), 0.0};
}

/* ---- a disc and the obstacles ---- */

/* In a run without features, return when disc `i` hits half-plane k. */
static inline Instant wall_meeting(const State *s, Index i, Index k) {
    const Disc *a = &s->discs[i];
    const Wall *w = &s->walls[k];
    if (a->last == -1 - k || (s->touched != NULL && is_touched(&s->touched[i], -1 - k)))
        return NEVER;
    return (Instant){a->time + wall_time(a->x, a->y, a->vx, a->vy, a->radius, w->x, w->y, w->nx, w->ny), 0.0};
}

/* Return when disc `i` hits feature k of a wall that does not move, ignoring all other bodies. */
static inline Instant feature_meeting(const State *s, Index i, Index k, double *wait) {
    const Disc *a = &s->discs[i];
    Mover mover = mover_of(a);
    *wait = CAROM_INF;
    if (s->accelerated.paths != NULL)
        return is_never_met(s, i, k) ? NEVER : parabola_feature_meeting(s, i, k, &mover, CAROM_INF);
    if (is_left_for_good(s, i, k, 0.0))
        return NEVER;
    *wait = feature_time(&mover, &s->features[k], path_start(s, i, k, a->last)).time;
    return (Instant){a->time + *wait, 0.0};
}

/* Return the first feature that disc `i` hits, among features `first` to `end` - 1 of a wall at rest. On straight
   paths, the code compares the seconds until each impact; on other paths, the times of impact. In a tie, the feature
   with the lower number is first. */
static inline NextObstacle first_feature_of(const State *s, Index i, Index first, Index end) {
    NextObstacle found = {NEVER, NO_OBSTACLE};
    double least = CAROM_INF;
    for (Index k = first; k < end; k++) {
        double wait;
        Instant at = feature_meeting(s, i, k, &wait);
        if (s->accelerated.paths != NULL ? is_before(at, found.time) : wait < least) {
            found = (NextObstacle){at, k};
            least = wait;
        }
    }
    return found;
}

static inline NextObstacle first_feature_of_driven(const State *s, Index i, const Driven *wall) {
    const Disc *a = &s->discs[i];
    NextObstacle found = {NEVER, NO_OBSTACLE};
    if (s->accelerated.paths != NULL)
        return first_of_driven_wall(s, i, wall, found);
    Index first = leg_at(&s->driving, wall, a->time);
    for (Index n = first; n < wall->first_leg + wall->leg_count; n++) {
        const Leg *leg = &s->driving.legs[n];
        double begin = n == first ? a->time : leg->begin;
        Disc seen = seen_from_leg(a, leg, begin);
        FeatureImpact impact = first_impact_on_wall(s, i, &seen, wall, leg, n == first, CAROM_INF);
        if (begin + impact.wait < leg->end)
            return (NextObstacle){{begin + impact.wait, 0.0}, impact.feature};
    }
    return found;
}

/* Return the obstacle that disc `i` hits first. If the disc hits several walls at the same instant, return the wall
   with the highest number k, because its body number -1 - k is the lowest. */
static inline NextObstacle next_obstacle(const State *s, Index i) {
    NextObstacle next = {NEVER, NO_OBSTACLE};
    if (s->feature_count == 0) {
        for (Index k = 0; k < s->wall_count; k++) {
            Instant at = wall_meeting(s, i, k);
            if (!is_before(next.time, at))
                next = (NextObstacle){at, k};
        }
        return next;
    }
    for (Index k = 0, end; k < s->feature_count; k = end) {
        Index wall = s->features[k].wall;
        for (end = k; end < s->feature_count && s->features[end].wall == wall;)
            end++;
        const Driven *row = driven_row(&s->driving, -1 - wall);
        bool is_driven = row != NULL && row->leg_count > 0;
        NextObstacle found = is_driven ? first_feature_of_driven(s, i, row) : first_feature_of(s, i, k, end);
        if (!is_before(next.time, found.time))
            next = found;
    }
    return next;
}

/* ---- the loop ---- */

/* Return the first event of all discs, or an event at NEVER if there is none. */
static inline NextEvent first_event(const State *s) {
    NextEvent least = {NEVER, s->disc_count, 0};
    for (Index i = 0; i < s->disc_count; i++) {
        bool is_free = s->discs[i].inverse_mass > 0.0;
        if (is_free) {
            NextObstacle obstacle = next_obstacle(s, i);
            keep_sooner(&least, (NextEvent){obstacle.time, i, -1 - obstacle.feature});
            if (s->accelerated.paths != NULL)
                keep_sooner(&least, (NextEvent){s->accelerated.paths[i].ends, -1, i});
        }
        for (Index j = i + 1; j < s->disc_count; j++) {
            if (is_free || s->discs[j].inverse_mass > 0.0)
                keep_sooner(&least, (NextEvent){pair_meeting(s, i, j), i, j});
        }
    }
    return least;
}

/* Apply an event with the functions of the event loop. Return false and set `State.stopped` if the run ends. */
static inline bool apply_event(State *s, const NextEvent *event, Instant at, bool is_wanted) {
    if (event->second < 0) /* if the disc begins to glide, `carom_gliding_wall` reads this obstacle */
        s->predictions[event->first].obstacle = (int)(-1 - event->second);
    if (s->accelerated.paths != NULL)
        return apply_accelerated(s, event->first < 0 ? event->second : event->first, event->second, at, is_wanted);
    if (s->has_special_impacts)
        return apply_special_impact(s, event->first, event->second, at.high, is_wanted);
    if (event->second < 0)
        apply_wall_impact(s, event->first, -1 - event->second, at.high, is_wanted, false);
    else
        apply_pair_impact(s, event->first, event->second, at.high, is_wanted, false);
    return true;
}

static CAROM_NOINLINE Ending advance_all_pairs(State *s, double until, Index impacts, Index events) {
    while (true) {
        if (s->counts.at_instant > s->standstill)
            return STANDSTILL;
        if (events <= 0)
            return PAUSE;
        /* an iteration with many discs takes as long as several events of the event loop, so it counts as several
           events */
        events -= 1 + s->disc_count * s->disc_count / 64;
        NextEvent event = first_event(s);
        if (!(event.at.high < CAROM_INF))
            return DONE;
        Instant at = later_of(event.at, now_instant(s));
        bool is_wanted;
        Ending ending = check_limits(s, at, until, impacts, &is_wanted);
        if (ending != NOT_ENDED)
            return ending;
        if (!apply_event(s, &event, at, is_wanted))
            return s->stopped;
        if (s->accelerated.paths == NULL && s->counts.epoch_impacts >= CAROM_EPOCH_IMPACTS * s->disc_count)
            begin_epoch(s);
    }
}
