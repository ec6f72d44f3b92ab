"""The broad phase: which discs are near each other, whatever their sizes and wherever they go.

Discs of about one size (within a factor of 2) lie on a level of square cells, so that a few large ones do not make the
cells of all the others large. The plane is not bounded: a cell's number is folded into a fixed number of chains, cells of
one row side by side, and what lies in another cell of the same chain is told apart by its distance.

A disc is put into the cell in which it is when somebody looks around it, and may go on from there by the `leeway` of its
level before it is due again. So two discs that can touch lie, as they were put, no further apart than their `reach` and
radius and leeway say. Cells decide when a pair is tested, never what is found.
"""

from libc.math cimport fabs, sqrt

from carom.solvers.event_driven.layout cimport NOBODY, Index
from carom.solvers.pit.layout cimport MOST_LEVELS, NOWHERE, Disc, Grid, Level, State

ctypedef unsigned long long Hash

cdef enum:
    #: Up to so many discs, all count as near each other. Measured: looking through nine cells costs as much.
    FEW_DISCS = 36
    CHAINS_PER_DISC = 2  # at least, so that most cells have one of their own

cdef extern from *:
    """
    /* Odd, 2^64 over the golden ratio: rows are spread evenly over any power of 2 of chains (D. E. Knuth, TAOCP vol. 3,
       6.4), and columns stay side by side. */
    #define carom_ROW_STEP 0x9E3779B97F4A7C15ull
    #define carom_LEVEL_STEP 0xC2B2AE3D27D4EB4Full
    /* Cells further out than this are one. Floats that large still have a place for halves. */
    #define carom_LAST_CELL 0x1p51
    /* Leeway of a level, in parts of the mean distance of its discs and of their largest radius: the more, the seldomer
       a disc must be put into its cell anew, and the more discs are near it. Measured at packings .05 to .6. */
    #define carom_LEEWAY 0.2
    #define carom_LEAST_LEEWAY 0.25
    /* What the roundings of a cell's number and of a reach are together, many times over. */
    #define carom_REACH_MARGIN 0x1p-20
    """
    const Hash ROW_STEP "carom_ROW_STEP"
    const Hash LEVEL_STEP "carom_LEVEL_STEP"
    const double LAST_CELL "carom_LAST_CELL"
    const double LEEWAY "carom_LEEWAY"
    const double LEAST_LEEWAY "carom_LEAST_LEEWAY"
    const double REACH_MARGIN "carom_REACH_MARGIN"


# ---- laying it out ----

cdef inline double larger(double a, double b) noexcept nogil:
    return a if a > b else b


cdef inline double spacing(const State *s, Index discs) noexcept nogil:
    """Return the mean distance of so many discs in the rectangle that all discs fill at the start; 0 where that is empty."""
    cdef Index i
    x0 = x1 = s.discs[0].x
    y0 = y1 = s.discs[0].y
    for i in range(1, s.disc_count):
        a = &s.discs[i]
        x0 = a.x if a.x < x0 else x0
        x1 = larger(x1, a.x)
        y0 = a.y if a.y < y0 else y0
        y1 = larger(y1, a.y)
    return sqrt((x1 - x0) / discs * (y1 - y0))


cdef inline Index level_of(double radius, double largest) noexcept nogil:
    """Return how often the largest radius can be halved before it is this one or less than twice it."""
    cdef Index level = 0
    while level < MOST_LEVELS - 1 and radius * 2.0 <= largest:
        largest *= 0.5
        level += 1
    return level


cdef inline void choose_levels(State *s) noexcept nogil:
    """Choose the levels of a run, leaving out those without a disc, and give every disc its own."""
    cdef Index i, k
    cdef double radius[MOST_LEVELS]
    cdef Index discs[MOST_LEVELS]
    cdef int number[MOST_LEVELS]
    cdef double largest = 0.0
    for i in range(s.disc_count):
        largest = larger(largest, s.discs[i].radius)
    for k in range(MOST_LEVELS):
        radius[k], discs[k] = 0.0, 0
    for i in range(s.disc_count):
        k = level_of(s.discs[i].radius, largest)
        s.discs[i].level = <int>k
        discs[k] += 1
        radius[k] = larger(radius[k], s.discs[i].radius)
    for k in range(MOST_LEVELS):
        number[k] = <int>s.grid.level_count
        if discs[k] > 0:
            leeway = larger(LEEWAY * spacing(s, discs[k]), LEAST_LEEWAY * radius[k])
            s.grid.levels[s.grid.level_count] = Level(2.0 * (radius[k] + leeway), leeway, radius[k] + leeway, discs[k])
            s.grid.level_count += 1
    for i in range(s.disc_count):
        s.discs[i].level = number[s.discs[i].level]


cdef inline Index chain_count(Index discs) noexcept nogil:
    """Return the number of chains for so many discs: a power of 2, or 0 where all are near each other."""
    cdef Index chains = 1
    if discs <= FEW_DISCS:
        return 0
    while chains < CHAINS_PER_DISC * discs:
        chains *= 2
    return chains


# ---- who is where ----

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
