"""Time of impact of two discs in straight uniform motion, to within 2 units in the last place; hit or miss exactly.

With ``d = c2 - c1``, ``u = v2 - v1`` and ``R = r1 + r2`` the discs touch when ``|d + t u| = R``, that is

    a t^2 + 2 b t + c = 0,   a = u.u,   b = d.u,   c = d.d - R^2,

and collide at the earlier root ``t = c / (-b + sqrt(D))``, ``D = b^2 - a c = a R^2 - (d x u)^2``, where they approach
(``b < 0``), are apart (``c > 0``) and do not pass each other by (``D > 0``). Three steps, each with its own guarantee:

1. The *plain form* in working precision. A verdict "separate", "overlap" or "miss" stands only where the quantity that
   decides it exceeds the bound of its own rounding error.
2. A hit's root is *refined* by one step: at a point so near to the contact, the residual
   ``c' = |d + t u|^2 - R^2`` can be formed without cancellation by splitting its operands onto a common grid. The step
   reports whether its error is certain to be below 2 units in the last place.
3. What either step leaves undecided goes to the *error-free form*: sums of exact products, scaled by powers of two, and
   where these cancel to less than their own error, exact sums.

This is the form on plain floats; `core/pair.h` is that of the compiled extension, with the same bits. The bounds are
derived in ``docs/physics.md``; nothing here is a tolerance on time or distance.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from carom.physics.double_double import (
    Pair,
    exact_products,
    exact_sum,
    pair_product,
    split,
    sum_of_products,
    two_diff,
    two_prod,
    two_sum,
)

#: 8 roundings: more than the terms of b (4), c (5) and, with its factor 2, of D gather before their last sum.
ERROR = 2.0**-50
#: Where products of this size count, underflow (2^-1075 at most, each) may count too, and the error-free form decides.
NEGLIGIBLE = 2.0**-900
#: Adding and taking away 2^28 R rounds to a grid of 2^-25 R to 2^-24 R: 25 bits or so for any coordinate up to R.
_GRID = 2.0**28
#: b and c are right to some 2^-150 of their largest product: below this part of it, the sum is made exact.
_DOUBTFUL_SUM = 2.0**-140
#: D is right to some 2^-99 of its terms, so ``sqrt(D)``, where it is above this part of them, to 2^-55 of their root.
DOUBTFUL_DISCRIMINANT = 2.0**-90
#: Every float is below two to this.
_LARGEST_EXPONENT = 1024


class Encounter(NamedTuple):
    """The second disc as seen from the first, without rounding: relative position and velocity, sum of the radii."""

    x: Pair
    y: Pair
    ux: Pair
    uy: Pair
    reach: Pair


def encounter(
    x1: float, y1: float, vx1: float, vy1: float, r1: float, x2: float, y2: float, vx2: float, vy2: float, r2: float
) -> Encounter:
    """Return the second disc as seen from the first."""
    return Encounter(two_diff(x2, x1), two_diff(y2, y1), two_diff(vx2, vx1), two_diff(vy2, vy1), two_sum(r1, r2))


def approach(dx: float, dy: float, ux: float, uy: float) -> Pair:
    """Return ``b = d.u`` of the plain form, negative where the discs approach, and a bound on its rounding error."""
    along_x, along_y = dx * ux, dy * uy
    return along_x + along_y, ERROR * (abs(along_x) + abs(along_y)) + NEGLIGIBLE


def discriminant(dx: float, dy: float, ux: float, uy: float, reach: float) -> Pair:
    """Return ``D = a R^2 - (d x u)^2`` of the plain form, negative where the discs miss, and a bound on its error."""
    across_x, across_y = dx * uy, dy * ux
    cross = across_x - across_y
    largest = (reach * reach) * (ux * ux + uy * uy)
    across = abs(across_x) + abs(across_y)
    error = (2.0 * ERROR) * ((abs(cross) + ERROR * across) * across + largest) + NEGLIGIBLE
    return largest - cross * cross, error


def separation(dx: float, dy: float, reach: float) -> Pair:
    """Return ``c = d.d - R^2`` of the plain form, negative where the discs overlap, and a bound on its error."""
    distance2, reach2 = dx * dx + dy * dy, reach * reach
    return distance2 - reach2, ERROR * (distance2 + reach2) + NEGLIGIBLE


def pair_time(
    x1: float, y1: float, vx1: float, vy1: float, r1: float, x2: float, y2: float, vx2: float, vy2: float, r2: float
) -> float:
    """Return the seconds until two discs collide, from their centres (metres), velocities and radii at one instant.

    0 where they touch or overlap and approach; infinity where they never meet. A graze of zero depth, ``D = 0``,
    exchanges no momentum and is no impact.
    """
    dx, dy, ux, uy, reach = x2 - x1, y2 - y1, vx2 - vx1, vy2 - vy1, r1 + r2
    b, b_error = approach(dx, dy, ux, uy)
    if b > b_error:
        return math.inf
    d, d_error = discriminant(dx, dy, ux, uy, reach)
    if d < -d_error:
        return math.inf
    return _time_of_doubt(b, d, encounter(x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2))


def meeting_time(e: Encounter) -> float:
    """Return the seconds until two circles meet whose place, velocity and reach are pairs; as `pair_time` does."""
    dx, dy, ux, uy, reach = e.x[0], e.y[0], e.ux[0], e.uy[0], e.reach[0]
    b, b_error = approach(dx, dy, ux, uy)
    if b > b_error:
        return math.inf
    d, d_error = discriminant(dx, dy, ux, uy, reach)
    if d < -d_error:
        return math.inf
    return _time_of_doubt(b, d, e)


def _time_of_doubt(b: float, d: float, e: Encounter) -> float:
    """Return the time where the plain form's `b` and `D` leave a hit possible: refined, or by the error-free form."""
    c, _ = separation(e.x[0], e.y[0], e.reach[0])
    if b < 0.0 and c > 0.0 and d > 0.0:
        root = _refined(c / (math.sqrt(d) - b), e)
        if root is not None:
            return root
    return exact_pair_time(e)


