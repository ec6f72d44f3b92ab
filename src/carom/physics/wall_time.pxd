"""The compiled form of `wall_time.py`, operation by operation; a test holds the two to the same bits."""

from carom.constants cimport INF
from carom.physics.double_double cimport DoubleDouble, add_product, no_terms, rounded, two_diff, two_prod
from carom.physics.pair_time cimport approach


cdef inline DoubleDouble wall_gap(
    double x, double y, double radius, double qx, double qy, double nx, double ny
) noexcept nogil:
    dx = two_diff(x, qx)
    dy = two_diff(y, qy)
    total = add_product(add_product(no_terms(), dx.high, nx), dx.low, nx)
    total = add_product(add_product(total, dy.high, ny), dy.low, ny)
    return rounded(add_product(total, -radius, 1.0))


cdef inline DoubleDouble wall_speed(double vx, double vy, double nx, double ny) noexcept nogil:
    return rounded(add_product(add_product(no_terms(), vx, nx), vy, ny))


cdef inline double quotient(DoubleDouble gap, DoubleDouble speed) noexcept nogil:
    t = -gap.high / speed.high
    product = two_prod(t, speed.high)
    return t - (((gap.high + product.high) + product.low) + (gap.low + t * speed.low)) / speed.high


cdef inline double wall_time(
    double x, double y, double vx, double vy, double radius, double qx, double qy, double nx, double ny
) noexcept nogil:
    toward = approach(vx, vy, nx, ny)
    if toward.value > toward.error:
        return INF
    speed = wall_speed(vx, vy, nx, ny)
    if not speed.high < 0.0:
        return INF
    gap = wall_gap(x, y, radius, qx, qy, nx, ny)
    if gap.high <= 0.0:
        return 0.0
    return quotient(gap, speed)
