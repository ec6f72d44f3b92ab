"""What is written down of impacts, and which of them are ambiguous: the rule is that of `carom.solvers.impact_log`."""

from cython cimport likely, unlikely
from libc.math cimport NAN
from libc.stdlib cimport realloc

from carom.solvers.event_driven.layout cimport *
from carom.solvers.resolution cimport clock_resolution, pair_resolution, size_of, wall_resolution

cdef extern from *:
    """
    #include <stdlib.h>
    #include <string.h>
    #if defined(__linux__)
    #include <sys/mman.h>
    #endif
    /* As `realloc`, of which the first `used` bytes count. Where the system gives large pages on request, some megabytes or
       more are taken anew, and copied, since what has been enlarged gets none: with small ones fresh memory costs as much
       as all else that recording does. From a gigabyte on memory is scarcer. */
    static void *carom_enlarged(void *memory, size_t used, size_t size) {
    #if defined(__linux__)
        void *fresh;
        if (size >= (size_t)4 << 20 && size <= (size_t)1 << 30 && posix_memalign(&fresh, (size_t)2 << 20, size) == 0) {
            madvise(fresh, size, MADV_HUGEPAGE);
            memcpy(fresh, memory, used);
            free(memory);
            return fresh;
        }
    #endif
        return realloc(memory, size);
    }
    """
    void *enlarged "carom_enlarged" (void *memory, size_t used, size_t size) noexcept nogil


cdef inline bint is_recorded(const Record *r, double time) noexcept nogil:
    return r.wanted and r.begin <= time and time <= r.end


cdef inline bint has_room(Record *r) noexcept nogil:
    """Make room for one more impact; return whether there is any."""
    cdef Index room
    if unlikely(r.count == r.room):
        room = 4 * r.room + 256 if r.room < 1 << 22 else r.room + r.room // 2
        if r.turns:
            spins = <Spins *>enlarged(r.spins, r.count * sizeof(Spins), room * sizeof(Spins))
            if spins == NULL:
                return False
            r.spins = spins
        rows = <Impact *>enlarged(r.rows, r.count * sizeof(Impact), room * sizeof(Impact))
        if rows == NULL:
            return False
        r.rows = rows
        r.room = room
    if unlikely(r.ambiguous_count == r.ambiguous_room):
        room = 2 * r.ambiguous_room + 64
        ambiguous = <long long *>realloc(r.ambiguous, room * sizeof(long long))
        if ambiguous == NULL:
            return False
        r.ambiguous = ambiguous
        r.ambiguous_room = room
    return True


cdef inline bint interferes(const Struck *earlier, double begin, double nx, double ny) noexcept nogil:
    """Whether an impact, not before `begin`, may be at one instant with an earlier one that changes what it sees."""
    return begin <= earlier.reach and nx * earlier.nx + ny * earlier.ny != 0.0


cdef inline bint strike(Recent *recent, double time, double resolution, double nx, double ny) noexcept nogil:
    """Add an impact to those of a disc; return whether it is ambiguous."""
    f = &recent.furthest
    begin = time - resolution
    reach = time + resolution
    cdef bint found = interferes(f, begin, nx, ny) or interferes(&recent.across, begin, nx, ny)
    cdef bint parallel = nx * f.ny == ny * f.nx
    if likely(reach > f.reach):
        if likely(not parallel):
            recent.across = f[0]
        recent.furthest = Struck(reach, nx, ny)
    elif not parallel and reach > recent.across.reach:
        recent.across = Struck(reach, nx, ny)
    return found


cdef inline void forget(Recent *recent) noexcept nogil:
    recent.furthest = Struck(-INF, 0.0, 0.0)
    recent.across = Struck(-INF, 0.0, 0.0)


cdef inline void note_ambiguous(Record *r) noexcept nogil:
    r.ambiguous[r.ambiguous_count] = r.taken + r.count
    r.ambiguous_count += 1


cdef inline void record_pair(State *s, Index i, Index j, double nx, double ny, const Before *before) noexcept nogil:
    """Record an impact of discs `i` and `j`, carried out just now; there is room. `before` holds both velocities."""
    r = &s.record
    row = &r.rows[r.count]
    a = &s.discs[i]
    b = &s.discs[j]
    row.time = s.clock.reported
    row.first = i
    row.second = j
    row.normal[0] = nx
    row.normal[1] = ny
    row.first_before[0] = before.vx1
    row.first_before[1] = before.vy1
    row.second_before[0] = before.vx2
    row.second_before[1] = before.vy2
    row.first_after[0] = a.vx
    row.first_after[1] = a.vy
    row.second_after[0] = b.vx
    row.second_after[1] = b.vy
    ux = before.vx1 - before.vx2
    uy = before.vy1 - before.vy2
    sizes = size_of(a.x, a.y, a.radius) + size_of(b.x, b.y, b.radius)
    known = pair_resolution(sizes, a.radius + b.radius, ux, uy, ux * nx + uy * ny) + clock_resolution(row.time)
    if unlikely(s.law.grip.friction > 0.0):  # no impact is orthogonal to this one
        nx = ny = NAN
    cdef bint ambiguous = a.inverse_mass > 0.0 and strike(&r.recent[i], row.time, known, nx, ny)
    if b.inverse_mass > 0.0 and strike(&r.recent[j], row.time, known, nx, ny):
        ambiguous = True
    if unlikely(ambiguous):
        note_ambiguous(r)
    r.count += 1


cdef inline void record_wall(State *s, Index i, Index k, double along, const Before *before) noexcept nogil:
    """Record an impact of disc `i` on wall `k`, carried out just now; `along` is its velocity before, off the wall."""
    r = &s.record
    row = &r.rows[r.count]
    a = &s.discs[i]
    wall = &s.walls[k]
    row.time = s.clock.reported
    row.first = i
    row.second = -1 - k
    row.normal[0] = -wall.nx
    row.normal[1] = -wall.ny
    row.first_before[0] = before.vx1
    row.first_before[1] = before.vy1
    row.first_after[0] = a.vx
    row.first_after[1] = a.vy
    row.second_before[0] = row.second_before[1] = row.second_after[0] = row.second_after[1] = 0.0
    sizes = size_of(a.x, a.y, a.radius) + size_of(wall.x, wall.y, 0.0)
    known = wall_resolution(sizes, -along) + clock_resolution(row.time)
    nx, ny = row.normal[0], row.normal[1]
    if unlikely(s.law.wall_grip.friction > 0.0):
        nx = ny = NAN
    if unlikely(strike(&r.recent[i], row.time, known, nx, ny)):
        note_ambiguous(r)
    r.count += 1
