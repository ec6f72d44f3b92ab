"""Finite walls as PIT sees them: what of one is nearest to a point, operation by operation as `carom.outline` finds it."""

from libc.math cimport fabs, sqrt

from carom.constants cimport INF
from carom.physics.double_double cimport lesser
from carom.solvers.impact.structs cimport Index

cdef struct Stretch:  # an edge of a chain, or a circle
    double ax  # where it begins
    double ay
    double bx  # where it ends; of a whole circle the same
    double by
    double bulge
    double cx  # of an arc, the centre of its circle
    double cy
    double radius
    bint bent  # whether it is an arc
    bint whole  # whether it is a whole circle, or a point

cdef struct Finite:  # a wall; a half-plane has no stretches
    Stretch *first
    Index count
    double half_width
    double size  # more than any of its coordinates and radii

cdef struct Foot:  # the nearest point of a wall's line
    double x
    double y


cdef inline double power(const Stretch *s, double x, double y) noexcept nogil:
    across = (s.bx - s.ax) * (y - s.ay) - (s.by - s.ay) * (x - s.ax)
    chord = (x - s.ax) * (x - s.bx) + (y - s.ay) * (y - s.by)
    return chord - across * (0.5 * (1.0 / s.bulge - s.bulge))


cdef inline Foot nearest_of_arc(const Stretch *s, double x, double y) noexcept nogil:
    cdef bint begun, not_ended
    dx = x - s.cx
    dy = y - s.cy
    distance = sqrt(dx * dx + dy * dy)
    if s.whole:
        if distance == 0.0:
            return Foot(s.ax, s.ay)
        return Foot(s.cx + s.radius * dx / distance, s.cy + s.radius * dy / distance)
    begun = ((s.ax - s.cx) * (y - s.ay) - (s.ay - s.cy) * (x - s.ax)) * s.bulge > 0.0
    not_ended = ((s.bx - s.cx) * (y - s.by) - (s.by - s.cy) * (x - s.bx)) * s.bulge < 0.0
    if (begun or not_ended) if fabs(s.bulge) > 1.0 else (begun and not_ended):
        if distance == 0.0:
            return Foot(s.ax, s.ay)
        out = power(s, x, y) / (distance + s.radius)
        return Foot(x - out * dx / distance, y - out * dy / distance)
    to_a = (x - s.ax) * (x - s.ax) + (y - s.ay) * (y - s.ay)
    to_b = (x - s.bx) * (x - s.bx) + (y - s.by) * (y - s.by)
    return Foot(s.ax, s.ay) if to_a <= to_b else Foot(s.bx, s.by)


cdef inline Foot nearest_of_edge(const Stretch *s, double x, double y) noexcept nogil:
    ex = s.bx - s.ax
    ey = s.by - s.ay
    part = ((x - s.ax) * ex + (y - s.ay) * ey) / (ex * ex + ey * ey)
    if 0.0 < part < 1.0:
        return Foot(s.ax + part * ex, s.ay + part * ey)
    return Foot(s.ax, s.ay) if part <= 0.0 else Foot(s.bx, s.by)


cdef inline Foot nearest(const Finite *wall, double x, double y) noexcept nogil:
    """Return the point of a wall's line that is nearest to another; of several that of the lowest edge."""
    cdef Index k
    cdef Foot best = Foot(0.0, 0.0)
    cdef double least = INF
    for k in range(wall.count):
        s = &wall.first[k]
        foot = nearest_of_arc(s, x, y) if s.bent else nearest_of_edge(s, x, y)
        dx = foot.x - x
        dy = foot.y - y
        square = dx * dx + dy * dy
        if k == 0 or square < least:
            least, best = square, foot
    return best


cdef inline double distance_at_least(const Finite *wall, double x, double y) noexcept nogil:
    """Return how far a point is from a wall's line at least, except for rounding: an arc is nowhere nearer than its circle."""
    cdef Index k
    cdef double least = INF
    for k in range(wall.count):
        s = &wall.first[k]
        if s.bent:
            dx = x - s.cx
            dy = y - s.cy
            distance = fabs(sqrt(dx * dx + dy * dy) - s.radius)
        else:
            foot = nearest_of_edge(s, x, y)
            dx = foot.x - x
            dy = foot.y - y
            distance = sqrt(dx * dx + dy * dy)
        least = lesser(distance, least)
    return least
