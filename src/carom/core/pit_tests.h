/* One frame of Algorithm 1: all its tests, or only those that can find something.

   Each disc keeps one time before which it is not due: that of the earliest impact that it could have with any of the
   discs around it or with a wall, or of leaving its leeway. No impact is missed, because of any two discs the one that
   was scheduled later saw the other on its present path. So until they can meet, one of the two is due. */

#ifndef CAROM_PIT_TESTS_H
#define CAROM_PIT_TESTS_H

#include "carom/core/constants.h"
#include "carom/core/double_double.h"
#include "carom/core/pit_bounds.h"
#include "carom/core/pit_grid.h"
#include "carom/core/pit_impacts.h"
#include "carom/core/pit_motion.h"
#include "carom/core/pit_pending.h"

/* ---- whether skipping pays ---- */

/* Return the number of tests of a frame. */
static inline double plain_work(const State *s) {
    return (double)s->disc_count * (0.5 * (double)(s->disc_count - 1) + (double)s->wall_count);
}

/* Decide whether the next frame is looped plainly: if asked for, or while the cost of skipping is earned back.

   To skip, all discs must be scheduled first, and bounds that have run out meanwhile are computed again. So skipping
   that costs more than plain looping is given up only after a while, and is tried again after a longer one. */
static inline bool loops_plainly(State *s) {
    if (!s->skips)
        return true;
    if (s->excess > s->max_waste * s->first_search)
        s->pays_back = true;
    else if (s->excess <= 0.0)
        s->pays_back = false;
    return s->pays_back;
}

/* Account for work of skipping. */
static inline void spend(State *s, double work) {
    s->work -= work;
    s->excess += work;
}

/* Account for frames that were not looped plainly. */
static inline void save(State *s, Index frames) {
    s->excess = greater(s->excess - (double)frames * plain_work(s), -CAROM_SAVED_FRAMES * plain_work(s));
}

/* Pass frames, up to `until`, at which no disc is due; return whether there were any. */
static inline bool skip_frames(State *s, Index until) {
    Index last = s->disc_count - 1;
    Index count = 0;
    Index most = until - s->counts.frames < MAX_STEPS ? until - s->counts.frames : MAX_STEPS;
    while (count < most) {
        double time = frame_time(&s->clock, s->counts.frames + count);
        if (time >= s->next_due)
            break;
        s->steps[count] = time - s->now;
        s->now = time;
        count += 1;
    }
    if (count == 0)
        return false;
    for (Index i = 0; i <= last; i += 2)
        advance_two(&s->discs[i], &s->discs[i < last ? i + 1 : last], s->steps, count);
    s->counts.frames += count;
    save(s, count);
    s->work -= (double)(count * s->disc_count);
    return true;
}

/* ---- all tests of a frame ---- */

/* Make every test of the next frame, as long as there is work left; `row` is where to go on. */
static inline void test_all(State *s) {
    Index n = s->disc_count;
    if (s->row == 0)
        advance_to_next_frame(s);
    while (s->row < n) {
        Index i = s->row;
        for (Index j = i + 1; j < n; j++) {
            if (pair_interferes(s, i, j)) {
                apply_pair_impact(s, i, j);
                s->due[i] = s->due[j] = s->now;
            }
        }
        s->row += 1;
        s->work -= (double)(n - i);
        if (s->work <= 0.0 && s->row < n)
            return;
    }
    for (Index i = 0; i < n; i++) {
        for (Index k = 0; k < s->wall_count; k++) {
            if (wall_interferes(s, i, k)) {
                apply_wall_impact(s, i, k);
                s->due[i] = s->now;
            }
        }
    }
    s->row = 0;
    s->next_due = s->now;
    s->counts.pair_tests += (Index)plain_work(s);
    s->counts.tested += 1;
    s->counts.frames += 1;
    s->work -= (double)(n * s->wall_count);
    s->excess -= CAROM_EXCESS_PART * plain_work(s);
}

/* ---- the tests that can find something ---- */

/* Add the test of two discs if it is due now; return the lesser of `least` and how long the two can wait. */
static inline double test_or_wait(State *s, Index i, Index j, double extent_i, double least) {
    s->counts.pair_tests += 1;
    if (are_separating(s, i, j))
        return least;
    double wait = bound_pair_wait(s, &s->discs[i], &s->discs[j], extent_i);
    if (wait == CAROM_IN_CONTACT) {
        add_test(s, i < j ? test_of(i, j) : test_of(j, i));
        return 0.0;
    }
    return wait < least ? wait : least;
}

