"""One frame of Algorithm 1: all its tests, or those only that can find something."""

from carom.solvers.event_driven.layout cimport INF, Index
from carom.solvers.pit.impacts cimport collide_pair, collide_wall
from carom.solvers.pit.interference cimport discs_interfere, wall_interferes
from carom.solvers.pit.layout cimport State
from carom.solvers.pit.motion cimport go_to_next_frame, skip_frames
from carom.solvers.pit.search cimport look_around
from carom.solvers.pit.turns cimport FIRST_TURN, HALF, next_turn

cdef extern from *:
    """
    /* Where skipping has not paid, frames are looped plainly until it has cost no more than this part of them. */
    #define carom_EXCESS_PART 0x1p-6
    /* What has been saved counts for so many frames. */
    #define carom_SAVED_FRAMES 64.0
    """
    const double EXCESS_PART "carom_EXCESS_PART"
    const double SAVED_FRAMES "carom_SAVED_FRAMES"


cdef inline double plain_work(const State *s) noexcept nogil:
    """Return the number of tests of a frame."""
    return s.disc_count * (0.5 * (s.disc_count - 1) + s.wall_count)


cdef inline bint loops_plainly(State *s) noexcept nogil:
    """Decide whether the next frame is looped plainly: asked for, or while what skipping has cost is earned back.

    To skip, all discs must be looked around first, and bounds that have run out meanwhile are found anew. So skipping
    that costs more than plain looping is given up only after a while, and is tried again after a longer one.
    """
    if not s.skips:
        return True
    if s.excess > s.patience * s.first_look:
        s.pays_back = True
    elif s.excess <= 0.0:
        s.pays_back = False
    return s.pays_back


cdef inline void save(State *s, Index frames) noexcept nogil:
    """Note that some frames have not been looped plainly."""
    plain = plain_work(s)
    s.excess -= frames * plain
    if s.excess < -SAVED_FRAMES * plain:
        s.excess = -SAVED_FRAMES * plain


cdef inline void test_all(State *s) noexcept nogil:
    """Make every test of the next frame, as long as there is work left; `s.row` says where to go on."""
    cdef Index i, j, k
    cdef Index n = s.disc_count
    if s.row == 0:
        go_to_next_frame(s)
    while s.row < n:
        i = s.row
        for j in range(i + 1, n):
            if discs_interfere(&s.discs[i], &s.discs[j]):
                collide_pair(s, i, j)
                s.due[i] = s.due[j] = s.now
        s.row += 1
        s.work -= n - i
        if s.work <= 0.0 and s.row < n:
            return
    for i in range(n):
        for k in range(s.wall_count):
            if wall_interferes(&s.discs[i], &s.walls[k]):
                collide_wall(s, i, k)
                s.due[i] = s.now
    s.row = 0
    s.next_look = s.now
    s.counts.pair_tests += <Index>plain_work(s)
    s.counts.looked_at += 1
    s.counts.frames += 1
    s.work -= n * s.wall_count
    s.excess -= EXCESS_PART * plain_work(s)


cdef inline Index find_due(State *s) noexcept nogil:
    """List the discs that are due now, and note when the next one of the others is; return how many are due."""
    cdef Index i
    cdef Index count = 0
    cdef double next_look = INF
    for i in range(s.disc_count):
        due = s.due[i]
        s.looking[count] = <int>i
        count += <Index>(due <= s.now)
        if s.now < due < next_look:
            next_look = due
    s.next_look = next_look
    return count


cdef inline void make_test(State *s) noexcept nogil:
    """Make the test whose turn it is; whom an impact has turned may approach at this very frame what it overlaps."""
    cdef Index n = s.disc_count
    cdef Index first = <Index>(s.turns.last >> HALF)
    cdef Index second = <Index>(s.turns.last & <unsigned long long>0xFFFFFFFF)
    if first >= n:
        first -= n
        if not wall_interferes(&s.discs[first], &s.walls[second]):
            return
        collide_wall(s, first, second)
        look_around(s, first)
    else:
        if not discs_interfere(&s.discs[first], &s.discs[second]):
            return
        collide_pair(s, first, second)
        look_around(s, second)
        s.next_look = s.due[second] if s.due[second] < s.next_look else s.next_look
        look_around(s, first)
    s.next_look = s.due[first] if s.due[first] < s.next_look else s.next_look


cdef inline bint skip(State *s, Index until) noexcept nogil:
    """Pass frames, up to `until`, at which no disc is due; return whether there were any."""
    frames = skip_frames(s, until)
    save(s, frames)
    s.work -= frames * s.disc_count
    return frames > 0


cdef inline void look(State *s) noexcept nogil:
    """Make those tests of the next frame that can find something."""
    cdef Index k, count, i
    go_to_next_frame(s)
    s.counts.frames += 1
    s.work -= s.disc_count
    count = find_due(s)
    if count == 0:
        save(s, 1)
        return
    s.counts.looked_at += 1
    s.turns.last = FIRST_TURN
    for k in range(count):
        look_around(s, s.looking[k])
    while next_turn(&s.turns):
        make_test(s)
    for k in range(count):
        due = s.due[s.looking[k]]
        if due < s.next_look:
            s.next_look = due
    if s.counts.frames == 1:
        s.first_look = s.excess
    save(s, 1)
