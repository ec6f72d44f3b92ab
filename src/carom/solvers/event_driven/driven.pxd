"""Who meets a driven body.

It is in no cell and in no list of obstacles: it goes where it goes, and there are few. Each disc looks at all of them
whenever its path changes, and at walls whenever it crosses an edge, too. What is predicted goes from leg to leg of the
body's path, up to what the disc has before it anyway.
"""

from carom.constants cimport TIME_ERROR
from carom.physics.double_double cimport greater, lesser
from carom.physics.feature_time cimport feature_time
from carom.physics.features cimport INNER_ARC, Mover
from carom.physics.pair_time cimport pair_time
from carom.solvers.event_driven.events cimport solve
from carom.solvers.event_driven.exits cimport is_out_of_reach, mover_of
from carom.solvers.event_driven.layout cimport *
from carom.solvers.event_driven.paths cimport driven_row, leg_at, seen_on, state_on
from carom.solvers.event_driven.scan cimport predicted

cdef struct Touch:  # of a disc and one of the features of a wall
    double wait  # until it is, seconds; INF for never
    Index feature


# ---- walls ----

cdef inline Touch first_touch(
    const State *s, const Disc *seen, const Driven *wall, bint just_left, double within
) noexcept nogil:
    """Return which feature of a wall a disc, as seen from it, meets first; those surely not met within a time left out.

    Of equal times that of the lower number comes first. `just_left` says whether what the disc has met last counts.
    """
    cdef Index k
    cdef bint left
    cdef Mover disc = mover_of(seen)
    cdef Touch first = Touch(INF, NO_OBSTACLE)
    for k in range(wall.first_feature, wall.first_feature + wall.feature_count):
        f = &s.features[k]
        left = just_left and seen.last == -1 - k
        if left and f.kind != INNER_ARC:
            continue
        if not left and is_out_of_reach(seen, f, within):
            continue
        wait = feature_time(&disc, f, left).time
        if wait < first.wait:
            first = Touch(wait, k)
    return first


cdef inline void meet_driven_wall(State *s, Index i, const Driven *wall) noexcept nogil:
    """Let disc `i`'s stay in its cell end on a driven wall, if it meets that before; of walls at one time the last counts."""
    cdef Index n
    cdef Disc seen
    cdef Touch touch
    a = &s.discs[i]
    p = &s.predictions[i]
    cdef Index first = leg_at(&s.driving, wall, a.time)
    for n in range(first, wall.first_leg + wall.leg_count):
        leg = &s.driving.legs[n]
        begin = a.time if n == first else leg.begin
        if begin > p.exit_time:
            return
        seen = seen_on(a, leg, begin)
        within = lesser(leg.end, p.exit_time) - begin
        touch = first_touch(s, &seen, wall, n == first, within + TIME_ERROR * (begin + within))
        at = begin + touch.wait
        if at < leg.end:
            if at < p.exit_time or (
                at == p.exit_time and p.edge == NO_EDGE and p.obstacle != NO_OBSTACLE
                and s.features[p.obstacle].wall < -1 - wall.body
            ):
                p.exit_time = at
                p.obstacle = <short>touch.feature
                p.edge = NO_EDGE
            return


cdef inline void meet_driven_walls(State *s, Index i) noexcept nogil:
    cdef Index k
    for k in range(s.driving.count):
        row = &s.driving.rows[k]
        if row.body < 0 and row.leg_count > 0:
            meet_driven_wall(s, i, row)


cdef inline bint glides_there(const State *s, Index i, Index k, double time) noexcept nogil:
    """Whether disc `i`, whose next impact would be on feature `k` at a time, comes to glide along it."""
    cdef Disc seen
    f = &s.features[k]
    if f.kind != INNER_ARC:
        return False
    seen = s.discs[i]
    cdef bint just_left = seen.last == -1 - k
    row = driven_row(&s.driving, -1 - <Index>f.wall)
    if row != NULL and row.leg_count > 0:
        leg = &s.driving.legs[leg_at(&s.driving, row, time)]
        just_left = just_left and leg.begin <= seen.time
        seen = seen_on(&s.discs[i], leg, greater(seen.time, leg.begin))
    cdef Mover disc = mover_of(&seen)
    return feature_time(&disc, f, just_left).glides


# ---- discs ----

cdef inline double driven_disc_time(const State *s, Index i, const Driven *row, double latest) noexcept nogil:
    """Return when disc `i` meets a driven one on their present paths; where that is after `latest`, that or infinity."""
    cdef Index n
    cdef Disc a, b
    cdef Index j = row.body
    start = s.discs[i].time
    cdef Index first = leg_at(&s.driving, row, start)
    for n in range(first, row.first_leg + row.leg_count):
        leg = &s.driving.legs[n]
        begin = greater(start, leg.begin)
        if begin > latest:
            break
        if n == first and s.discs[i].last == j:  # they part on the paths that they are on: see `just_met` in scan.pxd
            continue
        a = s.discs[i]
        wait = begin - a.time
        a.x += a.vx * wait
        a.y += a.vy * wait
        b = state_on(row, &s.discs[j], leg, begin)
        if i > j:
            a, b = b, a
        at = begin + pair_time(a.x, a.y, a.vx, a.vy, a.radius, b.x, b.y, b.vx, b.vy, b.radius)
        if at < leg.end:
            return at
    return INF


cdef inline void meet_driven_discs(State *s, Index i) noexcept nogil:
    """Let disc `i`'s next impact be one on a driven disc, if that comes before; of a tie the lower number counts."""
    cdef Index k
    p = &s.predictions[i]
    for k in range(s.driving.count):
        row = &s.driving.rows[k]
        if row.body < 0:
            continue
        at = driven_disc_time(s, i, row, predicted(p).high)
        if not at < INF or at > predicted(p).high:
            continue
        if at >= p.impact_time and not p.exact:
            solve(s, i)
        if at < p.impact_time or (at == p.impact_time and row.body < p.partner):
            p.impact_time = at
            p.exact = True
            p.partner = <int>row.body
            p.partner_impacts = s.discs[row.body].impacts
