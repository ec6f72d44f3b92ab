"""Two discs and no wall: they meet once at most, and their impact has a closed form.

One scene at one go, or the first impacts of many, by PIC and by PIT: operation by operation what the solvers of any scene
do. Tests hold them to the same bits.
"""

from cpython.bytes cimport PyBytes_FromStringAndSize
from libc.math cimport NAN, fabs, sqrt

from carom.physics.impact_law cimport pair_push
from carom.physics.pair_time cimport NEVER, pair_time
from carom.solvers.event_driven.layout cimport Impact
from carom.solvers.resolution cimport are_told_apart

from carom.solvers.resolution import too_far_out

cdef extern from *:
    """
    #define carom_LEAST 0x1p-200
    #define carom_MOST 0x1p200
    """
    const double LEAST "carom_LEAST"  # of `ORDINARY` in limits.py
    const double MOST "carom_MOST"

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


cdef inline double instant_of_pic(TwoDiscs *s, double until) noexcept nogil:
    """Bring two discs to their impact, if that comes until then; return its instant, infinity for none."""
    a = &s.first
    b = &s.second
    time = pair_time(a.x, a.y, a.vx, a.vy, a.radius, b.x, b.y, b.vx, b.vy, b.radius)
    if not time <= until or time == NEVER:
        return NEVER
    move(a, time)
    move(b, time)
    return time


cdef inline double instant_of_pit(TwoDiscs *s, const double[::1] frames) noexcept nogil:
    """Bring two discs to the first frame at which they overlap and approach; return its instant, infinity for none."""
    cdef Py_ssize_t k
    a = &s.first
    b = &s.second
    for k in range(frames.shape[0]):
        if k > 0:
            move(a, frames[k] - frames[k - 1])
            move(b, frames[k] - frames[k - 1])
        dx = b.x - a.x
        dy = b.y - a.y
        ux = b.vx - a.vx
        uy = b.vy - a.vy
        along = dx * ux + dy * uy
        squared = dx * dx + dy * dy
        if along < 0.0 and sqrt(squared) <= a.radius + b.radius:
            return frames[k]
        # Rounding alone could turn a pair that separates at its closest point into one that approaches: it is followed
        # until it has plainly passed.
        if along > 2.0**-20 * sqrt(squared) * sqrt(ux * ux + uy * uy):
            break
    return NEVER


cdef inline void write_velocities(const TwoDiscs *s, double *first, double *second) noexcept nogil:
    first[0], first[1] = s.first.vx, s.first.vy
    second[0], second[1] = s.second.vx, s.second.vy


cdef inline bint carry_out(TwoDiscs *s, double time, double restitution, Impact *row) noexcept nogil:
    """Give two discs in contact their velocities after the impact, and record it; no impact at `NEVER`.

    Returns whether floats tell their centres apart.
    """
    a = &s.first
    b = &s.second
    row.time, row.first, row.second = time, 0, 1
    row.normal[0] = row.normal[1] = NAN
    write_velocities(s, row.first_before, row.second_before)
    if time != NEVER:
        dx = b.x - a.x
        dy = b.y - a.y
        push = pair_push(dx, dy, b.vx - a.vx, b.vy - a.vy, a.inverse_mass + b.inverse_mass, restitution)
        a.vx += push * a.inverse_mass * dx
        a.vy += push * a.inverse_mass * dy
        b.vx -= push * b.inverse_mass * dx
        b.vy -= push * b.inverse_mass * dy
        distance = sqrt(dx * dx + dy * dy)
        row.normal[0], row.normal[1] = dx / distance, dy / distance
    write_velocities(s, row.first_after, row.second_after)
    return time == NEVER or are_told_apart(a.x, a.y, b.x, b.y, a.radius + b.radius)


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
        if not (LEAST <= fabs((<double *>&s)[k]) <= MOST or (<double *>&s)[k] == 0.0):
            return None
    if not LEAST <= end <= MOST and end != 0.0:
        return None
    time = instant_of_pic(&s, end)
    if not carry_out(&s, time, restitution, &impact):
        return None
    met = time != NEVER
    wait = end - time if met else end
    state.position[0] = s.first.x + s.first.vx * wait
    state.position[1] = s.first.y + s.first.vy * wait
    state.position[2] = s.second.x + s.second.vx * wait
    state.position[3] = s.second.y + s.second.vy * wait
    write_velocities(&s, state.velocity, state.velocity + 2)
    impacts = PyBytes_FromStringAndSize(<char *>&impact, sizeof(Impact) * met)
    return impacts, PyBytes_FromStringAndSize(<char *>&state, sizeof(State))


def fill_first_impacts(first, second, double restitution, double until, frames, double[:, ::1] rows):
    """Write the first impact of each scene: by PIC, or by PIT where frames are given.

    Args:
        first: Of the first discs: positions, velocities, shape ``(n, 2)``, radii, masses, shape ``(n,)``.
        second: Of the second discs.
        restitution: Of all scenes.
        until: PIC: impacts after it do not count, seconds.
        frames: PIT: instants of the frames, seconds, contiguous floats. None for PIC.
        rows: What is filled: rows of `carom.trace.IMPACT_DTYPE` seen as floats; the time is infinity where there is none.

    Raises:
        InputError: Two discs meet so far out that floats do not tell their centres apart.
    """
    cdef const double[:, :] p1 = first[0], v1 = first[1], p2 = second[0], v2 = second[1]
    cdef const double[:] r1 = first[2], m1 = first[3], r2 = second[2], m2 = second[3]
    cdef bint sampled = frames is not None
    cdef const double[::1] instants = frames if sampled else None
    cdef Py_ssize_t k, too_far = 0
    cdef TwoDiscs s
    with nogil:
        for k in range(rows.shape[0]):
            s.first = Disc(p1[k, 0], p1[k, 1], v1[k, 0], v1[k, 1], r1[k], 1.0 / m1[k])
            s.second = Disc(p2[k, 0], p2[k, 1], v2[k, 0], v2[k, 1], r2[k], 1.0 / m2[k])
            time = instant_of_pit(&s, instants) if sampled else instant_of_pic(&s, until)
            too_far += not carry_out(&s, time, restitution, <Impact *>&rows[k, 0])
    if too_far > 0:
        raise too_far_out()
