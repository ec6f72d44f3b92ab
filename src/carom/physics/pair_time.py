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
3. What either step leaves undecided goes to the *error-free form*: sums of exact products, scaled by powers of two.

All functions but `pair_time` and `exact_pair_time` are free of branches and serve floats, arrays and compiled code
alike. The bounds are derived in ``docs/pic.md``; nothing here is a tolerance on time or distance.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.physics.double_double import (
    Real,
    pair_product,
    split,
    sum_of_products,
    two_diff,
    two_prod,
    two_sum,
)

if TYPE_CHECKING:
    Pair = tuple[Real, Real]

__all__ = [
    "ERROR",
    "NEGLIGIBLE",
    "approach",
    "contact_time",
    "discriminant_from_gap",
    "discriminant_from_miss",
    "encounter",
    "exact_coefficients",
    "exact_pair_time",
    "exact_root",
    "pair_time",
    "refine",
    "separation",
]

#: 8 roundings: more than the terms of b (4), c (5) and, with a factor 2 beside it, of D gather before their last sum.
ERROR = 2.0**-50
#: Where products of this size count, underflow (2^-1075 at most, each) may count too, and the error-free form decides.
NEGLIGIBLE = 2.0**-900
#: Adding and taking away 2^28 R rounds to a grid of 2^-25 R to 2^-24 R: 25 bits or so for any coordinate up to R.
_GRID = 2.0**28
#: Every float is below two to this.
_LARGEST_EXPONENT = 1024


def approach(dx: Real, dy: Real, ux: Real, uy: Real) -> tuple[Real, Real]:
    """Return ``b = d.u`` of the plain form, negative where the discs approach, and a bound on its rounding error.

    Args:
        dx: Centre of the second less that of the first, x, metres; `dy` likewise.
        dy: See `dx`.
        ux: Velocity of the second less that of the first, x, metres a second; `uy` likewise.
        uy: See `ux`.
    """
    along_x, along_y = dx * ux, dy * uy
    return along_x + along_y, ERROR * (abs(along_x) + abs(along_y)) + NEGLIGIBLE


def encounter(dx: Real, dy: Real, ux: Real, uy: Real, reach: Real) -> tuple[Real, Real]:
    """Return ``D = a R^2 - (d x u)^2`` of the plain form, negative where the discs miss, and a bound on its error.

    Args:
        dx: As in `approach`; so are `dy`, `ux` and `uy`.
        dy: See `dx`.
        ux: See `dx`.
        uy: See `dx`.
        reach: Sum of the radii, metres.
    """
    across_x, across_y = dx * uy, dy * ux
    cross = across_x - across_y
    largest = (reach * reach) * (ux * ux + uy * uy)
    across = abs(across_x) + abs(across_y)
    error = (2.0 * ERROR) * ((abs(cross) + ERROR * across) * across + largest) + NEGLIGIBLE
    return largest - cross * cross, error


def separation(dx: Real, dy: Real, reach: Real) -> tuple[Real, Real]:
    """Return ``c = d.d - R^2`` of the plain form, negative where the discs overlap, and a bound on its error."""
    distance2, reach2 = dx * dx + dy * dy, reach * reach
    return distance2 - reach2, ERROR * (distance2 + reach2) + NEGLIGIBLE


