"""Where driven bodies are: on which leg of its path each is at a time, and how a disc is seen from there.

A driven wall is where its features say at the start of the run, and a disc is seen from it; a driven disc is brought
along its path from where it began.
"""

from carom.solvers.event_driven.layout cimport *


cdef inline const Driven *driven_row(const Driving *d, Index body) noexcept nogil:
    """Return the row of a body, a wall being negative; NULL if it is not driven."""
    cdef Index k
    for k in range(d.count):
        if d.rows[k].body == body:
            return &d.rows[k]
    return NULL


cdef inline bint moves(const Driving *d, Index wall) noexcept nogil:
    """Whether a wall moves."""
    row = driven_row(d, -1 - wall)
    return row != NULL and row.leg_count > 0


cdef inline Index leg_at(const Driving *d, const Driven *row, double time) noexcept nogil:
    """Return the number of the leg on which a body is at a time; before the start, of its first."""
    cdef Index middle
    cdef Index low = row.first_leg
    cdef Index high = row.first_leg + row.leg_count
    while high - low > 1:  # low is the answer or before it, high is after it
        middle = (low + high) // 2
        if d.legs[middle].begin <= time:
            low = middle
        else:
            high = middle
    return low


cdef inline Disc seen_on(const Disc *a, const Leg *leg, double time) noexcept nogil:
    """Return a disc at a time, on its present path, as seen from a wall that is on a leg of its own."""
    cdef Disc seen = a[0]
    wait = time - a.time
    lasted = time - leg.begin
    seen.x = (a.x + a.vx * wait) - (leg.moved_x + leg.vx * lasted)
    seen.y = (a.y + a.vy * wait) - (leg.moved_y + leg.vy * lasted)
    seen.vx -= leg.vx
    seen.vy -= leg.vy
    seen.time = time
    return seen


cdef inline Disc seen_by(const State *s, const Disc *a, const Driven *row, double time) noexcept nogil:
    """Return a disc at a time as seen from a wall of a row of `Driving`."""
    if row.leg_count == 0:
        return a[0]
    return seen_on(a, &s.driving.legs[leg_at(&s.driving, row, time)], time)


cdef inline Surface surface_of(const State *s, const Driven *row, double time) noexcept nogil:
    """Return how a wall of a row of `Driving` moves at a time."""
    cdef Surface surface = Surface(0.0, 0.0, row.belt)
    if row.leg_count > 0:
        leg = &s.driving.legs[leg_at(&s.driving, row, time)]
        surface.vx, surface.vy = leg.vx, leg.vy
    return surface


cdef inline Disc state_on(const Driven *row, const Disc *b, const Leg *leg, double time) noexcept nogil:
    """Return a driven disc at a time within a leg."""
    cdef Disc state = b[0]
    lasted = time - leg.begin
    state.x = row.x + (leg.moved_x + leg.vx * lasted)
    state.y = row.y + (leg.moved_y + leg.vy * lasted)
    state.vx, state.vy = leg.vx, leg.vy
    return state


cdef inline void bring_driven(State *s, Index i, double time) noexcept nogil:
    """Bring disc `i`, if it is driven, to where it is at a time."""
    cdef const Driven *row
    if s.discs[i].inverse_mass > 0.0:
        return
    row = driven_row(&s.driving, i)
    if row != NULL:
        s.discs[i] = state_on(row, &s.discs[i], &s.driving.legs[leg_at(&s.driving, row, time)], time)


cdef inline void count_legs_anew(State *s) noexcept nogil:
    """Count the legs of all paths from the present epoch."""
    cdef Index k
    clock = &s.clock
    for k in range(s.driving.leg_count):
        leg = &s.driving.legs[k]
        leg.begin = (leg.begins - clock.epoch) - clock.epoch_rest
        leg.end = (leg.ends - clock.epoch) - clock.epoch_rest


cdef inline void forget_ended_leg(State *s, Index i) noexcept nogil:
    """Let disc `i` meet a driven body again that it has met last, where that is on another leg by now."""
    a = &s.discs[i]
    if a.last == NO_BODY:
        return
    row = driven_row(&s.driving, a.last if a.last >= 0 else -1 - <Index>s.features[-1 - a.last].wall)
    if row != NULL and row.leg_count > 1:
        if s.driving.legs[leg_at(&s.driving, row, a.time)].end <= s.clock.now:
            a.last = NO_BODY
