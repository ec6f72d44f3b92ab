/* Narrow phase: finds the disc with which a given disc collides next.

   A scan is the search for the next impact of one disc. For each near disc (a candidate), the scan computes bounds of
   the time of impact in ordinary floats, with the plain form of pair_time.h. The scan computes exact times only if the
   bounds do not decide which candidate is first. The exact time of the first candidate is computed only when its impact
   may be the next event of all discs.

   A scan has four rounds. Each round processes the discs that the previous round has kept, with as few branches as
   possible. A processor cannot predict which discs are near and which of them approach, and a wrong prediction costs as
   much as the arithmetic of a pair. */

#pragma once

#include "carom/core/pic/grid.h"
#include "carom/core/pic/separation.h"

/* chains (lists of further discs) in a block of cells */
typedef struct Chains {
    Index left;         /* number of chains that are not completely processed */
    Index disc;         /* the next unprocessed disc of the present chain, or NOBODY */
} Chains;

/* Return when discs `i` and `j` collide on their present paths; infinity for never. */
static inline double pair_event_time(const State *s, Index i, Index j) {
    return pair_impact_time(&s->discs[i < j ? i : j], &s->discs[i < j ? j : i]);
}

/* Round 1: find the discs in a block of cells, except those in chains (lists of further discs). Return the
   number of discs found. */
static inline Index gather_discs(State *s, Block block, Chains *chains) {
    Index count = 0;
    Index left = 0;
    for (Index line = 0; line < block.lines; line++) {
        for (Index k = 0; k < 3; k++) {
            const Cell *cell = &s->grid.cells[block.first + line * block.to_line + k * block.to_cell];
            for (Index place = 0; place < PLACES; place++) {
                Index disc = cell->disc[place];
                s->candidates.disc[count] = (int)disc;
                count += disc > NOBODY;
            }
            left += cell->disc[PLACES - 1] < NOBODY;
        }
    }
    chains->left = left;
    chains->disc = NOBODY;
    return count;
}

/* Add discs from chains (lists of discs in the same cell) to the `count` discs already found, up to a total of BATCH
   discs. Return the total number of discs. */
static CAROM_NOINLINE Index gather_chained_discs(State *s, Block block, Chains *chains, Index count) {
    while (chains->left > 0 && count < BATCH) {
        Index chain = chains->left;
        for (Index line = 0; line < block.lines && chains->disc == NOBODY; line++) {
            for (Index k = 0; k < 3; k++) {
                const Cell *cell = &s->grid.cells[block.first + line * block.to_line + k * block.to_cell];
                Index last = cell->disc[PLACES - 1];
                chain -= last < NOBODY;
                if (last < NOBODY && chain == 0)
                    chains->disc = CHAINED - last;
            }
        }
        while (chains->disc != NOBODY && count < BATCH) {
            s->candidates.disc[count] = (int)chains->disc;
            count += 1;
            chains->disc = s->grid.chain[chains->disc];
        }
        chains->left -= chains->disc == NOBODY;
    }
    return count;
}

/* Round 2: keep the discs that approach disc `i`, and store their motion relative to disc `i`. Disc `met` is excluded,
   because it collided with disc `i` last and therefore does not approach. Return the number of discs kept. */
static inline Index keep_approaching(State *s, Index i, Index met, Index count) {
    Candidates *c = &s->candidates;
    Disc a = s->discs[i];
    Index kept = 0;
    for (Index k = 0; k < count; k++) {
        Index j = c->disc[k];
        const Disc *b = &s->discs[j];
        RelativeMotion r = relative_motion(&a, b);
        c->disc[kept] = (int)j;
        c->dx[kept] = r.dx;
        c->dy[kept] = r.dy;
        c->ux[kept] = r.ux;
        c->uy[kept] = r.uy;
        c->reach[kept] = a.radius + b->radius;
        c->start[kept] = r.start;
        Bounded along = approach(r.dx, r.dy, r.ux, r.uy);
        /* if a product overflows, `along` may be NaN. If `along` is NaN, the disc is kept, and the error-free form of
           pair_time.h decides whether the two discs collide */
        int comes = !(along.value > along.error);
        int is_other = j != i;
        int is_free = j != met;
        kept += comes & is_other & is_free;
    }
    return kept;
}

/* Round 3: for each candidate, compute bounds of the time at which disc `i` hits the candidate; infinity for never. If
   `has_low` is true, each start time is the sum of `start` and `start_low`. */
