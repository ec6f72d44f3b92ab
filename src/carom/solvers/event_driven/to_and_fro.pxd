"""Discs that bounce to and fro between what closes on them: the compiled form of `ToAndFro` in `plain/squeeze.py`.

Here impacts in a row are counted; Python is asked whether a disc is crushed, and so seldom that its time does not count.
"""

from libc.math cimport sqrt

from carom.solvers.event_driven.layout cimport *


cdef inline bint goes_on(ToAndFro *t, int body, int obstacle, double nx, double ny) noexcept nogil:
    """Note that a disc has struck a body, from which a normal leads to it; return whether it goes on to and fro."""
    cdef bint opposite = t.last != NO_BODY and t.last != body and t.nx == -nx and t.ny == -ny
    if opposite:
        t.across, t.across_obstacle = t.last, t.last_obstacle
    elif not (body >= 0 and t.last == body and t.nx == nx and t.ny == ny):
        t.across, t.row = NO_BODY, -1
    t.last, t.last_obstacle = body, obstacle
    t.nx, t.ny = nx, ny
    t.row += 1
    return t.row > 0


cdef inline bint is_crushed(State *s, Index disc, Index body, int obstacle, double nx, double ny) noexcept nogil:
    """Note that a disc that moves has struck a body; return whether it is crushed before what is asked for ends."""
    t = &s.to_and_fro[disc]
    return goes_on(t, <int>body, obstacle, nx, ny) and t.row > s.standstill and s.crushes(s.asked, <int>disc)


cdef inline bint crushes_one(State *s, Index i, Index j) noexcept nogil:
    """Note that two discs have struck each other; return whether one is crushed."""
    a = &s.discs[i]
    b = &s.discs[j]
    dx = b.x - a.x
    dy = b.y - a.y
    distance = sqrt(dx * dx + dy * dy)
    nx = dx / distance
    ny = dy / distance
    cdef bint first = a.inverse_mass > 0.0 and is_crushed(s, i, j, NO_OBSTACLE, -nx, -ny)
    cdef bint second = b.inverse_mass > 0.0 and is_crushed(s, j, i, NO_OBSTACLE, nx, ny)
    return first or second
