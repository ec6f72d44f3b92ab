"""The compiled form of `double_double.py`, operation by operation; none of them may be fused or reordered."""

from carom.constants cimport SPLITTER

cdef struct DoubleDouble:  # the exact sum of two floats
    double high
    double low

cdef enum:
    MOST_TERMS = 768  # of an exact sum: those of the discriminant of two discs

cdef struct TripleDouble:  # a sum carried in three parts
    double high
    double middle
    double low


cdef inline double lesser(double a, double b) noexcept nogil:
    """One instruction, where `fmin` is a call; neither is NaN."""
    return a if a < b else b


cdef inline double greater(double a, double b) noexcept nogil:
    return a if a > b else b


cdef inline DoubleDouble split(double a) noexcept nogil:
    scaled = SPLITTER * a
    high = scaled - (scaled - a)
    return DoubleDouble(high, a - high)


cdef inline DoubleDouble two_sum(double a, double b) noexcept nogil:
    total = a + b
    part = total - a
    return DoubleDouble(total, (a - (total - part)) + (b - part))


cdef inline DoubleDouble two_diff(double a, double b) noexcept nogil:
    total = a - b
    part = total - a
    return DoubleDouble(total, (a - (total - part)) - (b + part))


cdef inline DoubleDouble two_prod(double a, double b) noexcept nogil:
    rounded_product = a * b
    x = split(a)
    y = split(b)
    error = ((x.high * y.high - rounded_product) + x.high * y.low + x.low * y.high) + x.low * y.low
    return DoubleDouble(rounded_product, error)


cdef inline DoubleDouble pair_product(DoubleDouble a, DoubleDouble b) noexcept nogil:
    p = two_prod(a.high, b.high)
    return two_sum(p.high, p.low + (a.high * b.low + a.low * b.high))


cdef inline DoubleDouble negated(DoubleDouble a) noexcept nogil:
    return DoubleDouble(-a.high, -a.low)


cdef inline TripleDouble no_terms() noexcept nogil:
    return TripleDouble(0.0, 0.0, 0.0)


cdef inline TripleDouble add_term(TripleDouble total, double term) noexcept nogil:
    high = two_sum(total.high, term)
    middle = two_sum(total.middle, high.low)
    return TripleDouble(high.high, middle.high, total.low + middle.low)


cdef inline TripleDouble add_product(TripleDouble total, double a, double b) noexcept nogil:
    p = two_prod(a, b)
    return add_term(add_term(total, p.high), p.low)


cdef inline TripleDouble add_pair_product(TripleDouble total, DoubleDouble p, DoubleDouble q) noexcept nogil:
    total = add_product(total, p.high, q.high)
    total = add_product(total, p.high, q.low)
    total = add_product(total, p.low, q.high)
    return add_product(total, p.low, q.low)


cdef inline TripleDouble add_square(TripleDouble total, DoubleDouble p, double sign) noexcept nogil:
    """Return a sum with the square of a pair added (`sign` 1) or subtracted (-1)."""
    total = add_product(total, p.high, sign * p.high)
    total = add_product(total, 2.0 * p.high, sign * p.low)
    return add_product(total, p.low, sign * p.low)


cdef inline DoubleDouble rounded(TripleDouble total) noexcept nogil:
    """Return a sum as a pair whose high part is its nearest float."""
    top = two_sum(total.high, total.middle)
    return two_sum(top.high, top.low + total.low)


cdef inline int write_products(
    double *terms, const double *p, int p_count, const double *q, int q_count, double sign
) noexcept nogil:
    """Write terms whose exact sum is that of `p` times that of `q` times the sign, 1 or -1; return how many."""
    cdef int i, j, count = 0
    for i in range(p_count):
        for j in range(q_count):
            product = two_prod(sign * p[i], q[j])
            terms[count] = product.high
            terms[count + 1] = product.low
            count += 2
    return count


cdef inline int write_pair_products(double *terms, DoubleDouble p, DoubleDouble q, double sign) noexcept nogil:
    """Write terms whose exact sum is the product of two pairs times the sign, 1 or -1; return how many: 8."""
    cdef double[2] a
    cdef double[2] b
    a[0], a[1] = p.high, p.low
    b[0], b[1] = q.high, q.low
    return write_products(terms, a, 2, b, 2, sign)


cdef inline DoubleDouble exact_sum(const double *terms, int count) noexcept nogil:
    cdef double[MOST_TERMS] parts  # which do not overlap, the smallest first: their sum is that of all terms so far
    cdef int i, k, kept, size = 0
    cdef DoubleDouble total, sum
    for i in range(count):
        total = DoubleDouble(terms[i], 0.0)
        kept = 0
        for k in range(size):
            total = two_sum(total.high, parts[k])
            if total.low != 0.0:
                parts[kept] = total.low
                kept += 1
        if total.high != 0.0:
            parts[kept] = total.high
            kept += 1
        size = kept
    sum = DoubleDouble(0.0, 0.0)
    for k in range(size - 1, -1, -1):  # the first of them fill `high`, the others add less and less to `low`
        total = two_sum(sum.high, parts[k])
        sum = DoubleDouble(total.high, sum.low + total.low)
    return two_sum(sum.high, sum.low)
