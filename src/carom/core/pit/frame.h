/* One frame of Algorithm 1 of the source paper: all tests of the frame, or only those that can find an impact.

   At a frame, an impact changes only velocities. So at each frame, the code searches only once for the bodies that a
   disc touches. After each impact of a disc at a frame, the disc is tested again with the bodies that it touches. After
   the last test of the frame, the code computes when the disc is due again (may have another impact). */

#pragma once

#include "carom/core/pit/interference_test.h"
#include "carom/core/pit/motion.h"
#include "carom/core/pit/schedule.h"
#include "carom/core/pit/pending_tests.h"

/* ---- frames at which nothing is tested ---- */

/* Advance over frames at which no disc is due (may have an impact), at most up to frame `until`. Return whether any
   frame was skipped. */
static inline bool skip_frames(State *s, Index until) {
    double before = s->now;
    Index count = 0;
    Index most = until - s->counts.frames < MAX_STEPS ? until - s->counts.frames : MAX_STEPS;
    while (count < most) {
        double time = frame_time(s, s->counts.frames + count);
        /* If the last tested frame had no impact, and this frame is at the same time, this frame has no impact. */
        if (time >= s->next_due && !(time == s->now && s->is_settled))
            break;
        s->steps[count] = time - s->now;
        s->times[count] = time;
        s->now = time;
        count += 1;
    }
    if (count == 0)
        return false;
    advance_over_frames(s, before, count);
    s->counts.frames += count;
    save_frames(s, count);
    s->work -= (double)(count * s->disc_count);
    return true;
}

/* ---- all tests of a frame ---- */

/* Make all tests of the next frame. If `State.work` is used up, return before all tests are made. The next call then
   continues at disc `State.row`. */
static inline void test_all(State *s) {
    Index n = s->disc_count;
    if (s->row == 0) {
        advance_to_next_frame(s);
        s->is_settled = true;
    }
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

/* Make the test with the number `pending.last`. */
static inline void make_test(State *s) {
    Index first = (Index)(s->pending.last >> HALF_BITS);
    Index second = (Index)(s->pending.last & 0xFFFFFFFFu);
    if (first >= s->disc_count) {
        first -= s->disc_count;
        if (wall_interferes(s, first, second)) {
            apply_wall_impact(s, first, second);
            follow_impact(s, first);
        }
    } else if (pair_interferes(s, first, second)) {
        apply_pair_impact(s, first, second);
        follow_impact(s, second);
        follow_impact(s, first);
    }
}

/* List the discs that are due now (may have an impact), and find the earliest time at which another disc is due. Return
   the number of discs in the list. */
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

/* Make the tests of the next frame that can find an impact. */
static inline void test_due(State *s) {
    advance_to_next_frame(s);
    limit_bounds(s);
    s->is_settled = true;
    s->counts.frames += 1;
    s->work -= (double)s->disc_count;
    Index count = find_due(s);
    if (count > 0) {
        s->counts.tested += 1;
        s->pending.last = NO_TEST;
        s->touching.count = 0;
        s->stale_count = 0;
        for (Index k = 0; k < count; k++)
            update_cell(s, s->due_discs[k]);
        for (Index k = 0; k < count; k++)
            schedule_disc(s, s->due_discs[k]);
        while (next_test(&s->pending))
            make_test(s);
        schedule_stale(s);
        for (Index k = 0; k < count; k++)
            s->next_due = lesser(s->due[s->due_discs[k]], s->next_due);
        if (s->counts.frames == 1)
            s->first_search = s->excess;
    }
    save_frames(s, 1);
}
