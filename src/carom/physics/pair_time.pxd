"""The compiled form of `pair_time.py`, operation by operation; a test holds the two to the same bits."""

from cython cimport unlikely
from libc.math cimport fabs, frexp, ldexp, sqrt

from carom.constants cimport (
    DOUBTFUL_DISCRIMINANT, DOUBTFUL_SUM, ERROR, GRID, INF, NEGLIGIBLE, UNCERTAIN,
)
from carom.physics.double_double cimport (
    MOST_TERMS, DoubleDouble, add_pair_product, add_square, exact_sum, greater, negated, no_terms, pair_product, rounded,
    split, two_diff, two_prod, two_sum, write_pair_products, write_products,
)

cdef enum:
    LARGEST_EXPONENT = 1024  # every float is below two to this

cdef struct Bounded:  # a value of the plain form
    double value
    double error  # bound on its rounding error

cdef struct Encounter:  # the second disc as seen from the first, without rounding
    DoubleDouble x
    DoubleDouble y
    DoubleDouble ux
    DoubleDouble uy
    DoubleDouble reach  # sum of the radii


cdef inline Bounded approach(double dx, double dy, double ux, double uy) noexcept nogil:
    """Return ``b = d.u``, negative where the discs approach."""
    along_x = dx * ux
    along_y = dy * uy
    return Bounded(along_x + along_y, ERROR * (fabs(along_x) + fabs(along_y)) + NEGLIGIBLE)


cdef inline Bounded discriminant(double dx, double dy, double ux, double uy, double reach) noexcept nogil:
    """Return ``D = a R^2 - (d x u)^2``, negative where the discs miss each other."""
    across_x = dx * uy
    across_y = dy * ux
    cross = across_x - across_y
    largest = (reach * reach) * (ux * ux + uy * uy)
    across = fabs(across_x) + fabs(across_y)
    error = (2.0 * ERROR) * ((fabs(cross) + ERROR * across) * across + largest) + NEGLIGIBLE
    return Bounded(largest - cross * cross, error)


cdef inline Bounded separation(double dx, double dy, double reach) noexcept nogil:
    """Return ``c = d.d - R^2``, negative where the discs overlap."""
    distance2 = dx * dx + dy * dy
    reach2 = reach * reach
    return Bounded(distance2 - reach2, ERROR * (distance2 + reach2) + NEGLIGIBLE)


cdef inline DoubleDouble advanced(DoubleDouble t, DoubleDouble p, DoubleDouble v) noexcept nogil:
    """Return ``p + t v`` as head and rest, for a time split into two parts."""
    fast = split(v.high)
    head = two_sum(p.high, t.high * fast.high)
    rest = head.low + ((t.high * fast.low + t.low * fast.high) + (t.low * fast.low + (p.low + t.high * v.low)))
    return DoubleDouble(head.high, rest)


cdef inline double refine(double near, Encounter e) noexcept nogil:
    """Return the root near a guess of 22 right bits or more: one step on operands split onto a common grid.

    UNCERTAIN unless it is the earlier root, and right to 2 units in the last place.
    """
    t = split(near)
    radius = e.reach.high
    grid = GRID * radius
    x = advanced(t, e.x, e.ux)
    y = advanced(t, e.y, e.uy)
    px = x.high + x.low
    py = y.high + y.low
    hx = (px + grid) - grid
    hy = (py + grid) - grid
    hr = (radius + grid) - grid
    lx = (x.high - hx) + x.low
    ly = (y.high - hy) + y.low
    lr = (radius - hr) + e.reach.low
    gap = ((hx * hx + hy * hy) - hr * hr) + (2.0 * ((hx * lx + hy * ly) - hr * lr) + ((lx * lx + ly * ly) - lr * lr))
    closing = -(px * e.ux.high + py * e.uy.high)
    # A far graze can leave a closing speed of exactly 0, which is UNCERTAIN below.
    inverse = 1.0 / (closing + (1.0 if closing == 0.0 else 0.0))
    step = gap * inverse
    bend = ((e.ux.high * e.ux.high + e.uy.high * e.uy.high) * step) * inverse
    speed = fabs(e.ux.high) + fabs(e.uy.high)
    extent = fabs(e.x.high) + fabs(e.y.high) + near * speed
    # Selects, not a chain of `and`: no branch that a processor would have to foresee.
    cdef double root = near + 0.5 * step * (1.0 + bend * (0.25 + 0.125 * bend))
    root = root if closing >= 2.0**-10 * (radius * speed) else UNCERTAIN
    root = root if extent <= 2.0**34 * radius else UNCERTAIN
    root = root if fabs(bend) <= 2.0**-12 else UNCERTAIN
    root = root if fabs(step) <= 2.0**-22 * near else UNCERTAIN
    root = root if 2.0**-17 * (radius * (2.0 * radius + extent)) <= closing * near else UNCERTAIN
    root = root if radius >= 2.0**-440 else UNCERTAIN
    return root if speed >= 2.0**-440 else UNCERTAIN


