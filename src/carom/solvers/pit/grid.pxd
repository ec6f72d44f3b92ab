"""The broad phase: which discs are near each other, whatever their sizes and wherever they go.

Discs of about one size (within a factor of 2) lie on a level of square cells of an unbounded plane. A cell's number is
folded into a fixed number of chains; what lies in another cell of the same chain is told apart by its distance.

A disc is put into its cell when somebody looks around it, and may go on from there by the `leeway` of its level before
it is due again. So two discs that can touch lie, as they were put, no further apart than their `reach` and radius and
leeway say. Cells decide when a pair is tested, never what is found.
"""

from libc.math cimport fabs, sqrt

from carom.constants cimport LAST_CELL, LEVEL_STEP, REACH_MARGIN, ROW_STEP
from carom.solvers.impact.structs cimport NOBODY, Index
from carom.solvers.pit.layout cimport NOWHERE, Disc, Grid, State

ctypedef unsigned long long Hash

cdef inline long long cell_number(double place) noexcept nogil:
    """Return the row or column in which a place, counted in cells, lies. It never falls as the place grows."""
    cdef long long number
    if not fabs(place) < LAST_CELL:
        if place != place:
            return 0
        place = LAST_CELL if place > 0.0 else -LAST_CELL
    number = <long long>place
    return number - <long long>(number > place)


cdef inline Index chain_of(const Grid *g, Index level, long long row, long long column) noexcept nogil:
    return <Index>((<Hash>column + <Hash>row * ROW_STEP + <Hash>level * LEVEL_STEP) & <Hash>(g.chains - 1))


cdef inline void settle(State *s, Index i) noexcept nogil:
    """Put a disc into the cell in which it is now."""
    cdef Index chain
    g = &s.grid
    a = &s.discs[i]
    if g.chains == 0:
        return
    width = g.levels[a.level].width
    chain = chain_of(g, a.level, cell_number(a.y / width), cell_number(a.x / width))
    if chain == a.cell:
        return
    if a.cell != NOWHERE:
        link = &g.first[a.cell]
        while link[0] != i:
            link = &s.discs[link[0]].next
        link[0] = a.next
    a.cell = <int>chain
    a.next = g.first[chain]
    g.first[chain] = <int>i


cdef inline double time_in_leeway(const State *s, const Disc *a, double margin) noexcept nogil:
    """Return for how long a disc that has just been put into its cell stays within its leeway, seconds.

    `margin` is what the roundings of its path can amount to, metres.
    """
    if s.grid.chains == 0:
        return s.horizon
    speed = sqrt(a.vx * a.vx + a.vy * a.vy)
    left = s.grid.levels[a.level].leeway - margin
    if speed * s.horizon <= left:
        return s.horizon
    return left / speed if left > 0.0 else 0.0
