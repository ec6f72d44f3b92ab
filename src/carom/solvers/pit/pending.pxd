"""The tests that a frame still needs, in the order of Algorithm 1: all pairs (i, j), i < j, then all discs and walls.

An impact changes what the tests after it see, so tests that are not left out keep that order. A test is a number that
grows in it: i in the upper half and j in the lower, or discs + i and k.
"""

from libc.stdlib cimport realloc

from carom.solvers.impact.structs cimport Index
from carom.solvers.pit.layout cimport Pending, State, Test

cdef enum:
    NO_TEST = 0  # no test has this number: a disc is not paired with itself
    HALF = 32  # bits


cdef inline Test test_of(Index first, Index second) noexcept nogil:
    return <Test>first << HALF | <Test>second


cdef inline void ask(State *s, Test test) noexcept nogil:
    """Ask for a test at this frame; not where its turn has passed, or is now."""
    t = &s.pending
    cdef Index place, above
    if test <= t.last:
        return
    if t.count == t.capacity:
        grown = <Test *>realloc(t.heap, (2 * t.capacity + 64) * sizeof(Test))
        if grown == NULL:
            s.no_memory = True
            return
        t.heap, t.capacity = grown, 2 * t.capacity + 64
    place = t.count
    t.count += 1
    while place > 0:
        above = (place - 1) // 2
        if t.heap[above] <= test:
            break
        t.heap[place] = t.heap[above]
        place = above
    t.heap[place] = test


cdef inline bint next_test(Pending *t) noexcept nogil:
    """Take the next test off, as `t.last`; return whether there is one. What was asked for twice comes once."""
    cdef Index place, below
    while t.count > 0:
        test = t.heap[0]
        t.count -= 1
        moved = t.heap[t.count]
        place, below = 0, 1
        while below < t.count:
            if below + 1 < t.count and t.heap[below + 1] < t.heap[below]:
                below += 1
            if moved <= t.heap[below]:
                break
            t.heap[place] = t.heap[below]
            place, below = below, 2 * below + 1
        t.heap[place] = moved
        if test > t.last:
            t.last = test
            return True
    return False
