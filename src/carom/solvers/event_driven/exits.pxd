"""What ends a disc's stay in its cell: the edge that it crosses, or an obstacle that it meets before."""

from libc.math cimport fabs, sqrt

from carom.constants cimport ERROR, TIME_ERROR
from carom.physics.double_double cimport lesser
from carom.physics.feature_time cimport feature_time
from carom.physics.features cimport FACE, INNER_ARC, PLANE, Feature, Mover, mover_at
from carom.physics.pair_time cimport approach, discriminant
from carom.physics.wall_time cimport wall_time
from carom.solvers.event_driven.grid cimport tile_of
from carom.solvers.event_driven.layout cimport *
from carom.solvers.event_driven.obstacles cimport stays_in_area

cdef inline double meet_walls(
    const State *s, const Disc *a, const int *near, double wait, Index *obstacle
) noexcept nogil:
    """Find the first of some walls that a disc meets within a wait; return when, or that wait, and note which.

    Of walls met at one time (own time and wait together: two waits that differ can round to one time) the last comes
    first, since wall k is body -1 - k.
    """
    cdef Index k
    cdef Wall w
    obstacle[0] = NO_OBSTACLE
    while near[0] != NO_OBSTACLE:
        k = near[0]
        near += 1
        if a.last == -1 - k:
            continue
        w = s.walls[k]
        toward = approach(a.vx, a.vy, w.nx, w.ny)
        rim = approach(a.x - w.x, a.y - w.y, w.nx, w.ny)
        gap = rim.value - a.radius - (rim.error + ERROR * a.radius)
        # Not at the wall by then, nor at the same time when rounded, even if all roundings are against it?
        if toward.value > toward.error or gap > (toward.error - toward.value) * (wait + TIME_ERROR * (a.time + wait)):
            continue
        meet = wall_time(a.x, a.y, a.vx, a.vy, a.radius, w.x, w.y, w.nx, w.ny)
        if meet < wait or (obstacle[0] != NO_OBSTACLE and a.time + meet == a.time + wait):
            wait = meet
            obstacle[0] = k
    return wait


cdef inline Mover mover_of(const Disc *a) noexcept nogil:
    """Return a disc at its own time as a wall sees it."""
    return mover_at(a.x, a.y, a.vx, a.vy, a.radius)


cdef inline bint passes_by(const Disc *a, const Feature *face, double reach) noexcept nogil:
    """Whether a disc's path surely passes by the circle around the middle of a face that holds all places of a touch."""
    dx = (face.x.high - a.x) + 0.5 * face.ex.high
    dy = (face.y.high - a.y) + 0.5 * face.ey.high
    # Widened by more than the roundings of the middle, as seen from the disc, and of the sum.
    circle = (reach + 0.5 * face.size.high) * (1.0 + 4.0 * ERROR) + 4.0 * ERROR * (fabs(dx) + fabs(dy))
    d = discriminant(dx, dy, a.vx, a.vy, circle)
    return d.value < -d.error


cdef inline bint is_out_of_reach(const Disc *a, const Feature *f, double later) noexcept nogil:
    """Whether a disc surely does not meet a feature within a time, even if all roundings are against it.

    For a face also where its centre is behind the line: it is the other side's then. Bounds on errors are those of eight
    roundings of a term, or of sixteen of a distance.
    """
    if f.kind <= FACE:
        toward = approach(a.vx, a.vy, f.nx, f.ny)
        rim = approach(a.x - f.x.high, a.y - f.y.high, f.nx, f.ny)
        if f.kind == FACE and rim.value < -rim.error:
            return True
        reach = a.radius + f.half_width
        gap = rim.value - reach - (rim.error + ERROR * reach)
        if toward.value > toward.error or gap > (toward.error - toward.value) * later:
            return True
        return f.kind == FACE and passes_by(a, f, reach)
    dx = (a.x - f.x.high) - f.x.low
    dy = (a.y - f.y.high) - f.y.low
    away = sqrt(dx * dx + dy * dy)
    reach = a.radius + f.half_width
    touch = f.size.high - reach if f.kind == INNER_ARC else f.size.high + reach
    if f.kind == INNER_ARC and touch < 0.0:
        return False  # so it may not fit inside: rarely asked, and by few
    gap = fabs(away - touch) if f.kind == INNER_ARC else away - touch
    return gap - 2.0 * ERROR * (away + f.size.high + reach) > (fabs(a.vx) + fabs(a.vy)) * later


cdef inline double meet_features(
    const State *s, const Disc *a, const int *near, double wait, Index *obstacle
) noexcept nogil:
    """Find the first of some features that a disc meets within a wait, as `meet_walls` does.

    Of two features of one wall the one with the lesser wait comes first, and of equal waits that of the lower number;
    of two walls the last, where times are equal.
    """
    cdef Index k
    cdef bint just_left
    cdef Mover disc = mover_of(a)
    obstacle[0] = NO_OBSTACLE
    while near[0] != NO_OBSTACLE:
        k = near[0]
        near += 1
        f = &s.features[k]
        just_left = a.last == -1 - k
        if just_left and f.kind != INNER_ARC:
            continue
        if not just_left and is_out_of_reach(a, f, wait + TIME_ERROR * (a.time + wait)):
            continue
        meet = feature_time(&disc, f, just_left).time
        if meet < wait or (
            obstacle[0] != NO_OBSTACLE and f.wall != s.features[obstacle[0]].wall and a.time + meet == a.time + wait
        ):
            wait = meet
            obstacle[0] = k
    return wait


cdef inline void predict_exit(State *s, Index i, bint features) noexcept nogil:
    """Predict when disc `i` crosses an edge of its cell, or meets an obstacle before that; `features` says what these are.

    An edge met at the time of an obstacle comes first: the obstacle is near the next cell too.
    """
    g = &s.grid
    p = &s.predictions[i]
    cdef Disc a = s.discs[i]
    cdef Index row = (p.cell >> COLUMN_BITS) - 1
    cdef Index column = (p.cell & COLUMN_MASK) - 1
    cdef Index right = a.vx > 0.0
    cdef Index up = a.vy > 0.0
    cdef Index vertical
    cdef Index obstacle = NO_OBSTACLE
    across = ((g.x0 + (column + right) * g.width) - a.x) / a.vx if a.vx != 0.0 else INF
    along = ((g.y0 + (row + up) * g.width) - a.y) / a.vy if a.vy != 0.0 else INF
    # A cell at the rim has no end outwards.
    across = INF if column == right * (g.columns - 1) else across
    along = INF if row == up * (g.rows - 1) else along
    vertical = along < across
    edge = lesser(along, across)
    cdef unsigned int known = g.list_of[tile_of(g, row + 1, column + 1)]
    cdef const int *near = g.lists + (known >> 1)
    cdef bint looks = known != 0
    cdef bint at_rim = known & 1
    wait = edge
    while looks:  # twice at most; called at one place, so that a compiler makes it part of the loop
        if features:
            wait = meet_features(s, &a, near, edge, &obstacle)
        else:
            wait = meet_walls(s, &a, near, edge, &obstacle)
        looks = at_rim and not stays_in_area(g, &a, wait)
        at_rim = False
        near = g.lists + FULL_LIST
        if features and looks:
            s.counts.beyond += 1
    p.exit_time = a.time + wait
    p.obstacle = <short>obstacle
    p.edge = <signed char>(LEFT + right + vertical * (DOWN + up - LEFT - right) if obstacle == NO_OBSTACLE else NO_EDGE)
