"""Which obstacles a cell knows: all that a disc in it may meet, and few others.

An obstacle is a wall, where all walls are half-planes with the coefficients of the scene; else it is a feature of one: a
half-plane, a side of an edge, or a vertex.

Four cells, a tile, know the same. The grid is halved again and again, and each half keeps those of the whole's obstacles
that come near it: so one that few tiles know costs the others nothing. A tile has the place of its list in a row of
lists, each of which holds numbers in ascending order and ends with NO_OBSTACLE; tiles far from all share the first list,
which is empty.

Where no disc can be, wholly behind a wall, a tile knows all: it need not be right, but it misses none. A tile at the rim
has no end outwards, its list has: for a disc that leaves the area of the lists all obstacles are looked at.
"""

from libc.math cimport fabs, sqrt
from libc.stdlib cimport free, malloc, realloc
from libc.string cimport memcpy

from carom.constants cimport ERROR
from carom.physics.double_double cimport greater, lesser
from carom.physics.features cimport FACE, PLANE, VERTEX, Feature
from carom.physics.pair_time cimport Bounded, approach
from carom.solvers.event_driven.layout cimport *
from carom.solvers.event_driven.paths cimport moves

cdef enum Side:  # of an obstacle, on which tiles lie
    CLEAR = 0  # no disc in them meets it
    NEAR = 1
    BEHIND = 2  # where it lets no disc be

cdef struct Tiles:  # a block of them; the ring is part of those at the rim
    Index left
    Index right  # one past the last
    Index low
    Index high


cdef inline double edge(double begin, double width, Index count, Index k) noexcept nogil:
    """Return where row or column `k` of `count` begins; the first begins, and the last ends, OUTWARD beyond the grid."""
    if k <= 1:
        return begin - OUTWARD * width
    return begin + (k - 1 if k <= count else count + OUTWARD) * width


cdef inline Side side_of(const Grid *g, const Wall *wall, const Tiles *c) noexcept nogil:
    """Return how some tiles lie to a wall: near it are those within a radius of it, and half their diagonal.

    Of one tile that is .71 of its width: a whole one leaves .29 for the roundings of a path, and of more tiles more.
    """
    left = edge(g.x0, g.width, g.columns, 2 * c.left)
    right = edge(g.x0, g.width, g.columns, 2 * c.right)
    low = edge(g.y0, g.width, g.rows, 2 * c.low)
    high = edge(g.y0, g.width, g.rows, 2 * c.high)
    reach = g.radius + 0.5 * ((right - left) + (high - low))
    distance = approach(0.5 * (left + right) - wall.x, 0.5 * (low + high) - wall.y, wall.nx, wall.ny)
    if distance.value + distance.error < -reach:
        return BEHIND
    return CLEAR if distance.value - distance.error >= reach else NEAR


cdef inline bint may_be_in_sector(const Feature *arc, double x, double y) noexcept nogil:
    """Return whether a place, as counted from the centre, is in an arc's sector, or so near that rounding leaves it open."""
    left_open = 4.0 * ERROR * arc.size.high * (fabs(x) + fabs(y))
    cdef bint begun = arc.ex.high * y - arc.ey.high * x >= -left_open
    cdef bint not_ended = arc.fx.high * y - arc.fy.high * x <= left_open
    return arc.whole or ((begun or not_ended) if arc.reflex else (begun and not_ended))


cdef inline Bounded distance_to(const Feature *f, double x, double y) noexcept nogil:
    """Return how far a point is from the line of a feature that is no plane.

    The bound is that of some twenty roundings of the lengths that it is made of. An arc's end is as far as its circle in
    the direction of that end, so it makes no difference which of them counts there.
    """
    dx = x - f.x.high
    dy = y - f.y.high
    cdef Bounded found = Bounded(0.0, 4.0 * ERROR * (fabs(x) + fabs(y) + fabs(f.x.high) + fabs(f.y.high) + f.size.high))
    if f.kind == VERTEX:
        found.value = sqrt(dx * dx + dy * dy)
    elif f.kind == FACE:
        ex = f.ex.high
        ey = f.ey.high
        part = lesser(greater((dx * ex + dy * ey) / (ex * ex + ey * ey), 0.0), 1.0)
        dx -= part * ex
        dy -= part * ey
        found.value = sqrt(dx * dx + dy * dy)
    elif may_be_in_sector(f, dx, dy):
        found.value = fabs(sqrt(dx * dx + dy * dy) - f.size.high)
    else:
        to_first = (dx - f.ex.high) * (dx - f.ex.high) + (dy - f.ey.high) * (dy - f.ey.high)
        to_last = (dx - f.fx.high) * (dx - f.fx.high) + (dy - f.fy.high) * (dy - f.fy.high)
        found.value = sqrt(lesser(to_first, to_last))
    return found


