"""The broad phase: square cells that tell which discs are near each other.

A cell is wider than the largest sum of two radii, so discs whose cells are not neighbours are apart. The outermost cells
have no end outwards, so a disc is in some cell wherever it goes. Around them lies a ring of cells that stay empty, which
spares the scans all special cases. Cells decide when a pair is looked at, never what is found.
"""

from cython cimport likely, unlikely
from libc.math cimport fabs, sqrt

from carom.constants cimport CELL_MARGIN, CELLS_PER_DISC, CELLS_PER_FEATURE, COORDINATE_ERROR
from carom.physics.double_double cimport greater, lesser
from carom.physics.features cimport PLANE, Feature
from carom.solvers.event_driven.layout cimport *

cdef inline void note_sizes(Grid *g, const double *radius, Index discs, double factor) noexcept nogil:
    """Note the largest radius, the largest sum of two (that of a single disc with one of its own size), and the factor."""
    cdef Index i
    cdef double second = 0.0
    g.radius = 0.0
    for i in range(discs):
        second = greater(second, lesser(g.radius, radius[i]))
        g.radius = greater(g.radius, radius[i])
    g.reach = g.radius + (second if discs > 1 else g.radius)
    g.factor = factor


cdef inline void widen(Box *box, double x, double y) noexcept nogil:
    """Widen a box so that a point is in it."""
    box.left = lesser(box.left, x)
    box.right = greater(box.right, x)
    box.low = lesser(box.low, y)
    box.high = greater(box.high, y)


cdef inline Box box_of(const double *position, Index discs) noexcept nogil:
    """Return the box of some centres."""
    cdef Index i
    cdef Box box = Box(position[0], position[0], position[1], position[1])
    for i in range(1, discs):
        widen(&box, position[2 * i], position[2 * i + 1])
    return box


cdef inline double extent_of(const Feature *f) noexcept nogil:
    """Return a bound on the coordinates of a feature; of a plane, the distance of its line from the origin."""
    if f.kind == PLANE:
        return fabs(f.x.high * f.nx + f.y.high * f.ny)
    # A face lies between its ends, and so within its length of the first; an arc within its radius of the centre.
    return greater(fabs(f.x.high), fabs(f.y.high)) + f.size.high + f.half_width


cdef inline void choose_grid(
    Grid *g, const Box *box, Index discs, const Wall *walls, Index wall_count, const Feature *features,
    Index feature_count,
) noexcept nogil:
    """Choose the cells for discs that move in a box; an infinite `factor` makes a single one."""
    cdef Index i
    cdef double width = box.right - box.left
    cdef double height = box.high - box.low
    cdef double cells = CELLS_PER_DISC * discs + CELLS_PER_FEATURE * feature_count
    cdef double most = lesser(cells, MOST_COLUMNS)
    largest = greater(greater(fabs(box.left), fabs(box.right)), greater(fabs(box.low), fabs(box.high)))
    for i in range(wall_count):  # what a wall sends back has been as far as the wall
        largest = greater(largest, fabs(walls[i].x * walls[i].nx + walls[i].y * walls[i].ny))
    for i in range(feature_count):
        largest = greater(largest, extent_of(&features[i]))
    cell = (g.reach * (1.0 + CELL_MARGIN) + largest * COORDINATE_ERROR) * g.factor
    cell = greater(cell, sqrt(width / cells * height))
    cell = greater(cell, greater(width / most, height / most))
    g.x0 = box.left
    g.y0 = box.low
    g.width = g.reach
    g.columns = g.rows = 1
    if cell < INF:
        g.width = cell
        g.columns = <Index>greater(1.0, width / cell)
        g.rows = <Index>greater(1.0, height / cell)
    g.stride = g.columns + 2
    g.tiles = g.columns // 2 + 1


cdef inline Index cell_count(const Grid *g) noexcept nogil:
    return g.stride * (g.rows + 2)


