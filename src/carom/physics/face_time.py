"""Time of impact of a disc and a straight face in straight uniform motion, to within 1 unit in the last place.

With ``e = b - a`` along the face, of length l, the centre at d from a, and ``R`` half width plus radius, the rim is at
``gap l = e x d - R l`` and closes at ``speed l = e x u``; it touches at minus their quotient. The edge's vector is not
normalised, so that no rounded normal enters. A disc's rim touches the face if its foot is on the edge by then, from a
to b. At a convex end the wall's thickened outline turns without a kink, so that face and vertex give the same impact.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.physics.double_double import Pair, pair_product, sum_of_products, two_diff, two_prod, two_sum
from carom.physics.pair_time import ERROR, NEGLIGIBLE, exact_discriminant, inner_product, product_factors
from carom.physics.wall_time import quotient

if TYPE_CHECKING:
    from carom.physics.features import Face, Mover

#: The length of a face is right to 2^-106 of itself: below this part of the terms, the gap is made of squares instead.
_DOUBTFUL_GAP = 2.0**-44


def negative(a: Pair) -> Pair:
    """Return minus a pair."""
    return -a[0], -a[1]


def from_point(a: Pair, q: float) -> Pair:
    """Return a coordinate as counted from a point: exactly, where it is one float."""
    high, low = two_diff(a[0], q)
    return two_sum(high, low + a[1])


def across(ex: Pair, ey: Pair, x: Pair, y: Pair) -> Pair:
    """Return the cross product ``e x d`` of two vectors of pairs; its sign is exact."""
    return inner_product(ex, negative(ey), y, x)


def face_gap(disc: Mover, face: Face) -> Pair:
    """Return the distance of a disc's rim from a face's line times the face's length, square metres.

    Its sign is exact, for the pairs given; negative behind the line, or in the wall.
    """
    (ex, ey), length = face.along, face.length
    x, y, reach = from_point(disc.x, face.a[0]), from_point(disc.y, face.a[1]), two_sum(disc.radius, face.half_width)
    gap = sum_of_products(
        (*product_factors(ex, y), *product_factors(negative(ey), x), *product_factors(negative(length), reach))
    )
    wide = length[0] * reach[0]
    if abs(gap[0]) > _DOUBTFUL_GAP * wide:
        return gap
    # There is no root in (e x d)^2 - R^2 e.e: divided by e x d + R l, which is far from 0, it is the gap.
    squares = negative(exact_discriminant(x, y, ex, ey, reach))
    cross, root = across(ex, ey, x, y), pair_product(length, reach)
    high, low = two_sum(cross[0], root[0])
    return _pair_quotient(squares, (high, low + (cross[1] + root[1])))


def _pair_quotient(a: Pair, b: Pair) -> Pair:
    """Return ``a / b`` as a pair, to some 2^-100 of itself."""
    first = a[0] / b[0]
    product, rest = two_prod(first, b[0])
    return two_sum(first, (((a[0] - product) - rest) + (a[1] - first * b[1])) / b[0])


def is_before_face(disc: Mover, face: Face) -> bool:
    """Whether a disc's centre is on a face's free side, with its foot on the edge: then a gap below 0 is an overlap.

    Elsewhere it means that the disc is next to the edge or behind it.
    """
    (ex, ey), x, y = face.along, from_point(disc.x, face.a[0]), from_point(disc.y, face.a[1])
    to_end = from_point(disc.x, face.b[0]), from_point(disc.y, face.b[1])
    return (
        across(ex, ey, x, y)[0] > 0.0
        and inner_product(ex, ey, x, y)[0] >= 0.0
        and inner_product(ex, ey, *to_end)[0] <= 0.0
    )


def face_time(disc: Mover, face: Face) -> float:
    """Return the seconds until a disc touches a face, infinity where it never does.

    0 where it touches or overlaps and approaches. One that has just left the face does not meet it again: not for this
    function to know.
    """
    (ex, ey), ux, uy = face.along, disc.ux, disc.uy
    toward = ex[0] * uy[0] - ey[0] * ux[0]
    if toward > ERROR * (abs(ex[0] * uy[0]) + abs(ey[0] * ux[0])) + NEGLIGIBLE:
        return math.inf
    speed = across(ex, ey, ux, uy)
    if not speed[0] < 0.0:
        return math.inf
    gap = face_gap(disc, face)
    if gap[0] <= 0.0:
        return 0.0 if is_before_face(disc, face) else math.inf
    return quotient(gap, speed) if _comes_onto(disc, face) else math.inf


def _comes_onto(disc: Mover, face: Face) -> bool:
    """Whether a disc that approaches a face's line has its foot on the edge when it touches the line.

    With ``t = -(e x d - R l) / (e x u)`` the foot's place ``e.(d + t u)`` is ``l (l d x u + R e.u) / (e x u)``, whose
    divisor is below 0; with d counted from a, or from b. So its sign needs no quotient, and is right to 2^-100.
    """
    (ex, ey), length, ux, uy = face.along, face.length, disc.ux, disc.uy
    reach = two_sum(disc.radius, face.half_width)
    x, y = from_point(disc.x, face.a[0]), from_point(disc.y, face.a[1])
    to_x, to_y = from_point(disc.x, face.b[0]), from_point(disc.y, face.b[1])
    drift = product_factors(reach, inner_product(ex, ey, ux, uy))
    after_a = sum_of_products((*product_factors(length, across(x, y, ux, uy)), *drift))
    before_b = sum_of_products((*product_factors(length, across(to_x, to_y, ux, uy)), *drift))
    return after_a[0] <= 0.0 <= before_b[0]
