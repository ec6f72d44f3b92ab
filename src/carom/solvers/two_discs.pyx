"""A scene of two discs and no wall, solved at one go: compiled, `carom.solvers.plain.two_discs` is the plain form."""

from cpython.bytes cimport PyBytes_FromStringAndSize
from libc.math cimport fabs

cdef extern from *:
    """
    #define carom_LEAST 0x1p-200
    #define carom_MOST 0x1p200
    """
    const double LEAST "carom_LEAST"  # of `ORDINARY` in limits.py
    const double MOST "carom_MOST"

cdef struct Row:  # of `carom.trace.IMPACT_DTYPE`
    double time
    long long first
    long long second
    double normal[2]
    double before[4]  # velocity of the first disc, then of the second
    double after[4]

cdef struct Solution:  # of `carom.solvers.plain.two_discs.SOLUTION_DTYPE`
    Row impact
    double position[4]  # at the end, of the first disc, then of the second
    double velocity[4]
    long long impacts[2]


cdef Disc disc_of(model) except *:
    x, y = model.position_m
    vx, vy = model.velocity_m_s
    return Disc(x, y, vx, vy, model.radius_m, 1.0 / <double> model.mass_kg)


cdef bint is_ordinary(double a) noexcept nogil:
    return LEAST <= fabs(a) <= MOST or a == 0.0


cdef bint are_ordinary(const Disc *d) noexcept nogil:
    return (
        is_ordinary(d.x)
        and is_ordinary(d.y)
        and is_ordinary(d.vx)
        and is_ordinary(d.vy)
        and is_ordinary(d.radius)
        and is_ordinary(d.inverse_mass)
    )


def solve(first, second, double restitution, double end):
    """Return the solution of two discs of a scene as bytes, see `carom.solvers.plain.two_discs.solve`."""
    cdef TwoDiscs s = TwoDiscs(disc_of(first), disc_of(second))
    if not (are_ordinary(&s.first) and are_ordinary(&s.second) and is_ordinary(end)):
        return None
    cdef Solution solution
    cdef Row* row = &solution.impact
    row.before[0], row.before[1], row.before[2], row.before[3] = s.first.vx, s.first.vy, s.second.vx, s.second.vy
    impact = meet(&s, end, restitution)
    met = impact.time != NEVER
    row.after[0], row.after[1], row.after[2], row.after[3] = s.first.vx, s.first.vy, s.second.vx, s.second.vy
    row.time, row.normal[0], row.normal[1] = impact.time, impact.nx, impact.ny
    row.first, row.second = 0, 1
    wait = end - impact.time if met else end
    solution.position[0] = s.first.x + s.first.vx * wait
    solution.position[1] = s.first.y + s.first.vy * wait
    solution.position[2] = s.second.x + s.second.vx * wait
    solution.position[3] = s.second.y + s.second.vy * wait
    solution.velocity[0], solution.velocity[1] = s.first.vx, s.first.vy
    solution.velocity[2], solution.velocity[3] = s.second.vx, s.second.vy
    solution.impacts[0] = solution.impacts[1] = met
    return PyBytes_FromStringAndSize(<char*> &solution, sizeof(Solution))
