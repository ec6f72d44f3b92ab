/* Event queue: a tournament tree of the times of all discs' next events. Each match of the tournament compares eight
   times, which share a cache line.

   The smallest time of a match moves up one level, together with the number of its disc. A disc's new time replaces its
   old time. Unlike in a heap, entries do not change places. */

#pragma once

#include "carom/core/pic/state.h"

typedef struct Sibling {
    double time;
    Index place; /* index of the time within its level */
} Sibling;

/* Set the sizes of a queue's levels. Return false if there are too many discs. */
static inline bool lay_out_queue(Queue *q, Index discs) {
    Index length = 0;
    Index size = discs;
    q->discs = discs;
    for (q->top = 0; q->top < LEVELS; q->top++) {
        q->level[q->top] = length;
        length += (size + SIBLINGS - 1) / SIBLINGS * SIBLINGS;
        if (size == 1 && q->top > 0)
            return true;
        size = (size + SIBLINGS - 1) / SIBLINGS;
    }
    return false;
}

static inline Index queue_length(const Queue *q) {
    return q->level[q->top] + SIBLINGS;
}

/* Return the smallest of the seven event times that are compared with the time at `place`. The comparisons are in three
   rounds, because a processor executes the comparisons of a round in parallel. */
static CAROM_ALWAYS_INLINE Sibling best_sibling(const double *times, Index place) {
    double a = times[place ^ 1];
    double b = times[place ^ 2];
    double c = times[place ^ 3];
    double d = times[place ^ 4];
    double e = times[place ^ 5];
    double f = times[place ^ 6];
    double g = times[place ^ 7];
    double bc = lesser(b, c);
    double de = lesser(d, e);
    double fg = lesser(f, g);
    double abc = lesser(a, bc);
    double defg = lesser(de, fg);
    Index at_bc = b < c ? 2 : 3;
    Index at_de = d < e ? 4 : 5;
    Index at_fg = f < g ? 6 : 7;
    Index at_abc = a < bc ? 1 : at_bc;
    Index at_defg = de < fg ? at_de : at_fg;
    return (Sibling){lesser(abc, defg), place ^ (abc < defg ? at_abc : at_defg)};
}

/* Set the time of disc `i`'s next event, and update the higher levels as far as necessary. */
static inline void set_time(Queue *q, Index i, double time) {
    Index place = i;
    Index holder = i;
    q->time[i] = time;
    for (Index level = 0; level < q->top; level++) {
        Index above = q->level[level + 1] + (place >> 3);
        if (time > q->time[above]) {
            if ((q->holder[above] >> (3 * level)) != place)
                return; /* another time is the smallest of this match, so the higher levels do not change */
            Sibling best = best_sibling(q->time + q->level[level], place);
            Index other = level == 0 ? best.place : q->holder[q->level[level] + best.place];
            Index earlier = best.time < time;
            /* arithmetic replaces a branch, which the processor could not predict */
            holder += (other - holder) * earlier;
            time = lesser(best.time, time);
        } else if (time == q->time[above] && (q->holder[above] >> (3 * level)) != place) {
            return;
        }
        q->time[above] = time;
        q->holder[above] = (int)holder;
        place >>= 3;
    }
}

/* Return the disc of the earliest event. If several discs have the earliest event, return any of them. */
static inline Index earliest(const Queue *q) {
    return q->holder[q->level[q->top]];
}

/* Return the earliest time of all discs except `i` and `j`. `i` and `j` may be equal. */
static inline double earliest_except(const Queue *q, Index i, Index j) {
    double least = CAROM_INF;
    for (Index level = 0; level < q->top; level++) {
        const double *times = q->time + q->level[level];
        if (i == j || (i >> 3) != (j >> 3)) {
            least = lesser(least, best_sibling(times, i).time);
            if (i != j)
                least = lesser(least, best_sibling(times, j).time);
        } else {
            for (Index k = 1; k < 8; k++) {
                if ((i ^ k) != j)
                    least = lesser(least, times[i ^ k]);
            }
        }
        i >>= 3;
        j >>= 3;
    }
    return least;
}

/* Return the first disc whose number is at least `i` and whose time is at most `time`. Return the number of discs if
   there is none. */
static inline Index next_not_after(const Queue *q, Index i, double time) {
    while (i < q->discs) {
        if (q->time[i] <= time)
            return i;
        /* Skip the largest subtree whose first disc is `i` and whose times are all after `time`. */
        Index level = 0;
        while (level < q->top && (i & (((Index)8 << (3 * level)) - 1)) == 0 &&
               q->time[q->level[level + 1] + (i >> (3 * (level + 1)))] > time)
            level += 1;
        i += (Index)1 << (3 * level);
    }
    return q->discs;
}

/* Return the disc whose event is most probably the next one after the earliest event, which belongs to disc `i`. The
   result may be wrong, because only the matches of disc `i` on the two highest levels are compared. */
static inline Index runner_up(const Queue *q, Index i) {
    Index last = q->top - 1;
    Sibling upper = best_sibling(q->time + q->level[last], i >> (3 * last));
    Sibling lower = best_sibling(q->time + q->level[last - 1], i >> (3 * (last - 1)));
    if (upper.time < lower.time)
        return q->holder[q->level[last] + upper.place];
    return q->holder[q->level[last - 1] + lower.place];
}
