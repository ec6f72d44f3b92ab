"""One frame of Algorithm 1: all its tests, or those only that can find something.

Discs are moved frame by frame, ``x += v dt`` with each product and sum rounded, as the definition does: so a disc can't
be taken over many frames in one step, but it can be taken over many frames before the next disc is.

Each disc keeps one time before which it is not due: that of the earliest impact that it could have with any of the
discs then around it, with a wall, or of leaving its leeway. That no impact is missed rests on this: of any two discs,
whichever was looked around later saw the other on its present path; so until they can meet, one of the two is due.
"""

from carom.constants cimport (
    BODY_WORK, CELL_WORK, DISC_WORK, EXCESS_PART, IN_CONTACT, INF, PATH_MARGIN, REACH_MARGIN, SAVED_FRAMES, TIME_MARGIN,
)
from carom.solvers.impact.structs cimport NOBODY, Index
from carom.solvers.pit.bounds cimport extent, finite_wait, pair_wait, wall_wait
from carom.solvers.pit.grid cimport cell_number, chain_of, settle, time_in_leeway
from carom.solvers.pit.impacts cimport collide_pair, collide_wall, discs_interfere, discs_part, is_due
from carom.solvers.pit.layout cimport MOST_STEPS, ON_WALL, Clock, Disc, State
from carom.solvers.pit.pending cimport NO_TEST, HALF, ask, next_test, test_of

# ---- whether skipping pays ----

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
    if s.excess > s.most_waste * s.first_look:
        s.pays_back = True
    elif s.excess <= 0.0:
        s.pays_back = False
    return s.pays_back


cdef inline void spend(State *s, double work) noexcept nogil:
    """Note work of skipping."""
    s.work -= work
    s.excess += work


cdef inline void save(State *s, Index frames) noexcept nogil:
    """Note that some frames have not been looped plainly."""
    s.excess = max(s.excess - frames * plain_work(s), -SAVED_FRAMES * plain_work(s))


# ---- from frame to frame ----

cdef inline double frame_time(const Clock *clock, Index frame) noexcept nogil:
    """Return the instant of a frame, seconds since the start."""
    return frame * clock.step / clock.rate


cdef inline void move_two(Disc *a, Disc *b, const double *steps, Index count) noexcept nogil:
    """Take two discs over some steps, one after the other; two at a time, as each sum waits for the one before it."""
    cdef Index k
    ax, ay, avx, avy = a.x, a.y, a.vx, a.vy
    bx, by, bvx, bvy = b.x, b.y, b.vx, b.vy
    for k in range(count):
        ax += avx * steps[k]
        ay += avy * steps[k]
        bx += bvx * steps[k]
        by += bvy * steps[k]
    if a.inverse_mass != 0.0:
        a.x, a.y = ax, ay
    if b.inverse_mass != 0.0:
        b.x, b.y = bx, by


cdef inline void fall(const State *s, double *centre, double *velocity, double step) noexcept nogil:
    """Take a disc along its parabola."""
    centre[0] += step * (velocity[0] + 0.5 * s.gx * step)
    centre[1] += step * (velocity[1] + 0.5 * s.gy * step)
    velocity[0] += s.gx * step
    velocity[1] += s.gy * step


cdef inline void go_to_next_frame(State *s) noexcept nogil:
    """Take every disc to the frame that comes next."""
    cdef Index i
    time = frame_time(&s.clock, s.counts.frames)
    step = time - s.now
    if s.counts.frames > 0:
        for i in range(s.disc_count):
            disc = &s.discs[i]
            if disc.inverse_mass == 0.0:
                continue
            if s.falls:
                fall(s, &disc.x, &disc.vx, step)
            else:
                disc.x += disc.vx * step
                disc.y += disc.vy * step
    s.now = time


cdef inline bint skip(State *s, Index until) noexcept nogil:
    """Pass frames, up to `until`, at which no disc is due; return whether there were any."""
    cdef Index i
    cdef Index last = s.disc_count - 1
    cdef Index count = 0
    cdef Index most = min(until - s.counts.frames, MOST_STEPS)
    while count < most:
        time = frame_time(&s.clock, s.counts.frames + count)
        if time >= s.next_look:
            break
        s.steps[count] = time - s.now
        s.now = time
        count += 1
    if count == 0:
        return False
    for i in range(0, last + 1, 2):
        move_two(&s.discs[i], &s.discs[min(i + 1, last)], s.steps, count)
    s.counts.frames += count
    save(s, count)
    s.work -= count * s.disc_count
    return True


# ---- all tests of a frame ----

cdef inline void test_all(State *s) noexcept nogil:
    """Make every test of the next frame, as long as there is work left; `s.row` says where to go on."""
    cdef Index i, j, k
    cdef Index n = s.disc_count
    if s.row == 0:
        go_to_next_frame(s)
    while s.row < n:
        i = s.row
        for j in range(i + 1, n):
            if discs_interfere(&s.discs[i], &s.discs[j]) and not discs_part(s, i, j):
                collide_pair(s, i, j)
                s.due[i] = s.due[j] = s.now
        s.row += 1
        s.work -= n - i
        if s.work <= 0.0 and s.row < n:
            return
    for i in range(n):
        for k in range(s.wall_count):
            if is_due(s, i, k):
                collide_wall(s, i, k)
                s.due[i] = s.now
    s.row = 0
    s.next_look = s.now
    s.counts.pair_tests += <Index>plain_work(s)
    s.counts.looked_at += 1
    s.counts.frames += 1
    s.work -= n * s.wall_count
    s.excess -= EXCESS_PART * plain_work(s)


