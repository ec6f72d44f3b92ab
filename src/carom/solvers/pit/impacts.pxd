"""The test of PIT, and its impacts: operation by operation what `carom.solvers.plain.bodies` does."""

from cython cimport unlikely
from libc.math cimport sqrt

from carom.constants cimport ROOT_ROOM
from carom.physics.double_double cimport greater
from carom.solvers.impact.law cimport collide_discs
from carom.solvers.impact.law cimport collide_wall as collide_with_wall
from carom.solvers.impact.record cimport has_room, record_impact
from carom.solvers.impact.structs cimport NO_FEATURE, Before, Body, Index, Spins, Wall
from carom.solvers.pit.layout cimport ON_WALL, Disc, State


cdef inline bint discs_interfere(const Disc *a, const Disc *b) noexcept nogil:
    """Return whether two discs approach and touch or overlap. Two that never move do not approach."""
    dx = b.x - a.x
    dy = b.y - a.y
    along = dx * (b.vx - a.vx) + dy * (b.vy - a.vy)
    squared = dx * dx + dy * dy
    contact = a.radius + b.radius
    # First both at once and without a root: whether two discs approach is as hard to predict as a coin.
    if greater(along, squared - contact * contact * (1.0 + ROOT_ROOM)) > 0.0:
        return False
    return along < 0.0 and sqrt(squared) <= contact


cdef inline bint wall_interferes(const Disc *a, const Wall *wall) noexcept nogil:
    """Return whether a disc approaches a wall and touches or overlaps it."""
    along = a.vx * wall.nx + a.vy * wall.ny
    depth = (a.x - wall.x) * wall.nx + (a.y - wall.y) * wall.ny
    return along < 0.0 and depth <= a.radius


cdef inline bint discs_part(const State *s, Index i, Index j) noexcept nogil:
    """Return whether two discs are on the paths that their own impact gave them; one that never moves always is."""
    a = &s.discs[i]
    b = &s.discs[j]
    return (a.last == j or a.inverse_mass == 0.0) and (b.last == i or b.inverse_mass == 0.0)


cdef inline Body body_of(const State *s, Index i, bint turns) noexcept nogil:
    """Return disc `i` as the law sees it."""
    a = &s.discs[i]
    return Body(&a.vx, a.inverse_mass, a.radius, &s.turning[i if turns else 0])


cdef inline void collide_pair(State *s, Index i, Index j) noexcept nogil:
    """Give two discs that approach their velocities after the impact, along the line of centres as it stands.

    A frame is the instant of all its impacts, and of no others: it is known without an error.
    """
    if not has_room(&s.record):
        s.no_memory = True
        return
    a = &s.discs[i]
    b = &s.discs[j]
    dx = b.x - a.x
    dy = b.y - a.y
    cdef Before before = Before([a.vx, a.vy], [b.vx, b.vy])
    cdef Body first = body_of(s, i, s.record.turns)
    cdef Body second = body_of(s, j, s.record.turns)
    cdef Spins spins
    if unlikely(s.record.turns):
        collide_discs(&s.law, dx, dy, &first, &second, False, True, &spins)
        s.record.spins[s.record.count] = spins
    else:
        collide_discs(&s.law, dx, dy, &first, &second, False, False, &spins)
    a.last, b.last = <int>j, <int>i
    distance = sqrt(dx * dx + dy * dy)
    record_impact(
        &s.record, s.now, i, j, dx / distance, dy / distance, &before, &a.vx, &b.vx, 0.0, s.law.contact.friction > 0.0,
        a.inverse_mass > 0.0, b.inverse_mass > 0.0, NO_FEATURE, False,
    )


cdef inline void collide_wall(State *s, Index i, Index k) noexcept nogil:
    """Give a disc that approaches a wall, and so moves, its velocity after the impact."""
    if not has_room(&s.record):
        s.no_memory = True
        return
    a = &s.discs[i]
    wall = &s.walls[k]
    a.last = <int>(ON_WALL - k)
    cdef Before before = Before([a.vx, a.vy], [0.0, 0.0])
    cdef Body body = body_of(s, i, s.record.turns)
    cdef Spins spins
    if unlikely(s.record.turns):
        collide_with_wall(&s.law, wall, &body, False, True, &spins)
        s.record.spins[s.record.count] = spins
    else:
        collide_with_wall(&s.law, wall, &body, False, False, &spins)
    record_impact(
        &s.record, s.now, i, -1 - k, -wall.nx, -wall.ny, &before, &a.vx, before.second, 0.0,
        s.law.wall_contact.friction > 0.0, True, False, NO_FEATURE, False,
    )
