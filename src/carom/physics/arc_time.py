"""Time of impact of a disc with a vertex, and with an arc from outside and from inside, in straight uniform motion.

A vertex and an arc's outer side are met as another disc would be: the earlier root of ``|d + t u| = R`` with R the sum
of the arc's radius, half width and the disc's radius. An arc's inner side is met at the *later* root, with R the arc's
radius less both. With ``a = u.u``, ``b = d.u``, ``c = d.d - R^2`` and ``D = b^2 - a c`` that is

    t = (-b + sqrt(D)) / a     for b <= 0,        t = -c / (b + sqrt(D))     for b > 0,

where nothing cancels, as c <= 0 inside. For a disc that has just left the arc's inner side, c is 0, whatever rounding
has made of it: its next impact is a chord away, ``t = -2 b / a``. To the last digit or its neighbour, all of them.

An arc is met if the contact is in its sector. Where rounding leaves this open, it is: at such a point the arc and what
it goes over into, or its end, are touched alike.

Floats leave a disc that touches an arc from inside an ulp too far out, and one that slides along a straight edge, too,
until the edge goes over into an arc. A path that from there never comes back into the circle is the arc's tangent, as
far as floats tell: ``D < 0``, and the disc glides. It is lost otherwise, as only what comes from inside meets the arc.
So is a path that leaves the arc by a chord that is rounding of its velocity: what an impact without restitution leaves.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from carom.physics.double_double import Pair, sum_of_products, two_diff, two_prod, two_sum
from carom.physics.face_time import across, negative
from carom.physics.pair_time import (
    DOUBTFUL_DISCRIMINANT,
    ERROR,
    NEGLIGIBLE,
    Encounter,
    discriminant_from_gap,
    discriminant_from_miss,
    exact_discriminant,
    exact_root,
    excess,
    inner_product,
    meeting_time,
    square_factors,
)
from carom.physics.wall_time import quotient

if TYPE_CHECKING:
    from carom.physics.features import Arc, Mover, Sector

#: More than the roundings of an end's direction and of a place, which are pairs, make of their cross product.
_PAIR_ERROR = 2.0**-100


class Touch(NamedTuple):
    """When a disc touches an arc from inside.

    Attributes:
        time: Seconds from now; infinity for never.
        glides: Whether it comes along the tangent, or touches already and moves along it: contact, and no impact.
    """

    time: float
    glides: bool = False


_NEVER = Touch(math.inf)


def from_pair(a: Pair, q: Pair) -> Pair:
    """Return a coordinate as counted from another."""
    high, low = two_diff(a[0], q[0])
    return two_sum(high, low + (a[1] - q[1]))


def reach_of(disc: Mover, arc: Arc) -> Pair:
    """Return the distance from an arc's centre at which a disc touches it; not above 0 where it does not fit inside."""
    thick = two_sum(disc.radius, arc.half_width)
    thick = negative(thick) if arc.inside else thick
    high, low = two_sum(arc.radius[0], thick[0])
    return two_sum(high, low + (arc.radius[1] + thick[1]))


def is_in(sector: Sector | None, x: Pair, y: Pair, moved_x: float = 0.0, moved_y: float = 0.0) -> bool:
    """Whether a place, as counted from the centre, is in a sector, or rounding leaves that open.

    Args:
        sector: The sector; None is the whole circle.
        x: Coordinate of the place.
        y: The other one.
        moved_x: How far the disc has moved to there; a time to the nearest float leaves 2^-53 of it open.
        moved_y: The same along y.
    """
    if sector is None:
        return True
    after_first, first_open = _turn_to(*sector.first, x, y, moved_x, moved_y)
    after_last, last_open = _turn_to(*sector.last, x, y, moved_x, moved_y)
    begun, not_ended = after_first >= -first_open, after_last <= last_open
    return begun or not_ended if sector.reflex else begun and not_ended


def _turn_to(fx: Pair, fy: Pair, x: Pair, y: Pair, moved_x: float, moved_y: float) -> tuple[float, float]:
    """Return the cross product of an end's direction and a place, and what rounding leaves open of it."""
    moved = abs(fx[0] * moved_y) + abs(fy[0] * moved_x)
    placed = abs(fx[0] * y[0]) + abs(fy[0] * x[0])
    return across(fx, fy, x, y)[0], ERROR * moved + _PAIR_ERROR * placed + NEGLIGIBLE


def is_before_arc(disc: Mover, arc: Arc) -> bool:
    """Whether a disc's centre is on the side of an arc that is asked about, and in its sector.

    Then a gap below 0 is an overlap; elsewhere it means that the disc is next to the arc or behind it.
    """
    x, y = from_pair(disc.x, arc.centre[0]), from_pair(disc.y, arc.centre[1])
    beyond = excess(x, y, arc.radius)[0]
    return (beyond < 0.0 if arc.inside else beyond > 0.0) and is_in(arc.sector, x, y)


def outer_arc_time(disc: Mover, arc: Arc) -> float:
    """Return the seconds until a disc touches an arc from outside, or a vertex, infinity where it never does.

    0 where it touches or overlaps and approaches. One that is within the circle of contact, but next to the arc, does
    not meet it: a straight path enters a circle once.
    """
    if disc.radius < arc.fits_below:
        return math.inf
    x, y = from_pair(disc.x, arc.centre[0]), from_pair(disc.y, arc.centre[1])
    time = meeting_time(Encounter(x, y, disc.ux, disc.uy, reach_of(disc, arc)))
    if time == math.inf:
        return time
    if time == 0.0:
        return time if is_before_arc(disc, arc) else math.inf
    return time if _touches(arc.sector, x, y, disc, time) else math.inf


