"""The demand on a step, and the step that each impact of a reference allows a method that checks once per step."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from carom.model.scene import Scene, Wall
from carom.model.trace import Trace, wall_index
from carom.studies.advise.sampling_limit import ContactWindow, PairLimit, pair_limit

#: An impact is a graze at an impact parameter above cos 30 degrees, where the chord is less than half of a head-on one.
GRAZE = math.cos(math.pi / 6)


class Cause(Enum):
    """Why an impact is hard to find; the value is the phrase shown."""

    GRAZE = "a graze"
    FAST = "a fast small disc"
    TURN = "the line of centres turns fast"
    WALL = "a wall, which nothing passes unseen"
    EDGE = "a wall of two sides, which a disc may pass unseen that goes further than its reach in a step"


@dataclass(frozen=True)
class Demand:
    """Required accuracy.

    Attributes:
        direction_error_rad: Largest allowed error of a disc's direction after any impact.
        miss_probability: Share of starts at which an impact may be missed or invented.
    """

    direction_error_rad: float
    miss_probability: float = 0.0


@dataclass(frozen=True)
class HardImpact:
    """The step that one impact of the reference allows a method that checks for overlap once per step.

    Attributes:
        time_s: Time of the impact.
        first: The disc.
        second: The other disc, or a wall.
        limit: The allowed steps; for discs with friction those without it, which suffice to aim starts.
        cause: Reason why it allows no larger step.
    """

    time_s: float
    first: int
    second: int
    limit: PairLimit
    cause: Cause


def hardest_impacts(reference: Trace, demand: Demand) -> tuple[HardImpact, ...]:
    """Return the steps that each impact of a reference allows on its own, the hardest first."""
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
