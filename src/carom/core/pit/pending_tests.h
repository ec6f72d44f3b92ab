/* Pending tests of a frame, in the order of Algorithm 1 of the source paper: first all pairs of discs i < j, then all
   pairs of a disc and a wall.

   The order of tests matters, because an impact changes the velocities that later tests read. Each test has a number,
   and a later test has a higher number. In the number of a test of discs i and j, the upper half is i and the lower
   half is j. For a test of disc i and wall k, the halves are disc_count + i and k. */

#pragma once

#include "carom/core/pit/state.h"

enum {
    NO_TEST = 0,    /* no test has this number, because it would test disc 0 with itself */
    HALF_BITS = 32, /* number of bits in half of a test's number */
};

#define LAST_TEST UINT64_MAX /* no test has a larger number */

static inline Test test_of(Index first, Index second) {
    return (Test)first << HALF_BITS | (Test)second;
}

/* Add a test at the present frame, unless this test or a later one has already been made. */
static inline void add_test(State *s, Test test) {
    Pending *t = &s->pending;
    if (test <= t->last)
        return;
    if (t->count == t->capacity) {
        Index capacity = 2 * t->capacity + 64;
        Test *heap = s->record.resize(t->heap, (size_t)t->count * sizeof(Test), (size_t)capacity * sizeof(Test));
        if (heap == NULL) {
            s->is_out_of_memory = true;
            return;
        }
        t->heap = heap;
        t->capacity = capacity;
    }
    Index place = t->count;
    t->count += 1;
    while (place > 0) {
        Index above = (place - 1) / 2;
        if (t->heap[above] <= test)
            break;
        t->heap[place] = t->heap[above];
        place = above;
    }
    t->heap[place] = test;
}

static inline Test pop_test(Pending *t) {
    Test test = t->heap[0];
    t->count -= 1;
    Test moved = t->heap[t->count];
    Index place = 0;
    Index below = 1;
    while (below < t->count) {
        if (below + 1 < t->count && t->heap[below + 1] < t->heap[below])
            below += 1;
        if (moved <= t->heap[below])
            break;
        t->heap[place] = t->heap[below];
        place = below;
        below = 2 * below + 1;
    }
    t->heap[place] = moved;
    return test;
}

/* Set `last` to the next remaining test. Return false if no test remains. If a test was added twice, it is made only
   once. */
static inline bool next_test(Pending *t) {
    while (t->count > 0) {
        Test test = pop_test(t);
        if (test > t->last) {
            t->last = test;
            return true;
        }
    }
    return false;
}
