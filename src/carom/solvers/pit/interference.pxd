"""The test of PIT: approaching, and overlapping?

Operation by operation what `carom.solvers.plain.bodies` does; a property test holds the two to the same bits.
"""

from libc.math cimport sqrt

from carom.physics.double_double cimport greater
from carom.solvers.event_driven.layout cimport Wall
from carom.solvers.pit.layout cimport Disc

cdef extern from *:
    """
    /* A root that rounds to R is of a square within two roundings (2^-53) of R^2. */
    #define carom_ROOM 0x1p-50
    """
    const double ROOM "carom_ROOM"


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
    if greater(along, depth - a.radius) > 0.0:
        return False
    return along < 0.0 and depth <= a.radius