def refine(near: Real, x: Pair, y: Pair, ux: Pair, uy: Pair, reach: Pair) -> tuple[Real, Real]:
    """Return the root near `near`, and whether it is certain to be the earlier one and right to 2 ulp.

    One step of ``tau = c'/(2 q) (1 + x/4 + x^2/8 + ...)`` from `near`, with ``q = -b'`` and ``x = a c'/q^2``. Split
    in two, time and velocity multiply exactly; on a common grid of 25 bits the squares of the two coordinates and of R,
    and their sum, are exact too, and what the grid leaves over enters at first order.

    Args:
        near: A guess at the root, seconds, of 22 right bits or more.
        x: Relative position as a pair, rounded difference and its error; `y` likewise.
        y: See `x`.
        ux: Relative velocity as a pair; `uy` likewise.
        uy: See `ux`.
        reach: Sum of the radii as a pair.
    """
    late, early = split(near)
    radius, radius_rest = reach
    grid = _GRID * radius
    x_head, x_rest = _advanced(late, early, x, ux)
    y_head, y_rest = _advanced(late, early, y, uy)
    px, py = x_head + x_rest, y_head + y_rest
    hx, hy, hr = (px + grid) - grid, (py + grid) - grid, (radius + grid) - grid
    lx, ly, lr = (x_head - hx) + x_rest, (y_head - hy) + y_rest, (radius - hr) + radius_rest
    gap = ((hx * hx + hy * hy) - hr * hr) + (2.0 * ((hx * lx + hy * ly) - hr * lr) + ((lx * lx + ly * ly) - lr * lr))
    closing = -(px * ux[0] + py * uy[0])
    # A far graze can leave a closing speed of exactly 0, which `certain` refuses.
    inverse = 1.0 / (closing + (closing == 0.0))
    step = gap * inverse
    bend = ((ux[0] * ux[0] + uy[0] * uy[0]) * step) * inverse
    speed = abs(ux[0]) + abs(uy[0])
    extent = abs(x[0]) + abs(y[0]) + near * speed
    certain = (
        (closing >= 2.0**-10 * (radius * speed))
        & (extent <= 2.0**34 * radius)
        & (abs(bend) <= 2.0**-12)
        & (abs(step) <= 2.0**-22 * near)
        & (2.0**-17 * (radius * (2.0 * radius + extent)) <= closing * near)
        & (radius >= 2.0**-440)
        & (speed >= 2.0**-440)
    )
    return near + 0.5 * step * (1.0 + bend * (0.25 + 0.125 * bend)), certain


def _advanced(late: Real, early: Real, p: Pair, v: Pair) -> Pair:
    """Return ``p + t v`` as head and rest, for a time split into ``late + early``."""
    fast, slow = split(v[0])
    head, error = two_sum(p[0], late * fast)
    return head, error + ((late * slow + early * fast) + (early * slow + (p[1] + late * v[1])))


def exact_coefficients(x: Pair, y: Pair, ux: Pair, uy: Pair, reach: Pair) -> tuple[Pair, Pair, Pair]:
    """Return ``b``, ``c`` and ``a`` of the error-free form as pairs; arguments as in `refine`, scaled to about 1."""
    zero = 0.0 * x[0]
    none = (zero, zero)
    # Nine factors each: one loop then serves all.
    b = sum_of_products((*_products(x, ux), *_products(y, uy), none))
    c = sum_of_products((*_square(x, x), *_square(y, y), *_square(reach, (-reach[0], -reach[1]))))
    a = sum_of_products((*_square(ux, ux), *_square(uy, uy), none, none, none))
    return b, c, a


def _square(p: Pair, q: Pair) -> tuple[Pair, Pair, Pair]:
    """Return the factors whose products add up to ``p q``, where q is p or -p."""
    return (p[0], q[0]), (2.0 * p[0], q[1]), (p[1], q[1])


def _products(p: Pair, q: Pair) -> tuple[Pair, Pair, Pair, Pair]:
    """Return the factors whose products add up to ``p q``."""
    return (p[0], q[0]), (p[0], q[1]), (p[1], q[0]), (p[1], q[1])


def discriminant_from_gap(b: Pair, c: Pair, a: Pair) -> Pair:
    """Return ``D = b^2 - a c`` as a pair: the form that loses nothing near contact, where b and c are small."""
    square, rest = two_prod(b[0], b[0])
    product, product_rest = two_prod(a[0], c[0])
    high, low = two_diff(square, product)
    return two_sum(high, low + ((rest - product_rest) + (2.0 * b[0] * b[1] - (a[0] * c[1] + a[1] * c[0]))))


def discriminant_from_miss(x: Pair, y: Pair, ux: Pair, uy: Pair, reach: Pair, a: Pair) -> Pair:
    """Return ``D = a R^2 - (d x u)^2`` as a pair: it loses nothing far away, where b^2 and a c nearly cancel."""
    zero = 0.0 * x[0]
    cross = sum_of_products((*_products(x, uy), *_products((-y[0], -y[1]), ux), (zero, zero)))
    square, rest = pair_product(cross[0], cross[1], cross[0], cross[1])
    reach2 = pair_product(reach[0], reach[1], reach[0], reach[1])
    largest, largest_rest = pair_product(a[0], a[1], reach2[0], reach2[1])
    high, low = two_diff(largest, square)
    return two_sum(high, low + (largest_rest - rest))


def exact_root(b: Pair, c: Pair, d: Pair, root: Real) -> Real:
    """Return ``c / (-b + sqrt(D))``, corrected once by its residual; `root` is the rounded root of `d`'s head."""
    square, square_rest = two_prod(root, root)
    root_rest = (((d[0] - square) - square_rest) + d[1]) / (2.0 * root)
    high, low = two_sum(root, -b[0])
    low = low + (root_rest - b[1])
    t = c[0] / high
    product, product_rest = two_prod(t, high)
    return t + ((((c[0] - product) - product_rest) + c[1]) - t * low) / high


