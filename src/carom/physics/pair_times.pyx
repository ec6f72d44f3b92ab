"""The time of impact of arrays of pairs of discs: one loop over the compiled `pair_time`."""

from carom.physics.pair_time cimport pair_time


def fill_pair_times(const double[:, ::1] columns, double[::1] times):
    """Write the seconds until each pair of discs collides into `times`.

    Args:
        columns: Ten columns of floats, shape ``(10, n)``, in the order of the arguments of `carom.physics.pair_time`.
        times: Shape ``(n,)``.
    """
    cdef Py_ssize_t k
    if columns.shape[0] != 10 or columns.shape[1] != times.shape[0]:
        raise ValueError("columns must have shape (10, n), times (n,)")
    with nogil:
        for k in range(times.shape[0]):
            times[k] = pair_time(
                columns[0, k], columns[1, k], columns[2, k], columns[3, k], columns[4, k],
                columns[5, k], columns[6, k], columns[7, k], columns[8, k], columns[9, k],
            )