cdef inline Side side_of_feature(const Grid *g, const Feature *f, const Tiles *c) noexcept nogil:
    """Return how some tiles lie to a feature, as `side_of` does."""
    cdef Wall plane
    if f.kind == PLANE:
        plane = Wall(f.x.high, f.y.high, f.nx, f.ny)
        return side_of(g, &plane, c)
    left = edge(g.x0, g.width, g.columns, 2 * c.left)
    right = edge(g.x0, g.width, g.columns, 2 * c.right)
    low = edge(g.y0, g.width, g.rows, 2 * c.low)
    high = edge(g.y0, g.width, g.rows, 2 * c.high)
    reach = g.radius + f.half_width + 0.5 * ((right - left) + (high - low))
    distance = distance_to(f, 0.5 * (left + right), 0.5 * (low + high))
    return CLEAR if distance.value - distance.error >= reach else NEAR


cdef inline bint stays_in_area(const Grid *g, const Disc *a, double wait) noexcept nogil:
    """Return whether a disc is where the lists of its tiles hold, and will be there after a wait; so it is between."""
    x = a.x + a.vx * wait  # not a number where the wait has no end: not in the area
    y = a.y + a.vy * wait
    cdef bint now = (g.area.left <= a.x) & (a.x <= g.area.right) & (g.area.low <= a.y) & (a.y <= g.area.high)
    return now & (g.area.left <= x) & (x <= g.area.right) & (g.area.low <= y) & (y <= g.area.high)


cdef inline bint add_list(Grid *g, const int *numbers, Index count) noexcept nogil:
    """Add a list to the row of lists; return whether there is memory."""
    cdef Index capacity
    if g.listed + count + 1 > g.list_capacity:
        capacity = 2 * g.list_capacity + count + 64
        lists = <int *>realloc(g.lists, capacity * sizeof(int))
        if lists == NULL:
            return False
        g.lists, g.list_capacity = lists, capacity
    memcpy(g.lists + g.listed, numbers, count * sizeof(int))
    g.lists[g.listed + count] = NO_OBSTACLE
    g.listed += count + 1
    return True


cdef inline bint share_list(Grid *g, const Tiles *c, unsigned int place) noexcept nogil:
    """Give some tiles the list at a place of the row."""
    cdef Index row, column
    cdef bint at_rim
    cdef bint any_obstacle = g.lists[FULL_LIST] != NO_OBSTACLE
    for row in range(c.low, c.high):
        for column in range(c.left, c.right):
            at_rim = row == 0 or column == 0 or row == g.rows // 2 or column == g.columns // 2
            g.list_of[row * g.tiles + column] = 2 * place + (any_obstacle and at_rim)
    return True


cdef inline bint list_obstacles(
    Grid *g, const Wall *walls, const Feature *features, Tiles c, int *known, Index count
) noexcept nogil:
    """Give some tiles their lists, of the obstacles that are `known` to all of them; return whether there is memory.

    Behind `known` there is room for as many numbers a halving.
    """
    cdef Index k, side
    cdef Index kept = 0
    cdef Tiles half = c
    near = known + count
    for k in range(count):
        side = side_of(g, &walls[known[k]], &c) if features == NULL else side_of_feature(g, &features[known[k]], &c)
        if side == BEHIND:
            return share_list(g, &c, FULL_LIST)
        near[kept] = known[k]
        kept += side == NEAR
    if kept == 0:
        return share_list(g, &c, EMPTY_LIST)
    width = c.right - c.left
    height = c.high - c.low
    if width == height == 1:
        share_list(g, &c, <unsigned int>g.listed)
        return add_list(g, near, kept)
    if width >= height:
        half.right = c.left = c.left + width // 2
    else:
        half.high = c.low = c.low + height // 2
    return list_obstacles(g, walls, features, half, near, kept) and list_obstacles(g, walls, features, c, near, kept)


cdef inline bint find_obstacles(State *s) noexcept nogil:
    """Give every tile the list of what a disc in it may meet, features if there are any; return whether there is memory.

    Those of driven walls are in none.
    """
    cdef Index k
    cdef Index kept = 0
    cdef bint has_features = s.feature_count > 0
    cdef Index count = s.feature_count if has_features else s.wall_count
    g = &s.grid
    g.area.left = edge(g.x0, g.width, g.columns, 1)
    g.area.right = edge(g.x0, g.width, g.columns, g.columns + 1)
    g.area.low = edge(g.y0, g.width, g.rows, 1)
    g.area.high = edge(g.y0, g.width, g.rows, g.rows + 1)
    numbers = <int *>malloc((2 * COLUMN_BITS + 2) * (count + 1) * sizeof(int))
    if numbers == NULL:
        return False
    for k in range(count):
        numbers[kept] = <int>k
        kept += not has_features or not moves(&s.driving, s.features[k].wall)
    cdef bint done = add_list(g, numbers, 0) and add_list(g, numbers, kept)
    done = done and list_obstacles(
        g, s.walls, s.features if has_features else NULL, Tiles(0, g.tiles, 0, g.rows // 2 + 1), numbers, kept
    )
    free(numbers)
    return done
