"""The compiled form of `face_time.py`, operation by operation; a test holds the two to the same bits."""

from libc.math cimport fabs

from carom.constants cimport DOUBTFUL_GAP, ERROR, INF, NEGLIGIBLE
from carom.physics.double_double cimport (
    DoubleDouble, add_pair_product, negated, no_terms, pair_product, rounded, two_diff, two_prod, two_sum,
)
from carom.physics.features cimport Feature, Mover
from carom.physics.pair_time cimport Encounter, exact_discriminant, inner_product
from carom.physics.wall_time cimport quotient


cdef inline DoubleDouble from_point(DoubleDouble a, double q) noexcept nogil:
    """Return a coordinate as counted from a point."""
    d = two_diff(a.high, q)
    return two_sum(d.high, d.low + a.low)


cdef inline DoubleDouble across(DoubleDouble ex, DoubleDouble ey, DoubleDouble x, DoubleDouble y) noexcept nogil:
    """Return the cross product ``e x d``; its sign is exact."""
    return inner_product(ex, negated(ey), y, x)


cdef inline DoubleDouble pair_quotient(DoubleDouble a, DoubleDouble b) noexcept nogil:
    first = a.high / b.high
    product = two_prod(first, b.high)
    return two_sum(first, (((a.high - product.high) - product.low) + (a.low - first * b.low)) / b.high)


cdef inline DoubleDouble face_gap(const Mover *disc, const Feature *face) noexcept nogil:
    """Return the distance of a disc's rim from a face's line times the face's length."""
    x = from_point(disc.x, face.x.high)
    y = from_point(disc.y, face.y.high)
    reach = two_sum(disc.radius, face.half_width)
    total = add_pair_product(add_pair_product(no_terms(), face.ex, y), negated(face.ey), x)
    gap = rounded(add_pair_product(total, negated(face.size), reach))
    if fabs(gap.high) > DOUBTFUL_GAP * (face.size.high * reach.high):
        return gap
    squares = negated(exact_discriminant(Encounter(x, y, face.ex, face.ey, reach)))
    cross = across(face.ex, face.ey, x, y)
    root = pair_product(face.size, reach)
    total_root = two_sum(cross.high, root.high)
    return pair_quotient(squares, DoubleDouble(total_root.high, total_root.low + (cross.low + root.low)))


cdef inline bint is_before_face(const Mover *disc, const Feature *face) noexcept nogil:
    """Whether a disc's centre is on a face's free side, with its foot on the edge."""
    x = from_point(disc.x, face.x.high)
    y = from_point(disc.y, face.y.high)
    return (
        across(face.ex, face.ey, x, y).high > 0.0
        and inner_product(face.ex, face.ey, x, y).high >= 0.0
        and inner_product(face.ex, face.ey, from_point(disc.x, face.fx.high), from_point(disc.y, face.fy.high)).high <= 0.0
    )


cdef inline bint comes_onto(const Mover *disc, const Feature *face) noexcept nogil:
    """Whether a disc that approaches a face's line has its foot on the edge when it touches the line."""
    reach = two_sum(disc.radius, face.half_width)
    along = inner_product(face.ex, face.ey, disc.ux, disc.uy)
    after_a = across(from_point(disc.x, face.x.high), from_point(disc.y, face.y.high), disc.ux, disc.uy)
    before_b = across(from_point(disc.x, face.fx.high), from_point(disc.y, face.fy.high), disc.ux, disc.uy)
    after = rounded(add_pair_product(add_pair_product(no_terms(), face.size, after_a), reach, along))
    before = rounded(add_pair_product(add_pair_product(no_terms(), face.size, before_b), reach, along))
    return after.high <= 0.0 and 0.0 <= before.high


cdef inline double face_time(const Mover *disc, const Feature *face) noexcept nogil:
    """Return the seconds until a disc touches a face, infinity where it never does."""
    one = face.ex.high * disc.uy.high
    other = face.ey.high * disc.ux.high
    if one - other > ERROR * (fabs(one) + fabs(other)) + NEGLIGIBLE:
        return INF
    speed = across(face.ex, face.ey, disc.ux, disc.uy)
    if not speed.high < 0.0:
        return INF
    gap = face_gap(disc, face)
    if gap.high <= 0.0:
        return 0.0 if is_before_face(disc, face) else INF
    return quotient(gap, speed) if comes_onto(disc, face) else INF
