"""The time of impact of arrays of pairs of discs, pair by pair that of `pair_time` to the bit."""

from libc.math cimport NAN, fabs

from carom.constants cimport PAIR_LEAST, PAIR_MOST
from carom.physics.pair_time cimport pair_time

cdef inline bint is_moderate(double a) noexcept nogil:
    size = fabs(a)
    return (PAIR_LEAST <= size) & (size < PAIR_MOST) | (size == 0.0)


def fill_pair_times(
    const double[:, :] p1, const double[:, :] v1, const double[:] r1,
    const double[:, :] p2, const double[:, :] v2, const double[:] r2, double[::1] times,
):
    """Write `carom.time_of_impact` of each pair into `times`, shape ``(n,)``; NaN for other than moderate sizes."""
    cdef Py_ssize_t k
    cdef bint moderate
    with nogil:
        for k in range(times.shape[0]):
            x1, y1, vx1, vy1 = p1[k, 0], p1[k, 1], v1[k, 0], v1[k, 1]
            x2, y2, vx2, vy2 = p2[k, 0], p2[k, 1], v2[k, 0], v2[k, 1]
            moderate = is_moderate(x2 - x1) & is_moderate(y2 - y1) & is_moderate(vx2 - vx1) & is_moderate(vy2 - vy1)
            moderate = moderate & is_moderate(r1[k] + r2[k])
            times[k] = pair_time(x1, y1, vx1, vy1, r1[k], x2, y2, vx2, vy2, r2[k]) if moderate else NAN
