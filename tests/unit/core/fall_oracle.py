"""Exact times of fall in rational numbers: an independent reference for the core.

A gap is a polynomial in time with rational coefficients. For an arc it is the squared distance of a disc from the
centre minus the squared distance of contact. For a face it is the distance of the rim times the length of the face. Its
closings come from `carom.core.exact_quartic`. The sign of a cross or inner product tells whether the disc is in front
of the feature at such a time. Where that sign is within rounding of 0, either answer is right, so the functions here
return all times that are right.
"""

import contextlib
import math
from collections.abc import Iterable, Sequence
from fractions import Fraction

from tests.unit.core.fall_cases import Encounter, Fall

from carom.core.exact_quartic import find_closings
from carom.core.wall_features import Arc, Face, Mover, Point, Sector
from carom.core.wall_parts import Pair

Polynomial = list[Fraction]  # lowest power first
Vector = tuple[Fraction, Fraction]

NEVER = math.inf

#: More than floats round of a way, and than pairs round of a place, in parts of them.
_WAY_ERROR, _PLACE_ERROR = Fraction(2) ** -49, Fraction(2) ** -98
#: Part of its terms by which a sum of pairs and floats is rounded to a pair of 106 bits, twice.
_PAIR_ERROR = Fraction(2) ** -104
#: Bits of the length of a face.
_ROOT_BITS = 300
#: Below this part of its terms the discriminant of a face's quadratic is too close to 0 for a bound on the error.
_DOUBTFUL = Fraction(2) ** -80


def value(pair: Pair) -> Fraction:
    """Return the number that a pair is."""
    return Fraction(pair[0]) + Fraction(pair[1])


def find_closing_times(gap: Polynomial) -> list[float]:
    """Return the times at which a gap closes, except those larger than the largest float."""
    found = list[float]()
    with contextlib.suppress(OverflowError):
        found.extend(find_closings(gap))
    return found


def compute_disc_time(case: Encounter) -> float:
    """Return the seconds until a falling disc touches a fixed one, infinity for never."""
    x, y, ux, uy, radius, fixed_x, fixed_y, fixed_radius, ax, ay = map(
        Fraction, (*case.disc, *case.fixed, *case.acceleration)
    )
    gap = build_squared_gap((x - fixed_x, y - fixed_y), (ux, uy), (ax, ay), radius + fixed_radius, case.leaving)
    try:
        return next(find_closings([max(gap[0], Fraction(0)), *gap[1:]]), NEVER)
    except OverflowError:
        return NEVER


def build_squared_gap(
    place: Vector, velocity: Vector, pull: Vector, reach: Fraction, leaving: float | None
) -> Polynomial:
    """Return the squared distance from the origin less that of contact; with a speed of leaving the two touch now."""
    (px, py), (ux, uy), (ax, ay) = place, velocity, pull
    gap, opening = px * px + py * py - reach * reach, 2 * (px * ux + py * uy)
    if leaving is not None:
        gap, opening = Fraction(0), 2 * reach * Fraction(leaving)
    return [gap, opening, ux * ux + uy * uy + px * ax + py * ay, ux * ax + uy * ay, (ax * ax + ay * ay) / 4]


class Path:
    """A disc's parabola as seen from a point."""

    def __init__(self, disc: Mover, origin: tuple[Pair, Pair], pull: Point) -> None:
        self.place = value(disc.x) - value(origin[0]), value(disc.y) - value(origin[1])
        self.velocity = value(disc.ux), value(disc.uy)
        self.pull = Fraction(pull[0]), Fraction(pull[1])

    def powers(self) -> tuple[Polynomial, Polynomial]:
        """Return both coordinates as polynomials in time."""
        x, y = ([p, u, a / 2] for p, u, a in zip(self.place, self.velocity, self.pull, strict=True))
        return x, y

    def at(self, time: float) -> tuple[Vector, Vector]:
        """Return the place at a time, and the most by which rounding of place and way may change each coordinate."""
        t = Fraction(time)
        x, y = (p + u * t + a * t * t / 2 for p, u, a in zip(self.place, self.velocity, self.pull, strict=True))
        error_x, error_y = (
            _WAY_ERROR * (abs(u * t) + abs(a * t * t)) + _PLACE_ERROR * abs(p)
            for p, u, a in zip((x, y), self.velocity, self.pull, strict=True)
        )
        return (x, y), (error_x, error_y)


