/* Scheduling of a disc: find the tests that can find an impact at this frame, and the time at which the disc is due
   (may have an impact) again.

   `State.due` contains the due time of each disc. Before its due time, a disc cannot hit a near disc or a wall, and
   moves no farther than its leeway. For any two discs, the disc that was scheduled last was scheduled with the present
   paths of both discs. So at least one of two discs is due before they can touch, and no impact is missed. */

#pragma once

#include "carom/core/pit/skip_bounds.h"
#include "carom/core/pit/grid.h"
#include "carom/core/pit/pending_tests.h"

/* ---- work, measured in tests of two discs, and whether skipping tests saves work ---- */

/* A build with CAROM_PLAIN_FRAMES leaves out skipping and sweeps to save space. The page of `carom play` uses a
   WebAssembly build with CAROM_PLAIN_FRAMES. Builds with and without CAROM_PLAIN_FRAMES have the same results. */
#if defined(CAROM_PLAIN_FRAMES)
#define CAROM_SKIPS false
#else
#define CAROM_SKIPS true
#endif

/* Return the number of tests at a frame if all pairs of bodies are tested. */
static inline double plain_work(const State *s) {
    return (double)s->disc_count * (0.5 * (double)(s->disc_count - 1) + (double)s->wall_count);
}

/* Return the work of a frame without skipping, in tests of two discs. With cells, the frame uses a sweep; without
   cells, all pairs are tested. */
static inline double frame_work(const State *s) {
    if (s->grid.list_count == 0)
        return plain_work(s);
    return (double)s->disc_count * (CAROM_SWEEP_WORK + (double)s->wall_count);
}

/* Return whether all tests of the next frame are made. The result is true if the caller requests all tests, or if
   skipping has cost more work than it has saved and the excess is not yet recovered.

   Before skipping saves work, it must schedule all discs, and must compute expired bounds again. So skipping stops only
   if the excess is larger than a limit. Skipping resumes when frames without skipping have recovered the excess. */
static inline bool loops_plainly(State *s) {
    if (!CAROM_SKIPS || !s->skips)
        return true;
    if (s->excess > s->max_waste * s->first_search)
        s->pays_back = true;
    else if (s->excess <= 0.0)
        s->pays_back = false;
    return s->pays_back;
}

/* Count work that skipping has cost. */
static inline void spend_work(State *s, double work) {
    s->work -= work;
    s->excess += work;
}

/* Count the work that skipping has saved at `frames` frames. */
static inline void save_frames(State *s, Index frames) {
    s->excess = greater(s->excess - (double)frames * frame_work(s), -CAROM_SAVED_FRAMES * frame_work(s));
}

/* ---- bodies that may touch ---- */

/* Add a body to `State.touching`, because the disc of the present search may touch the body. */
static inline void add_touching(State *s, Index body) {
    Touching *t = &s->touching;
    if (t->count == t->capacity) {
        Index capacity = 2 * t->capacity + 64;
        int *bodies = s->record.resize(t->bodies, (size_t)t->count * sizeof(int), (size_t)capacity * sizeof(int));
        if (bodies == NULL) {
            s->is_out_of_memory = true;
            return;
        }
        t->bodies = bodies;
        t->capacity = capacity;
    }
    t->bodies[t->count] = (int)body;
    t->count += 1;
}

/* ---- discs ---- */

/* If discs i and j may have an impact at this frame, add their test. The wait of two bodies is a time for which they
   cannot have an impact (see skip_bounds.h). Return the smaller of `least` and the wait of discs i and j. */
static inline double test_or_wait(State *s, Index i, Index j, double extent_i, double least) {
    const Disc *a = &s->discs[i];
    const Disc *b = &s->discs[j];
    Approach p = approach_of(s, a, b, extent_i);
    double wait;
    s->counts.pair_tests += 1;
    if (may_touch(&p)) {
        if (are_immovable(a, b))
            return least;
        add_touching(s, j);
        if (are_separating(s, i, j))
            return least;
        wait = bound_touching(s, a, b, &p);
        if (wait == CAROM_IN_CONTACT) {
            add_test(s, i < j ? test_of(i, j) : test_of(j, i));
            return 0.0;
        }
    } else {
        wait = bound_approach(s, a, b, &p, least);
        if (wait < least && (are_separating(s, i, j) || are_immovable(a, b)))
            return least;
    }
    return wait < least ? wait : least;
}

/* Return the smallest of `least` and all waits of disc i with other discs (see `test_or_wait`). */
static inline double search_all(State *s, Index i, double extent_i, double least) {
    for (Index j = 0; j < s->disc_count; j++) {
        if (j != i)
            least = test_or_wait(s, i, j, extent_i, least);
    }
    return least;
}

