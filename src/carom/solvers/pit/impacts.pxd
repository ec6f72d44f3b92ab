"""The test of PIT, what an impact does, and what is recorded of it.

Operation by operation what `carom.solvers.plain.bodies` and `carom.solvers.impact_log` do; a property test holds the two
to the same bits.
"""

from libc.math cimport sqrt

from carom.physics.double_double cimport greater
from carom.physics.impact_law cimport pair_push
from carom.solvers.event_driven.layout cimport Impact, Index, Wall
from carom.solvers.event_driven.record cimport has_room, note_ambiguous, strike
from carom.solvers.pit.layout cimport Disc, State

cdef extern from *:
    """
    /* A root that rounds to R is of a square within two roundings (2^-53) of R^2. */
    #define carom_ROOM 0x1p-50
    /* A frame is the instant of all its impacts, and of no others. */
    #define carom_RESOLUTION 0.0
    """
    const double ROOM "carom_ROOM"
    const double RESOLUTION "carom_RESOLUTION"


cdef inline bint discs_interfere(const Disc *a, const Disc *b) noexcept nogil:
    """Return whether two discs approach and touch or overlap. Two that never move do not approach."""
    dx = b.x - a.x
    dy = b.y - a.y
    along = dx * (b.vx - a.vx) + dy * (b.vy - a.vy)
    squared = dx * dx + dy * dy
    contact = a.radius + b.radius
    # First both at once and without a root: whether two discs approach is as hard to predict as a coin.
    if greater(along, squared - contact * contact * (1.0 + ROOM)) > 0.0:
        return False
    return along < 0.0 and sqrt(squared) <= contact


cdef inline bint wall_interferes(const Disc *a, const Wall *wall) noexcept nogil:
    """Return whether a disc approaches a wall and touches or overlaps it."""
    along = a.vx * wall.nx + a.vy * wall.ny
    depth = (a.x - wall.x) * wall.nx + (a.y - wall.y) * wall.ny
    return along < 0.0 and depth <= a.radius


cdef inline Impact *new_row(State *s, Index first, Index second, double nx, double ny) noexcept nogil:
    """Return a row with time, bodies, normal and the first disc's velocity before; NULL where there is no memory."""
    if not has_room(&s.record):
        s.no_memory = True
        return NULL
    row = &s.record.rows[s.record.count]
    row.time, row.first, row.second = s.now, first, second
    row.normal[0], row.normal[1] = nx, ny
    row.first_before[0], row.first_before[1] = s.discs[first].vx, s.discs[first].vy
    return row


cdef inline bint strikes(State *s, Index i, const Impact *row) noexcept nogil:
    """Add an impact to those of a disc that moves; return whether it is ambiguous."""
    if s.discs[i].inverse_mass == 0.0:
        return False
    return strike(&s.record.recent[i], row.time, RESOLUTION, row.normal[0], row.normal[1])


cdef inline void collide_pair(State *s, Index i, Index j) noexcept nogil:
    """Give two discs that approach their velocities after the impact, along the line of centres as it stands."""
    a = &s.discs[i]
    b = &s.discs[j]
    dx = b.x - a.x
    dy = b.y - a.y
    distance = sqrt(dx * dx + dy * dy)
    row = new_row(s, i, j, dx / distance, dy / distance)
    if row == NULL:
        return
    row.second_before[0], row.second_before[1] = b.vx, b.vy
    push = pair_push(dx, dy, b.vx - a.vx, b.vy - a.vy, a.inverse_mass + b.inverse_mass, s.law.restitution)
    a.vx += push * a.inverse_mass * dx
    a.vy += push * a.inverse_mass * dy
    b.vx -= push * b.inverse_mass * dx
    b.vy -= push * b.inverse_mass * dy
    row.first_after[0], row.first_after[1] = a.vx, a.vy
    row.second_after[0], row.second_after[1] = b.vx, b.vy
    if strikes(s, i, row) | strikes(s, j, row):
        note_ambiguous(&s.record)
    s.record.count += 1


cdef inline void collide_wall(State *s, Index i, Index k) noexcept nogil:
    """Give a disc that approaches a wall its velocity after the impact."""
    a = &s.discs[i]
    wall = &s.walls[k]
    row = new_row(s, i, -1 - k, -wall.nx, -wall.ny)
    if row == NULL:
        return
    along = a.vx * wall.nx + a.vy * wall.ny
    a.vx -= (1.0 + s.law.wall_restitution) * along * wall.nx
    a.vy -= (1.0 + s.law.wall_restitution) * along * wall.ny
    row.first_after[0], row.first_after[1] = a.vx, a.vy
    row.second_before[0] = row.second_before[1] = row.second_after[0] = row.second_after[1] = 0.0
    if strikes(s, i, row):
        note_ambiguous(&s.record)
    s.record.count += 1