def cross(a: Vector, b: Vector) -> Fraction:
    return a[0] * b[1] - a[1] * b[0]


def find_possible_signs(number: Fraction, error: Fraction) -> set[bool]:
    """Return whether a number is 0 or more: one answer, or both where it is within an error below 0."""
    return {True} if number >= 0 else {False} if number < -error else {True, False}


def check_sector(sector: Sector | None, path: Path, time: float) -> set[bool]:
    """Return whether a disc is in a sector at a time, both answers where rounding decides."""
    if sector is None:
        return {True}
    place, (error_x, error_y) = path.at(time)
    sides = []
    for end, sense in ((sector.first, 1), (sector.last, -1)):
        direction = value(end[0]), value(end[1])
        error = abs(direction[0]) * error_y + abs(direction[1]) * error_x
        sides.append(find_possible_signs(sense * cross(direction, place), error))
    begun, not_ended = sides
    return {(a or b) if sector.reflex else (a and b) for a in begun for b in not_ended}


def find_first_times(times: Iterable[float], path: Path, sector: Sector | None) -> set[float]:
    """Return the first of some times at which a disc is in a sector, and earlier ones at which rounding decides."""
    right = set[float]()
    for time in sorted(times):
        answers = check_sector(sector, path, time)
        if True in answers:
            right.add(time)
        if answers == {True}:
            return right
    return right | {NEVER}


def find_arc_times(case: Fall, arc: Arc) -> set[float]:
    """Return the right times at which a falling disc touches an arc or a vertex."""
    disc = case.disc
    if (disc.radius < arc.fits_below) is not arc.inside:
        return {NEVER}
    path, thick = Path(disc, arc.centre, case.acceleration), Fraction(disc.radius) + Fraction(arc.half_width)
    reach = value(arc.radius) + (-thick if arc.inside else thick)
    gap = build_squared_gap(path.place, path.velocity, path.pull, reach, case.leaving)
    if arc.inside:
        gap = [-gap[0], gap[1] if case.leaving is not None else -gap[1], *(-power for power in gap[2:])]
    beyond = sum(p * p for p in path.place) - value(arc.radius) ** 2
    is_in_front = beyond < 0 if arc.inside else beyond > 0
    right = set[float]()
    for in_contact in check_sector(arc.sector, path, 0.0) if gap[0] <= 0 and is_in_front else {False}:
        now = [Fraction(0), *gap[1:]] if in_contact else gap
        times = find_closing_times(now)
        if arc.inside and arc.sector is not None and now[0] <= 0:
            times += find_sector_entries(arc, arc.sector, path, now)
        right |= find_first_times(times, path, arc.sector)
    return right


def estimate_arc_time_error(case: Fall, arc: Arc, time: float) -> float:
    """Return how far a time of contact may be off since place and reach are sums that are rounded to pairs."""
    path = Path(case.disc, arc.centre, case.acceleration)
    (x, y), _ = path.at(time)
    vx, vy = (u + a * Fraction(time) for u, a in zip(path.velocity, path.pull, strict=True))
    terms = sum(map(abs, (value(case.disc.x), value(case.disc.y), *map(value, arc.centre), value(arc.radius))))
    rounded = _PAIR_ERROR * (terms + Fraction(case.disc.radius) + Fraction(arc.half_width))
    distance, closing = math.hypot(x, y), abs(x * vx + y * vy)
    return float(rounded * Fraction(distance) / closing) if closing else 0.0


def find_sector_entries(arc: Arc, sector: Sector, path: Path, gap: Polynomial) -> list[float]:
    """Return when a disc that overlaps the circle of contact next to an arc touches the arc, after it reaches it."""
    found, (xs, ys) = list[float](), path.powers()
    for end, sense in ((sector.first, 1), (sector.last, -1)):
        fx, fy = value(end[0]), value(end[1])
        for time in find_closing_times([sense * (fy * x - fx * y) for x, y in zip(xs, ys, strict=True)]):
            (x, y), _ = path.at(time)
            overlap, *rest = shift_polynomial(gap, time)
            if overlap <= 0 and fx * x + fy * y > 0 and x * x + y * y < value(arc.radius) ** 2:
                found += [time + wait for wait in find_closing_times([Fraction(0), *rest])]
    return found


