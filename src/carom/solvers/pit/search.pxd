"""Looking around a disc: until when nothing can happen to it, and which of its tests are due at this very frame.

Each disc keeps one time before which it is not due. It is that of the earliest impact that it could have with any of the
discs then around it, with a wall, or of leaving its leeway. That no impact is missed rests on this: of any two discs,
whichever was looked around later saw the other on its present path; so until they can meet, one of the two is due.
"""

from carom.solvers.event_driven.layout cimport INF, NOBODY, Index
from carom.solvers.pit.bounds cimport IN_CONTACT, MARGIN, due_time, extent, pair_wait, wall_wait
from carom.solvers.pit.grid cimport REACH_MARGIN, cell_number, chain_of, settle, time_in_leeway
from carom.solvers.pit.layout cimport State
from carom.solvers.pit.turns cimport ask, pair_turn, wall_turn

cdef extern from *:
    """
    /* What it costs to look around a disc, into a cell, and at a body: in tests of plain looping. Fitted to the times of
       some hundred gases, crowds and lattices, and rounded up. */
    #define carom_DISC_WORK 24.0
    #define carom_CELL_WORK 6.0
    #define carom_BODY_WORK 3.0
    """
    const double DISC_WORK "carom_DISC_WORK"
    const double CELL_WORK "carom_CELL_WORK"
    const double BODY_WORK "carom_BODY_WORK"


cdef inline void spend(State *s, double work) noexcept nogil:
    """Note work of skipping."""
    s.work -= work
    s.excess += work


cdef inline double ask_or_wait(State *s, Index i, Index j, double extent_i, double least) noexcept nogil:
    """Ask for the test of two discs if it is due now; return the lesser of `least` and how long the two can wait."""
    s.counts.pair_tests += 1
    wait = pair_wait(s, &s.discs[i], &s.discs[j], extent_i)
    if wait == IN_CONTACT:
        ask(s, pair_turn(i, j))
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
    if a.inverse_mass == 0.0:  # whoever meets it sees it
        s.due[i] = INF
        return
    tests = s.counts.pair_tests
    settle(s, i)
    extent_i = extent(s, a)
    least = time_in_leeway(s, a, MARGIN * extent_i)
    for k in range(s.wall_count):
        wait = wall_wait(a, &s.walls[k], extent_i)
        if wait == IN_CONTACT:
            ask(s, wall_turn(s.disc_count, i, k))
            wait = 0.0
        least = wait if wait < least else least
    s.counts.pair_tests += s.wall_count
    if s.grid.chains == 0:
        least = search_all(s, i, extent_i, least)
    else:
        least = search_cells(s, i, extent_i, least)
    s.due[i] = due_time(s.now, least)
    spend(s, DISC_WORK + BODY_WORK * (s.counts.pair_tests - tests))
