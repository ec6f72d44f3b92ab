"""The compiled form of `resolution.py`, to the same bits."""

from cython cimport likely
from libc.math cimport fabs, sqrt

from carom.constants cimport FARTHEST, INF, ULP
from carom.physics.double_double cimport lesser

cdef inline bint are_told_apart(double x1, double y1, double x2, double y2, double reach) noexcept nogil:
    return fabs(x1) + fabs(y1) + fabs(x2) + fabs(y2) <= FARTHEST * reach


cdef inline double size_of(double x, double y, double radius) noexcept nogil:
    return fabs(x) + fabs(y) + radius


cdef inline double pair_resolution(double sizes, double reach, double ux, double uy, double speed) noexcept nogil:
    error = 5.0 * ULP * sizes
    # So far from a graze the first is the lesser by a factor of two or more: for error / speed <= 2^10 error / u, and
    # graze >= sqrt(2 2^22 error^2) / u.
    if likely(speed >= 2.0**-10 * (fabs(ux) + fabs(uy)) and error <= 2.0**-22 * reach and speed > 0.0):
        return error / speed
    fast = sqrt(ux * ux + uy * uy)
    graze = reach * sqrt(2.0 * (error / reach)) / fast if fast > 0.0 else INF
    return lesser(error / speed, graze) if speed > 0.0 else graze


cdef inline double wall_resolution(double sizes, double speed) noexcept nogil:
    return 5.0 * ULP * sizes / speed if speed > 0.0 else INF


cdef inline double clock_resolution(double time) noexcept nogil:
    return 2.0 * ULP * time