def inner_arc_time(disc: Mover, arc: Arc, *, just_left: bool = False) -> Touch:
    """Return when a disc touches an arc from inside, at once where it touches or overlaps and does not come away.

    With `just_left` the last thing that the disc met is this arc, on the path that it is on now.
    """
    reach = reach_of(disc, arc)
    a = sum_of_products((*square_factors(disc.ux), *square_factors(disc.uy)))
    if not disc.radius < arc.fits_below or a[0] == 0.0:
        return _NEVER
    x, y = from_pair(disc.x, arc.centre[0]), from_pair(disc.y, arc.centre[1])
    b = inner_product(x, y, disc.ux, disc.uy)
    c = (0.0, 0.0) if just_left else excess(x, y, reach)
    touch = _NEVER
    if c[0] == 0.0 > b[0]:
        chord = quotient((2.0 * b[0], 2.0 * b[1]), a)
        if chord * (abs(disc.ux[0]) + abs(disc.uy[0])) > 2.0 * ERROR * reach[0]:
            touch = Touch(chord)
    elif c[0] < 0.0 or b[0] < 0.0:
        touch = _later_root(x, y, disc, reach, a, b, c)
    if touch.time < math.inf and _touches(arc.sector, x, y, disc, touch.time, glides=touch.glides):
        return touch
    stays_out = b[0] < 0.0 and touch.time == math.inf
    if c[0] >= 0.0 and (stays_out or b[0] >= 0.0) and (just_left or is_before_arc(disc, arc)):
        touch = Touch(0.0, stays_out or just_left or b[0] == 0.0)
        if not touch.glides or _touches(arc.sector, x, y, disc, 0.0, glides=True):
            return touch
    return _coming_in(arc, arc.sector, x, y, disc, reach) if stays_out and arc.sector is not None else _NEVER


def _coming_in(arc: Arc, sector: Sector, x: Pair, y: Pair, disc: Mover, reach: Pair) -> Touch:
    """Return when a disc that stays out of the circle comes into the sector where it overlaps the arc."""
    first = math.inf
    for (fx, fy), sense in ((sector.first, 1.0), (sector.last, -1.0)):
        turn, rate = across(fx, fy, x, y), across(fx, fy, disc.ux, disc.uy)
        if not sense * turn[0] < 0.0 < sense * rate[0]:
            continue
        time = quotient(turn, rate)
        (px, _), (py, _) = _moved(x, disc.ux, time), _moved(y, disc.uy, time)
        is_ahead = fx[0] * px[0] + fy[0] * py[0] > 0.0
        if time < first and is_ahead and excess(px, py, reach)[0] > 0.0 > excess(px, py, arc.radius)[0]:
            first = time
    return Touch(first, glides=True) if first < math.inf else _NEVER


def _later_root(x: Pair, y: Pair, disc: Mover, reach: Pair, a: Pair, b: Pair, c: Pair) -> Touch:
    """Return the later root, infinity where there is none after now, and whether it is the earlier one, too."""
    square, largest = b[0] * b[0], a[0] * (reach[0] * reach[0])
    if c[0] < 0.0 or square < largest:
        d = discriminant_from_gap(b, c, a)
        terms = square
    else:
        d = discriminant_from_miss(x, y, disc.ux, disc.uy, reach, a)
        terms = largest
    if c[0] > 0.0 and abs(d[0]) <= DOUBTFUL_DISCRIMINANT * terms:
        d = exact_discriminant(x, y, disc.ux, disc.uy, reach)
    if d[0] == 0.0:
        return Touch(quotient(b, a), glides=True)
    if d[0] < 0.0:
        return _NEVER
    root = math.sqrt(d[0])
    if b[0] > 0.0:
        return Touch(exact_root(negative(b), negative(c), d, root))
    product, product_rest = two_prod(root, root)
    root_rest = (((d[0] - product) - product_rest) + d[1]) / (2.0 * root)
    high, low = two_sum(root, -b[0])
    return Touch(-quotient((high, low + (root_rest - b[1])), a))


def _touches(sector: Sector | None, x: Pair, y: Pair, disc: Mover, time: float, *, glides: bool = False) -> bool:
    """Whether a disc at (x, y) from the centre is in the sector at a time; one that glides, not where it is left."""
    if sector is None:
        return True
    (px, moved_x), (py, moved_y) = _moved(x, disc.ux, time), _moved(y, disc.uy, time)
    if glides:
        ahead = px[0] * disc.uy[0] - py[0] * disc.ux[0]  # above 0: counterclockwise, to where the sector ends
        end_x, end_y = sector.last if ahead > 0.0 else sector.first
        turn, left_open = _turn_to(end_x, end_y, px, py, moved_x, moved_y)
        if abs(turn) <= left_open and end_x[0] * px[0] + end_y[0] * py[0] > 0.0:
            return False
    return is_in(sector, px, py, moved_x, moved_y)


def _moved(x: Pair, u: Pair, time: float) -> tuple[Pair, float]:
    """Return a coordinate after a time, and how much it has changed."""
    way, rest = two_prod(time, u[0])
    high, low = two_sum(x[0], way)
    return two_sum(high, low + (x[1] + (rest + time * u[1]))), way
