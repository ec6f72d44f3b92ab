"""The test of PIT, and its impacts: operation by operation what `carom.solvers.plain.bodies` does."""

from libc.math cimport sqrt

from carom.constants cimport ROOT_ROOM
from carom.physics.double_double cimport greater
from carom.solvers.impact.law cimport collide_discs
from carom.solvers.impact.law cimport collide_wall as collide_with_wall
from carom.solvers.impact.record cimport has_capacity, record_impact
from carom.solvers.impact.resolution cimport are_told_apart
from carom.solvers.impact.structs cimport NO_FEATURE, Before, Body, Index, Spins, Wall
from carom.solvers.pit.layout cimport ON_WALL, Disc, Normal, State
from carom.solvers.pit.stretches cimport Finite, nearest


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


cdef inline Normal normal_from(const Finite *wall, const Disc *a) noexcept nogil:
    """Return the unit vector from the nearest point of a finite wall to a disc's centre; NaN where that is on the line."""
    foot = nearest(wall, a.x, a.y)
    dx = a.x - foot.x
    dy = a.y - foot.y
    distance = sqrt(dx * dx + dy * dy)
    return Normal(dx / distance, dy / distance)


cdef inline bint finite_interferes(const State *s, Index i, Index k) noexcept nogil:
    """Return whether disc `i` approaches finite wall `k` and touches or overlaps it, and is not on its path from there.

    The wall bends, or has another side that the path leads to: so the normal tells whether it is that path.
    """
    a = &s.discs[i]
    wall = &s.finite[k]
    foot = nearest(wall, a.x, a.y)
    dx = a.x - foot.x
    dy = a.y - foot.y
    reach = wall.half_width + a.radius
    distance = sqrt(dx * dx + dy * dy)
    if distance == 0.0 or not (a.vx * dx + a.vy * dy < 0.0 and dx * dx + dy * dy <= reach * reach):
        return False
    return s.falls or a.last != ON_WALL - k or dx / distance != s.normals[i].x or dy / distance != s.normals[i].y


cdef inline bint is_due(const State *s, Index i, Index k) noexcept nogil:
    """Return whether disc `i` and wall `k` have an impact at this frame."""
    if s.finite != NULL and s.finite[k].count > 0:
        return finite_interferes(s, i, k)
    return wall_interferes(&s.discs[i], &s.walls[k]) and (s.falls or s.discs[i].last != ON_WALL - k)


cdef inline bint discs_part(const State *s, Index i, Index j) noexcept nogil:
    """Return whether two discs are on the paths that their own impact gave them; one that never moves always is.

    A fall onto what does not fall comes back.
    """
    a = &s.discs[i]
    b = &s.discs[j]
    if s.falls and (a.inverse_mass == 0.0 or b.inverse_mass == 0.0):
        return False
    return (a.last == j or a.inverse_mass == 0.0) and (b.last == i or b.inverse_mass == 0.0)


cdef inline Body body_of(const State *s, Index i, bint turns) noexcept nogil:
    """Return disc `i` as the law sees it."""
    a = &s.discs[i]
    return Body(&a.vx, a.inverse_mass, a.radius, &s.turning[i if turns else 0])


cdef inline void collide_pair(State *s, Index i, Index j) noexcept nogil:
    """Give two discs that approach their velocities after the impact, along the line of centres as it stands.

    A frame is the instant of all its impacts, and of no others: it is known without an error.
    """
    if not has_capacity(&s.record):
        s.no_memory = True
        return
    a = &s.discs[i]
    b = &s.discs[j]
    if not are_told_apart(a.x, a.y, b.x, b.y, a.radius + b.radius):
        s.too_far = True
        return
    dx = b.x - a.x
    dy = b.y - a.y
    cdef Before before = Before([a.vx, a.vy], [b.vx, b.vy])
    cdef Body first = body_of(s, i, s.record.turns)
    cdef Body second = body_of(s, j, s.record.turns)
    cdef Spins spins
    collide_discs(&s.law, dx, dy, &first, &second, False, s.record.turns, &spins)
    a.last, b.last = <int>j, <int>i
    distance = sqrt(dx * dx + dy * dy)
    record_impact(
        &s.record, s.now, i, j, dx / distance, dy / distance, &before, &a.vx, &b.vx, &spins, a.x, a.y, NO_FEATURE, 0.0,
        s.law.contact.friction > 0.0, a.inverse_mass > 0.0, b.inverse_mass > 0.0, NO_FEATURE, False,
    )


cdef inline void collide_wall(State *s, Index i, Index k) noexcept nogil:
    """Give a disc that approaches a wall, and so moves, its velocity after the impact."""
    if not has_capacity(&s.record):
        s.no_memory = True
        return
    a = &s.discs[i]
    wall = &s.walls[k]
    law = &s.wall_laws[k]
    a.last = <int>(ON_WALL - k)
    if s.finite != NULL and s.finite[k].count > 0:
        s.normals[i] = normal_from(&s.finite[k], a)
        wall.nx, wall.ny = s.normals[i].x, s.normals[i].y
    cdef Before before = Before([a.vx, a.vy], [0.0, 0.0])
    cdef Body body = body_of(s, i, s.record.turns)
    cdef Spins spins
    collide_with_wall(law, wall, NULL, &body, False, s.record.turns, &spins)
    record_impact(
        &s.record, s.now, i, -1 - k, -wall.nx, -wall.ny, &before, &a.vx, before.second, &spins, a.x, a.y, k, 0.0,
        law.wall_contact.friction > 0.0, True, False, NO_FEATURE, False,
    )
