"""Two discs and no wall: they meet once at most, and their impact has a closed form.

One scene at one go: operation by operation what the solvers of any scene do. Tests hold it to the same bits.
"""

from cpython.bytes cimport PyBytes_FromStringAndSize
from libc.math cimport fabs, sqrt

from carom.constants cimport INF, LEAST_ORDINARY, ORDINARY
from carom.physics.pair_time cimport pair_time
from carom.solvers.impact.law cimport bounce_pair
from carom.solvers.impact.resolution cimport are_told_apart
from carom.solvers.impact.structs cimport Impact

cdef struct Disc:
    double x
    double y
    double vx
    double vy
    double radius
    double inverse_mass  # 0 for one that never moves

cdef struct TwoDiscs:
    Disc first
    Disc second

cdef struct State:  # at the end, of the first disc, then of the second
    double position[4]
    double velocity[4]


cdef inline void move(Disc *disc, double wait) noexcept nogil:
    if disc.inverse_mass > 0.0:
        disc.x += disc.vx * wait
        disc.y += disc.vy * wait


cdef inline double go_to_impact(TwoDiscs *s, double until) noexcept nogil:
    """Bring two discs to their impact, if that comes until then; return its instant, infinity for none."""
    a = &s.first
    b = &s.second
    time = pair_time(a.x, a.y, a.vx, a.vy, a.radius, b.x, b.y, b.vx, b.vy, b.radius)
    if not time <= until or time == INF:
        return INF
    move(a, time)
    move(b, time)
    return time


cdef inline void write_velocities(const TwoDiscs *s, double *first, double *second) noexcept nogil:
    first[0], first[1] = s.first.vx, s.first.vy
    second[0], second[1] = s.second.vx, s.second.vy


cdef inline bint carry_out(TwoDiscs *s, double time, double restitution, Impact *row) noexcept nogil:
    """Give two discs in contact their velocities after the impact, and record it; return whether floats tell them apart."""
    a = &s.first
    b = &s.second
    dx = b.x - a.x
    dy = b.y - a.y
    distance = sqrt(dx * dx + dy * dy)
    row.time, row.first, row.second = time, 0, 1
    row.normal[0], row.normal[1] = dx / distance, dy / distance
    write_velocities(s, row.first_before, row.second_before)
    bounce_pair(dx, dy, &a.vx, a.inverse_mass, &b.vx, b.inverse_mass, restitution)
    write_velocities(s, row.first_after, row.second_after)
    return are_told_apart(a.x, a.y, b.x, b.y, a.radius + b.radius)


cdef Disc disc_of(model) except *:
    x, y = model.position_m
    vx, vy = model.velocity_m_s
    return Disc(x, y, vx, vy, model.radius_m, 1.0 / <double> model.mass_kg)


def solve(first, second, double restitution, double end):
    """Solve a scene of two discs.

    Returns:
        The rows of its impacts, none or one, and the positions and velocities at the end, shape ``(2, 2, 2)``, as bytes.
        None where that takes more: a number is not of an ordinary size (`carom.limits`), or they meet too far out.
    """
    cdef TwoDiscs s = TwoDiscs(disc_of(first), disc_of(second))
    cdef Impact impact
    cdef State state
    cdef int k
    for k in range(sizeof(TwoDiscs) // sizeof(double)):
        if not (LEAST_ORDINARY <= fabs((<double *>&s)[k]) <= ORDINARY or (<double *>&s)[k] == 0.0):
            return None
    if not LEAST_ORDINARY <= end <= ORDINARY and end != 0.0:
        return None
    time = go_to_impact(&s, end)
    met = time != INF
    if met and not carry_out(&s, time, restitution, &impact):
        return None
    wait = end - time if met else end
    state.position[0] = s.first.x + s.first.vx * wait
    state.position[1] = s.first.y + s.first.vy * wait
    state.position[2] = s.second.x + s.second.vx * wait
    state.position[3] = s.second.y + s.second.vy * wait
    write_velocities(&s, state.velocity, state.velocity + 2)
    impacts = PyBytes_FromStringAndSize(<char *>&impact, sizeof(Impact) * met)
    return impacts, PyBytes_FromStringAndSize(<char *>&state, sizeof(State))