def _refined(near: float, e: Encounter) -> float | None:
    """Return the root near a guess of 22 right bits or more; None unless it is certainly the earlier one, and to 2 ulp.

    One step of ``tau = c'/(2 q) (1 + x/4 + x^2/8 + ...)`` from `near`, with ``q = -b'`` and ``x = a c'/q^2``. Split
    in two, time and velocity multiply exactly; on a common grid of 25 bits the squares of the two coordinates and of R,
    and their sum, are exact too, and what the grid leaves over enters at first order.
    """
    x, y, ux, uy, (radius, radius_rest) = e
    late, early = split(near)
    grid = _GRID * radius
    x_head, x_rest = _advanced(late, early, x, ux)
    y_head, y_rest = _advanced(late, early, y, uy)
    px, py = x_head + x_rest, y_head + y_rest
    hx, hy, hr = (px + grid) - grid, (py + grid) - grid, (radius + grid) - grid
    lx, ly, lr = (x_head - hx) + x_rest, (y_head - hy) + y_rest, (radius - hr) + radius_rest
    gap = ((hx * hx + hy * hy) - hr * hr) + (2.0 * ((hx * lx + hy * ly) - hr * lr) + ((lx * lx + ly * ly) - lr * lr))
    closing = -(px * ux[0] + py * uy[0])
    if closing == 0.0:  # what a far graze can leave
        return None
    inverse = 1.0 / closing
    step = gap * inverse
    bend = ((ux[0] * ux[0] + uy[0] * uy[0]) * step) * inverse
    speed = abs(ux[0]) + abs(uy[0])
    extent = abs(x[0]) + abs(y[0]) + near * speed
    certain = (
        closing >= 2.0**-10 * (radius * speed)
        and extent <= 2.0**34 * radius
        and abs(bend) <= 2.0**-12
        and abs(step) <= 2.0**-22 * near
        and 2.0**-17 * (radius * (2.0 * radius + extent)) <= closing * near
        and radius >= 2.0**-440
        and speed >= 2.0**-440
    )
    return near + 0.5 * step * (1.0 + bend * (0.25 + 0.125 * bend)) if certain else None


def _advanced(late: float, early: float, p: Pair, v: Pair) -> Pair:
    """Return ``p + t v`` as head and rest, for a time split into ``late + early``."""
    fast, slow = split(v[0])
    head, error = two_sum(p[0], late * fast)
    return head, error + ((late * slow + early * fast) + (early * slow + (p[1] + late * v[1])))


