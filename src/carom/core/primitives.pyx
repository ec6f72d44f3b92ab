"""Times of impact for Python: of arrays of pairs of discs, and of a disc with the features of a finite wall."""

from cpython.mem cimport PyMem_Free, PyMem_Malloc
from libc.math cimport NAN, fabs


cdef inline bint is_moderate(double a) noexcept nogil:
    size = fabs(a)
    return (CAROM_PAIR_LEAST <= size) & (size < CAROM_PAIR_MOST) | (size == 0.0)


def fill_pair_times(
    const double[:, :] p1, const double[:, :] v1, const double[:] r1,
    const double[:, :] p2, const double[:, :] v2, const double[:] r2, double[::1] times,
):
    """Write `carom.time_of_impact` of each pair into `times`, shape ``(n,)``; NaN where a size is not moderate."""
    cdef Py_ssize_t k
    cdef bint moderate
    with nogil:
        for k in range(times.shape[0]):
            x1, y1, vx1, vy1 = p1[k, 0], p1[k, 1], v1[k, 0], v1[k, 1]
            x2, y2, vx2, vy2 = p2[k, 0], p2[k, 1], v2[k, 0], v2[k, 1]
            moderate = is_moderate(x2 - x1) & is_moderate(y2 - y1) & is_moderate(vx2 - vx1) & is_moderate(vy2 - vy1)
            moderate = moderate & is_moderate(r1[k] + r2[k])
            times[k] = pair_time(x1, y1, vx1, vy1, r1[k], x2, y2, vx2, vy2, r2[k]) if moderate else NAN


cdef class Features:
    """The features of a finite wall. Of those met at the same time, the first in this order counts."""

    cdef Feature *_rows
    cdef int _count

    def __cinit__(self, rows):
        cdef double[FEATURE_NUMBERS] numbers
        cdef int k, n
        self._count = len(rows)
        self._rows = <Feature *> PyMem_Malloc(self._count * sizeof(Feature))
        if self._rows == NULL:
            raise MemoryError
        for k in range(self._count):
            for n in range(FEATURE_NUMBERS):
                numbers[n] = rows[k][n]
            self._rows[k] = feature_from(numbers)

    def __dealloc__(self):
        PyMem_Free(self._rows)

    def first_time(self, x, y, ux, uy, double radius, int last):
        """Return the seconds until a disc meets a feature, the number of that feature, and whether the disc glides there.

        `last` is the number of the feature that the disc met last, or -1. The number returned is -1 if none is met.
        """
        cdef Mover disc = Mover(_pair(x), _pair(y), _pair(ux), _pair(uy), radius)
        cdef double least = CAROM_INF
        cdef int first = -1, k
        cdef bint glides = False
        for k in range(self._count):
            touch = feature_time(&disc, &self._rows[k], k == last)
            if touch.time < least:
                least, first, glides = touch.time, k, touch.glides
        return least, first, glides


cdef DoubleDouble _pair(pair):
    return DoubleDouble(pair[0], pair[1])
