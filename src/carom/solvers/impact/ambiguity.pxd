"""Which impacts are ambiguous: the compiled form of `carom.solvers.impact_log`, which says what the rule is."""

from cython cimport likely

from carom.constants cimport INF
from carom.solvers.impact.structs cimport NO_FEATURE, Corners, LastContact, Recent


cdef inline bint interferes(
    const LastContact *earlier, double begin, const LastContact *later, const Corners *corners
) noexcept nogil:
    """Whether an impact, not before `begin`, may be at one instant with an earlier one that changes what it sees."""
    if not (begin <= earlier.latest and later.nx * earlier.nx + later.ny * earlier.ny != 0.0):
        return False
    if earlier.feature == NO_FEATURE or later.feature == NO_FEATURE:
        return True
    return not corners.decides(corners.asked, earlier.feature, later.feature, earlier.elastic and later.elastic)


cdef inline bint add_contact(
    Recent *recent, double time, double resolution, double nx, double ny, int feature, bint elastic, const Corners *corners
) noexcept nogil:
    """Add an impact to those of a disc; return whether it is ambiguous."""
    f = &recent.furthest
    begin = time - resolution
    latest = time + resolution
    cdef LastContact last = LastContact(latest, nx, ny, feature, elastic)
    cdef bint found = interferes(f, begin, &last, corners) or interferes(&recent.across, begin, &last, corners)
    cdef bint parallel = nx * f.ny == ny * f.nx
    if likely(latest > f.latest):
        if likely(not parallel):
            recent.across = f[0]
        recent.furthest = last
    elif not parallel and latest > recent.across.latest:
        recent.across = last
    return found


cdef inline void forget(Recent *recent) noexcept nogil:
    recent.furthest = LastContact(-INF, 0.0, 0.0, NO_FEATURE, False)
    recent.across = recent.furthest