def exact_pair_time(
    x_high: float,
    x_low: float,
    y_high: float,
    y_low: float,
    ux_high: float,
    ux_low: float,
    uy_high: float,
    uy_low: float,
    reach_high: float,
    reach_low: float,
) -> float:
    """Return the time of impact by the error-free form, for the pairs of `refine`, of any size."""
    x, y, reach = (x_high, x_low), (y_high, y_low), (reach_high, reach_low)
    ux, uy = (ux_high, ux_low), (uy_high, uy_low)
    fastest = max(abs(ux[0]), abs(uy[0]))
    if fastest == 0.0:
        return math.inf
    _, length = math.frexp(max(abs(x[0]), abs(y[0]), reach[0]))
    _, pace = math.frexp(fastest)
    x, y, reach = _scaled(x, -length), _scaled(y, -length), _scaled(reach, -length)
    ux, uy = _scaled(ux, -pace), _scaled(uy, -pace)
    b, c, a = exact_coefficients(x, y, ux, uy, reach)
    # A velocity below 2^-1022 of the other component is lost in scaling, but not its sign.
    if not b[0] < 0.0 and not (b[0] == 0.0 and x[0] * ux_high + y[0] * uy_high < 0.0):
        return math.inf
    if c[0] <= 0.0:
        return 0.0
    if b[0] * b[0] < a[0] * (reach[0] * reach[0]):
        d = discriminant_from_gap(b, c, a)
    else:
        d = discriminant_from_miss(x, y, ux, uy, reach, a)
    if not d[0] > 0.0:
        return math.inf
    root = exact_root(b, c, d, math.sqrt(d[0]))
    _, size = math.frexp(root)
    # Beyond the largest float ldexp raises in plain Python, and gives infinity when compiled.
    return math.inf if size + length - pace > _LARGEST_EXPONENT else math.ldexp(root, length - pace)


def _scaled(pair: Pair, exponent: int) -> Pair:
    return math.ldexp(pair[0], exponent), math.ldexp(pair[1], exponent)


def contact_time(
    b: float,
    d: float,
    x1: float,
    y1: float,
    vx1: float,
    vy1: float,
    r1: float,
    x2: float,
    y2: float,
    vx2: float,
    vy2: float,
    r2: float,
) -> float:
    """Return `pair_time` of discs that the plain form's `b` and `d` have not ruled out; other arguments as there."""
    x, y = two_diff(x2, x1), two_diff(y2, y1)
    ux, uy = two_diff(vx2, vx1), two_diff(vy2, vy1)
    reach = two_sum(r1, r2)
    c, _ = separation(x[0], y[0], reach[0])
    if b < 0.0 and c > 0.0 and d > 0.0:
        t, certain = refine(c / (math.sqrt(d) - b), x, y, ux, uy, reach)
        if certain:
            return float(t)
    return exact_pair_time(x[0], x[1], y[0], y[1], ux[0], ux[1], uy[0], uy[1], reach[0], reach[1])


def pair_time(
    x1: float, y1: float, vx1: float, vy1: float, r1: float, x2: float, y2: float, vx2: float, vy2: float, r2: float
) -> float:
    """Return the seconds until two discs collide, given where they are and how they move at one instant.

    Args:
        x1: Centre of disc 1, x, metres; `y1`, `x2`, `y2` likewise.
        y1: See `x1`.
        vx1: Velocity of disc 1, x, metres a second; `vy1`, `vx2`, `vy2` likewise.
        vy1: See `vx1`.
        r1: Radius of disc 1, metres; `r2` likewise.
        x2: See `x1`.
        y2: See `x1`.
        vx2: See `vx1`.
        vy2: See `vx1`.
        r2: See `r1`.

    Returns:
        0 where they touch or overlap and approach; infinity where they never meet (a graze of zero depth, ``D = 0``,
        exchanges no momentum and is no impact).
    """
    dx, dy, ux, uy, reach = x2 - x1, y2 - y1, vx2 - vx1, vy2 - vy1, r1 + r2
    b, b_error = approach(dx, dy, ux, uy)
    if b > b_error:
        return math.inf
    d, d_error = encounter(dx, dy, ux, uy, reach)
    if d < -d_error:
        return math.inf
    return contact_time(b, d, x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2)
