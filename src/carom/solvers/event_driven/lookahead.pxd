"""What the next event will need is fetched from memory while this one is dealt with: no result depends on it.

Each piece says only where the next one is: a disc, then its partner and its cells, then the discs in these.
"""

from carom.solvers.event_driven.grid cimport cells_around, tile_of
from carom.solvers.event_driven.layout cimport *

cdef extern from *:
    """
    #if defined(__GNUC__)
    /* GCC takes a function that does nothing but prefetch for one without effect, and leaves its calls out: hence the
       empty statement. */
    #define carom_fetch(place) do { __builtin_prefetch(place); __asm__ volatile (""); } while (0)
    #else
    #define carom_fetch(place) ((void)(place))
    #endif
    """
    void fetch "carom_fetch" (const void *place) noexcept nogil


cdef inline void fetch_disc(const State *s, Index i) noexcept nogil:
    match = s.queue.level[1] + (i >> 3)
    fetch(s.discs + i)
    fetch(s.predictions + i)
    fetch(s.queue.time + i)
    fetch(s.queue.time + match)
    fetch(s.queue.holder + match)
    if s.record.wanted:
        fetch(s.record.recent + i)


cdef inline void fetch_cells(const State *s, Index i) noexcept nogil:
    cdef Index line
    block = cells_around(s, i)
    for line in range(3):
        cells = s.grid.cells + block.first + line * block.to_line
        fetch(cells)
        fetch(&cells[2].disc[PLACES - 1])
    cdef Index cell = s.predictions[i].cell
    fetch(s.grid.list_of + tile_of(&s.grid, cell >> COLUMN_BITS, cell & COLUMN_MASK))


cdef inline void fetch_surroundings(const State *s, Index i) noexcept nogil:
    """Fetch the rows of disc `i`'s partner, and the cells around disc `i`."""
    cdef Index partner = s.predictions[i].partner
    cdef Index last = s.discs[i].last
    if partner != NOBODY:
        fetch(s.discs + partner)
        fetch(s.predictions + partner)
        fetch(s.queue.time + partner)
        if s.record.wanted:
            fetch(s.record.recent + partner)
    fetch(s.discs + (last if last > 0 else 0))
    fetch_cells(s, i)


cdef inline void fetch_neighbours(const State *s, Index i) noexcept nogil:
    cdef Index line, k, place, j
    block = cells_around(s, i)
    for line in range(3):
        for k in range(3):
            cell = s.grid.cells + block.first + line * block.to_line + k
            for place in range(PLACES):
                j = cell.disc[place]
                fetch(s.discs + (j if j > 0 else 0))


cdef inline void fetch_partner_cells(const State *s, Index i) noexcept nogil:
    if s.predictions[i].partner != NOBODY:
        fetch_cells(s, s.predictions[i].partner)
