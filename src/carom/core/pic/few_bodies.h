/* Loop for runs with few discs and few walls: an event loop without cells and without a queue.

   With few bodies, it is faster to bound the times of all impacts of a disc than to find near bodies in cells. Vector
   instructions compute several bounds at once, and no disc crosses an edge of a cell. Each disc has one prediction: its
   first impact with any body. A prediction is stale if the partner's path has changed since the prediction was made.
   The results are bit-identical to those of the event loop (event_loop.c) and of the all-pairs loop (all_pairs.h).

   The loop is only used if all discs move in straight lines and all walls are half-planes: see `has_few_bodies`. */

#pragma once

#include "carom/core/pic/all_pairs.h"

/* ---- copies of rows ---- */

/* After the path of disc `i` has changed, copy the new path into `State.few`. */
static inline void copy_disc(State *s, Index i) {
    FewBodies *f = &s->few;
    const Disc *a = &s->discs[i];
    f->x[i] = a->x;
    f->y[i] = a->y;
    f->vx[i] = a->vx;
    f->vy[i] = a->vy;
    f->start[i] = a->time;
    f->radius[i] = a->radius;
}

static inline void fill_few_bodies(State *s) {
    FewBodies *f = &s->few;
    f->disc_places = (s->disc_count + LANES - 1) / LANES * LANES;
    f->wall_places = (s->wall_count + LANES - 1) / LANES * LANES;
    for (Index i = 0; i < MOST_FEW_DISCS; i++)
        f->time[i] = CAROM_INF;
    for (Index k = 0; k < s->wall_count; k++) {
        f->wall_x[k] = s->walls[k].x;
        f->wall_y[k] = s->walls[k].y;
        f->wall_nx[k] = s->walls[k].nx;
        f->wall_ny[k] = s->walls[k].ny;
    }
}

/* ---- bounds ---- */

/* For each disc j, write a lower bound of the time at which disc `i` hits disc j; infinity for never.

   Let d and u be the relative position and velocity of the two discs, and R the sum of their radii. Let a = u.u, b =
   d.u, c = d.d - R^2 and D = b^2 - a c. The bound is the root c / (-b + sqrt(D)) with a smaller c and a larger D. Let S
   = d.d + R^2, and let e be CAROM_FEW_ERROR. The errors of c and D are less than e S and e a S, so e S is subtracted
   from c, and e a S is added to D. The addition increases sqrt(D) by more than e/4 sqrt(a S). The error of b is less
   than e/32 sqrt(a S), so the bound needs no term for this error. If D is NaN because of an overflow, or if an
   underflow is possible, the bound is the start of the path. */
static inline void bound_disc_times(const FewBodies *f, Index i, double *low) {
    double x = f->x[i], y = f->y[i], vx = f->vx[i], vy = f->vy[i], begin = f->start[i], radius = f->radius[i];
    for (Index block = 0; block < f->disc_places; block += LANES) {
        for (Index lane = 0; lane < LANES; lane++) { /* compilers turn this loop into vector instructions */
            Index k = block + lane;
            double start = greater(begin, f->start[k]);
            double wait = start - begin, its_wait = start - f->start[k];
            double dx = (f->x[k] + f->vx[k] * its_wait) - (x + vx * wait);
            double dy = (f->y[k] + f->vy[k] * its_wait) - (y + vy * wait);
            double ux = f->vx[k] - vx, uy = f->vy[k] - vy;
            double reach = f->radius[k] + radius;
            double reach2 = reach * reach, distance2 = dx * dx + dy * dy;
            double error = CAROM_FEW_ERROR * (distance2 + reach2);
            double speed2 = ux * ux + uy * uy;
            double cross = dx * uy - dy * ux;
            double largest = speed2 * (reach2 + error);
            double d = largest - cross * cross;
            double closing = sqrt(d) - (dx * ux + dy * uy);
            double least = (distance2 - reach2 - error) / closing;
            int never = (d < 0.0) | (closing <= 0.0);
            int is_moving = (ux != 0.0) | (uy != 0.0);
            int is_small = (speed2 < CAROM_NEGLIGIBLE) | (largest < CAROM_NEGLIGIBLE);
            double wait_bound = is_small ? 0.0 : (never ? CAROM_INF : greater(least, 0.0));
            low[k] = start + (is_moving ? wait_bound : CAROM_INF);
        }
    }
}

