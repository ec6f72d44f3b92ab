"""Recorded impacts as arrays, for the bindings."""

from cython.view cimport array
from libc.stdlib cimport free, realloc

from carom.core.carom_core cimport Contact, Impact, Index, Record, Spins

cdef extern from "carom/core/binding_memory.h":
    void *carom_enlarge(void *memory, size_t used, size_t size) noexcept nogil


cdef inline array memory_as_array(void *memory, size_t size):
    """Shorten allocated memory to `size` bytes. Return an array whose deletion frees the memory."""
    rows = array((size,), 1, "B", allocate_buffer=False)
    rows.data = <char *>realloc(memory, size)
    rows.callback_free_data = free
    return rows


cdef inline tuple release_rows(Record *r):
    """Return the impacts recorded since the last call, and their spins and contacts, as bytes.

    At least one impact must have been recorded. No row is copied. Spins are None if no disc spins. Contacts are None if
    all walls are half-planes.
    """
    impacts = memory_as_array(r.rows, r.count * sizeof(Impact))
    spins = memory_as_array(r.spins, r.count * sizeof(Spins)) if r.has_spins else None
    contacts = memory_as_array(r.contacts, r.count * sizeof(Contact)) if r.has_contacts else None
    r.rows, r.spins, r.contacts = NULL, NULL, NULL
    r.released += r.count
    r.count = r.capacity = 0
    return impacts, spins, contacts


cdef inline tuple ambiguous_rows(const Record *r):
    """Return the numbers of the ambiguous impacts, counted from the run's first recorded impact."""
    cdef Index k
    return tuple([r.ambiguous[k] for k in range(r.ambiguous_count)])


cdef inline void free_record(Record *r) noexcept:
    """Free the memory of the record, except `recent`, which belongs to the caller."""
    free(r.rows)
    free(r.spins)
    free(r.contacts)
    free(r.ambiguous)
