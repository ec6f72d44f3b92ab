"""Formulas for the largest step size with which checking once per step finds one impact accurately enough.

Between first contact and closest approach, two discs overlap and still approach. A method that checks once per step
finds the impact at the first check in this interval. If the step dt is at most as long as the interval, the method
always finds the impact, with a delay of less than dt. The direction error that a delay causes follows from geometry. As
the discs move into each other, the line between their centres turns. A disc's velocity after the impact therefore
depends on the delay, and its possible values form a circle. Let u be the relative velocity, n the unit vector along the
line of centres, e the restitution, m the disc's mass, mu the reduced mass, and ``k = (1 + e) mu / m``. A disc's
velocity changes by ``k (u . n) n = (k / 2) (u + |u| w)``. The angle of the unit vector w is twice the angle of n, minus
the angle of u.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from enum import Enum

from carom.model.scene import Wall
from carom.model.trace import Trace, Vector, wall_index
from carom.studies.advise.options import AdviceOptions


@dataclass(frozen=True)
class ContactWindow:
    """Two discs at first contact, which would overlap for some time if there were no impact.

    Attributes:
        reach_m: Distance of the centres at contact.
        speed_m_s: Relative speed.
        miss_m: Impact parameter: signed distance of the first centre from the line along which the second disc moves
            relative to the first.
        normal: Unit vector from first to second at contact.
        relative_m_s: Velocity of the second disc minus the velocity of the first.
    """

    reach_m: float
    speed_m_s: float
    miss_m: float
    normal: Vector
    relative_m_s: Vector

    @property
    def length_s(self) -> float:
        """Seconds from contact to the closest approach, if there were no impact."""
        # `a² - b²` is computed as `(a - b)(a + b)`. For a graze, the difference of the rounded squares is mostly
        # rounding error.
        inside = (self.reach_m - abs(self.miss_m)) * (self.reach_m + abs(self.miss_m))
        return math.sqrt(max(inside, 0.0)) / self.speed_m_s

    @property
    def relative_offset(self) -> float:
        """The impact parameter divided by the contact distance: 0 for a head-on impact, 1 if the discs only graze."""
        return abs(self.miss_m) / self.reach_m

    @classmethod
    def of(cls, reach_m: float, normal: Vector, relative_m_s: Vector) -> ContactWindow:
        """Build the description of two discs at contact from their distance, normal and relative velocity."""
        (nx, ny), (ux, uy) = normal, relative_m_s
        speed = math.hypot(ux, uy)
        return cls(reach_m, speed, reach_m * (nx * uy - ny * ux) / speed, normal, relative_m_s)


def compute_direction_limit(
    window: ContactWindow, velocity_before: Vector, sign: float, push: float, angle_rad: float
) -> float:
    """Return how late an impact may be found without changing a disc's later direction by more than the allowed error.

    Args:
        window: The two discs at contact.
        velocity_before: Velocity of the disc before the impact, in metres per second.
        sign: 1 for the first disc, whose velocity changes by ``+push (u . n) n``; -1 for the second.
        push: ``(1 + e) mu / m`` of this disc; 0 for an immovable disc.
        angle_rad: Largest allowed error of the direction, above 0 and below pi.

    Returns:
        Delay in seconds; infinite if no delay causes a larger error.
    """
    before, relative = complex(*velocity_before), complex(*window.relative_m_s)
    radius = 0.5 * push * window.speed_m_s
    centre = before + sign * 0.5 * push * relative
    start = 2.0 * cmath.phase(complex(*window.normal)) - cmath.phase(relative)
    if radius == 0.0 or window.relative_offset == 0.0:  # a head-on impact stays head-on
        return math.inf
    # The signed angle by which w turns until the closest approach.
    turn = math.copysign(2.0 * math.acos(min(1.0, window.relative_offset)), window.miss_m)
    reference = centre + cmath.rect(sign * radius, start)
    # A disc at rest after the impact has no direction. The velocity before the impact and the change of velocity add up
    # to zero, except for rounding.
    if abs(reference) <= 8 * 2.0**-53 * (abs(before) + push * window.speed_m_s):
        return math.inf
    crossings = []
    for side in (cmath.phase(reference) - angle_rad, cmath.phase(reference) + angle_rad):
        for place in _find_circle_ray_points(centre, radius, side):
            swept = (cmath.phase(place if sign > 0 else -place) - start) % math.tau
            crossings.append(swept if turn > 0 else math.tau - swept)
    crossings_in_window = [swept for swept in crossings if 0.0 < swept < abs(turn)]
    return _delay_of_angle(window, math.copysign(min(crossings_in_window), turn)) if crossings_in_window else math.inf


def _delay_of_angle(window: ContactWindow, swept: float) -> float:
    """Return the delay in seconds after which w has turned by the given angle; see the module's docstring."""
    along = window.length_s * window.speed_m_s
    aside = abs(window.miss_m)
    # The line of centres turns by half of w's angle. The remaining distance to the closest approach is `aside` times
    # the tangent of the remaining angle.
    angle_left = math.atan2(along, aside) - 0.5 * abs(swept)
    return (along - aside * math.tan(angle_left)) / window.speed_m_s


