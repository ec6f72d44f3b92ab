"""Epochs: all discs are brought to the present instant now and then, and time is counted from there."""

from carom.physics.double_double cimport two_sum
from carom.physics.features cimport INNER_ARC
from carom.solvers.event_driven.grid cimport fill_cells, take_out
from carom.solvers.event_driven.impacts cimport move
from carom.solvers.event_driven.layout cimport *
from carom.solvers.event_driven.paths cimport count_legs_anew, forget_ended_leg


cdef inline void forget_chord(State *s, Index i) noexcept nogil:
    """Forget what disc `i` met last, if that was an arc's inner side and it is on its way: it is not where it left it."""
    a = &s.discs[i]
    if NO_BODY < a.last < 0 and s.features[-1 - a.last].kind == INNER_ARC and a.time < s.clock.now:
        a.last = NO_BODY


cdef inline void new_epoch(State *s) noexcept nogil:
    """Bring every disc to the present instant, and count time from there; all is predicted anew.

    Times of 32 free flights hold to 2^-53 of that time, in which a disc moves less than its own place is rounded by. A new
    epoch costs a prediction a disc, against two an impact.
    """
    cdef Index i
    for i in range(s.disc_count):
        if s.feature_count > 0:
            forget_chord(s, i)
        if s.driving.count > 0:
            forget_ended_leg(s, i)
        move(&s.discs[i], s.clock.now)
        s.discs[i].time = 0.0
        if s.law.contact_duration > 0.0:
            s.last_impact[i] -= s.clock.now
    # The epoch is a pair of floats: what the first loses by rounding, the second keeps.
    total = two_sum(s.clock.epoch, s.clock.now)
    s.clock.epoch = total.high
    s.clock.epoch_rest += total.low
    s.clock.now = 0.0
    count_legs_anew(s)
    s.counts.epochs += 1
    s.counts.epoch_impacts = 0
    s.counts.predicted = 0


cdef inline void fill_all_cells(State *s) noexcept nogil:
    """Put every disc into its cell but those that are driven."""
    cdef Index k
    fill_cells(s)
    for k in range(s.driving.count):
        if s.driving.rows[k].body >= 0:
            take_out(s, s.driving.rows[k].body)


cdef inline Index next_unpredicted(State *s) noexcept nogil:
    """Return the disc to be predicted next, where an epoch begins."""
    if s.counts.predicted == 0:
        fill_all_cells(s)
    s.counts.predicted += 1
    return s.counts.predicted - 1
