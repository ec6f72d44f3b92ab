"""The compiled form of `arc_time.py`, operation by operation; a test holds the two to the same bits."""

from libc.math cimport fabs, sqrt

from carom.constants cimport DOUBTFUL_DISCRIMINANT, ERROR, INF, NEGLIGIBLE, PAIR_ERROR
from carom.physics.double_double cimport (
    DoubleDouble, add_square, negated, no_terms, rounded, two_diff, two_prod, two_sum,
)
from carom.physics.face_time cimport across
from carom.physics.features cimport INNER_ARC, Feature, Mover
from carom.physics.pair_time cimport (
    Encounter, discriminant_from_gap, discriminant_from_miss, exact_discriminant, exact_root, excess, inner_product,
    meeting_time,
)
from carom.physics.wall_time cimport quotient

cdef struct Touch:
    double time  # seconds from now; INF for never
    bint glides  # along the tangent: contact, and no impact

cdef struct Turn:  # from an end's direction to a place
    double value
    double open  # what rounding leaves open of it

cdef struct Moved:  # a coordinate after a time
    DoubleDouble place
    double way


cdef inline DoubleDouble from_pair(DoubleDouble a, DoubleDouble q) noexcept nogil:
    """Return a coordinate as counted from another."""
    d = two_diff(a.high, q.high)
    return two_sum(d.high, d.low + (a.low - q.low))


cdef inline DoubleDouble reach_of(const Mover *disc, const Feature *arc) noexcept nogil:
    """Return the distance from an arc's centre at which a disc touches it; not above 0 where it does not fit inside."""
    thick = two_sum(disc.radius, arc.half_width)
    if arc.kind == INNER_ARC:
        thick = negated(thick)
    total = two_sum(arc.size.high, thick.high)
    return two_sum(total.high, total.low + (arc.size.low + thick.low))


cdef inline Turn turn_to(
    DoubleDouble fx, DoubleDouble fy, DoubleDouble x, DoubleDouble y, double moved_x, double moved_y
) noexcept nogil:
    moved = fabs(fx.high * moved_y) + fabs(fy.high * moved_x)
    placed = fabs(fx.high * y.high) + fabs(fy.high * x.high)
    return Turn(across(fx, fy, x, y).high, ERROR * moved + PAIR_ERROR * placed + NEGLIGIBLE)


cdef inline bint is_in(const Feature *arc, DoubleDouble x, DoubleDouble y, double moved_x, double moved_y) noexcept nogil:
    """Whether a place, as counted from the centre, is in an arc's sector, or rounding leaves that open."""
    if arc.whole:
        return True
    after_first = turn_to(arc.ex, arc.ey, x, y, moved_x, moved_y)
    after_last = turn_to(arc.fx, arc.fy, x, y, moved_x, moved_y)
    cdef bint begun = after_first.value >= -after_first.open
    cdef bint not_ended = after_last.value <= after_last.open
    return (begun or not_ended) if arc.reflex else (begun and not_ended)


cdef inline bint is_before_arc(const Mover *disc, const Feature *arc) noexcept nogil:
    """Whether a disc's centre is on the side of an arc that is asked about, and in its sector."""
    x = from_pair(disc.x, arc.x)
    y = from_pair(disc.y, arc.y)
    beyond = excess(x, y, arc.size).high
    return (beyond < 0.0 if arc.kind == INNER_ARC else beyond > 0.0) and is_in(arc, x, y, 0.0, 0.0)


cdef inline Moved after(DoubleDouble x, DoubleDouble u, double time) noexcept nogil:
    way = two_prod(time, u.high)
    total = two_sum(x.high, way.high)
    return Moved(two_sum(total.high, total.low + (x.low + (way.low + time * u.low))), way.high)


cdef inline bint touches(
    const Feature *arc, DoubleDouble x, DoubleDouble y, const Mover *disc, double time, bint glides
) noexcept nogil:
    """Whether a disc at (x, y) from the centre is in the sector at a time; one that glides, not where it is left."""
    if arc.whole:
        return True
    px = after(x, disc.ux, time)
    py = after(y, disc.uy, time)
    cdef DoubleDouble end_x = arc.ex
    cdef DoubleDouble end_y = arc.ey
    if glides:
        if px.place.high * disc.uy.high - py.place.high * disc.ux.high > 0.0:
            end_x, end_y = arc.fx, arc.fy
        turn = turn_to(end_x, end_y, px.place, py.place, px.way, py.way)
        if fabs(turn.value) <= turn.open and end_x.high * px.place.high + end_y.high * py.place.high > 0.0:
            return False
    return is_in(arc, px.place, py.place, px.way, py.way)


