"""Python binding of `damping.h`: damping as a change of the time variable."""

import numpy as np

from carom.core.carom_core cimport Impact, Index, Spins

cdef extern from "carom/core/damping.h" nogil:
    # the factor by which damping multiplies a speed during a time
    cpdef double kept "remaining_velocity"(double rate, double seconds)
    # the time in which an undamped disc moves as far as a damped disc in a time
    cpdef double undamped "undamped_time"(double rate, double seconds)
    # the time in which a damped disc moves as far as an undamped disc in a time; infinity for never
    cpdef double damped "damped_time"(double rate, double undamped_s)
    # the greatest undamped time t for which damped(rate, t) is at most a time
    cpdef double latest_undamped "latest_undamped_time"(double rate, double seconds)
    struct LogAnchor:
        pass

    LogAnchor first_anchor()
    double damped_time_from(LogAnchor *anchor, double rate, double undamped)
    void c_slow_impacts "slow_impacts"(double rate, Impact *impacts, Index count)
    void c_slow_spins "slow_spins"(double rate, const Impact *undamped, Spins *spins, Index count)


def all_damped(double rate, undamped_s):
    """Return the result of `damped` for each time of an array, shape ``(n,)``."""
    cdef const double[::1] times = np.ascontiguousarray(undamped_s, np.float64)
    found = np.empty(times.shape[0])
    cdef double[::1] rows = found
    cdef Index k
    cdef LogAnchor anchor = first_anchor()
    with nogil:
        for k in range(times.shape[0]):
            rows[k] = damped_time_from(&anchor, rate, times[k])
    return found


def slow_impacts(double rate, unsigned char[::1] impacts):
    """Convert the bytes of impacts of an undamped run, in place, to the impacts of the damped run."""
    if impacts.shape[0] > 0:
        with nogil:
            c_slow_impacts(rate, <Impact *>&impacts[0], impacts.shape[0] // sizeof(Impact))


def slow_spins(double rate, const unsigned char[::1] undamped, unsigned char[::1] spins):
    """Convert the bytes of spins in place, as `slow_impacts` does. `undamped` contains the unconverted impacts."""
    if spins.shape[0] > 0:
        with nogil:
            c_slow_spins(rate, <const Impact *>&undamped[0], <Spins *>&spins[0], spins.shape[0] // sizeof(Spins))
