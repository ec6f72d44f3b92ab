"""What is written down of impacts, row by row, and room for it."""

from cython cimport unlikely
from cython.view cimport array
from libc.math cimport NAN
from libc.stdlib cimport free, realloc

from carom.solvers.impact.ambiguity cimport add_contact
from carom.solvers.impact.structs cimport NO_FEATURE, Before, Contact, Impact, Index, Record, Spins

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


cdef inline bint has_capacity(Record *r) noexcept nogil:
    """Make room for one more impact; return whether there is any."""
    cdef Index capacity
    if unlikely(r.count == r.capacity):
        capacity = 4 * r.capacity + 256 if r.capacity < 1 << 22 else r.capacity + r.capacity // 2
        if r.turns:
            spins = <Spins *>enlarged(r.spins, r.count * sizeof(Spins), capacity * sizeof(Spins))
            if spins == NULL:
                return False
            r.spins = spins
        if r.locates:
            contacts = <Contact *>enlarged(r.contacts, r.count * sizeof(Contact), capacity * sizeof(Contact))
            if contacts == NULL:
                return False
            r.contacts = contacts
        rows = <Impact *>enlarged(r.rows, r.count * sizeof(Impact), capacity * sizeof(Impact))
        if rows == NULL:
            return False
        r.rows = rows
        r.capacity = capacity
    if unlikely(r.ambiguous_count == r.ambiguous_capacity):
        capacity = 2 * r.ambiguous_capacity + 64
        ambiguous = <long long *>realloc(r.ambiguous, capacity * sizeof(long long))
        if ambiguous == NULL:
            return False
        r.ambiguous = ambiguous
        r.ambiguous_capacity = capacity
    return True


cdef inline void record_impact(
    Record *r, double time, Index first, Index second, double nx, double ny, const Before *before, const double *after1,
    const double *after2, const Spins *spins, double x, double y, Index met, double resolution, bint slides, bint moves1,
    bint moves2, int feature, bint elastic,
) noexcept nogil:
    """Record an impact that was carried out just now; there is room.

    x, y and `met` are those of a `Contact`. `resolution` is how well its instant is known, seconds; `slides` whether friction acts between the bodies, the next
    two are whether each is a disc that moves; `feature` is that of a finite wall, and `elastic` whether nothing is lost
    on it. The velocity of a wall after is that before: 0.
    """
    row = &r.rows[r.count]
    row.time, row.first, row.second = time, first, second
    row.normal[0], row.normal[1] = nx, ny
    row.first_before[0], row.first_before[1] = before.first[0], before.first[1]
    row.second_before[0], row.second_before[1] = before.second[0], before.second[1]
    row.first_after[0], row.first_after[1] = after1[0], after1[1]
    row.second_after[0], row.second_after[1] = after2[0], after2[1]
    if r.turns:
        r.spins[r.count] = spins[0]
    if r.locates:
        r.contacts[r.count] = Contact(x, y, met)
    if unlikely(slides):  # no impact is orthogonal to one with friction
        nx = ny = NAN
        feature = NO_FEATURE
    cdef bint ambiguous = moves1 and add_contact(&r.recent[first], time, resolution, nx, ny, feature, elastic, &r.corners)
    if moves2 and add_contact(&r.recent[second], time, resolution, nx, ny, feature, elastic, &r.corners):
        ambiguous = True
    if unlikely(ambiguous):
        r.ambiguous[r.ambiguous_count] = r.taken + r.count
        r.ambiguous_count += 1
    r.count += 1


cdef inline array handed_out(void *memory, size_t size):
    """Return a piece of memory, of which a given number of bytes is wanted, as an array that frees it."""
    rows = array((size,), 1, "B", allocate_buffer=False)
    rows.data = <char *>realloc(memory, size)
    rows.callback_free_data = free
    return rows


cdef inline tuple taken_rows(Record *r):
    """Return the impacts recorded since the last call, one or more, as bytes, with their spins and their contacts.

    All are in the memory that they were written into. Spins are None if no disc spins, contacts where all walls are
    half-planes.
    """
    impacts = handed_out(r.rows, r.count * sizeof(Impact))
    spins = handed_out(r.spins, r.count * sizeof(Spins)) if r.turns else None
    contacts = handed_out(r.contacts, r.count * sizeof(Contact)) if r.locates else None
    r.rows, r.spins, r.contacts = NULL, NULL, NULL
    r.taken += r.count
    r.count = r.capacity = 0
    return impacts, spins, contacts


cdef inline tuple ambiguous_rows(const Record *r):
    """Return the numbers, from the first impact recorded on, of those that are ambiguous."""
    cdef Index k
    return tuple([r.ambiguous[k] for k in range(r.ambiguous_count)])


cdef inline void free_record(Record *r) noexcept:
    free(r.rows)
    free(r.spins)
    free(r.contacts)
    free(r.ambiguous)
