/* Narrow phase of discs that accelerate: which disc a disc meets next.

   As in scan.h, a scan bounds the times of all candidates, and solves only what the bounds do not separate. A pair with the
   same acceleration is bounded by the plain form of pair.h. Any other pair is bounded from below only, by the time that its
   greatest speed takes for its gap, and solved when that comes first. */

#pragma once

#include "carom/core/parabola.h"
#include "carom/core/scan.h"
#include "carom/core/touching.h"

typedef struct Meeting { /* a possible next impact with a disc */
    Instant time;        /* the instant if it is exact, else a lower bound of its high part; NEVER for never */
    double latest;       /* upper bound of its high part */
    Index partner;
    bool is_exact;
} Meeting;

static const Meeting NO_MEETING = {{CAROM_INF, 0.0}, CAROM_INF, NOBODY, true};

/* Return the bounds of the time at which two discs with the same acceleration meet. */
static inline Meeting bound_alike(const State *s, Index i, Index j) {
    const Disc *a = &s->discs[i], *b = &s->discs[j];
    Instant start = later_of(own_instant(a, &s->accelerated.paths[i]), own_instant(b, &s->accelerated.paths[j]));
    Motion first = motion_at(s, i, start), second = motion_at(s, j, start);
    double dx = second.x - first.x, dy = second.y - first.y;
    double ux = second.vx - first.vx, uy = second.vy - first.vy, reach = a->radius + b->radius;
    Bounded along = approach(dx, dy, ux, uy);
    if (along.value > along.error) {
        return NO_MEETING;
    }
    Bounded d = discriminant(dx, dy, ux, uy, reach);
    if (d.value < -d.error || fabs(ux) + fabs(uy) == 0.0) {
        return NO_MEETING;
    }
    Bounded gap = separation(dx, dy, reach);
    bool is_known = gap.value > CAROM_CERTAIN * gap.error && d.value > CAROM_CERTAIN * d.error &&
                    -along.value > CAROM_CERTAIN * along.error;
    if (!is_known) {
        return (Meeting){{-CAROM_INF, 0.0}, CAROM_INF, j, false};
    }
    double wait = gap.value / (sqrt(d.value) - along.value);
    double open = CAROM_ULP * fabs(start.low); /* of the sums with the low part */
    double low = start.high + ((start.low - open) + wait * (1.0 - CAROM_ROOT_ERROR));
    double high = start.high + ((start.low + open) + wait * (1.0 + CAROM_ROOT_ERROR));
    return (Meeting){{low, 0.0}, high, j, false};
}

/* Return the bounds of the time at which disc `i` meets another one. */
static inline Meeting bound_meeting(const State *s, Index i, Index j) {
    if (s->discs[j].inverse_mass > 0.0 && accelerate_alike(s, i, j)) {
        bool is_parting = s->touched != NULL ? are_parting(s, i, j) : last_partner(s, i) == j;
        return is_parting ? NO_MEETING : bound_alike(s, i, j);
    }
    Instant earliest = earliest_meeting(s, i, j);
    return (Meeting){{earliest.high, 0.0}, CAROM_INF, j, !(earliest.high < CAROM_INF)};
}

static inline void solve_meeting(const State *s, Index i, Meeting *m) {
    m->time = parabola_pair_time(s, i < m->partner ? i : m->partner, i < m->partner ? m->partner : i);
    m->latest = m->time.high;
    m->is_exact = true;
}

/* Return whether a candidate comes before another: by time, a bound before what is exact, then by the disc's number. */
static inline bool precedes(const Meeting *a, const Meeting *b) {
    if (a->time.high != b->time.high) {
        return a->time.high < b->time.high;
    }
    if (!a->is_exact || !b->is_exact) {
        return !a->is_exact && (b->is_exact || a->partner < b->partner);
    }
    return a->time.low != b->time.low ? a->time.low < b->time.low : a->partner < b->partner;
}

/* Return the earliest of some candidates, of which it solves as many as it takes to tell. */
static inline Meeting earliest_meeting_of(const State *s, Index i, Meeting *candidates, Index count) {
    while (true) {
        Index first = 0;
        double second = CAROM_INF;
        for (Index k = 1; k < count; k++) {
            if (precedes(&candidates[k], &candidates[first])) {
                second = lesser(second, candidates[first].time.high);
                first = k;
            } else {
                second = lesser(second, candidates[k].time.high);
            }
        }
        Meeting *best = &candidates[first];
        /* What is exact comes after all bounds at its time. */
        if (best->is_exact || second > best->latest) {
            return best->time.high < CAROM_INF ? *best : NO_MEETING;
        }
        solve_meeting(s, i, best);
    }
}

/* Return the predicted impact of a disc as a candidate; a bound is computed again. */
static inline Meeting predicted_meeting(const State *s, Index i) {
    const Prediction *p = &s->predictions[i];
    if (p->partner == NOBODY) {
        return NO_MEETING;
    }
    if (p->exact) {
        return (Meeting){{p->impact_time, s->accelerated.paths[i].impact_low}, p->impact_time, p->partner, true};
    }
    return bound_meeting(s, i, p->partner);
}

/* Predict the next impact of disc `i` with a disc, as `predict_impact` does. */
static inline void predict_parabola_impact(State *s, Index i, Change change) {
    Meeting candidates[BATCH + 1];
    Meeting best = NO_MEETING;
    Chains chains;
    Block block;
    if (change == OF_CELL) {
        best = predicted_meeting(s, i);
        block = new_neighbours(s, i);
    } else {
        block = cells_around(s, i);
        for (Index k = 0; k < s->driving.count; k++) { /* these are in no cell */
            if (s->driving.rows[k].body >= 0) {
                candidates[0] = best;
                candidates[1] = bound_meeting(s, i, s->driving.rows[k].body);
                best = earliest_meeting_of(s, i, candidates, 2);
            }
        }
    }
    Index count = gather(s, block, &chains);
    while (true) {
        Index kept = 1;
        candidates[0] = best;
        for (Index k = 0; k < count; k++) {
            if (s->candidates.disc[k] != i) {
                candidates[kept] = bound_meeting(s, i, s->candidates.disc[k]);
                kept += candidates[kept].time.high < CAROM_INF;
            }
        }
        best = earliest_meeting_of(s, i, candidates, kept);
        if (CAROM_LIKELY(chains.left == 0)) {
            break;
        }
        count = gather_chained(s, block, &chains);
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