cdef inline Encounter encounter(
    double x1, double y1, double vx1, double vy1, double r1, double x2, double y2, double vx2, double vy2, double r2
) noexcept nogil:
    return Encounter(two_diff(x2, x1), two_diff(y2, y1), two_diff(vx2, vx1), two_diff(vy2, vy1), two_sum(r1, r2))


cdef inline double refined_time(double b, double d, Encounter e) noexcept nogil:
    """Return the time of impact from the plain form's ``b`` and ``D``, refined once, or UNCERTAIN."""
    c = separation(e.x.high, e.y.high, e.reach.high)
    closing = sqrt(greater(d, 0.0)) - b
    cdef double root = refine(c.value / (closing if closing > 0.0 else 1.0), e)
    root = root if b < 0.0 else UNCERTAIN
    root = root if c.value > 0.0 else UNCERTAIN
    return root if d > 0.0 else UNCERTAIN


cdef inline DoubleDouble discriminant_from_gap(DoubleDouble b, DoubleDouble c, DoubleDouble a) noexcept nogil:
    """Return ``D = b^2 - a c``: the form that loses nothing near contact, where b and c are small."""
    square = two_prod(b.high, b.high)
    product = two_prod(a.high, c.high)
    d = two_diff(square.high, product.high)
    rest = (square.low - product.low) + (2.0 * b.high * b.low - (a.high * c.low + a.low * c.high))
    return two_sum(d.high, d.low + rest)


cdef inline DoubleDouble discriminant_from_miss(Encounter e, DoubleDouble a) noexcept nogil:
    """Return ``D = a R^2 - (d x u)^2``: it loses nothing far away, where b^2 and a c nearly cancel."""
    cross = rounded(add_pair_product(add_pair_product(no_terms(), e.x, e.uy), negated(e.y), e.ux))
    square = pair_product(cross, cross)
    largest = pair_product(a, pair_product(e.reach, e.reach))
    d = two_diff(largest.high, square.high)
    return two_sum(d.high, d.low + (largest.low - square.low))


cdef inline double exact_root(DoubleDouble b, DoubleDouble c, DoubleDouble d) noexcept nogil:
    """Return ``c / (-b + sqrt(D))``, corrected once by its residual."""
    root = sqrt(d.high)
    square = two_prod(root, root)
    root_rest = (((d.high - square.high) - square.low) + d.low) / (2.0 * root)
    closing = two_sum(root, -b.high)
    low = closing.low + (root_rest - b.low)
    t = c.high / closing.high
    product = two_prod(t, closing.high)
    return t + ((((c.high - product.high) - product.low) + c.low) - t * low) / closing.high


cdef inline int exponent_of(double a) noexcept nogil:
    cdef int exponent = 0
    frexp(a, &exponent)
    return exponent


cdef inline DoubleDouble scaled(DoubleDouble a, int exponent) noexcept nogil:
    return DoubleDouble(ldexp(a.high, exponent), ldexp(a.low, exponent))


cdef inline DoubleDouble exact_inner_product(
    DoubleDouble x, DoubleDouble y, DoubleDouble ux, DoubleDouble uy
) noexcept nogil:
    cdef double[16] terms
    write_pair_products(terms, x, ux, 1.0)
    write_pair_products(terms + 8, y, uy, 1.0)
    return exact_sum(terms, 16)


cdef inline DoubleDouble inner_product(
    DoubleDouble x, DoubleDouble y, DoubleDouble ux, DoubleDouble uy
) noexcept nogil:
    """Return ``b = d.u``, whose sign is exact."""
    b = rounded(add_pair_product(add_pair_product(no_terms(), x, ux), y, uy))
    if fabs(b.high) <= DOUBTFUL_SUM * (fabs(x.high * ux.high) + fabs(y.high * uy.high)):
        return exact_inner_product(x, y, ux, uy)
    return b


cdef inline DoubleDouble exact_excess(DoubleDouble x, DoubleDouble y, DoubleDouble reach) noexcept nogil:
    cdef double[24] terms
    write_pair_products(terms, x, x, 1.0)
    write_pair_products(terms + 8, y, y, 1.0)
    write_pair_products(terms + 16, reach, reach, -1.0)
    return exact_sum(terms, 24)