# ---- those that can find something ----

cdef inline double ask_or_wait(State *s, Index i, Index j, double extent_i, double least) noexcept nogil:
    """Ask for the test of two discs if it is due now; return the lesser of `least` and how long the two can wait."""
    s.counts.pair_tests += 1
    if discs_part(s, i, j):
        return least
    wait = pair_wait(s, &s.discs[i], &s.discs[j], extent_i)
    if wait == IN_CONTACT:
        ask(s, test_of(i, j) if i < j else test_of(j, i))
        return 0.0
    return wait if wait < least else least


cdef inline double search_all(State *s, Index i, double extent_i, double least) noexcept nogil:
    """Look through all discs; return as `ask_or_wait`."""
    cdef Index j
    for j in range(s.disc_count):
        if j != i:
            least = ask_or_wait(s, i, j, extent_i, least)
    return least


cdef inline double search_cells(State *s, Index i, double extent_i, double least) noexcept nogil:
    """Look through the cells of every level in which discs that `i` can touch may lie; return as `ask_or_wait`."""
    cdef Index level, j
    cdef long long row, column, left, right, lower, upper
    g = &s.grid
    a = &s.discs[i]
    own = a.radius + g.levels[a.level].leeway
    for level in range(g.level_count):
        width = g.levels[level].width
        reach = (own + g.levels[level].reach) * (1.0 + REACH_MARGIN)
        left, right = cell_number((a.x - reach) / width), cell_number((a.x + reach) / width)
        lower, upper = cell_number((a.y - reach) / width), cell_number((a.y + reach) / width)
        cells = <double>(right - left + 1) * <double>(upper - lower + 1)
        if cells > s.disc_count:
            return search_all(s, i, extent_i, least)
        spend(s, CELL_WORK * cells)
        for row in range(lower, upper + 1):
            for column in range(left, right + 1):
                j = g.first[chain_of(g, level, row, column)]
                while j != NOBODY:
                    if j != i:
                        least = ask_or_wait(s, i, j, extent_i, least)
                    j = s.discs[j].next
    return least


cdef inline void look_around(State *s, Index i) noexcept nogil:
    """Ask for the tests of a disc that are due at this frame, and find out when it is due again."""
    cdef Index k
    a = &s.discs[i]
    if a.inverse_mass == 0.0:  # the disc that meets it sees it
        s.due[i] = INF
        return
    tests = s.counts.pair_tests
    settle(s, i)
    extent_i = extent(s, a)
    least = time_in_leeway(s, a, PATH_MARGIN * extent_i)
    for k in range(s.wall_count):
        if s.finite != NULL and s.finite[k].count > 0:
            wait = finite_wait(a, &s.finite[k], extent_i)
        elif a.last == ON_WALL - k:
            continue
        else:
            wait = wall_wait(a, &s.walls[k], extent_i)
        if wait == IN_CONTACT:
            ask(s, test_of(s.disc_count + i, k))
            wait = 0.0
        least = wait if wait < least else least
    s.counts.pair_tests += s.wall_count
    least = search_all(s, i, extent_i, least) if s.grid.chains == 0 else search_cells(s, i, extent_i, least)
    s.due[i] = (s.now + least) * (1.0 - TIME_MARGIN)
    spend(s, DISC_WORK + BODY_WORK * (s.counts.pair_tests - tests))


cdef inline void look_again(State *s, Index i) noexcept nogil:
    """Look around a disc that an impact has turned: it may approach at this very frame what it overlaps."""
    look_around(s, i)
    s.next_look = s.due[i] if s.due[i] < s.next_look else s.next_look


cdef inline void make_test(State *s) noexcept nogil:
    """Make the test whose turn it is."""
    cdef Index first = <Index>(s.pending.last >> HALF)
    cdef Index second = <Index>(s.pending.last & <unsigned long long>0xFFFFFFFF)
    if first >= s.disc_count:
        first -= s.disc_count
        if is_due(s, first, second):
            collide_wall(s, first, second)
            look_again(s, first)
    elif discs_interfere(&s.discs[first], &s.discs[second]):
        collide_pair(s, first, second)
        look_again(s, second)
        look_again(s, first)


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


cdef inline void look(State *s) noexcept nogil:
    """Make those tests of the next frame that can find something."""
    cdef Index k
    go_to_next_frame(s)
    s.counts.frames += 1
    s.work -= s.disc_count
    count = find_due(s)
    if count > 0:
        s.counts.looked_at += 1
        s.pending.last = NO_TEST
        for k in range(count):
            look_around(s, s.looking[k])
        while next_test(&s.pending):
            make_test(s)
        for k in range(count):
            s.next_look = min(s.next_look, s.due[s.looking[k]])
        if s.counts.frames == 1:
            s.first_look = s.excess
    save(s, 1)
