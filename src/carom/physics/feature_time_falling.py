"""Time of impact of a falling disc with any feature of a wall; apart, as a scene without gravity loads none of it.

The gap to a face is the quadratic of `carom.physics.wall_time_falling`, and the impact its falling root: there is one
at most, so a disc whose foot is not on the edge by then never meets the face on this path. The squared distance from
the centre of an arc, or from a vertex, is a quartic in time, as in `carom.physics.pair_time_falling`; its negative is
that of an arc from inside. A fall outside the sector is no contact, and the next one counts.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING

from carom.physics.arc_time import from_pair, is_before_arc, is_in, reach_of
from carom.physics.double_double import Pair, pair_product, two_sum
from carom.physics.exact_quartic import find_closings as touches
from carom.physics.face_time import across, face_gap, from_point, is_before_face
from carom.physics.features import Face
from carom.physics.pair_time import discriminant_from_gap
from carom.physics.pair_time_falling import squared_gap
from carom.physics.wall_time_falling import descent_time, return_time

if TYPE_CHECKING:
    from collections.abc import Iterable

    from carom.physics.features import Arc, Feature, Mover, Point, Sector
    from carom.physics.wall_features import WallFeature

    _Powers = list[Fraction]  # lowest first


def feature_time_falling(disc: Mover, feature: Feature, gravity: Point, leaving: float | None = None) -> float:
    """Return the seconds until a falling disc touches a feature; 0 for one that rests on it, infinity for never.

    Where the feature is the last thing that the disc met, `leaving` is the speed at which it left it, along the normal.
    """
    if isinstance(feature, Face):
        return face_time_falling(disc, feature, gravity, leaving)
    return arc_time_falling(disc, feature, gravity, leaving)


def first_feature_falling(
    disc: Mover, features: Iterable[WallFeature], gravity: Point, last: Feature | None, leaving: float
) -> tuple[float, WallFeature | None]:
    """Return the seconds until a falling disc meets a wall, and which feature of it; infinity and None for never.

    Args:
        disc: The disc.
        features: Those of one wall, in the order in which they are met at one instant.
        gravity: In m/s^2.
        last: The feature that it met last, on the path that it is on.
        leaving: The speed at which it left that one, along the normal.
    """
    least: tuple[float, WallFeature | None] = (math.inf, None)
    for part in features:
        time = feature_time_falling(disc, part.feature, gravity, leaving if part.feature is last else None)
        if time < least[0]:
            least = (time, part)
    return least


def face_time_falling(disc: Mover, face: Face, gravity: Point, leaving: float | None = None) -> float:
    """Return the seconds until a falling disc touches a face, infinity where it never does; as `descent_time` does.

    Where the disc has just hit the face, `leaving` is the speed at which it leaves it, 0 or more: the gap is then 0,
    whatever rounding has made of it.
    """
    pull = across(*face.along, (gravity[0], 0.0), (gravity[1], 0.0))  # times the face's length
    if leaving is not None:
        if not pull[0] < 0.0:
            return math.inf
        wait = return_time(pair_product((leaving, 0.0), face.length), pull)
        return wait if foot_is_on(disc, face, wait, gravity) else math.inf
    gap, speed = face_gap(disc, face), across(*face.along, disc.ux, disc.uy)
    if gap[0] <= 0.0:
        if is_before_face(disc, face):
            return descent_time(gap, speed, pull)
        if not speed[0] > 0.0 or not pull[0] < 0.0:  # next to it or behind, from where only a fall back leads onto it
            return math.inf
        if not discriminant_from_gap(speed, (2.0 * gap[0], 2.0 * gap[1]), pull)[0] > 0.0:
            return math.inf
    wait = descent_time(gap, speed, pull)
    return wait if wait < math.inf and foot_is_on(disc, face, wait, gravity) else math.inf


def foot_is_on(disc: Mover, face: Face, time: float, gravity: Point) -> bool:
    """Whether a falling disc's foot is on the edge at a time; where rounding decides, face and vertex agree."""
    (ex, _), (ey, _) = face.along
    gx, gy = gravity
    moved_x, moved_y = time * (disc.ux[0] + 0.5 * gx * time), time * (disc.uy[0] + 0.5 * gy * time)
    x, y = from_point(disc.x, face.a[0])[0] + moved_x, from_point(disc.y, face.a[1])[0] + moved_y
    to_x, to_y = from_point(disc.x, face.b[0])[0] + moved_x, from_point(disc.y, face.b[1])[0] + moved_y
    return ex * x + ey * y >= 0.0 >= ex * to_x + ey * to_y


