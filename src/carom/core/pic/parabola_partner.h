/* Narrow phase for discs that accelerate: finds the disc with which a given disc collides next.

   Two discs with the same acceleration move in a straight line relative to each other. For two discs with the same
   acceleration, the search (a scan) has the rounds that straight_partner.h describes. For other pairs of discs, a scan
   first computes only a lower bound of the time of impact (`earliest_meeting`). The scan computes the exact time only
   if no other candidate is earlier than the lower bound. */

#pragma once

#include "carom/core/pic/separation.h"
#include "carom/core/pic/straight_partner.h"

/* a candidate: a possible next impact with another disc */
typedef struct Meeting {
    /* the instant of the impact if `is_exact`, otherwise a lower bound of its high part; NEVER if the discs do not
       collide */
    Instant time;
    double latest;       /* upper bound of the high part of the instant of impact */
    Index partner;
    bool is_exact;
} Meeting;

static const Meeting NO_MEETING = {{CAROM_INF, 0.0}, CAROM_INF, NOBODY, true};

/* Return whether disc `j` moves in a straight line relative to disc `i`, because both have the same acceleration. */
static inline bool moves_straight(const State *s, Index i, Index j) {
    return s->discs[j].inverse_mass > 0.0 && accelerate_alike(s, i, j);
}

/* Return a lower bound of the time at which discs `i` and `j` collide. The path of one disc relative to the other is
   not straight. */
static inline Meeting bound_bent(const State *s, Index i, Index j) {
    Instant earliest = earliest_meeting(s, i, j);
    return (Meeting){{earliest.high, 0.0}, CAROM_INF, j, !(earliest.high < CAROM_INF)};
}

/* Round 2 of straight_partner.h: keep the discs that approach disc `i` and have the same acceleration. The relative
   motion of two discs is computed as in `parabola_pair_time`. For all other discs, append lower bounds of the times of
   impact to `bent`. */
static inline Index keep_approaching_alike(State *s, Index i, Index count, Meeting *bent, Index *bent_count) {
    Candidates *c = &s->candidates;
    const Parabola *p = &s->accelerated.paths[i];
    Disc a = s->discs[i];
    double low = p->time_low, half_x = 0.5 * p->ax, half_y = 0.5 * p->ay;
    bool has_table = s->accelerated.deceleration > 0.0;
    Index met = last_partner(s, i), kept = 0;
    for (Index k = 0; k < count; k++) {
        Index j = c->disc[k];
        const Disc *b = &s->discs[j];
        const Parabola *q = &s->accelerated.paths[j];
        if (CAROM_UNLIKELY(!moves_straight(s, i, j))) {
            bent[*bent_count] = bound_bent(s, i, j);
            *bent_count += bent[*bent_count].time.high < CAROM_INF;
            continue;
        }
        int is_later = (b->time > a.time) | ((b->time == a.time) & (q->time_low > low));
        Instant start = {is_later ? b->time : a.time, is_later ? q->time_low : low};
        /* At `start`, the disc whose path began later is at its position, so one of the two waits is 0. */
        double wait = (start.high - a.time) + (start.low - low);
        double its_wait = (start.high - b->time) + (start.low - q->time_low);
        Motion from = {a.x + wait * (a.vx + half_x * wait), a.y + wait * (a.vy + half_y * wait), a.vx + p->ax * wait,
                       a.vy + p->ay * wait};
        Motion to = {b->x + its_wait * (b->vx + half_x * its_wait), b->y + its_wait * (b->vy + half_y * its_wait),
                     b->vx + p->ax * its_wait, b->vy + p->ay * its_wait};
        if (CAROM_UNLIKELY(has_table)) { /* one of the discs may have stopped */
            from = motion_at(s, i, start);
            to = motion_at(s, j, start);
        }
        double dx = to.x - from.x, dy = to.y - from.y, ux = to.vx - from.vx, uy = to.vy - from.vy;
        c->disc[kept] = (int)j;
        c->dx[kept] = dx;
        c->dy[kept] = dy;
        c->ux[kept] = ux;
        c->uy[kept] = uy;
        c->reach[kept] = a.radius + b->radius;
        c->start[kept] = start.high;
        c->start_low[kept] = start.low;
        Bounded along = approach(dx, dy, ux, uy);
        int comes = !(along.value > along.error);
        int is_other = j != i;
        int is_free = CAROM_UNLIKELY(s->touched != NULL) ? !are_parting(s, i, j) : j != met;
        kept += comes & is_other & is_free;
    }
    return kept;
}

static inline void solve_meeting(const State *s, Index i, Meeting *m) {
    m->time = parabola_pair_time(s, i < m->partner ? i : m->partner, i < m->partner ? m->partner : i);
    m->latest = m->time.high;
    m->is_exact = true;
}