/* For each wall, write a lower bound of the time at which disc `i` hits this wall; infinity for never. The error bounds
   are twice those of `wall_impact_wait`, so that they also cover the rounding of the quotient. */
static inline void bound_wall_times(const FewBodies *f, Index i, double *low) {
    double x = f->x[i], y = f->y[i], vx = f->vx[i], vy = f->vy[i], radius = f->radius[i], start = f->start[i];
    for (Index block = 0; block < f->wall_places; block += LANES) {
        for (Index lane = 0; lane < LANES; lane++) {
            Index k = block + lane;
            Bounded toward = approach(vx, vy, f->wall_nx[k], f->wall_ny[k]);
            Bounded rim = approach(x - f->wall_x[k], y - f->wall_y[k], f->wall_nx[k], f->wall_ny[k]);
            double gap = rim.value - radius - 2.0 * (rim.error + CAROM_ERROR * radius);
            double closing = 2.0 * toward.error - toward.value;
            double least = gap / closing;
            low[k] = start + (closing <= 0.0 ? CAROM_INF : greater(least, 0.0));
        }
    }
}

typedef struct LeastTimes {
    double first;  /* the least time of an array */
    double second; /* the second least time; equal to `first` if two times are equal */
    Index place;   /* index of the least time; the first index if all times are infinite */
} LeastTimes;

/* Return the two least times of two arrays together, from the two least times of each array. */
static inline LeastTimes merge_least_times(LeastTimes a, LeastTimes b) {
    return (LeastTimes){lesser(a.first, b.first), lesser(lesser(a.second, b.second), greater(a.first, b.first)),
                        b.first < a.first ? b.place : a.place};
}

/* Return the two least times of an array, whose length is a multiple of LANES. Each lane (place in a vector) finds its
   own least times, because comparing all times one after the other would be slower. The function is always inlined,
   because GCC then uses vector instructions, which halve the function's time. */
static CAROM_ALWAYS_INLINE LeastTimes find_least_times(const double *times, Index count) {
    /* indices are stored as floats, so that the same vector instructions select times and indices */
    double first[LANES], second[LANES], place[LANES], here[LANES];
    for (Index lane = 0; lane < LANES; lane++) {
        first[lane] = times[lane];
        second[lane] = CAROM_INF;
        place[lane] = here[lane] = (double)lane;
    }
    for (Index block = LANES; block < count; block += LANES) {
        for (Index lane = 0; lane < LANES; lane++) {
            double time = times[block + lane];
            here[lane] += (double)LANES;
            place[lane] = time < first[lane] ? here[lane] : place[lane];
            second[lane] = lesser(second[lane], greater(first[lane], time));
            first[lane] = lesser(first[lane], time);
        }
    }
    LeastTimes of[LANES];
    for (Index lane = 0; lane < LANES; lane++)
        of[lane] = (LeastTimes){first[lane], second[lane], (Index)place[lane]};
    return merge_least_times(merge_least_times(of[0], of[1]), merge_least_times(of[2], of[3]));
}

/* ---- predictions ---- */

static inline void store_first_impact(State *s, Index i, FirstImpact first) {
    s->few.first[i] = first;
    s->few.time[i] = first.time;
}

