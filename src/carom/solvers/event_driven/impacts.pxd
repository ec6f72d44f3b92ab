"""An impact of the event-driven kernel: the clock goes on, the discs are brought there, the law acts, and it is recorded."""

from cython cimport unlikely
from libc.math cimport sqrt

from carom.physics.arc_time cimport reach_of
from carom.physics.feature_time cimport Direction, normal_at
from carom.physics.features cimport FACE, PLANE, VERTEX, Feature, Mover
from carom.solvers.event_driven.exits cimport mover_of
from carom.solvers.event_driven.grid cimport widen
from carom.solvers.event_driven.layout cimport *
from carom.solvers.event_driven.paths cimport driven_row, seen_by, surface_of
from carom.solvers.impact.law cimport collide_discs, collide_wall
from carom.solvers.impact.record cimport record_impact
from carom.solvers.impact.resolution cimport (
    are_told_apart, clock_resolution, pair_resolution, size_of, wall_resolution,
)


cdef inline double reported_time(const Clock *clock, double time) noexcept nogil:
    """Return the time since the start of a time since the epoch, never less than one reported before."""
    since_start = clock.epoch + (clock.epoch_rest + time)
    return since_start if since_start > clock.reported else clock.reported


cdef inline void bring_clock(State *s, double time) noexcept nogil:
    """Bring the clock to a time, never back."""
    if time > s.clock.now:
        s.clock.now = time
        s.counts.at_instant = 0
    s.clock.reported = reported_time(&s.clock, s.clock.now)


cdef inline void advance_clock(State *s, double time) noexcept nogil:
    """Bring the clock to the time of an impact, never back, and count it."""
    bring_clock(s, time)
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


cdef inline Body body_of(const State *s, Index i, bint turns) noexcept nogil:
    """Return disc `i` as the law sees it."""
    a = &s.discs[i]
    return Body(&a.vx, a.inverse_mass, a.radius, &s.turning[i if turns else 0])


cdef inline void carry_out_pair(State *s, Index i, Index j, double time, bint wanted, bint turns) noexcept nogil:
    """Carry out the impact of discs `i` < `j`, and record it where that is `wanted`; `turns` says whether anything does."""
    a = &s.discs[i]
    b = &s.discs[j]
    advance_clock(s, time)
    cdef bint elastic = is_one_contact(s, i) | is_one_contact(s, j)
    move(a, s.clock.now)
    move(b, s.clock.now)
    dx = b.x - a.x
    dy = b.y - a.y
    cdef Before before = Before([a.vx, a.vy], [b.vx, b.vy])
    cdef Body first = body_of(s, i, turns)
    cdef Body second = body_of(s, j, turns)
    cdef Spins spins
    collide_discs(&s.law, dx, dy, &first, &second, elastic, turns, &spins)
    a.impacts += 1
    b.impacts += 1
    a.last = <int>j
    b.last = <int>i
    distance2 = dx * dx + dy * dy
    reach = a.radius + b.radius
    s.counts.too_far += not are_told_apart(a.x, a.y, b.x, b.y, reach)
    s.counts.predictions += <Index>(a.inverse_mass > 0.0) + <Index>(b.inverse_mass > 0.0)
    if unlikely(wanted):  # which keeps it out of the way of a run without a record
        distance = sqrt(distance2)
        nx = dx / distance
        ny = dy / distance
        ux = before.first[0] - before.second[0]
        uy = before.first[1] - before.second[1]
        sizes = size_of(a.x, a.y, a.radius) + size_of(b.x, b.y, b.radius)
        known = pair_resolution(sizes, reach, ux, uy, ux * nx + uy * ny) + clock_resolution(s.clock.reported)
        record_impact(
            &s.record, s.clock.reported, i, j, nx, ny, &before, &a.vx, &b.vx, &spins, a.x, a.y, NO_FEATURE, known,
            s.law.contact.friction > 0.0, a.inverse_mass > 0.0, b.inverse_mass > 0.0, NO_FEATURE, False,
        )


