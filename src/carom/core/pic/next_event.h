/* The next event of each disc, and of all discs.

   Each disc has two predictions: its earliest known impact with another disc, and the time at which it leaves its cell.
   The file carom_core.h explains why no impact is missed. Only `event_of` decides which event of a disc is next. */

#pragma once

#include "carom/core/pic/event_queue.h"
#include "carom/core/pic/straight_partner.h"

typedef struct Bodies {
    Index first;
    Index second;
} Bodies;

/* ---- the event of a disc ---- */

/* Return whether the path of disc `i`'s partner has changed since the impact of the two was predicted. */
static inline bool is_stale(const State *s, Index i) {
    const Prediction *p = &s->predictions[i];
    return p->partner != NOBODY && s->discs[p->partner].impacts != p->partner_impacts;
}

/* Return the time of a disc's next event, or a lower bound of that time, in seconds since the present epoch. */
static inline double event_time(const Prediction *p) {
    return lesser(p->impact_time, p->exit_time);
}

/* Compare the times of a disc's two predictions. Return a negative number if the event at `exit_time` is first, a
   positive number if the impact at `impact_time` is first, and 0 in a tie. */
static CAROM_ALWAYS_INLINE int compare_predictions(const State *s, Index i) {
    const Prediction *p = &s->predictions[i];
    if (CAROM_LIKELY(p->exit_time != p->impact_time || s->accelerated.paths == NULL))
        return (p->exit_time > p->impact_time) - (p->exit_time < p->impact_time);
    const Parabola *path = &s->accelerated.paths[i];
    return (path->exit_low > path->impact_low) - (path->exit_low < path->impact_low);
}

static CAROM_ALWAYS_INLINE EventKind event_of(const State *s, Index i) {
    const Prediction *p = &s->predictions[i];
    int order = compare_predictions(s, i);
    if (p->exit_time <= p->impact_time && p->edge != NO_EDGE && (p->edge != MOTION_END || order <= 0))
        return p->edge == MOTION_END ? MOTION_ENDS : CROSSING;
    if (order < 0)
        return WALL_IMPACT;
    if (is_stale(s, i))
        return STALE;
    if (!p->exact)
        return BOUNDED;
    /* In a tie, impacts are in the order of body numbers: the impact on the partner is first if the partner's number is
       less than i, otherwise the impact on the wall. */
    return order == 0 && i < p->partner ? WALL_IMPACT : PAIR_IMPACT;
}

/* Return the low part of the instant of a disc's next event, which is the sum of a high and a low part. If discs do not
   accelerate, the low part is 0. */
static inline double event_low(const State *s, Event event) {
    if (s->accelerated.paths == NULL)
        return 0.0;
    const Parabola *path = &s->accelerated.paths[event.disc];
    return event.kind == PAIR_IMPACT ? path->impact_low : path->exit_low;
}

/* Return disc `i` and its partner in ascending order. */
static inline Bodies pair_of(const State *s, Index i) {
    Index j = s->predictions[i].partner;
    return (Bodies){i < j ? i : j, i < j ? j : i};
}

/* Return the two bodies of an impact as (first, second). If several impacts are simultaneous, the impact with the
   smallest pair (first, second) is applied first.

   In the pair (first, second), obstacle k has the number -1 - k. Obstacles are sorted by walls, and a prediction stores
   only the first obstacle that the disc hits. So comparing the numbers of obstacles gives the same order as comparing
   the numbers of walls. */
static inline Bodies bodies_of(const State *s, Event impact) {
    if (impact.kind == WALL_IMPACT)
        return (Bodies){impact.disc, -1 - (Index)s->predictions[impact.disc].obstacle};
    /* the first number is -1, so that the end of a motion precedes all impacts at that instant */
    if (impact.kind == MOTION_ENDS)
        return (Bodies){-1, impact.disc};
    return pair_of(s, impact.disc);
}

static CAROM_NOINLINE void solve_parabola_impact(State *s, Index i) {
    Prediction *p = &s->predictions[i];
    Index j = p->partner;
    Instant at = parabola_pair_time(s, i < j ? i : j, i < j ? j : i);
    p->impact_time = at.high;
    s->accelerated.paths[i].impact_low = at.low;
}

/* Replace the lower bound of the time of disc `i`'s predicted impact by the exact time. The exact time is later than
   the bound, so a different event of the disc may now be first. */
static CAROM_ALWAYS_INLINE void solve_impact(State *s, Index i) {
    Prediction *p = &s->predictions[i];
    if (CAROM_UNLIKELY(s->accelerated.paths != NULL))
        solve_parabola_impact(s, i);
    else
        p->impact_time = pair_event_time(s, i, p->partner);
    p->exact = true;
}

/* ---- the event of all discs ---- */

/* Disc `i` is predicted to hit its partner at `time`. Return the partner if its next event is the same impact.
   If the partner's next event is another event, return `i`. */
static inline Index other_holder(const State *s, Index i, double time) {
    const Prediction *p = &s->predictions[i];
    if (p->partner == NOBODY || p->impact_time != time)
        return i;
    const Prediction *other = &s->predictions[p->partner];
    if (other->partner != i || other->partner_impacts != s->discs[i].impacts || other->exit_time <= time)
        return i;
    return p->partner;
}

/* Return the event to process first if several discs have events at `time`.

   Events that only change predictions come first. If no event changes only predictions, return the impact with the
   smallest pair (first, second) of body numbers. The prediction of each disc contains the first of its simultaneous
   impacts, so the first of all impacts is among the predictions. */
static inline Event first_of_tie(State *s, double time) {
    Event event;
    Event first = {POSTPONED, NOBODY};
    Bodies least = {s->disc_count, 0};
    double least_low = CAROM_INF;
    event.disc = next_not_after(&s->queue, 0, time);
    while (event.disc < s->disc_count) {
        event.kind = event_of(s, event.disc);
        if (event.kind == BOUNDED) {
            solve_impact(s, event.disc);
            return (Event){POSTPONED, event.disc};
        }
        if (event.kind == CROSSING || event.kind == STALE)
            return event;
        Bodies bodies = bodies_of(s, event);
        double low = event_low(s, event);
        bool is_first = bodies.first < least.first || (bodies.first == least.first && bodies.second < least.second);
        if (low < least_low || (low == least_low && is_first)) {
            first = event;
            least = bodies;
            least_low = low;
        }
        event.disc = next_not_after(&s->queue, event.disc + 1, time);
    }
    return first;
}

/* Return the next event of all discs. Disc `i` must have the earliest time in the queue. */
static inline Event next_event(State *s, Index i) {
    EventKind kind = event_of(s, i);
    if (kind == BOUNDED) {
        solve_impact(s, i);
        kind = event_of(s, i);
        /* the disc leaves its cell before the impact, but another disc may have an even earlier event */
        if (kind == CROSSING)
            return (Event){POSTPONED, i};
    }
    if (kind == CROSSING || kind == STALE)
        return (Event){kind, i};
    double time = event_time(&s->predictions[i]);
    /* In most cases the impact at `time` is far earlier than all other events. The impact will change the disc's path,
       so the queue does not need the exact time. */
    if (time < earliest_except(&s->queue, i, other_holder(s, i, time)))
        return (Event){kind, i};
    if (CAROM_UNLIKELY(s->queue.time[i] == time))
        return first_of_tie(s, time);
    return (Event){POSTPONED, i};
}
