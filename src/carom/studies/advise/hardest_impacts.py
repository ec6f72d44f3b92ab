"""Accuracy target, and the largest step at which checking once per step meets the target for an impact."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from carom.model.scene import Scene, Wall
from carom.model.trace import Trace, wall_index
from carom.studies.advise.sampling_limit import ContactWindow, PairLimit, pair_limit

#: Smallest impact parameter of a graze, as a fraction of the contact distance: cos 30°. In a graze the overlap lasts
#: less than half as long as in a head-on impact.
GRAZE = math.cos(math.pi / 6)


class Cause(Enum):
    """Reason why an impact is hard to find. The value is the phrase shown."""

    GRAZE = "a graze"
    FAST = "a fast small disc"
    TURN = "the line between the centres turns fast"
    WALL = "the other body is a wall, which a disc cannot pass without overlapping it in some frame"
    EDGE = "the other body is a thin wall, which a disc passes unnoticed if it moves too far in a step"


@dataclass(frozen=True)
class Demand:
    """Required accuracy.

    Attributes:
        direction_error_rad: Largest allowed error of a disc's direction after any impact.
        miss_probability: Fraction of start positions at which an impact may be missed or invented.
    """

    direction_error_rad: float
    miss_probability: float = 0.0


@dataclass(frozen=True)
class HardImpact:
    """The largest step at which a method that checks for overlap once per step finds an impact of the reference.

    Attributes:
        time_s: Time of the impact.
        first: The disc.
        second: The other disc, or a wall.
        limit: The largest steps. Friction is ignored, because the limits only serve to choose start positions if discs
            have friction.
        cause: Reason why the impact needs a small step.
    """

    time_s: float
    first: int
    second: int
    limit: PairLimit
    cause: Cause


def hardest_impacts(reference: Trace, demand: Demand) -> tuple[HardImpact, ...]:
    """Return the largest steps for each impact of a reference, beginning with the hardest impact."""
    found = [_hard(reference, k, demand) for k in range(len(reference.impacts))]
    return tuple(sorted(found, key=lambda impact: (impact.limit.dt_s, impact.time_s)))


def _hard(reference: Trace, number: int, demand: Demand) -> HardImpact:
    impact, scene = reference.impacts[number], reference.scene
    first, second, at = int(impact["first"]), int(impact["second"]), float(impact["time_s"])
    if second < 0:
        return HardImpact(at, first, second, PairLimit(None, math.inf, math.inf), _of_wall(scene, second))
    fields = ("normal", "velocity_first_before", "velocity_second_before")
    normal, (ux, uy), (vx, vy) = ((float(impact[name][0]), float(impact[name][1])) for name in fields)
    one, other = scene.discs[first], scene.discs[second]
    window = ContactWindow.of(one.radius_m + other.radius_m, normal, (vx - ux, vy - uy))
    limit = pair_limit(
        window,
        ((ux, uy), (vx, vy)),
        (1.0 / one.mass_kg, 1.0 / other.mass_kg),
        scene.restitution,
        demand.direction_error_rad,
        demand.miss_probability,
    )
    soft = Cause.TURN if limit.direction_dt_s < limit.miss_dt_s else Cause.FAST
    return HardImpact(at, first, second, limit, Cause.GRAZE if window.share >= GRAZE else soft)


def _of_wall(scene: Scene, body: int) -> Cause:
    return Cause.WALL if isinstance(scene.walls[wall_index(body)], Wall) else Cause.EDGE