def _find_circle_ray_points(centre: complex, radius: float, heading: float) -> list[complex]:
    """Return the points at which a ray from the origin meets a circle, as vectors from the circle's centre."""
    ray = cmath.rect(1.0, heading)
    turned = centre * ray.conjugate()  # the centre's coordinates along and across the ray
    inside = (radius - abs(turned.imag)) * (radius + abs(turned.imag))
    if inside < 0.0:
        return []
    root = math.sqrt(inside)
    return [along * ray - centre for along in (turned.real - root, turned.real + root) if along > 0.0]


#: An impact counts as a graze if its impact parameter, divided by the contact distance, is at least this number: cos
#: 30°. In a graze, discs overlap for less than half as long as in a head-on impact.
GRAZE = math.cos(math.pi / 6)


class Cause(Enum):
    """Reason why an impact is hard to find.

    Each member's value is the phrase that the report shows, with names of numbers in braces.
    """

    GRAZE = "a graze, off centre by {offset} times the contact distance"
    FAST = "the discs are fast for their size ({size})"
    TURN = "the line between their centres turns fast ({size})"
    WALL = "the other body is a wall, which a disc cannot pass without overlapping it in some frame"
    EDGE = "the other body is a thin wall, which a disc passes unnoticed if the disc moves too far in a step"


@dataclass(frozen=True)
class HardImpact:
    """An impact of the reference, with the largest step sizes at which checking once per step is accurate enough.

    The step sizes are computed without friction, so for discs with friction they only guide the search.

    Attributes:
        time_s: Time of the impact.
        first: The first body, which is a disc.
        second: The second body: a disc or a wall.
        cause: Reason why the impact needs a small step size.
        window: The two discs at contact; None for a wall.
        miss_dt_s: Largest step size at which the impact is missed at no more than the allowed fraction of phases.
        direction_dt_s: Largest step size at which no disc's direction has more than the allowed error.
    """

    time_s: float
    first: int
    second: int
    cause: Cause
    window: ContactWindow | None = None
    miss_dt_s: float = math.inf
    direction_dt_s: float = math.inf

    @property
    def dt_s(self) -> float:
        """The largest step size that is small enough both to find the impact and to keep directions accurate."""
        return min(self.miss_dt_s, self.direction_dt_s)


def rank_hardest_impacts(reference: Trace, options: AdviceOptions) -> tuple[HardImpact, ...]:
    """Compute the largest step sizes for each impact of a reference, and sort the impacts by step size."""
    found = [_build_hard_impact(reference, k, options) for k in range(len(reference.impacts))]
    return tuple(sorted(found, key=lambda impact: (impact.dt_s, impact.time_s)))


def _build_hard_impact(reference: Trace, number: int, options: AdviceOptions) -> HardImpact:
    impact, scene = reference.impacts[number], reference.scene
    first, second, time_s = int(impact["first"]), int(impact["second"]), float(impact["time_s"])
    if second < 0:
        cause = Cause.WALL if isinstance(scene.walls[wall_index(second)], Wall) else Cause.EDGE
        return HardImpact(time_s, first, second, cause)
    fields = ("normal", "velocity_first_before", "velocity_second_before")
    normal, (ux, uy), (vx, vy) = ((float(impact[name][0]), float(impact[name][1])) for name in fields)
    one, other = scene.discs[first], scene.discs[second]
    window = ContactWindow.of(one.radius_m + other.radius_m, normal, (vx - ux, vy - uy))
    inverse_masses = (1.0 / one.mass_kg, 1.0 / other.mass_kg)  # 0 for an immovable disc
    pushes = [(1.0 + scene.restitution) * inverse / sum(inverse_masses) for inverse in inverse_masses]
    direction_dt_s = min(
        compute_direction_limit(window, before, sign, push, options.direction_error_rad)
        for before, push, sign in zip(((ux, uy), (vx, vy)), pushes, (1.0, -1.0), strict=True)
    )
    miss_dt_s = window.length_s / (1.0 - options.miss_probability)
    cause = Cause.TURN if direction_dt_s < miss_dt_s else Cause.FAST
    if window.relative_offset >= GRAZE:
        cause = Cause.GRAZE
    return HardImpact(time_s, first, second, cause, window, miss_dt_s, direction_dt_s)
