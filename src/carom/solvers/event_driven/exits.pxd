"""What ends a disc's stay in its cell: the edge that it crosses, or a wall that it meets before."""

from carom.constants cimport ERROR, TIME_ERROR
from carom.physics.double_double cimport lesser
from carom.physics.pair_time cimport approach
from carom.physics.wall_time cimport wall_time
from carom.solvers.event_driven.grid cimport tile_of
from carom.solvers.event_driven.layout cimport *
from carom.solvers.event_driven.obstacles cimport stays_in_area

cdef inline double meet_walls(const State *s, const Disc *a, const int *near, double wait, Index *wall) noexcept nogil:
    """Find the first of some walls that a disc meets within a wait; return when, or that wait, and note which.

    Of walls met at one time (own time and wait together: two waits that differ can round to one time) the last comes
    first, since wall k is body -1 - k.
    """
    cdef Index k
    cdef Wall w
    wall[0] = NO_WALL
    while near[0] != NO_WALL:
        k = near[0]
        near += 1
        if a.last == -1 - k:
            continue
        w = s.walls[k]
        toward = approach(a.vx, a.vy, w.nx, w.ny)
        rim = approach(a.x - w.x, a.y - w.y, w.nx, w.ny)
        gap = rim.value - a.radius - (rim.error + ERROR * a.radius)
        # Not at the wall by then, nor at the same time when rounded, even if all roundings are against it?
        if toward.value > toward.error or gap > (toward.error - toward.value) * (wait + TIME_ERROR * (a.time + wait)):
            continue
        meet = wall_time(a.x, a.y, a.vx, a.vy, a.radius, w.x, w.y, w.nx, w.ny)
        if meet < wait or (wall[0] != NO_WALL and a.time + meet == a.time + wait):
            wait = meet
            wall[0] = k
    return wait


cdef inline void predict_exit(State *s, Index i) noexcept nogil:
    """Predict when disc `i` crosses an edge of its cell, or meets a wall before that.

    An edge met at the time of a wall comes first: the wall is near the next cell too.
    """
    g = &s.grid
    p = &s.predictions[i]
    cdef Disc a = s.discs[i]
    cdef Index row = (p.cell >> COLUMN_BITS) - 1
    cdef Index column = (p.cell & COLUMN_MASK) - 1
    cdef Index right = a.vx > 0.0
    cdef Index up = a.vy > 0.0
    cdef Index vertical
    cdef Index wall = NO_WALL
    across = ((g.x0 + (column + right) * g.width) - a.x) / a.vx if a.vx != 0.0 else INF
    along = ((g.y0 + (row + up) * g.width) - a.y) / a.vy if a.vy != 0.0 else INF
    # A cell at the rim has no end outwards.
    across = INF if column == right * (g.columns - 1) else across
    along = INF if row == up * (g.rows - 1) else along
    vertical = along < across
    edge = lesser(along, across)
    cdef unsigned int known = g.list_of[tile_of(g, row + 1, column + 1)]
    cdef const int *near = g.lists + (known >> 1)
    cdef bint looks = known != 0
    cdef bint at_rim = known & 1
    wait = edge
    while looks:  # twice at most; called at one place, so that a compiler makes it part of the loop
        wait = meet_walls(s, &a, near, edge, &wall)
        looks = at_rim and not stays_in_area(g, &a, wait)
        at_rim = False
        near = g.lists + FULL_LIST
    p.exit_time = a.time + wait
    p.wall = <short>wall
    p.edge = <signed char>(LEFT + right + vertical * (DOWN + up - LEFT - right) if wall == NO_WALL else NO_EDGE)