def arc_time_falling(disc: Mover, arc: Arc, gravity: Point, leaving: float | None = None) -> float:
    """Return the seconds until a falling disc touches an arc, or a vertex, infinity where it never does.

    0 where it touches and approaches, or touches, does not move apart and is pressed against the arc: contact. Where
    the disc has just hit the arc, `leaving` is the speed at which it leaves it: the gap is then 0, whatever rounding
    has made of it.
    """
    reach = reach_of(disc, arc)
    if (disc.radius < arc.fits_below) is not arc.inside:
        return math.inf
    place = _exact(disc.x) - _exact(arc.centre[0]), _exact(disc.y) - _exact(arc.centre[1])
    velocity, pull = (_exact(disc.ux), _exact(disc.uy)), (Fraction(gravity[0]), Fraction(gravity[1]))
    gap = squared_gap(place, velocity, pull, _exact(reach), leaving)
    if arc.inside:
        opening = -gap[1] if leaving is None else gap[1]
        gap = [-gap[0], opening, *(-power for power in gap[2:])]
    if gap[0] <= 0 and is_before_arc(disc, arc):
        gap[0] = Fraction(0)
    found = next((time for time in touches(gap) if _is_in_sector_at(time, disc, arc, gravity)), math.inf)
    if not arc.inside or arc.sector is None or gap[0] > 0:
        return found
    xs, ys = ([p, u, a / 2] for p, u, a in zip(place, velocity, pull, strict=True))
    return min(found, _coming_in(arc, arc.sector, disc, gravity, xs, ys, gap))


def _coming_in(arc: Arc, sector: Sector, disc: Mover, gravity: Point, xs: _Powers, ys: _Powers, gap: _Powers) -> float:
    """Return when a falling disc touches an arc into whose sector it comes where it touches or overlaps it by then.

    `carom.physics.arc_time` says why; the gap is 0 there. Place and gap are polynomials in time.
    """
    first = math.inf
    for end, sense in ((sector.first, 1), (sector.last, -1)):
        fx, fy = map(_exact, end)
        for time in touches([sense * (fy * x - fx * y) for x, y in zip(xs, ys, strict=True)]):
            (x, *_), (y, *_), (overlap, *rest) = (_from(time, powers) for powers in (xs, ys, gap))
            if overlap <= 0 and fx * x + fy * y > 0 and x * x + y * y < _exact(arc.radius) ** 2:
                later = (time + wait for wait in touches([Fraction(0), *rest]))
                first = min(first, next((t for t in later if _is_in_sector_at(t, disc, arc, gravity)), math.inf))
    return first


def _from(time: float, powers: _Powers) -> _Powers:
    """Return a polynomial in time as one in the time from an instant on."""
    found, t = list(powers), Fraction(time)
    for lowest in range(len(found)):
        for k in reversed(range(lowest, len(found) - 1)):
            found[k] += t * found[k + 1]
    return found


def _exact(pair: Pair) -> Fraction:
    return Fraction(pair[0]) + Fraction(pair[1])


def _is_in_sector_at(time: float, disc: Mover, arc: Arc, gravity: Point) -> bool:
    """Whether a disc is in an arc's sector at a time, or rounding leaves that open."""
    if arc.sector is None:
        return True
    (px, moved_x), (py, moved_y) = (
        _fallen(from_pair(x, c), u, g, time)
        for x, c, u, g in zip(disc[:2], arc.centre, disc[2:4], gravity, strict=True)
    )
    return is_in(arc.sector, px, py, moved_x, moved_y)


def _fallen(x: Pair, u: Pair, g: float, time: float) -> tuple[Pair, float]:
    """Return a coordinate after a time of free fall, and how far at most it has moved in it."""
    flown, fallen = time * u[0], 0.5 * g * time * time
    high, low = two_sum(x[0], flown + fallen)
    return two_sum(high, low + x[1]), abs(flown) + abs(fallen)