cdef inline DoubleDouble excess(DoubleDouble x, DoubleDouble y, DoubleDouble reach) noexcept nogil:
    """Return ``c = d.d - R^2``, whose sign is exact."""
    c = rounded(add_square(add_square(add_square(no_terms(), x, 1.0), y, 1.0), reach, -1.0))
    if fabs(c.high) <= DOUBTFUL_SUM * (reach.high * reach.high):
        return exact_excess(x, y, reach)
    return c


cdef inline DoubleDouble exact_discriminant(Encounter e) noexcept nogil:
    """Return ``D = a R^2 - (d x u)^2``, whose sign is exact."""
    cdef double[16] a
    cdef double[16] cross
    cdef double[8] reach2
    cdef double[MOST_TERMS] terms
    write_pair_products(a, e.ux, e.ux, 1.0)
    write_pair_products(a + 8, e.uy, e.uy, 1.0)
    write_pair_products(cross, e.x, e.uy, 1.0)
    write_pair_products(cross + 8, e.y, e.ux, -1.0)
    write_pair_products(reach2, e.reach, e.reach, 1.0)
    count = write_products(terms, a, 16, reach2, 8, 1.0)
    count += write_products(terms + count, cross, 16, cross, 16, -1.0)
    return exact_sum(terms, count)


cdef inline double exact_pair_time(Encounter e) noexcept nogil:
    """Return the time of impact by the error-free form, whatever the size of the numbers."""
    ux = e.ux.high
    uy = e.uy.high
    fastest = greater(fabs(ux), fabs(uy))
    if fastest == 0.0:
        return INF
    length = exponent_of(greater(greater(fabs(e.x.high), fabs(e.y.high)), e.reach.high))
    pace = exponent_of(fastest)
    e.x = scaled(e.x, -length)
    e.y = scaled(e.y, -length)
    e.reach = scaled(e.reach, -length)
    e.ux = scaled(e.ux, -pace)
    e.uy = scaled(e.uy, -pace)
    b = inner_product(e.x, e.y, e.ux, e.uy)
    # A velocity below 2^-1022 of the other component is lost in scaling, but not its sign.
    if not b.high < 0.0 and not (b.high == 0.0 and e.x.high * ux + e.y.high * uy < 0.0):
        return INF
    c = excess(e.x, e.y, e.reach)
    if c.high <= 0.0:
        return 0.0
    a = rounded(add_square(add_square(no_terms(), e.ux, 1.0), e.uy, 1.0))
    terms = b.high * b.high
    largest = a.high * (e.reach.high * e.reach.high)
    if terms < largest:
        d = discriminant_from_gap(b, c, a)
    else:
        d = discriminant_from_miss(e, a)
        terms = largest
    if fabs(d.high) <= DOUBTFUL_DISCRIMINANT * terms:
        d = exact_discriminant(e)
    if not d.high > 0.0:
        return INF
    root = exact_root(b, c, d)
    return INF if exponent_of(root) + length - pace > LARGEST_EXPONENT else ldexp(root, length - pace)


cdef inline double pair_time(
    double x1, double y1, double vx1, double vy1, double r1, double x2, double y2, double vx2, double vy2, double r2
) noexcept nogil:
    """Return the seconds until two discs collide, from where they are and how they move at one instant.

    0 where they touch or overlap and approach, infinity where they never meet. A graze of depth zero, ``D = 0``,
    exchanges no momentum and is no impact.
    """
    b = approach(x2 - x1, y2 - y1, vx2 - vx1, vy2 - vy1)
    if b.value > b.error:
        return INF
    d = discriminant(x2 - x1, y2 - y1, vx2 - vx1, vy2 - vy1, r1 + r2)
    if d.value < -d.error:
        return INF
    e = encounter(x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2)
    time = refined_time(b.value, d.value, e)
    if unlikely(time < 0.0):
        return exact_pair_time(e)
    return time


cdef inline double meeting_time(Encounter e) noexcept nogil:
    """Return the seconds until two circles meet whose place, velocity and reach are pairs; as `pair_time` does."""
    b = approach(e.x.high, e.y.high, e.ux.high, e.uy.high)
    if b.value > b.error:
        return INF
    d = discriminant(e.x.high, e.y.high, e.ux.high, e.uy.high, e.reach.high)
    if d.value < -d.error:
        return INF
    time = refined_time(b.value, d.value, e)
    if unlikely(time < 0.0):
        return exact_pair_time(e)
    return time
