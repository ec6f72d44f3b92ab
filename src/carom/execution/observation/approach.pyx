"""Tests for free flight: whether discs move straight, overlap, or come near each other or near walls.

The formulas in this module are much faster than the computation of an impact's time. Two bodies count as near while
they are still far from touching. So rounding errors of the computed times do not matter.
"""

from libc.math cimport INFINITY, fabs, hypot, isfinite, sqrt


cdef inline double near_time(double x, double y, double vx, double vy, double reach) noexcept nogil:
    """Return the seconds until a body comes within `reach` of the origin: 0 if near and approaching, infinity if never.

    If a distance or a speed overflows, return 0, because an immediate contact is possible.
    """
    cdef double speed = hypot(vx, vy), along, aside
    if speed == 0.0:
        return INFINITY
    vx, vy = vx / speed, vy / speed
    along, aside = x * vx + y * vy, fabs(x * vy - y * vx)
    if not (isfinite(along) and isfinite(speed)):
        return 0.0
    if not (along < 0.0 and aside < reach):
        return INFINITY
    # The root of a product is computed as a product of roots, since the product of two lengths could overflow.
    return max((-along - sqrt(reach - aside) * sqrt(reach + aside)) / speed, 0.0)


def has_moved_straight(
    const double[:, :] before,
    const double[:, :] after,
    const double[:, :] velocity,
    double step_s,
    double end_s,
    double roundings,
):
    """Whether every disc has moved by its velocity times the step's duration, except for rounding.

    The largest allowed rounding error is `roundings` times a length. This length is the largest coordinate or, if
    longer, the path of the fastest disc from time 0 to the step's end `end_s`.
    """
    cdef double farthest = 0.0, fastest = 0.0
    cdef Py_ssize_t i, axis
    for i in range(before.shape[0]):
        for axis in range(2):
            farthest = max(farthest, fabs(before[i, axis]), fabs(after[i, axis]))
            fastest = max(fastest, fabs(velocity[i, axis]))
    farthest = roundings * max(farthest, fastest * end_s)
    for i in range(before.shape[0]):
        for axis in range(2):
            if not fabs(after[i, axis] - before[i, axis] - velocity[i, axis] * step_s) <= farthest:  # true for NaN
                return False
    return True


def are_overlapping(
    const double[:, :] position, const double[:] radius, const Py_ssize_t[:] first, const Py_ssize_t[:] second
):
    """Whether any of the pairs of discs overlaps or touches."""
    cdef Py_ssize_t k, i, j
    for k in range(first.shape[0]):
        i, j = first[k], second[k]
        if hypot(position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]) <= radius[i] + radius[j]:
            return True
    return False


def compute_pair_time(
    const double[:, :] position,
    const double[:, :] velocity,
    const double[:] reach,
    const Py_ssize_t[:] first,
    const Py_ssize_t[:] second,
):
    """Return the seconds until two discs are nearer to each other than the sum of their reaches; infinity if never."""
    cdef double earliest = INFINITY
    cdef Py_ssize_t k, i, j
    for k in range(first.shape[0]):
        i, j = first[k], second[k]
        earliest = min(earliest, near_time(
            position[j, 0] - position[i, 0],
            position[j, 1] - position[i, 1],
            velocity[j, 0] - velocity[i, 0],
            velocity[j, 1] - velocity[i, 1],
            reach[i] + reach[j],
        ))
    return earliest


def compute_wall_time(
    const double[:, :] position, const double[:, :] velocity, const double[:] reach, const double[:, :] walls
):
    """Return the seconds until any disc is nearer to a half-plane wall than the disc's reach; infinity if never.

    A row of `walls` contains a point and the unit normal of a wall.
    """
    cdef double earliest = INFINITY, along, gap
    cdef Py_ssize_t i, k
    for k in range(walls.shape[0]):
        for i in range(position.shape[0]):
            along = velocity[i, 0] * walls[k, 2] + velocity[i, 1] * walls[k, 3]
            if along < 0.0:
                gap = (position[i, 0] - walls[k, 0]) * walls[k, 2] + (position[i, 1] - walls[k, 1]) * walls[k, 3]
                earliest = min(earliest, max(gap - reach[i], 0.0) / -along)
    return earliest
