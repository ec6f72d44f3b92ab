"""First impacts of many scenes of two discs and no wall, by PIC and by PIT.

Scene by scene, operation by operation, what the solvers of single scenes do; a test holds them to the same bits.
"""

from libc.math cimport NAN, sqrt

from carom.physics.pair_time cimport NEVER
from carom.solvers.two_discs cimport Disc, Impact, TwoDiscs, collide, meet, move


cdef inline Impact pit(TwoDiscs *s, const double[::1] frames, double restitution) noexcept nogil:
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
    cdef TwoDiscs s
    cdef Impact impact
    with nogil:
        for k in range(time.shape[0]):
            s.first = Disc(p1[k, 0], p1[k, 1], v1[k, 0], v1[k, 1], r1[k], 1.0 / m1[k])
            s.second = Disc(p2[k, 0], p2[k, 1], v2[k, 0], v2[k, 1], r2[k], 1.0 / m2[k])
            impact = pit(&s, instants, restitution) if sampled else meet(&s, until, restitution)
            time[k] = impact.time
            normal[k, 0] = impact.nx
            normal[k, 1] = impact.ny
            after1[k, 0] = s.first.vx
            after1[k, 1] = s.first.vy
            after2[k, 0] = s.second.vx
            after2[k, 1] = s.second.vy