cdef inline void carry_out_wall(State *s, Index i, Index k, double time, bint wanted, bint turns) noexcept nogil:
    """Carry out the impact of disc `i`, which moves, on wall `k`, as `carry_out_pair` does."""
    a = &s.discs[i]
    cdef Wall w = s.walls[k]
    advance_clock(s, time)
    cdef bint elastic = is_one_contact(s, i)
    move(a, s.clock.now)
    cdef Before before = Before([a.vx, a.vy], [0.0, 0.0])
    cdef Body body = body_of(s, i, turns)
    cdef Spins spins
    along = collide_wall(&s.law, &w, NULL, &body, elastic, turns, &spins)
    a.impacts += 1
    a.last = <int>(-1 - k)
    s.counts.wall_impacts += 1
    s.counts.predictions += 1
    if unlikely(wanted):
        sizes = size_of(a.x, a.y, a.radius) + size_of(w.x, w.y, 0.0)
        known = wall_resolution(sizes, -along) + clock_resolution(s.clock.reported)
        record_impact(
            &s.record, s.clock.reported, i, -1 - k, -w.nx, -w.ny, &before, &a.vx, before.second, &spins, a.x, a.y, k, known,
            s.law.wall_contact.friction > 0.0, True, False, NO_FEATURE, False,
        )


cdef inline double feature_resolution(
    const Feature *f, const Disc *a, double ux, double uy, double speed, bint again
) noexcept nogil:
    """Return how well the instant is known at which a disc with a velocity u, as seen from there, met a feature.

    The disc is in its own place, whose coordinates are rounded. `speed` is that along the normal. One that comes back to
    an arc with nothing between meets it a chord later, whatever the gap: `again`.
    """
    cdef Mover disc = mover_of(a)
    sizes = size_of(a.x, a.y, a.radius)
    if again:
        return 0.0
    if f.kind == PLANE:
        return wall_resolution(sizes + size_of(f.x.high, f.y.high, 0.0), speed)
    if f.kind == FACE:
        return wall_resolution(sizes + size_of(f.x.high, f.y.high, f.half_width), speed)
    if f.kind == VERTEX:
        sizes += size_of(f.x.high, f.y.high, f.half_width)
        return pair_resolution(sizes, a.radius + f.half_width, ux, uy, speed)
    sizes += size_of(f.x.high, f.y.high, f.size.high + f.half_width)
    return pair_resolution(sizes, reach_of(&disc, f).high, ux, uy, speed)


cdef inline Direction carry_out_feature(State *s, Index i, Index k, double time, bint wanted) noexcept nogil:
    """Carry out the impact of disc `i`, which moves, on feature `k`, as `carry_out_pair` does; return the normal."""
    a = &s.discs[i]
    f = &s.features[k]
    law = &s.wall_laws[f.wall]
    cdef bint turns = s.record.turns
    cdef bint again = a.last == -1 - k
    advance_clock(s, time)
    cdef bint elastic = is_one_contact(s, i)
    move(a, s.clock.now)
    widen(&s.visited, a.x, a.y)
    cdef Disc relative
    cdef const Disc *seen = a
    cdef Surface surface = Surface(0.0, 0.0, 0.0)
    row = driven_row(&s.driving, -1 - <Index>f.wall)
    if row != NULL:
        relative = seen_by(s, a, row, a.time)
        seen = &relative
        surface = surface_of(s, row, a.time)
    cdef Mover disc = mover_of(seen)
    cdef Before before = Before([a.vx, a.vy], [surface.vx, surface.vy])
    cdef Body body = body_of(s, i, turns)
    cdef Spins spins
    normal = normal_at(f, &disc)
    cdef Wall w = Wall(f.x.high, f.y.high, normal.x, normal.y)
    ux = seen.vx
    uy = seen.vy
    along = collide_wall(law, &w, &surface if row != NULL else NULL, &body, elastic, turns, &spins)
    a.impacts += 1
    a.last = <int>(-1 - k)
    s.counts.wall_impacts += 1
    s.counts.predictions += 1
    if wanted:
        known = feature_resolution(f, a, ux, uy, -along, again)
        known += clock_resolution(s.clock.reported)
        record_impact(
            &s.record, s.clock.reported, i, -1 - <Index>f.wall, -w.nx, -w.ny, &before, &a.vx, before.second, &spins, seen.x,
            seen.y, k, known, law.wall_contact.friction > 0.0, True, False, NO_FEATURE if f.kind == PLANE else <int>k,
            law.wall_restitution == 1.0,
        )
    return normal