/* Return the smallest of `least` and the waits of disc i with all discs in near cells (see `test_or_wait`). */
static inline double search_cells(State *s, Index i, double extent_i, double least) {
    const Grid *g = &s->grid;
    const Disc *a = &s->discs[i];
    double own = a->radius + g->levels[a->level].leeway;
    for (Index level = 0; level < g->level_count; level++) {
        double width = g->levels[level].width;
        double reach = (own + g->levels[level].reach) * (1.0 + CAROM_REACH_MARGIN);
        int64_t left = cell_number((a->x - reach) / width), right = cell_number((a->x + reach) / width);
        int64_t lower = cell_number((a->y - reach) / width), upper = cell_number((a->y + reach) / width);
        double cells = (double)(right - left + 1) * (double)(upper - lower + 1);
        if (cells > (double)s->disc_count)
            return search_all(s, i, extent_i, least);
        spend_work(s, CAROM_CELL_WORK * cells);
        for (int64_t row = lower; row <= upper; row++) {
            for (int64_t column = left; column <= right; column++) {
                for (Index j = g->first[list_of(g, level, row, column)]; j != NOBODY; j = s->discs[j].next) {
                    if (j != i)
                        least = test_or_wait(s, i, j, extent_i, least);
                }
            }
        }
    }
    return least;
}

/* ---- walls ---- */

/* Return a lower bound of the gap between disc i and any wall that never moves, in metres. The bound includes rounding
   errors.

   The bound is the gap at an earlier position of the disc, minus the distance from that position. For most discs, the
   bound proves that they are far from all walls, so that no wall must be examined. */
static inline double bound_clearance(const State *s, Index i, double extent_i) {
    const Disc *a = &s->discs[i];
    const Clearance *c = &s->clearances[i];
    double moved = fabs(a->x - c->x) + fabs(a->y - c->y);
    return c->gap - moved - a->radius - CAROM_PATH_MARGIN * (extent_i + s->wall_size + a->radius);
}

/* Return a lower bound of the distance of disc i's centre from wall k, in metres. `a` is the disc's motion relative to
   the wall. */
static inline double bound_wall_distance(State *s, const Disc *a, Index i, Index k) {
    const Wall *wall = &s->walls[k];
    if (!is_chain(s, k))
        return (a->x - wall->x) * wall->nx + (a->y - wall->y) * wall->ny;
    const Chain *chain = &s->chains[k];
    Index edge = near_edge(s, i, k);
    double distance = bound_distance(chain, a->x, a->y, &edge) - chain->half_width;
    if (distance < s->clearances[i].gap)
        s->clearances[i].edge = chain->edges - s->edges + edge;
    return distance;
}

/* Return a lower bound of a disc's distance from wall k (see `bound_wall_distance`). If wall k never moves, also reduce
   the disc's clearance to the returned bound. */
static inline double find_distance(State *s, Index i, const Disc *relative, Index k) {
    double distance = bound_wall_distance(s, relative, i, k);
    if (wall_path(s, k) == NULL)
        s->clearances[i].gap = lesser(distance, s->clearances[i].gap);
    return distance;
}

/* Reset the clearance of disc i, before its distances from all walls are computed. */
static inline void begin_clearance(State *s, Index i) {
    const Disc *a = &s->discs[i];
    s->clearances[i] = (Clearance){a->x, a->y, CAROM_INF, s->clearances[i].edge};
}

/* Return the wait (time without an impact) of disc i and wall k, computed from their gap. For a driven wall, the wait
   is valid only until the wall's present leg (straight part of its path) ends. */
static inline double bound_wall(const State *s, Index i, Index k, const Disc *relative, double gap, double least) {
    if (is_chain(s, k))
        return bound_chain(s, relative, gap, least);
    if (is_leaving_plane(s, i, k))
        return CAROM_INF;
    if (s->motion == STRAIGHT)
        return bound_straight_plane(relative, &s->walls[k], gap);
    return bound_curved_plane(s, relative, &s->walls[k], gap, least);
}

/* If disc i and wall k may have an impact at this frame, add their test. Return the smaller of `least` and the wait of
   disc i and wall k. */
