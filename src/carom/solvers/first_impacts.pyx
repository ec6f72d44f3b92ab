"""First impacts of many scenes of two discs and no wall, by PIC and by PIT.

Scene by scene, operation by operation, what the solvers of single scenes do; a test holds them to the same bits.
"""

from libc.math cimport NAN, sqrt

from carom.physics.impact_law cimport pair_push
from carom.physics.pair_time cimport NEVER, pair_time

cdef struct Disc:
    double x
    double y
    double vx
    double vy
    double radius
    double inverse_mass  # 0 for one that never moves

cdef struct Scene:
    Disc first
    Disc second

cdef struct Impact:
    double time  # NEVER where there is none
    double nx  # unit normal from first to second
    double ny


cdef inline void move(Disc *disc, double wait) noexcept nogil:
    if disc.inverse_mass > 0.0:
        disc.x += disc.vx * wait
        disc.y += disc.vy * wait


cdef inline Impact collide(Scene *s, double time, double restitution) noexcept nogil:
    """Give two discs in contact their velocities after the impact."""
    a = &s.first
    b = &s.second
    dx = b.x - a.x
    dy = b.y - a.y
    push = pair_push(dx, dy, b.vx - a.vx, b.vy - a.vy, a.inverse_mass + b.inverse_mass, restitution)
    a.vx += push * a.inverse_mass * dx
    a.vy += push * a.inverse_mass * dy
    b.vx -= push * b.inverse_mass * dx
    b.vy -= push * b.inverse_mass * dy
    distance = sqrt(dx * dx + dy * dy)
    return Impact(time, dx / distance, dy / distance)


cdef inline Impact pic(Scene *s, double until, double restitution) noexcept nogil:
    a = &s.first
    b = &s.second
    time = pair_time(a.x, a.y, a.vx, a.vy, a.radius, b.x, b.y, b.vx, b.vy, b.radius)
    if not time <= until or time == NEVER:
        return Impact(NEVER, NAN, NAN)
    move(a, time)
    move(b, time)
    return collide(s, time, restitution)


cdef inline Impact pit(Scene *s, const double[::1] frames, double restitution) noexcept nogil:
    cdef Py_ssize_t k
    a = &s.first
    b = &s.second
    contact = a.radius + b.radius
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
        if along < 0.0 and sqrt(squared) <= contact:
            return collide(s, frames[k], restitution)
        # Rounding alone could turn a pair that separates at its closest point into one that approaches: it is followed
        # until it has plainly passed.
        if along > 2.0**-20 * sqrt(squared) * sqrt(ux * ux + uy * uy):
            break
    return Impact(NEVER, NAN, NAN)


def fill_first_impacts(first, second, double restitution, double until, frames, impacts):
    """Write the first impact of each scene: by PIC, or by PIT where frames are given.

    Args:
        first: Of the first discs: positions, velocities, shape ``(n, 2)``, radii, masses, shape ``(n,)``.
        second: Of the second discs.
        restitution: Of all scenes.
        until: PIC: impacts after it do not count, seconds.
        frames: PIT: instants of the frames, seconds, contiguous floats. None for PIC.
        impacts: What is filled, contiguous: times, shape ``(n,)``, normals, velocities of the first discs after it, and
            of the second, shape ``(n, 2)``, as `carom.solvers.ensemble.FirstImpacts` has them.
    """
    cdef const double[:, :] p1 = first[0], v1 = first[1], p2 = second[0], v2 = second[1]
    cdef const double[:] r1 = first[2], m1 = first[3], r2 = second[2], m2 = second[3]
    cdef double[::1] time = impacts[0]
    cdef double[:, ::1] normal = impacts[1], after1 = impacts[2], after2 = impacts[3]
    cdef bint sampled = frames is not None
    cdef const double[::1] instants = frames if sampled else time
    cdef Py_ssize_t k
    cdef Scene s
    cdef Impact impact
    with nogil:
        for k in range(time.shape[0]):
            s.first = Disc(p1[k, 0], p1[k, 1], v1[k, 0], v1[k, 1], r1[k], 1.0 / m1[k])
            s.second = Disc(p2[k, 0], p2[k, 1], v2[k, 0], v2[k, 1], r2[k], 1.0 / m2[k])
            impact = pit(&s, instants, restitution) if sampled else pic(&s, until, restitution)
            time[k] = impact.time
            normal[k, 0] = impact.nx
            normal[k, 1] = impact.ny
            after1[k, 0] = s.first.vx
            after1[k, 1] = s.first.vy
            after2[k, 0] = s.second.vx
            after2[k, 1] = s.second.vy