/* Predict the first impact of disc `i` from lower bounds of the times of all its impacts. */
static inline void predict_from_bounds(State *s, Index i) {
    const FewBodies *f = &s->few;
    double low[MOST_FEW_DISCS + MOST_FEW_WALLS];
    double *wall_low = low + f->disc_places;
    bound_disc_times(f, i, low);
    bound_wall_times(f, i, wall_low);
    for (Index k = s->disc_count; k < f->disc_places; k++)
        low[k] = CAROM_INF;
    for (Index k = s->wall_count; k < f->wall_places; k++)
        wall_low[k] = CAROM_INF;
    low[i] = CAROM_INF;
    Index met = last_partner(s, i), last = s->discs[i].last;
    if (met != NOBODY)
        low[met] = CAROM_INF;
    if (NO_BODY < last && last < 0)
        wall_low[-1 - last] = CAROM_INF;
    LeastTimes least = find_least_times(low, f->disc_places + f->wall_places);
    FirstImpact found = {least.first, least.second, (int)least.place, 0, false};
    if (least.place < f->disc_places)
        found.partner_impacts = s->discs[least.place].impacts;
    else
        found.body = (int)(-1 - (least.place - f->disc_places));
    store_first_impact(s, i, found);
}

/* Predict the first impact of disc `i` from the exact times of all its impacts. The exact times are necessary if bounds
   do not decide which impact is first. */
static CAROM_NOINLINE void predict_from_times(State *s, Index i) {
    NextEvent least = {NEVER, i, -1};
    for (Index k = 0; k < s->wall_count; k++)
        keep_sooner(&least, (NextEvent){wall_meeting(s, i, k), i, -1 - k});
    for (Index j = 0; j < s->disc_count; j++) {
        if (j < i)
            keep_sooner(&least, (NextEvent){pair_meeting(s, j, i), j, i});
        else if (j > i)
            keep_sooner(&least, (NextEvent){pair_meeting(s, i, j), i, j});
    }
    Index body = least.first == i ? least.second : least.first;
    int partner_impacts = body >= 0 ? s->discs[body].impacts : 0;
    store_first_impact(s, i, (FirstImpact){least.at.high, CAROM_INF, (int)body, partner_impacts, true});
}

/* Return whether the path of the partner has changed since the first impact of disc `i` was predicted. */
static inline bool is_first_stale(const State *s, Index i) {
    const FirstImpact *p = &s->few.first[i];
    return p->body >= 0 && s->discs[p->body].impacts != p->partner_impacts;
}

/* Replace the lower bound of the time of disc `i`'s first impact by the exact time. */
static inline void solve_first_impact(State *s, Index i) {
    FirstImpact p = s->few.first[i];
    p.time = p.body >= 0 ? pair_event_time(s, i, p.body) : wall_meeting(s, i, -1 - p.body).high;
    p.is_exact = true;
    if (CAROM_UNLIKELY(p.second <= p.time && p.second < CAROM_INF))
        predict_from_times(s, i);
    else
        store_first_impact(s, i, p);
}

/* Refine the prediction of disc `i`'s first impact: predict the impact again if the prediction is stale, otherwise
   compute the exact time. Return false if the time was already exact. */
static inline bool refine_first_impact(State *s, Index i) {
    if (is_first_stale(s, i)) {
        s->counts.stale += 1;
        predict_from_bounds(s, i);
        return true;
    }
    if (s->few.first[i].is_exact)
        return false;
    solve_first_impact(s, i);
    return true;
}

/* ---- the next impact ---- */

/* Return the two bodies of disc `i`'s first impact, in the order of `Bodies`. */
static inline Bodies first_bodies(const State *s, Index i) {
    Index body = s->few.first[i].body;
    return 0 <= body && body < i ? (Bodies){body, i} : (Bodies){i, body};
}

/* Several discs may have impacts at `time`. Return the disc whose impact is applied first. If the time of one of these
   impacts is not exact, refine its prediction and return NOBODY. */
static CAROM_NOINLINE Index first_disc_of_tie(State *s, double time) {
    Index first = NOBODY;
    NextEvent least = {NEVER, s->disc_count, 0};
    for (Index i = 0; i < s->disc_count; i++) {
        if (s->few.time[i] > time)
            continue;
        if (refine_first_impact(s, i))
            return NOBODY;
        Bodies bodies = first_bodies(s, i);
        NextEvent event = {{time, 0.0}, bodies.first, bodies.second};
        if (is_sooner(&event, &least)) {
            least = event;
            first = i;
        }
    }
    return first;
}