/* Return whether candidate `a` comes before candidate `b`. The candidate with the earlier time is first. If the times
   are equal, a lower bound comes before an exact time. If times and kinds are equal, the candidate whose partner has
   the lower number is first. */
static inline bool is_preceding(const Meeting *a, const Meeting *b) {
    if (a->time.high != b->time.high) {
        return a->time.high < b->time.high;
    }
    if (!a->is_exact || !b->is_exact) {
        return !a->is_exact && (b->is_exact || a->partner < b->partner);
    }
    return a->time.low != b->time.low ? a->time.low < b->time.low : a->partner < b->partner;
}

/* Return the earliest of the candidates. Exact times are computed for as few candidates as possible. */
static inline Meeting earliest_meeting_of(const State *s, Index i, Meeting *candidates, Index count) {
    while (true) {
        Index first = 0;
        double second = CAROM_INF;
        for (Index k = 1; k < count; k++) {
            if (is_preceding(&candidates[k], &candidates[first])) {
                second = lesser(second, candidates[first].time.high);
                first = k;
            } else {
                second = lesser(second, candidates[k].time.high);
            }
        }
        Meeting *best = &candidates[first];
        /* If the first candidate's time is exact, all lower bounds are later, because an equal lower bound would come
           first. */
        if (best->is_exact || second > best->latest) {
            return best->time.high < CAROM_INF ? *best : NO_MEETING;
        }
        solve_meeting(s, i, best);
    }
}

/* Return the predicted next impact of a disc as a candidate. If the predicted time is a lower bound, compute an upper
   bound from it. */
static inline Meeting predicted_meeting(const State *s, Index i) {
    const Prediction *p = &s->predictions[i];
    if (p->partner == NOBODY) {
        return NO_MEETING;
    }
    if (p->exact) {
        return (Meeting){{p->impact_time, s->accelerated.paths[i].impact_low}, p->impact_time, p->partner, true};
    }
    /* If both discs have the same acceleration, a lower bound of 0 or more comes from `bound_times`. The exact time is
       at most (1 + 4 CAROM_ROOT_ERROR) times this lower bound. For other pairs of discs, a lower bound gives no upper
       bound. */
    bool is_straight = moves_straight(s, i, p->partner) && p->impact_time >= 0.0;
    double latest = is_straight ? p->impact_time * (1.0 + 4.0 * CAROM_ROOT_ERROR) : CAROM_INF;
    return (Meeting){{p->impact_time, 0.0}, latest, p->partner, false};
}

/* Predict the next impact of disc `i` with another disc, like `predict_partner`. */
static inline void predict_parabola_partner(State *s, Index i, Change change) {
    Candidates *c = &s->candidates;
    Meeting meetings[BATCH + 1];
    Meeting best = NO_MEETING;
    Chains chains;
    Block block = change == OF_CELL ? new_neighbours(s, i) : cells_around(s, i);
    Index count = gather_discs(s, block, &chains);
    if (change == OF_CELL) {
        best = predicted_meeting(s, i);
    } else {
        for (Index k = 0; k < s->driving.count; k++) { /* driven discs are not in any cell */
            if (s->driving.rows[k].body >= 0) {
                meetings[0] = best;
                meetings[1] = bound_bent(s, i, s->driving.rows[k].body);
                best = earliest_meeting_of(s, i, meetings, 2);
            }
        }
    }
    while (true) {
        if (CAROM_UNLIKELY(chains.left > 0)) {
            count = gather_chained_discs(s, block, &chains, count);
        }
        Index met = 1;
        Index kept = keep_approaching_alike(s, i, count, meetings, &met);
        bound_times(c, kept, true);
        double latest = best.latest;
        for (Index k = 0; k < kept; k++) {
            latest = lesser(latest, c->high[k]);
        }
        for (Index k = 0; k < kept; k++) {
            if (c->low[k] <= latest && c->low[k] < CAROM_INF) {
                meetings[met++] = (Meeting){{c->low[k], 0.0}, c->high[k], c->disc[k], false};
            }
        }
        meetings[0] = best;
        best = earliest_meeting_of(s, i, meetings, met);
        if (CAROM_LIKELY(chains.left == 0)) {
            break;
        }
        count = 0;
    }
    Prediction *p = &s->predictions[i];
    p->impact_time = best.time.high;
    s->accelerated.paths[i].impact_low = best.time.low;
    p->exact = best.is_exact;
    p->partner = (int)best.partner;
    if (best.partner != NOBODY) {
        p->partner_impacts = s->discs[best.partner].impacts;
    }
}
