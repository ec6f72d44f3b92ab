"""Two discs and no wall: they meet once at most, and their impact has a closed form."""

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

cdef struct TwoDiscs:
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


cdef inline Impact collide(TwoDiscs *s, double time, double restitution) noexcept nogil:
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


cdef inline Impact meet(TwoDiscs *s, double until, double restitution) noexcept nogil:
    """Bring two discs to their impact and through it, if that comes until then; else leave them where they are."""
    a = &s.first
    b = &s.second
    time = pair_time(a.x, a.y, a.vx, a.vy, a.radius, b.x, b.y, b.vx, b.vy, b.radius)
    if not time <= until or time == NEVER:
        return Impact(NEVER, NAN, NAN)
    move(a, time)
    move(b, time)
    return collide(s, time, restitution)