/* The time of disc `i`'s first impact must already be exact. Return the least time of all other discs, but ignore the
   partner if its first impact is the same impact. */
static inline double least_other_time(State *s, Index i) {
    FewBodies *f = &s->few;
    const FirstImpact *p = &f->first[i];
    Index same = i;
    if (p->body >= 0) {
        const FirstImpact *q = &f->first[p->body];
        if (q->body == i && q->partner_impacts == s->discs[i].impacts && p->time < q->second)
            same = p->body;
    }
    double time = f->time[i], same_time = f->time[same];
    f->time[i] = f->time[same] = CAROM_INF;
    double least = find_least_times(f->time, f->disc_places).first;
    f->time[same] = same_time;
    f->time[i] = time;
    return least;
}

/* Disc `i` must have the least time of all discs. Return the disc whose impact is next. If the next impact is not
   certain yet, refine a prediction and return NOBODY. */
static inline Index next_disc(State *s, Index i) {
    if (is_first_stale(s, i)) {
        refine_first_impact(s, i);
        return NOBODY;
    }
    if (!s->few.first[i].is_exact)
        solve_first_impact(s, i);
    double time = s->few.time[i];
    double other = least_other_time(s, i);
    if (CAROM_LIKELY(time < other))
        return i;
    return time == other && time < CAROM_INF ? first_disc_of_tie(s, time) : NOBODY;
}

/* ---- the loop ---- */

/* Predict the first impact of a disc after its path has changed. A disc that never moves has no prediction. */
static inline void predict_few(State *s, Index i) {
    if (s->discs[i].inverse_mass > 0.0)
        predict_from_bounds(s, i);
}

/* Predict all discs at the beginning of an epoch (part of a run). */
static CAROM_NOINLINE void predict_all_few(State *s) {
    for (Index i = 0; i < s->disc_count; i++)
        copy_disc(s, i);
    for (Index i = 0; i < s->disc_count; i++)
        predict_few(s, i);
    s->counts.predicted = s->disc_count;
}

/* Apply the first impact of disc `i`, and predict the next impacts of its discs again. */
static inline void apply_first_impact(State *s, Index i, bool is_wanted) {
    Bodies bodies = first_bodies(s, i);
    double time = s->few.time[i];
    if (bodies.second < 0) {
        apply_wall_impact(s, i, -1 - bodies.second, time, is_wanted, false);
        copy_disc(s, i);
        predict_few(s, i);
    } else {
        apply_pair_impact(s, bodies.first, bodies.second, time, is_wanted, false);
        copy_disc(s, bodies.first);
        copy_disc(s, bodies.second);
        predict_few(s, bodies.first);
        predict_few(s, bodies.second);
    }
}

/* Advance a run like `carom_advance`. */
static CAROM_NOINLINE Ending advance_few(State *s, double until, Index impacts, Index events) {
    while (true) {
        if (s->counts.at_instant > s->standstill)
            return STANDSTILL;
        if (events-- == 0)
            return PAUSE;
        if (CAROM_UNLIKELY(s->counts.predicted < s->disc_count))
            predict_all_few(s);
        LeastTimes least = find_least_times(s->few.time, s->few.disc_places);
        if (!(least.first < CAROM_INF) || reported_time(&s->clock, least.first) > until)
            return DONE;
        Index i = next_disc(s, least.place);
        if (i == NOBODY)
            continue;
        bool is_wanted;
        Instant at = {greater(s->few.time[i], s->clock.now), 0.0};
        Ending ending = check_limits(s, at, until, impacts, &is_wanted);
        if (CAROM_UNLIKELY(ending != NOT_ENDED))
            return ending;
        apply_first_impact(s, i, is_wanted);
        if (CAROM_UNLIKELY(s->counts.epoch_impacts >= CAROM_EPOCH_IMPACTS * s->disc_count))
            begin_epoch(s);
    }
}
