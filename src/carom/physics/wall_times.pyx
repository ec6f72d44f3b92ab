"""Times of impact of a disc on a wall, compiled, for who solves for one at a time."""

from cpython.mem cimport PyMem_Free, PyMem_Malloc

from carom.constants cimport INF
from carom.physics.double_double cimport DoubleDouble
from carom.physics.feature_time cimport feature_time
from carom.physics.features cimport FEATURE_NUMBERS, Feature, Mover, feature_from


cdef class Features:
    """The features of a finite wall, in the order in which they are met at one instant."""

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
        """Return the seconds until a disc meets the first of them, which that is, and whether it glides there.

        The last that the disc has met is `last`; -1 stands for none, and is what is returned where none is met.
        """
        cdef Mover disc = Mover(_pair(x), _pair(y), _pair(ux), _pair(uy), radius)
        cdef double least = INF
        cdef int first = -1, k
        cdef bint glides = False
        for k in range(self._count):
            touch = feature_time(&disc, &self._rows[k], k == last)
            if touch.time < least:
                least, first, glides = touch.time, k, touch.glides
        return least, first, glides


cdef DoubleDouble _pair(pair):
    return DoubleDouble(pair[0], pair[1])
