"""The compiled physics one function at a time, for tests: whatever runs inlines them, so nothing else can call them."""

from carom.physics cimport double_double, impact_law, wall_time as wall
from carom.physics.pair_time cimport encounter, exact_pair_time
from carom.physics.pair_time cimport pair_time as compiled_pair_time

cdef extern from "float.h":
    int FLT_EVAL_METHOD

#: 0 where every operation is rounded to its own type, as IEEE 754 demands.
EVALUATION_METHOD = FLT_EVAL_METHOD


def two_sum(double a, double b):
    s = double_double.two_sum(a, b)
    return s.high, s.low


def two_diff(double a, double b):
    s = double_double.two_diff(a, b)
    return s.high, s.low


def two_prod(double a, double b):
    p = double_double.two_prod(a, b)
    return p.high, p.low


def pair_time(
    double x1, double y1, double vx1, double vy1, double r1, double x2, double y2, double vx2, double vy2, double r2
):
    return compiled_pair_time(x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2)


def exact_time(
    double x1, double y1, double vx1, double vy1, double r1, double x2, double y2, double vx2, double vy2, double r2
):
    """Return the time of impact by the error-free form alone."""
    return exact_pair_time(encounter(x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2))


def wall_time(double x, double y, double vx, double vy, double radius, double qx, double qy, double nx, double ny):
    return wall.wall_time(x, y, vx, vy, radius, qx, qy, nx, ny)


def pair_push(double dx, double dy, double ux, double uy, double inverse_masses, double restitution):
    return impact_law.pair_push(dx, dy, ux, uy, inverse_masses, restitution)