/* Search all discs; return as `test_or_wait`. */
static inline double search_all(State *s, Index i, double extent_i, double least) {
    for (Index j = 0; j < s->disc_count; j++) {
        if (j != i)
            least = test_or_wait(s, i, j, extent_i, least);
    }
    return least;
}

/* Search the cells of every level in which discs that disc i can touch may be; return as `test_or_wait`. */
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
        spend(s, CAROM_CELL_WORK * cells);
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

/* Add the tests of a disc with walls that are due now; return as `test_or_wait`. */
static inline double search_walls(State *s, Index i, double extent_i, double least) {
    const Disc *a = &s->discs[i];
    for (Index k = 0; k < s->wall_count; k++) {
        double wait;
        if (is_chain(s, k))
            wait = bound_chain_wait(a, &s->chains[k], extent_i);
        else if (a->last == ON_WALL - k)
            continue;
        else
            wait = bound_plane_wait(a, &s->walls[k], extent_i);
        if (wait == CAROM_IN_CONTACT) {
            add_test(s, test_of(s->disc_count + i, k));
            wait = 0.0;
        }
        least = wait < least ? wait : least;
    }
    s->counts.pair_tests += s->wall_count;
    return least;
}

/* Add the tests of a disc that are due at this frame, and find when it is due again. */
static inline void schedule_disc(State *s, Index i) {
    const Disc *a = &s->discs[i];
    if (a->inverse_mass == 0.0) { /* the disc that meets it schedules the test */
        s->due[i] = CAROM_INF;
        return;
    }
    Index tests = s->counts.pair_tests;
    update_cell(s, i);
    double extent_i = extent_of(s, a);
    double least = time_in_leeway(s, a, CAROM_PATH_MARGIN * extent_i);
    least = search_walls(s, i, extent_i, least);
    least = s->grid.list_count == 0 ? search_all(s, i, extent_i, least) : search_cells(s, i, extent_i, least);
    s->due[i] = (s->now + least) * (1.0 - CAROM_TIME_MARGIN);
    spend(s, CAROM_DISC_WORK + CAROM_BODY_WORK * (double)(s->counts.pair_tests - tests));
}

/* Schedule a disc whose path an impact has changed: at this very frame it may approach a body that it overlaps. */
static inline void reschedule_disc(State *s, Index i) {
    schedule_disc(s, i);
    s->next_due = s->due[i] < s->next_due ? s->due[i] : s->next_due;
}

/* Make the test whose turn it is. */
static inline void make_test(State *s) {
    Index first = (Index)(s->pending.last >> HALF_BITS);
    Index second = (Index)(s->pending.last & 0xFFFFFFFFu);
    if (first >= s->disc_count) {
        first -= s->disc_count;
        if (wall_interferes(s, first, second)) {
            apply_wall_impact(s, first, second);
            reschedule_disc(s, first);
        }
    } else if (pair_interferes(s, first, second)) {
        apply_pair_impact(s, first, second);
        reschedule_disc(s, second);
        reschedule_disc(s, first);
    }
}

/* List the discs that are due now, and note when the next one of the others is; return how many are due. */
static inline Index find_due(State *s) {
    Index count = 0;
    double next_due = CAROM_INF;
    for (Index i = 0; i < s->disc_count; i++) {
        double due = s->due[i];
        s->due_discs[count] = (int)i;
        count += due <= s->now;
        if (s->now < due && due < next_due)
            next_due = due;
    }
    s->next_due = next_due;
    return count;
}

/* Make those tests of the next frame that can find something. */
static inline void test_due(State *s) {
    advance_to_next_frame(s);
    s->counts.frames += 1;
    s->work -= (double)s->disc_count;
    Index count = find_due(s);
    if (count > 0) {
        s->counts.tested += 1;
        s->pending.last = NO_TEST;
        for (Index k = 0; k < count; k++)
            schedule_disc(s, s->due_discs[k]);
        while (next_test(&s->pending))
            make_test(s);
        for (Index k = 0; k < count; k++)
            s->next_due = lesser(s->due[s->due_discs[k]], s->next_due);
        if (s->counts.frames == 1)
            s->first_search = s->excess;
    }
    save(s, 1);
}

#endif