def shift_polynomial(powers: Sequence[Fraction], time: float) -> Polynomial:
    """Return a polynomial in time as one in the time from an instant on."""
    t, found = Fraction(time), [Fraction(0)] * len(powers)
    for k, power in enumerate(powers):
        for low in range(k + 1):
            found[low] += power * math.comb(k, low) * t ** (k - low)
    return found


def solve_quadratic_time(gap: Fraction, speed: Fraction, pull: Fraction) -> float:
    """Return when a gap to a straight wall closes; one below 0, by rounding, is contact."""
    if gap < 0 and speed <= 0:
        gap = Fraction(0)
    if gap < 0 and pull < 0 and speed * speed <= 2 * gap * pull:
        return float(speed / -pull)
    return next(find_closings([gap, speed, pull / 2]), NEVER)


def is_doubtful(gap: Fraction, speed: Fraction, pull: Fraction) -> bool:
    """Whether the apex of a parabola is so close to contact that its times are not known to some ulp."""
    return gap != 0 and abs(speed * speed - 2 * gap * pull) <= _DOUBTFUL * speed * speed


def length_of(vector: Vector) -> Fraction:
    """Return the length of a vector, exactly where it is a short fraction."""
    shift = Fraction(4) ** _ROOT_BITS
    return Fraction(math.isqrt(math.floor((vector[0] ** 2 + vector[1] ** 2) * shift))) / (1 << _ROOT_BITS)


def find_face_times(case: Fall, face: Face) -> set[float]:
    """Return the right times, to some ulp, at which a falling disc touches a face; none where they are not known."""
    begin, end = (Path(case.disc, ((p[0], 0.0), (p[1], 0.0)), case.acceleration) for p in (face.a, face.b))
    along = value(face.along[0]), value(face.along[1])
    length = length_of(along)
    pull = cross(along, begin.pull)
    if case.leaving is not None:
        gap, speed, on_face = Fraction(0), Fraction(case.leaving) * length, True
        if not pull < 0:
            return {NEVER}
    else:
        gap = cross(along, begin.place) - (Fraction(case.disc.radius) + Fraction(face.half_width)) * length
        speed, on_face = cross(along, begin.velocity), cross(along, begin.place) > 0
    if is_doubtful(gap, speed, pull):
        return set()
    right = set[float]()
    on_edge = check_foot(along, begin, end, 0.0) if on_face and case.leaving is None and gap <= 0 else {False}
    for in_contact in on_edge:
        if in_contact:
            right.add(solve_quadratic_time(gap, speed, pull))
            continue
        if case.leaving is None and gap <= 0 and not speed > 0:
            right.add(NEVER)
            continue
        time = next(find_closings([gap, speed, pull / 2]), NEVER)
        answers = check_foot(along, begin, end, time) if time < NEVER else {False}
        right |= {time if answer else NEVER for answer in answers}
    return right


def check_foot(along: Vector, begin: Path, end: Path, time: float) -> set[bool]:
    """Return whether a disc's foot is on an edge at a time, both answers where rounding decides."""
    sides = []
    for path, sense in ((begin, 1), (end, -1)):
        (x, y), (error_x, error_y) = path.at(time)
        error = abs(along[0]) * (error_x + _WAY_ERROR * abs(x)) + abs(along[1]) * (error_y + _WAY_ERROR * abs(y))
        inner = sense * (along[0] * x + along[1] * y)
        sides.append({True, False} if abs(inner) <= error and time > 0.0 else {inner >= 0})
    return {a and b for a in sides[0] for b in sides[1]}


def find_feature_times(case: Fall) -> set[float]:
    """Return the right times at which a falling disc touches a feature of a wall."""
    feature = case.feature
    return find_face_times(case, feature) if isinstance(feature, Face) else find_arc_times(case, feature)