static CAROM_ALWAYS_INLINE void bound_times(Candidates *c, Index count, bool has_low) {
    for (Index block = 0; block < (count + LANES - 1) / LANES; block++) {
        for (Index lane = 0; lane < LANES; lane++) { /* compilers turn this loop into vector instructions */
            Index k = block * LANES + lane;
            Bounded b = approach(c->dx[k], c->dy[k], c->ux[k], c->uy[k]);
            Bounded gap = separation(c->dx[k], c->dy[k], c->reach[k]);
            Bounded d = discriminant(c->dx[k], c->dy[k], c->ux[k], c->uy[k], c->reach[k]);
            int passes = d.value < -d.error;
            int is_at_rest = fabs(c->ux[k]) + fabs(c->uy[k]) == 0.0;
            int never = passes | is_at_rest;
            int is_apart = gap.value > CAROM_CERTAIN * gap.error;
            int is_deep = d.value > CAROM_CERTAIN * d.error;
            int closes = -b.value > CAROM_CERTAIN * b.error;
            int is_known = is_apart & is_deep & closes;
            double closing = sqrt(d.value > 0.0 ? d.value : 0.0) - b.value;
            double wait = gap.value / (closing > 0.0 ? closing : 1.0);
            double least = wait * (1.0 - CAROM_ROOT_ERROR);
            double most = wait * (1.0 + CAROM_ROOT_ERROR);
            if (has_low) {
                double open = CAROM_ULP * fabs(c->start_low[k]); /* bound of the rounding errors of the next two sums */
                least += c->start_low[k] - open;
                most += c->start_low[k] + open;
            }
            double low = c->start[k] + least;
            double high = c->start[k] + most;
            low = is_known ? low : -CAROM_INF;
            high = is_known ? high : CAROM_INF;
            c->low[k] = never ? CAROM_INF : low;
            c->high[k] = never ? CAROM_INF : high;
        }
    }
}

/* Among `best` and all candidates, return the candidate that disc `i` hits first, with the exact time. In a tie the
   partner with the lower number is first. */
static inline Candidate solve_earliest(const State *s, Index i, Index count, Candidate best) {
    const Candidates *c = &s->candidates;
    double latest = best.high;
    for (Index k = 0; k < count; k++)
        latest = lesser(c->high[k], latest);
    if (best.low < best.high)
        best.low = best.low <= latest ? pair_event_time(s, i, best.partner) : CAROM_INF;
    for (Index k = 0; k < count; k++) {
        if (c->low[k] <= latest) {
            double time = pair_event_time(s, i, c->disc[k]);
            if (time < best.low || (time == best.low && c->disc[k] < best.partner)) {
                best.low = time;
                best.partner = c->disc[k];
            }
        }
    }
    return (Candidate){best.low, best.low, best.partner};
}

/* Round 4: among `best` and all candidates, return the candidate that disc `i` hits first. */
static inline Candidate earliest_of(const State *s, Index i, Index count, Candidate best) {
    const Candidates *c = &s->candidates;
    Index at = -1;
    double least = best.low;
    double second = CAROM_INF;
    for (Index k = 0; k < count; k++) {
        double low = c->low[k];
        Index is_first = low < least;
        at += (k - at) * is_first;
        second = lesser(second, greater(least, low));
        least = lesser(least, low);
    }
    Candidate found = {least, best.high, best.partner};
    if (at >= 0) {
        found.high = c->high[at];
        found.partner = c->disc[at];
    }
    if (CAROM_UNLIKELY(second <= found.high && least < CAROM_INF))
        return solve_earliest(s, i, count, best);
    return found;
}

/* Return the predicted next impact of a disc with another disc, as a candidate. */
static inline Candidate predicted_impact(const Prediction *p) {
    double high = p->impact_time;
    /* a lower bound of 0 or more comes from `bound_times`, so the exact time is at most (1 + 4 CAROM_ROOT_ERROR) times
       this bound. A negative lower bound gives no upper bound */
    if (!p->exact)
        high = p->impact_time >= 0.0 ? p->impact_time * (1.0 + 4.0 * CAROM_ROOT_ERROR) : CAROM_INF;
    return (Candidate){p->impact_time, high, p->partner};
}

/* Predict the next impact of disc `i` with another disc. The candidates are all discs near disc `i`. If `change` is
   OF_CELL, the candidates are only the predicted partner and the discs in cells that have become neighbours. */
static inline void predict_partner(State *s, Index i, Change change) {
    Candidate best = {CAROM_INF, CAROM_INF, NOBODY};
    Index met = last_partner(s, i);
    Chains chains;
    Block block;
    if (change == OF_CELL) {
        best = predicted_impact(&s->predictions[i]);
        block = new_neighbours(s, i);
    } else {
        block = cells_around(s, i);
    }
    Index known = best.partner;
    Index count = gather_discs(s, block, &chains);
    while (true) {
        if (CAROM_UNLIKELY(chains.left > 0))
            count = gather_chained_discs(s, block, &chains, count);
        if (CAROM_UNLIKELY(s->touched != NULL))
            count = remove_touching(s, i, count);
        Index kept = keep_approaching(s, i, met, count);
        bound_times(&s->candidates, kept, false);
        best = earliest_of(s, i, kept, best);
        if (CAROM_LIKELY(chains.left == 0))
            break;
        count = 0;
    }
    if (change == OF_CELL && best.partner == known)
        return;
    Prediction *p = &s->predictions[i];
    p->impact_time = best.low;
    p->exact = best.low == best.high;
    p->partner = (int)best.partner;
    if (best.partner != NOBODY)
        p->partner_impacts = s->discs[best.partner].impacts;
}