def exact_pair_time(e: Encounter) -> float:
    """Return the time of impact by the error-free form alone, whatever the size of the numbers."""
    x, y, ux, uy, reach = e
    fastest = max(abs(ux[0]), abs(uy[0]))
    if fastest == 0.0:
        return math.inf
    _, length = math.frexp(max(abs(x[0]), abs(y[0]), reach[0]))
    _, pace = math.frexp(fastest)
    x, y, reach = _scaled(x, -length), _scaled(y, -length), _scaled(reach, -length)
    ux, uy = _scaled(ux, -pace), _scaled(uy, -pace)
    b = inner_product(x, y, ux, uy)
    # A velocity below 2^-1022 of the other component is lost in scaling, but not its sign.
    if not b[0] < 0.0 and not (b[0] == 0.0 and x[0] * e.ux[0] + y[0] * e.uy[0] < 0.0):
        return math.inf
    c = excess(x, y, reach)
    if c[0] <= 0.0:
        return 0.0
    a = sum_of_products((*square_factors(ux), *square_factors(uy)))
    largest, square = a[0] * (reach[0] * reach[0]), b[0] * b[0]
    if square < largest:
        d, terms = discriminant_from_gap(b, c, a), square
    else:
        d, terms = discriminant_from_miss(x, y, ux, uy, reach, a), largest
    if abs(d[0]) <= DOUBTFUL_DISCRIMINANT * terms:
        d = exact_discriminant(x, y, ux, uy, reach)
    if not d[0] > 0.0:
        return math.inf
    root = exact_root(b, c, d, math.sqrt(d[0]))
    _, size = math.frexp(root)
    # Beyond the largest float ldexp raises in plain Python, and gives infinity when compiled.
    return math.inf if size + length - pace > _LARGEST_EXPONENT else math.ldexp(root, length - pace)


def _scaled(pair: Pair, exponent: int) -> Pair:
    return math.ldexp(pair[0], exponent), math.ldexp(pair[1], exponent)


def square_factors(p: Pair, sign: float = 1.0) -> tuple[Pair, ...]:
    """Return the factors whose products add up to ``p^2``, or to its negative."""
    return (p[0], sign * p[0]), (2.0 * p[0], sign * p[1]), (p[1], sign * p[1])


def product_factors(p: Pair, q: Pair) -> tuple[Pair, ...]:
    """Return the factors whose products add up to ``p q``."""
    return (p[0], q[0]), (p[0], q[1]), (p[1], q[0]), (p[1], q[1])


def inner_product(x: Pair, y: Pair, ux: Pair, uy: Pair) -> Pair:
    """Return ``b = d.u``."""
    b = sum_of_products((*product_factors(x, ux), *product_factors(y, uy)))
    if abs(b[0]) <= _DOUBTFUL_SUM * (abs(x[0] * ux[0]) + abs(y[0] * uy[0])):
        b = exact_sum([*exact_products(x, ux), *exact_products(y, uy)])
    return b


def excess(x: Pair, y: Pair, reach: Pair) -> Pair:
    """Return ``c = d.d - R^2``."""
    c = sum_of_products((*square_factors(x), *square_factors(y), *square_factors(reach, -1.0)))
    if abs(c[0]) <= _DOUBTFUL_SUM * (reach[0] * reach[0]):
        c = exact_sum([*exact_products(x, x), *exact_products(y, y), *exact_products(reach, reach, -1.0)])
    return c


def discriminant_from_gap(b: Pair, c: Pair, a: Pair) -> Pair:
    """Return ``D = b^2 - a c`` as a pair: the form that loses nothing near contact, where b and c are small."""
    square, rest = two_prod(b[0], b[0])
    product, product_rest = two_prod(a[0], c[0])
    high, low = two_diff(square, product)
    return two_sum(high, low + ((rest - product_rest) + (2.0 * b[0] * b[1] - (a[0] * c[1] + a[1] * c[0]))))


def discriminant_from_miss(x: Pair, y: Pair, ux: Pair, uy: Pair, reach: Pair, a: Pair) -> Pair:
    """Return ``D = a R^2 - (d x u)^2`` as a pair: it loses nothing far away, where b^2 and a c nearly cancel."""
    cross = sum_of_products((*product_factors(x, uy), *product_factors((-y[0], -y[1]), ux)))
    square, rest = pair_product(cross, cross)
    largest, largest_rest = pair_product(a, pair_product(reach, reach))
    high, low = two_diff(largest, square)
    return two_sum(high, low + (largest_rest - rest))


def exact_discriminant(x: Pair, y: Pair, ux: Pair, uy: Pair, reach: Pair) -> Pair:
    """Return ``D = a R^2 - (d x u)^2``, whose sign is exact."""
    a = [*exact_products(ux, ux), *exact_products(uy, uy)]
    cross = [*exact_products(x, uy), *exact_products(y, ux, -1.0)]
    return exact_sum([*exact_products(a, exact_products(reach, reach)), *exact_products(cross, cross, -1.0)])


def exact_root(b: Pair, c: Pair, d: Pair, root: float) -> float:
    """Return ``c / (-b + sqrt(D))``, corrected once by its residual; `root` is the rounded root of `d`'s head."""
    square, square_rest = two_prod(root, root)
    root_rest = (((d[0] - square) - square_rest) + d[1]) / (2.0 * root)
    high, low = two_sum(root, -b[0])
    low = low + (root_rest - b[1])
    t = c[0] / high
    product, product_rest = two_prod(t, high)
    return t + ((((c[0] - product) - product_rest) + c[1]) - t * low) / high
