"""What an impact does: restitution along the line of centres and friction across it, on the paths of one disc or two."""

from cython cimport unlikely
from libc.math cimport sqrt

from carom.physics.friction cimport Grip, friction_impulse, pair_rub
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


cdef inline bint is_one_contact(State *s, Index i) noexcept nogil:
    """Return whether by the TC model an impact of disc `i` now is one contact with its last: then no energy is lost."""
    cdef bint found = False
    if s.law.contact_duration > 0.0 and s.discs[i].inverse_mass > 0.0:
        found = s.clock.now - s.last_impact[i] < s.law.contact_duration
        s.last_impact[i] = s.clock.now
    return found


cdef inline void rub_pair(
    const Grip *grip, Disc *a, Disc *b, Turning *turning_a, Turning *turning_b, const Before *before, double push
) noexcept nogil:
    """Let friction act on two discs that were given a push."""
    dx = b.x - a.x
    dy = b.y - a.y
    distance = sqrt(dx * dx + dy * dy)
    surface = distance * (a.radius * turning_a.spin + b.radius * turning_b.spin)
    yielding = a.inverse_mass * (1.0 + turning_a.ease) + b.inverse_mass * (1.0 + turning_b.ease)
    rub = pair_rub(grip, dx, dy, before.vx2 - before.vx1, before.vy2 - before.vy1, surface, yielding, push)
    a.vx += rub * a.inverse_mass * dy
    a.vy -= rub * a.inverse_mass * dx
    b.vx -= rub * b.inverse_mass * dy
    b.vy += rub * b.inverse_mass * dx
    turning_a.spin -= rub * distance * a.inverse_mass * turning_a.ease / a.radius
    turning_b.spin -= rub * distance * b.inverse_mass * turning_b.ease / b.radius


cdef inline void rub_wall(
    const Grip *grip, Disc *a, Turning *turning, const Wall *w, const Before *before, double pressed
) noexcept nogil:
    """Let the friction of a wall act on a disc that was given a speed off it."""
    slip = before.vx1 * w.ny - before.vy1 * w.nx + a.radius * turning.spin
    rub = friction_impulse(grip, slip, 1.0 + turning.ease, pressed)
    a.vx -= rub * w.ny
    a.vy += rub * w.nx
    turning.spin -= rub * turning.ease / a.radius


cdef inline void collide_pair(State *s, Index i, Index j, double time, bint wanted, bint turns) noexcept nogil:
    """Carry out the impact of discs `i` < `j`, and record it where that is `wanted`; `turns` says whether anything does."""
    a = &s.discs[i]
    b = &s.discs[j]
    advance_clock(s, time)
    cdef bint elastic = is_one_contact(s, i) | is_one_contact(s, j)
    move(a, s.clock.now)
    move(b, s.clock.now)
    dx = b.x - a.x
    dy = b.y - a.y
    cdef Before before = Before(a.vx, a.vy, b.vx, b.vy)
    cdef Spins spins
    restitution = 1.0 if elastic else s.law.restitution
    push = pair_push(dx, dy, b.vx - a.vx, b.vy - a.vy, a.inverse_mass + b.inverse_mass, restitution)
    a.vx += push * a.inverse_mass * dx
    a.vy += push * a.inverse_mass * dy
    b.vx -= push * b.inverse_mass * dx
    b.vy -= push * b.inverse_mass * dy
    if turns:
        spins.first_before, spins.second_before = s.turning[i].spin, s.turning[j].spin
        if s.law.grip.friction > 0.0 and not elastic:
            rub_pair(&s.law.grip, a, b, &s.turning[i], &s.turning[j], &before, push)
        spins.first_after, spins.second_after = s.turning[i].spin, s.turning[j].spin
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
        if turns:
            s.record.spins[s.record.count] = spins
        record_pair(s, i, j, dx / distance, dy / distance, &before)


cdef inline void collide_wall(State *s, Index i, Index k, double time, bint wanted, bint turns) noexcept nogil:
    """Carry out the impact of disc `i` on wall `k`, as `collide_pair` does."""
    a = &s.discs[i]
    cdef Wall w = s.walls[k]
    advance_clock(s, time)
    cdef bint elastic = is_one_contact(s, i)
    move(a, s.clock.now)
    cdef Before before = Before(a.vx, a.vy, 0.0, 0.0)
    cdef Spins spins
    cdef double push = 0.0
    along = a.vx * w.nx + a.vy * w.ny
    if along < 0.0:  # rounding can turn the weakest of grazes into a separation: an impact never pulls
        push = (1.0 + (1.0 if elastic else s.law.wall_restitution)) * along
        a.vx -= push * w.nx
        a.vy -= push * w.ny
    if turns:
        spins = Spins(s.turning[i].spin, 0.0, 0.0, 0.0)
        if s.law.wall_grip.friction > 0.0 and along < 0.0 and not elastic:
            rub_wall(&s.law.wall_grip, a, &s.turning[i], &w, &before, -push)
        spins.first_after = s.turning[i].spin
    a.impacts += 1
    a.last = <int>(-1 - k)
    s.counts.wall_impacts += 1
    s.counts.predictions += 1
    if unlikely(wanted):
        if turns:
            s.record.spins[s.record.count] = spins
        record_wall(s, i, k, along, &before)
