"""The test of PIT, what an impact does, and what is recorded of it.

Operation by operation what `carom.solvers.plain.bodies` and `carom.solvers.impact_log` do; a property test holds the two
to the same bits.
"""

from cython cimport unlikely
from libc.math cimport NAN, sqrt

from carom.physics.double_double cimport greater
from carom.physics.friction cimport friction_impulse, pair_rub
from carom.physics.impact_law cimport pair_push
from carom.solvers.event_driven.layout cimport Impact, Index, Spins, Wall
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


cdef inline bint strikes(State *s, Index i, const Impact *row, double friction) noexcept nogil:
    """Add an impact to those of a disc that moves; return whether it is ambiguous."""
    if s.discs[i].inverse_mass == 0.0:
        return False
    if friction > 0.0:  # no impact is orthogonal to this one
        return strike(&s.record.recent[i], row.time, RESOLUTION, NAN, NAN)
    return strike(&s.record.recent[i], row.time, RESOLUTION, row.normal[0], row.normal[1])


cdef inline void turn_pair(State *s, Index i, Index j, const Impact *row, double push) noexcept nogil:
    """Let friction act on two discs that were given a push, at full radius from each centre; record their spins."""
    a = &s.discs[i]
    b = &s.discs[j]
    turning_a = &s.turning[i]
    turning_b = &s.turning[j]
    spins = &s.record.spins[s.record.count]
    spins.first_before, spins.second_before = turning_a.spin, turning_b.spin
    if s.law.grip.friction > 0.0:
        dx = b.x - a.x
        dy = b.y - a.y
        ux = row.second_before[0] - row.first_before[0]
        uy = row.second_before[1] - row.first_before[1]
        distance = sqrt(dx * dx + dy * dy)
        surface = distance * (a.radius * turning_a.spin + b.radius * turning_b.spin)
        yielding = a.inverse_mass * (1.0 + turning_a.ease) + b.inverse_mass * (1.0 + turning_b.ease)
        rub = pair_rub(&s.law.grip, dx, dy, ux, uy, surface, yielding, push)
        a.vx += rub * a.inverse_mass * dy
        a.vy -= rub * a.inverse_mass * dx
        b.vx -= rub * b.inverse_mass * dy
        b.vy += rub * b.inverse_mass * dx
        turning_a.spin -= rub * distance * a.inverse_mass * turning_a.ease / a.radius
        turning_b.spin -= rub * distance * b.inverse_mass * turning_b.ease / b.radius
    spins.first_after, spins.second_after = turning_a.spin, turning_b.spin


cdef inline void turn_on_wall(State *s, Index i, const Wall *wall, const Impact *row, double pressed) noexcept nogil:
    """Let the friction of a wall act on a disc that was given a speed off it; record its spin."""
    a = &s.discs[i]
    turning = &s.turning[i]
    spins = &s.record.spins[s.record.count]
    spins[0] = Spins(turning.spin, 0.0, 0.0, 0.0)
    if s.law.wall_grip.friction > 0.0:
        slip = row.first_before[0] * wall.ny - row.first_before[1] * wall.nx + a.radius * turning.spin
        rub = friction_impulse(&s.law.wall_grip, slip, 1.0 + turning.ease, pressed)
        a.vx -= rub * wall.ny
        a.vy += rub * wall.nx
        turning.spin -= rub * turning.ease / a.radius
    spins.first_after = turning.spin


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
    if unlikely(s.turning != NULL):
        turn_pair(s, i, j, row, push)
    row.first_after[0], row.first_after[1] = a.vx, a.vy
    row.second_after[0], row.second_after[1] = b.vx, b.vy
    if strikes(s, i, row, s.law.grip.friction) | strikes(s, j, row, s.law.grip.friction):
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
    if unlikely(s.turning != NULL):
        turn_on_wall(s, i, wall, row, -((1.0 + s.law.wall_restitution) * along))
    row.first_after[0], row.first_after[1] = a.vx, a.vy
    row.second_before[0] = row.second_before[1] = row.second_after[0] = row.second_after[1] = 0.0
    if strikes(s, i, row, s.law.wall_grip.friction):
        note_ambiguous(&s.record)
    s.record.count += 1
