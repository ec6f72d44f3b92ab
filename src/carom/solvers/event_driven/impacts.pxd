"""What an impact does: Newton's law of restitution along the line of centres, on the paths of one disc or two."""

from cython cimport unlikely
from libc.math cimport sqrt

from carom.physics.impact_law cimport pair_push
from carom.solvers.event_driven.layout cimport *
from carom.solvers.event_driven.record cimport record_pair, record_wall
from carom.solvers.resolution cimport are_told_apart


cdef inline double reported_time(const Clock *clock, double time) noexcept nogil:
    """Return the time since the start of a time since the epoch, never less than one reported before."""
    since_start = clock.epoch + (clock.epoch_rest + time)
    return since_start if since_start > clock.reported else clock.reported


cdef inline void advance_clock(State *s, double time) noexcept nogil:
    """Bring the clock to the time of an impact, never back, and count it."""
    if time > s.clock.now:
        s.clock.now = time
        s.counts.at_instant = 0
    s.clock.reported = reported_time(&s.clock, s.clock.now)
    s.counts.impacts += 1
    s.counts.epoch_impacts += 1
    s.counts.at_instant += 1


cdef inline void move(Disc *a, double time) noexcept nogil:
    """Bring a disc forward along its path; one that never moves stands where it stood at the start."""
    if a.inverse_mass > 0.0:
        wait = time - a.time
        a.x += a.vx * wait
        a.y += a.vy * wait
        a.time = time


cdef inline double restitution_now(State *s, Index i, double restitution) noexcept nogil:
    """Return the restitution of an impact of disc `i` now: 1 where by the TC model it is one contact with its last."""
    if s.law.contact_duration > 0.0 and s.discs[i].inverse_mass > 0.0:
        if s.clock.now - s.last_impact[i] < s.law.contact_duration:
            restitution = 1.0
        s.last_impact[i] = s.clock.now
    return restitution


cdef inline void collide_pair(State *s, Index i, Index j, double time, bint wanted) noexcept nogil:
    """Carry out the impact of discs `i` < `j`, and record it where that is `wanted`."""
    a = &s.discs[i]
    b = &s.discs[j]
    advance_clock(s, time)
    restitution = restitution_now(s, j, restitution_now(s, i, s.law.restitution))
    move(a, s.clock.now)
    move(b, s.clock.now)
    dx = b.x - a.x
    dy = b.y - a.y
    cdef Before before = Before(a.vx, a.vy, b.vx, b.vy)
    push = pair_push(dx, dy, b.vx - a.vx, b.vy - a.vy, a.inverse_mass + b.inverse_mass, restitution)
    a.vx += push * a.inverse_mass * dx
    a.vy += push * a.inverse_mass * dy
    b.vx -= push * b.inverse_mass * dx
    b.vy -= push * b.inverse_mass * dy
    a.impacts += 1
    b.impacts += 1
    a.last = <int>j
    b.last = <int>i
    distance2 = dx * dx + dy * dy
    s.counts.too_far += not are_told_apart(a.x, a.y, b.x, b.y, a.radius + b.radius)
    s.virial -= push * distance2
    s.counts.predictions += <Index>(a.inverse_mass > 0.0) + <Index>(b.inverse_mass > 0.0)
    if unlikely(wanted):  # which keeps it out of the way of a run without a record
        distance = sqrt(distance2)
        record_pair(s, i, j, dx / distance, dy / distance, &before)


cdef inline void collide_wall(State *s, Index i, Index k, double time, bint wanted) noexcept nogil:
    """Carry out the impact of disc `i` on wall `k`, and record it where that is `wanted`."""
    a = &s.discs[i]
    cdef Wall w = s.walls[k]
    advance_clock(s, time)
    restitution = restitution_now(s, i, s.law.wall_restitution)
    move(a, s.clock.now)
    cdef Before before = Before(a.vx, a.vy, 0.0, 0.0)
    along = a.vx * w.nx + a.vy * w.ny
    if along < 0.0:  # rounding can turn the weakest of grazes into a separation: an impact never pulls
        push = (1.0 + restitution) * along
        a.vx -= push * w.nx
        a.vy -= push * w.ny
    a.impacts += 1
    a.last = <int>(-1 - k)
    s.counts.wall_impacts += 1
    s.counts.predictions += 1
    if unlikely(wanted):
        record_wall(s, i, k, along, &before)