static inline double test_wall_or_wait(State *s, Index i, Index k, double extent_i, double least) {
    Disc relative;
    const Disc *a = relative_to_wall(s, &s->discs[i], k, &relative);
    const Path *path = wall_path(s, k);
    double margin = CAROM_PATH_MARGIN * (extent_i + s->wall_size + a->radius);
    double gap = find_distance(s, i, a, k) - a->radius - margin;
    double wait = bound_wall(s, i, k, a, gap, least);
    if (gap <= 0.0)
        add_touching(s, -1 - k);
    if (path != NULL && path->legs[path->leg].end < s->now + lesser(wait, least))
        wait = greater(path->legs[path->leg].end - s->now, bound_on_any_leg(s, path, &s->discs[i], gap));
    if (wait == CAROM_IN_CONTACT) {
        add_test(s, test_of(s->disc_count + i, k));
        wait = 0.0;
    }
    return wait < least ? wait : least;
}

/* Return the smallest of `least` and the waits of disc i with all walls (see `test_wall_or_wait`), except walls that
   are certainly too far away. */
static inline double search_walls(State *s, Index i, double extent_i, double least) {
    const Disc *a = &s->discs[i];
    double speed = (fabs(a->vx) + fabs(a->vy)) * (1.0 + CAROM_PATH_MARGIN);
    bool is_clear = stays_open(bound_clearance(s, i, extent_i), speed, s->pull, least);
    if (is_clear && s->wall_motions == NULL)
        return least;
    if (!is_clear)
        begin_clearance(s, i);
    for (Index k = 0; k < s->wall_count; k++) {
        if (!is_clear || wall_path(s, k) != NULL)
            least = test_wall_or_wait(s, i, k, extent_i, least);
    }
    s->counts.pair_tests += s->wall_count;
    return least;
}

/* ---- all bodies ---- */

/* Add the tests of a disc that can find an impact at this frame. Also compute when the disc is due (may have an impact)
   again. Before this call, all discs that are due at this frame must have been put into their present cells. */
static inline void schedule_disc(State *s, Index i) {
    const Disc *a = &s->discs[i];
    const Path *path = disc_path(s, i);
    /* a disc that never moves needs no search of its own, because the searches of other discs find its impacts */
    if (a->inverse_mass == 0.0 && path == NULL) {
        s->due[i] = CAROM_INF;
        return;
    }
    Index tests = s->counts.pair_tests;
    Index first = s->touching.count;
    double extent_i = extent_of(s, a);
    double least = time_in_leeway(s, a, CAROM_PATH_MARGIN * extent_i);
    least = path != NULL ? lesser(path->legs[path->leg].end - s->now, least) : search_walls(s, i, extent_i, least);
    least = s->grid.list_count == 0 ? search_all(s, i, extent_i, least) : search_cells(s, i, extent_i, least);
    s->due[i] = (s->now + least) * (1.0 - CAROM_TIME_MARGIN);
    s->searches[i] = (Search){s->counts.frames, first, s->touching.count - first, false};
    spend_work(s, CAROM_DISC_WORK + CAROM_BODY_WORK * (double)(s->counts.pair_tests - tests));
}

static inline void reschedule_disc(State *s, Index i) {
    schedule_disc(s, i);
    s->next_due = lesser(s->due[i], s->next_due);
}

/* After an impact has changed the velocity of disc i, add its tests with the bodies that it may touch. */
static inline void test_touching(State *s, Index i) {
    const Search *search = &s->searches[i];
    const Disc *a = &s->discs[i];
    for (Index n = 0; n < search->count; n++) {
        Index body = s->touching.bodies[search->first + n];
        if (body < 0) {
            add_test(s, test_of(s->disc_count + i, -1 - body));
        } else {
            const Disc *b = &s->discs[body];
            double along = (b->x - a->x) * (b->vx - a->vx) + (b->y - a->y) * (b->vy - a->vy);
            if (along < 0.0 && !are_separating(s, i, body))
                add_test(s, i < body ? test_of(i, body) : test_of(body, i));
        }
    }
}

/* An impact at this frame has changed the velocity of a disc. Add the tests of the disc that can find an impact because
   of the new velocity. At the end of the frame, the code computes again when the disc is due. */
static inline void follow_impact(State *s, Index i) {
    Search *search = &s->searches[i];
    if (s->discs[i].inverse_mass == 0.0) /* impacts do not change the disc's path */
        return;
    if (search->frame != s->counts.frames) {
        update_cell(s, i);
        reschedule_disc(s, i);
        return;
    }
    if (!search->is_stale) {
        s->stale_discs[s->stale_count] = (int)i;
        s->stale_count += 1;
        search->is_stale = true;
    }
    test_touching(s, i);
}

/* After all tests of a frame, schedule again each disc whose path was changed by an impact. */
static inline void schedule_stale(State *s) {
    /* from here on `add_test` ignores all tests, because no further test is made at this frame */
    s->pending.last = LAST_TEST;
    for (Index k = 0; k < s->stale_count; k++)
        reschedule_disc(s, s->stale_discs[k]);
}
