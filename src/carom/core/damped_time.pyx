"""Python binding of damping as a change of time, `damping.h`."""

import numpy as np

cdef extern from "carom/core/damping.h" nogil:
    double remaining_velocity(double rate, double time)
    double undamped_time(double rate, double time)
    double damped_time(double rate, double undamped)
    double latest_undamped_time(double rate, double time)


def kept(double rate, double seconds):
    """Return the factor by which damping has decreased a speed after some seconds."""
    return remaining_velocity(rate, seconds)


def undamped(double rate, double seconds):
    """Return the time in which an undamped disc moves as far as a damped one does in some seconds."""
    return undamped_time(rate, seconds)


def damped(double rate, double undamped_s):
    """Return the time in which a damped disc moves as far as an undamped one in `undamped_s`; infinity for never."""
    return damped_time(rate, undamped_s)


def latest_undamped(double rate, double seconds):
    """Return the greatest undamped time that `damped` maps to at most `seconds`."""
    return latest_undamped_time(rate, seconds)


def all_damped(double rate, undamped_s):
    """Return `damped` of each time of an array, shape ``(n,)``."""
    cdef const double[::1] times = np.ascontiguousarray(undamped_s, np.float64)
    found = np.empty(times.shape[0])
    cdef double[::1] rows = found
    cdef Py_ssize_t k
    with nogil:
        for k in range(times.shape[0]):
            rows[k] = damped_time(rate, times[k])
    return found
