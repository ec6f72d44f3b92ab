"""What an impact does, and what is recorded of it.

Operation by operation what `carom.solvers.plain.bodies` and `carom.solvers.impact_log` do; a property test holds the two
to the same bits.
"""

from libc.math cimport sqrt

from carom.physics.impact_law cimport pair_push
from carom.solvers.event_driven.layout cimport Impact, Index
from carom.solvers.event_driven.record cimport has_room, note_ambiguous, strike
from carom.solvers.pit.layout cimport State

cdef extern from *:
    """
    /* A frame is the instant of all its impacts, and of no others. */
    #define carom_RESOLUTION 0.0
    """
    const double RESOLUTION "carom_RESOLUTION"


cdef inline Impact *new_row(State *s) noexcept nogil:
    """Return room for one more impact, or NULL."""
    if has_room(&s.record):
        return &s.record.rows[s.record.count]
    s.no_memory = True
    return NULL


cdef inline void keep(State *s, const Impact *row, bint first_moves, bint second_moves) noexcept nogil:
    """Count the impact that has been written into a new row."""
    cdef bint ambiguous = False
    if first_moves:
        ambiguous = strike(&s.record.recent[row.first], row.time, RESOLUTION, row.normal[0], row.normal[1])
    if second_moves and strike(&s.record.recent[row.second], row.time, RESOLUTION, row.normal[0], row.normal[1]):
        ambiguous = True
    if ambiguous:
        note_ambiguous(&s.record)
    s.record.count += 1


cdef inline void collide_pair(State *s, Index i, Index j) noexcept nogil:
    """Give two discs that approach their velocities after the impact, along the line of centres as it stands."""
    a = &s.discs[i]
    b = &s.discs[j]
    row = new_row(s)
    if row == NULL:
        return
    dx = b.x - a.x
    dy = b.y - a.y
    distance = sqrt(dx * dx + dy * dy)
    row.time, row.first, row.second = s.now, i, j
    row.normal[0], row.normal[1] = dx / distance, dy / distance
    row.first_before[0], row.first_before[1] = a.vx, a.vy
    row.second_before[0], row.second_before[1] = b.vx, b.vy
    push = pair_push(dx, dy, b.vx - a.vx, b.vy - a.vy, a.inverse_mass + b.inverse_mass, s.law.restitution)
    a.vx += push * a.inverse_mass * dx
    a.vy += push * a.inverse_mass * dy
    b.vx -= push * b.inverse_mass * dx
    b.vy -= push * b.inverse_mass * dy
    row.first_after[0], row.first_after[1] = a.vx, a.vy
    row.second_after[0], row.second_after[1] = b.vx, b.vy
    keep(s, row, a.inverse_mass != 0.0, b.inverse_mass != 0.0)


cdef inline void collide_wall(State *s, Index i, Index k) noexcept nogil:
    """Give a disc that approaches a wall its velocity after the impact."""
    a = &s.discs[i]
    wall = &s.walls[k]
    row = new_row(s)
    if row == NULL:
        return
    row.time, row.first, row.second = s.now, i, -1 - k
    row.normal[0], row.normal[1] = -wall.nx, -wall.ny
    row.first_before[0], row.first_before[1] = a.vx, a.vy
    along = a.vx * wall.nx + a.vy * wall.ny
    a.vx -= (1.0 + s.law.wall_restitution) * along * wall.nx
    a.vy -= (1.0 + s.law.wall_restitution) * along * wall.ny
    row.first_after[0], row.first_after[1] = a.vx, a.vy
    row.second_before[0] = row.second_before[1] = 0.0
    row.second_after[0] = row.second_after[1] = 0.0
    keep(s, row, True, False)
