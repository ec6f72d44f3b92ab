"""What an impact does, and what is recorded of it.

Operation by operation what `carom.solvers.plain.bodies` and `carom.solvers.impact_log` do; a property test holds the two
to the same bits.
"""

from libc.math cimport sqrt
from libc.stdlib cimport realloc

from carom.physics.impact_law cimport pair_push
from carom.solvers.pit.layout cimport Disc, Impact, Index, Record, State, Struck


cdef inline Index more_room(Index room) noexcept nogil:
    return 2 * room + 64


cdef inline bint has_room(Record *r) noexcept nogil:
    """Make room for one more impact, which may be ambiguous; return whether there was memory for it."""
    if r.count == r.room:
        rows = <Impact *>realloc(r.rows, more_room(r.room) * sizeof(Impact))
        if rows == NULL:
            return False
        r.rows, r.room = rows, more_room(r.room)
    if r.ambiguous_count == r.ambiguous_room:
        numbers = <long long *>realloc(r.ambiguous, more_room(r.ambiguous_room) * sizeof(long long))
        if numbers == NULL:
            return False
        r.ambiguous, r.ambiguous_room = numbers, more_room(r.ambiguous_room)
    return True


cdef inline bint interferes(Struck *disc, const Impact *impact) noexcept nogil:
    """Note that a movable disc has been struck; return whether an earlier impact of the same frame changes this one.

    It does unless their normals are exactly orthogonal. Of all that strike a disc in one frame two are enough to tell:
    no direction is orthogonal to two that are not parallel.
    """
    nx = impact.normal[0]
    ny = impact.normal[1]
    if disc.time != impact.time:
        disc[0] = Struck(impact.time, nx, ny, 0.0, 0.0)
        return False
    cdef bint found = nx * disc.nx + ny * disc.ny != 0.0 or nx * disc.across_x + ny * disc.across_y != 0.0
    if disc.across_x == 0.0 and disc.across_y == 0.0 and disc.nx * ny != disc.ny * nx:
        disc.across_x, disc.across_y = nx, ny
    return found


cdef inline void keep(State *s, const Impact *impact, bint first_moves, bint second_moves) noexcept nogil:
    """Append an impact to the record, for which there is room."""
    r = &s.record
    cdef bint ambiguous = False
    if first_moves:
        ambiguous = interferes(&r.struck[impact.first], impact)
    if second_moves:
        ambiguous |= interferes(&r.struck[impact.second], impact)
    if ambiguous:
        r.ambiguous[r.ambiguous_count] = r.count
        r.ambiguous_count += 1
    r.rows[r.count] = impact[0]
    r.count += 1


cdef inline void collide_pair(State *s, Index i, Index j) noexcept nogil:
    """Give two discs that approach their velocities after the impact, along the line of centres as it stands."""
    cdef Impact impact
    a = &s.discs[i]
    b = &s.discs[j]
    if not has_room(&s.record):
        s.no_memory = True
        return
    dx = b.x - a.x
    dy = b.y - a.y
    impact.time, impact.first, impact.second = s.now, i, j
    impact.first_before[0], impact.first_before[1] = a.vx, a.vy
    impact.second_before[0], impact.second_before[1] = b.vx, b.vy
    push = pair_push(dx, dy, b.vx - a.vx, b.vy - a.vy, a.inverse_mass + b.inverse_mass, s.law.restitution)
    a.vx += push * a.inverse_mass * dx
    a.vy += push * a.inverse_mass * dy
    b.vx -= push * b.inverse_mass * dx
    b.vy -= push * b.inverse_mass * dy
    distance = sqrt(dx * dx + dy * dy)
    impact.normal[0], impact.normal[1] = dx / distance, dy / distance
    impact.first_after[0], impact.first_after[1] = a.vx, a.vy
    impact.second_after[0], impact.second_after[1] = b.vx, b.vy
    keep(s, &impact, a.inverse_mass != 0.0, b.inverse_mass != 0.0)


cdef inline void collide_wall(State *s, Index i, Index k) noexcept nogil:
    """Give a disc that approaches a wall its velocity after the impact."""
    cdef Impact impact
    a = &s.discs[i]
    wall = &s.walls[k]
    if not has_room(&s.record):
        s.no_memory = True
        return
    impact.time, impact.first, impact.second = s.now, i, -1 - k
    impact.normal[0], impact.normal[1] = -wall.nx, -wall.ny
    impact.first_before[0], impact.first_before[1] = a.vx, a.vy
    along = a.vx * wall.nx + a.vy * wall.ny
    if along < 0.0:  # rounding can turn the weakest of grazes into a separation: an impact never pulls
        a.vx -= (1.0 + s.law.wall_restitution) * along * wall.nx
        a.vy -= (1.0 + s.law.wall_restitution) * along * wall.ny
    impact.first_after[0], impact.first_after[1] = a.vx, a.vy
    impact.second_before[0] = impact.second_before[1] = 0.0
    impact.second_after[0] = impact.second_after[1] = 0.0
    keep(s, &impact, True, False)
