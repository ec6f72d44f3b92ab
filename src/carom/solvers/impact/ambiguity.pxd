"""Which impacts are ambiguous: the compiled form of `carom.solvers.impact_log`, which says what the rule is."""

from cython cimport likely

from carom.constants cimport INF
from carom.solvers.impact.structs cimport LastContact, Recent


cdef inline bint interferes(const LastContact *earlier, double begin, double nx, double ny) noexcept nogil:
    """Whether an impact, not before `begin`, may be at one instant with an earlier one that changes what it sees."""
    return begin <= earlier.latest and nx * earlier.nx + ny * earlier.ny != 0.0


cdef inline bint add_contact(Recent *recent, double time, double resolution, double nx, double ny) noexcept nogil:
    """Add an impact to those of a disc; return whether it is ambiguous."""
    f = &recent.furthest
    begin = time - resolution
    latest = time + resolution
    cdef bint found = interferes(f, begin, nx, ny) or interferes(&recent.across, begin, nx, ny)
    cdef bint parallel = nx * f.ny == ny * f.nx
    if likely(latest > f.latest):
        if likely(not parallel):
            recent.across = f[0]
        recent.furthest = LastContact(latest, nx, ny)
    elif not parallel and latest > recent.across.latest:
        recent.across = LastContact(latest, nx, ny)
    return found


cdef inline void forget(Recent *recent) noexcept nogil:
    recent.furthest = LastContact(-INF, 0.0, 0.0)
    recent.across = LastContact(-INF, 0.0, 0.0)
