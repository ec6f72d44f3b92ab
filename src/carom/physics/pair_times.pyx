"""The time of impact of arrays of pairs of discs, pair by pair that of `pair_time` to the bit.

Some pairs at a time are laid out as columns, so that each step is a loop that a compiler can take apart into vectors:
the plain form rules most pairs out, one refinement answers nearly all others, the error-free form what is left.
"""

from libc.math cimport NAN, fabs

from carom.physics.pair_time cimport (
    NEVER, Encounter, approach, discriminant, encounter, exact_pair_time, refined_time,
)

cdef extern from *:
    """
    #define carom_LEAST 0x1p-101
    #define carom_MOST 0x1p100
    """
    const double LEAST "carom_LEAST"  # the sizes of ordinary numbers, as in any_size.py
    const double MOST "carom_MOST"

cdef enum:
    BLOCK = 128  # pairs at a time: 17 columns of them, 17 kB, stay in the first-level cache; 64 to 512 take as long

ctypedef double[BLOCK] Column

cdef struct Pairs:  # some pairs; their numbers as `carom.time_of_impact` has them
    Py_ssize_t count
    Py_ssize_t[BLOCK] row  # where each stood before those that are ruled out were dropped
    Column x1
    Column y1
    Column vx1
    Column vy1
    Column r1
    Column x2
    Column y2
    Column vx2
    Column vy2
    Column r2
    Column b  # the plain form's ``d.u``
    Column d  # and ``a R^2 - (d x u)^2``
    Column never  # 0 unless these rule an impact out
    Column other  # 0 unless a number is not of ordinary size
    Column time


cdef inline double unusual(double a) noexcept nogil:
    """Return 0 for an ordinary size and for 0, else 1."""
    size = fabs(a)
    return 1.0 if size >= MOST else ((1.0 if size < LEAST else 0.0) if size > 0.0 else 0.0)


cdef inline void take(const double[:] values, Py_ssize_t start, Py_ssize_t count, double *column) noexcept nogil:
    """Copy some values into a column; the two most frequent distances of values are loops of their own, for vectors."""
    cdef Py_ssize_t k, stride = values.strides[0]
    first = <const char *>&values[start]
    if stride == sizeof(double):
        for k in range(count):
            column[k] = (<const double *>first)[k]
    elif stride == 2 * sizeof(double):
        for k in range(count):
            column[k] = (<const double *>first)[2 * k]
    else:
        for k in range(count):
            column[k] = (<const double *>(first + k * stride))[0]


cdef inline void rule_out(Pairs *p) noexcept nogil:
    """Ask the plain form which pairs separate or miss each other; those of other than ordinary sizes drop out, too."""
    cdef Py_ssize_t k
    for k in range(p.count):
        dx = p.x2[k] - p.x1[k]
        dy = p.y2[k] - p.y1[k]
        ux = p.vx2[k] - p.vx1[k]
        uy = p.vy2[k] - p.vy1[k]
        b = approach(dx, dy, ux, uy)
        reach = p.r1[k] + p.r2[k]
        d = discriminant(dx, dy, ux, uy, reach)
        p.b[k] = b.value
        p.d[k] = d.value
        p.other[k] = unusual(dx) + unusual(dy) + unusual(ux) + unusual(uy) + unusual(reach)
        p.never[k] = p.other[k] + (1.0 if d.value < -d.error else (1.0 if b.value > b.error else 0.0))


cdef inline void keep_possible(Pairs *p) noexcept nogil:
    """Drop the pairs that are ruled out."""
    cdef Py_ssize_t k, row, kept = 0
    for k in range(p.count):
        p.row[kept] = k
        kept += p.never[k] == 0.0
    if kept == p.count:
        return
    p.count = kept
    for k in range(kept):
        row = p.row[k]
        p.x1[k] = p.x1[row]
        p.y1[k] = p.y1[row]
        p.vx1[k] = p.vx1[row]
        p.vy1[k] = p.vy1[row]
        p.r1[k] = p.r1[row]
        p.x2[k] = p.x2[row]
        p.y2[k] = p.y2[row]
        p.vx2[k] = p.vx2[row]
        p.vy2[k] = p.vy2[row]
        p.r2[k] = p.r2[row]
        p.b[k] = p.b[row]
        p.d[k] = p.d[row]


cdef inline Encounter pair(Pairs *p, Py_ssize_t k) noexcept nogil:
    return encounter(p.x1[k], p.y1[k], p.vx1[k], p.vy1[k], p.r1[k], p.x2[k], p.y2[k], p.vx2[k], p.vy2[k], p.r2[k])


cdef inline void solve(Pairs *p) noexcept nogil:
    """Find the time of each pair that is left."""
    cdef Py_ssize_t k
    for k in range(p.count):
        p.time[k] = refined_time(p.b[k], p.d[k], pair(p, k))
    for k in range(p.count):
        if p.time[k] < 0.0:
            p.time[k] = exact_pair_time(pair(p, k))


def fill_pair_times(
    const double[:, :] p1, const double[:, :] v1, const double[:] r1,
    const double[:, :] p2, const double[:, :] v2, const double[:] r2, double[::1] times,
):
    """Write `carom.time_of_impact` of each pair into `times`, shape ``(n,)``; NaN for other than ordinary sizes."""
    cdef Py_ssize_t start, k, count = times.shape[0]
    cdef Pairs p
    with nogil:
        for start in range(0, count, 128):
            p.count = min(BLOCK, count - start)
            take(p1[:, 0], start, p.count, p.x1)
            take(p1[:, 1], start, p.count, p.y1)
            take(v1[:, 0], start, p.count, p.vx1)
            take(v1[:, 1], start, p.count, p.vy1)
            take(r1, start, p.count, p.r1)
            take(p2[:, 0], start, p.count, p.x2)
            take(p2[:, 1], start, p.count, p.y2)
            take(v2[:, 0], start, p.count, p.vx2)
            take(v2[:, 1], start, p.count, p.vy2)
            take(r2, start, p.count, p.r2)
            rule_out(&p)
            for k in range(p.count):
                times[start + k] = NEVER if p.other[k] == 0.0 else NAN
            keep_possible(&p)
            solve(&p)
            for k in range(p.count):
                times[start + p.row[k]] = p.time[k]
