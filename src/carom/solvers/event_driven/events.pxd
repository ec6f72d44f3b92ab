"""What comes next: for a disc, and of all.

Each disc keeps two things: the earliest impact on another disc that it knows of, and what ends its stay in its cell. Of
any two discs, the one that was predicted later saw the other's present path. So the lesser of the two times that are
kept for them is never later than their impact, and none is missed. What a disc's event is, `event_of` alone says.
"""

from cython cimport unlikely

from carom.physics.double_double cimport lesser
from carom.solvers.event_driven.layout cimport *
from carom.solvers.event_driven.queue cimport earliest_but, next_at
from carom.solvers.event_driven.scan cimport pair_event_time

cdef struct Bodies:  # of an impact
    Index first
    Index second


cdef inline bint is_stale(const State *s, Index i) noexcept nogil:
    """Whether the path of disc `i`'s partner has changed since their impact was predicted."""
    p = &s.predictions[i]
    return p.partner != NOBODY and s.discs[p.partner].impacts != p.partner_impacts


cdef inline double event_time(const Prediction *p) noexcept nogil:
    """Return the time of a disc's next event, or a lower bound."""
    return lesser(p.impact_time, p.exit_time)


cdef inline EventKind event_of(const State *s, Index i) noexcept nogil:
    """Return what the next event of disc `i` is."""
    p = &s.predictions[i]
    if p.exit_time <= p.impact_time and p.edge != NO_EDGE:
        return CROSSING
    if p.exit_time < p.impact_time:
        return WALL_IMPACT
    if is_stale(s, i):
        return STALE
    if not p.exact:
        return BOUNDED
    # At one time (partner, i) comes before (i, wall), and that before (i, partner).
    return WALL_IMPACT if p.exit_time == p.impact_time and i < p.partner else PAIR_IMPACT


cdef inline Bodies pair_of(const State *s, Index i) noexcept nogil:
    """Return disc `i` and its partner in their order."""
    cdef Index j = s.predictions[i].partner
    return Bodies(i if i < j else j, j if i < j else i)


cdef inline Bodies bodies_of(const State *s, Event impact) noexcept nogil:
    """Return the bodies of an impact in their order; of simultaneous impacts the least of these goes first.

    Obstacles count for bodies here: they are in the order of their walls, and a disc's next is on one of them.
    """
    if impact.kind == WALL_IMPACT:
        return Bodies(impact.disc, -1 - <Index>s.predictions[impact.disc].obstacle)
    return pair_of(s, impact.disc)


cdef inline void solve(State *s, Index i) noexcept nogil:
    """Replace the lower bound on the time of disc `i`'s impact by the time; its next event may be another now."""
    p = &s.predictions[i]
    p.impact_time = pair_event_time(s, i, p.partner)
    p.exact = True


cdef inline Index holder_too(const State *s, Index i, double time) noexcept nogil:
    """Return the disc whose next event is the same impact at `time` as that of disc `i`: its partner, or `i` itself."""
    p = &s.predictions[i]
    if p.partner == NOBODY or p.impact_time != time:
        return i
    other = &s.predictions[p.partner]
    if other.partner != i or other.partner_impacts != s.discs[i].impacts or other.exit_time <= time:
        return i
    return p.partner


cdef inline Event first_of_tie(State *s, double time) noexcept nogil:
    """Return the event to go on with where several discs have one at `time`.

    First whatever is not a certain impact, as long as there is one; then the impact that is first by (first, second). Of
    the impacts that a disc has at one time it keeps the first, so the first of all is kept.
    """
    cdef Event event
    cdef Event first = Event(POSTPONED, NOBODY)
    cdef Bodies least = Bodies(s.disc_count, 0)
    event.disc = next_at(&s.queue, 0, time)
    while event.disc < s.disc_count:
        event.kind = event_of(s, event.disc)
        if event.kind == BOUNDED:
            solve(s, event.disc)
            return Event(POSTPONED, event.disc)
        if event.kind == CROSSING or event.kind == STALE:
            return event
        bodies = bodies_of(s, event)
        if bodies.first < least.first or (bodies.first == least.first and bodies.second < least.second):
            first = event
            least = bodies
        event.disc = next_at(&s.queue, event.disc + 1, time)
    return first


cdef inline Event next_event(State *s, Index i) noexcept nogil:
    """Return the next event of all, where disc `i` is the earliest in the queue."""
    cdef EventKind kind = event_of(s, i)
    if kind == BOUNDED:
        solve(s, i)
        kind = event_of(s, i)
        if kind == CROSSING:  # before the impact, but perhaps after the event of another disc
            return Event(POSTPONED, i)
    if kind == CROSSING or kind == STALE:
        return Event(kind, i)
    time = event_time(&s.predictions[i])
    # Mostly this impact is the next of all by far. It changes the disc's path, so the queue need not know its time.
    if time < earliest_but(&s.queue, i, holder_too(s, i, time)):
        return Event(kind, i)
    if unlikely(s.queue.time[i] == time):
        return first_of_tie(s, time)
    return Event(POSTPONED, i)