cdef inline double outer_arc_time(const Mover *disc, const Feature *arc) noexcept nogil:
    """Return the seconds until a disc touches an arc from outside, or a vertex, infinity where it never does."""
    if disc.radius < arc.fits_below:
        return INF
    x = from_pair(disc.x, arc.x)
    y = from_pair(disc.y, arc.y)
    time = meeting_time(Encounter(x, y, disc.ux, disc.uy, reach_of(disc, arc)))
    if time == INF:
        return time
    if time == 0.0:
        return time if is_before_arc(disc, arc) else INF
    return time if touches(arc, x, y, disc, time, False) else INF


cdef inline Touch later_root(
    DoubleDouble x, DoubleDouble y, const Mover *disc, DoubleDouble reach, DoubleDouble a, DoubleDouble b, DoubleDouble c
) noexcept nogil:
    """Return the later root, infinity where there is none after now, and whether it is the earlier one, too."""
    cdef Encounter e = Encounter(x, y, disc.ux, disc.uy, reach)
    terms = b.high * b.high
    largest = a.high * (reach.high * reach.high)
    if c.high < 0.0 or terms < largest:
        d = discriminant_from_gap(b, c, a)
    else:
        d = discriminant_from_miss(e, a)
        terms = largest
    if c.high > 0.0 and fabs(d.high) <= DOUBTFUL_DISCRIMINANT * terms:
        d = exact_discriminant(e)
    if d.high == 0.0:
        return Touch(quotient(b, a), True)
    if d.high < 0.0:
        return Touch(INF, False)
    if b.high > 0.0:
        return Touch(exact_root(negated(b), negated(c), d), False)
    root = sqrt(d.high)
    product = two_prod(root, root)
    root_rest = (((d.high - product.high) - product.low) + d.low) / (2.0 * root)
    total = two_sum(root, -b.high)
    return Touch(-quotient(DoubleDouble(total.high, total.low + (root_rest - b.low)), a), False)


cdef inline Touch coming_in(
    const Feature *arc, DoubleDouble x, DoubleDouble y, const Mover *disc, DoubleDouble reach
) noexcept nogil:
    """Return when a disc that stays out of the circle comes into the sector where it overlaps the arc."""
    cdef int k
    cdef bint is_ahead
    cdef DoubleDouble fx = arc.ex
    cdef DoubleDouble fy = arc.ey
    first = INF
    sense = 1.0
    for k in range(2):
        if k == 1:
            fx, fy, sense = arc.fx, arc.fy, -1.0
        turn = across(fx, fy, x, y)
        rate = across(fx, fy, disc.ux, disc.uy)
        if not sense * turn.high < 0.0 < sense * rate.high:
            continue
        time = quotient(turn, rate)
        px = after(x, disc.ux, time).place
        py = after(y, disc.uy, time).place
        is_ahead = fx.high * px.high + fy.high * py.high > 0.0
        if time < first and is_ahead and excess(px, py, reach).high > 0.0 > excess(px, py, arc.size).high:
            first = time
    return Touch(first, first < INF)


cdef inline Touch inner_arc_time(const Mover *disc, const Feature *arc, bint just_left) noexcept nogil:
    """Return when a disc touches an arc from inside, at once where it touches or overlaps and does not come away."""
    cdef bint stays_out
    cdef Touch touch = Touch(INF, False)
    cdef Touch never = Touch(INF, False)
    reach = reach_of(disc, arc)
    a = rounded(add_square(add_square(no_terms(), disc.ux, 1.0), disc.uy, 1.0))
    if not disc.radius < arc.fits_below or a.high == 0.0:
        return never
    x = from_pair(disc.x, arc.x)
    y = from_pair(disc.y, arc.y)
    b = inner_product(x, y, disc.ux, disc.uy)
    c = DoubleDouble(0.0, 0.0) if just_left else excess(x, y, reach)
    if c.high == 0.0 > b.high:
        chord = quotient(DoubleDouble(2.0 * b.high, 2.0 * b.low), a)
        if chord * (fabs(disc.ux.high) + fabs(disc.uy.high)) > 2.0 * ERROR * reach.high:
            touch = Touch(chord, False)
    elif c.high < 0.0 or b.high < 0.0:
        touch = later_root(x, y, disc, reach, a, b, c)
    if touch.time < INF and touches(arc, x, y, disc, touch.time, touch.glides):
        return touch
    stays_out = b.high < 0.0 and touch.time == INF
    if c.high >= 0.0 and (stays_out or b.high >= 0.0) and (just_left or is_before_arc(disc, arc)):
        touch = Touch(0.0, stays_out or just_left or b.high == 0.0)
        if not touch.glides or touches(arc, x, y, disc, 0.0, True):
            return touch
    return coming_in(arc, x, y, disc, reach) if stays_out and not arc.whole else never