cdef inline Index tile_count(const Grid *g) noexcept nogil:
    return g.tiles * (g.rows // 2 + 1)


cdef inline Index tile_of(const Grid *g, Index row, Index column) noexcept nogil:
    """Return the tile of a cell, a square of four; the ring is row 0 and column 0."""
    return (row >> 1) * g.tiles + (column >> 1)


cdef inline void put(State *s, Index i, Index row, Index column) noexcept nogil:
    """Put disc `i` into a cell; the ring is row 0 and column 0."""
    cell = &s.grid.cells[row * s.grid.stride + column]
    cdef Index k, head
    cdef Index taken = 0
    s.predictions[i].cell = <int>(row << COLUMN_BITS | column)
    for k in range(PLACES):
        taken += cell.disc[k] != NOBODY
    if likely(taken < PLACES):
        cell.disc[taken] = <int>i
        return
    head = cell.disc[PLACES - 1]
    if head > NOBODY:  # a disc of its own place until now: the last of the chain
        s.grid.chain[head] = NOBODY
    else:
        head = CHAINED - head
    s.grid.chain[i] = <int>head
    cell.disc[PLACES - 1] = <int>(CHAINED - i)


cdef inline void take(State *s, Index i, Index row, Index column) noexcept nogil:
    """Take disc `i` out of a cell."""
    cell = &s.grid.cells[row * s.grid.stride + column]
    chain = s.grid.chain
    cdef Index k, head, before
    cdef Index place = 0
    cdef Index taken = 0
    for k in range(PLACES):
        place += k * <Index>(cell.disc[k] == i)
        taken += cell.disc[k] != NOBODY
    if likely(cell.disc[PLACES - 1] >= NOBODY):
        cell.disc[place] = cell.disc[taken - 1]
        cell.disc[taken - 1] = NOBODY
        return
    head = CHAINED - cell.disc[PLACES - 1]
    if cell.disc[place] == i:  # its place falls to the first of the chain
        cell.disc[place] = <int>head
        head = chain[head]
    elif head == i:
        head = chain[i]
    else:
        before = head
        while chain[before] != i:
            before = chain[before]
        chain[before] = chain[i]
    cell.disc[PLACES - 1] = <int>(CHAINED - head) if head != NOBODY else NOBODY


cdef inline void take_out(State *s, Index i) noexcept nogil:
    """Take disc `i` out of the cell in which it is."""
    cdef Index cell = s.predictions[i].cell
    take(s, i, cell >> COLUMN_BITS, cell & COLUMN_MASK)


cdef inline Index number_of(double place, Index count) noexcept nogil:
    """Return the row or column, of `count`, that a place (in cells from the first) is in; NaN is in the first."""
    if not place > 0.0:
        return 0
    return <Index>place if place < count else count - 1


cdef inline void fill_cells(State *s) noexcept nogil:
    """Put every disc into the cell in which it is now."""
    g = &s.grid
    cdef Index i, k
    for i in range(cell_count(g)):
        for k in range(PLACES):
            g.cells[i].disc[k] = NOBODY
    for i in range(s.disc_count):
        a = &s.discs[i]
        wait = s.clock.now - a.time
        column = (a.x + a.vx * wait - g.x0) / g.width
        row = (a.y + a.vy * wait - g.y0) / g.width
        put(s, i, 1 + number_of(row, g.rows), 1 + number_of(column, g.columns))


cdef inline double crowding(const State *s) noexcept nogil:
    """Return how many discs are in a disc's cell, itself counted: the mean over all."""
    cdef Index i, k, count, chained
    cdef double pairs = 0.0
    for i in range(cell_count(&s.grid)):
        cell = &s.grid.cells[i]
        count = 0
        for k in range(PLACES):
            count += cell.disc[k] > NOBODY
        chained = CHAINED - cell.disc[PLACES - 1] if cell.disc[PLACES - 1] < NOBODY else NOBODY
        while chained != NOBODY:
            count += 1
            chained = s.grid.chain[chained]
        pairs += count * count
    return pairs / s.disc_count


cdef inline void cross_edge(State *s, Index i) noexcept nogil:
    """Move disc `i` over the edge of its cell that it has come to."""
    cdef Index cell = s.predictions[i].cell
    cdef Index edge = s.predictions[i].edge
    cdef Index row = cell >> COLUMN_BITS
    cdef Index column = cell & COLUMN_MASK
    take_out(s, i)
    row += <Index>(edge == UP) - <Index>(edge == DOWN)
    column += <Index>(edge == RIGHT) - <Index>(edge == LEFT)
    put(s, i, row, column)


cdef inline Block cells_around(const State *s, Index i) noexcept nogil:
    """Return the cell of disc `i` and its eight neighbours."""
    cdef Index cell = s.predictions[i].cell
    cdef Index row = cell >> COLUMN_BITS
    cdef Index column = cell & COLUMN_MASK
    return Block((row - 1) * s.grid.stride + column - 1, 3, s.grid.stride, 1)


cdef inline Block new_neighbours(const State *s, Index i) noexcept nogil:
    """Return the three cells that have become neighbours of disc `i` as it crossed an edge."""
    cdef Index cell = s.predictions[i].cell
    cdef Index edge = s.predictions[i].edge
    cdef Index across = <Index>(edge == RIGHT) - <Index>(edge == LEFT)
    cdef Index along = <Index>(edge == UP) - <Index>(edge == DOWN)
    # One cell further on, in a line at right angles to the way taken.
    cdef Index row = (cell >> COLUMN_BITS) + along - across * across
    cdef Index column = (cell & COLUMN_MASK) + across - along * along
    return Block(row * s.grid.stride + column, 1, 0, s.grid.stride if along == 0 else 1)
