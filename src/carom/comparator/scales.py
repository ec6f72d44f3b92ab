"""The scene's own length, speed and time, by which errors are divided so that units do not matter."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from carom.scene import Scene
from carom.trace import Trace, kinetic_energy, rim_speeds, velocities

__all__ = ["Scales", "largest", "scales_of"]


@dataclass(frozen=True)
class Scales:
    """What errors of one scene are divided by.

    Attributes:
        length_m: Radius of the largest disc.
        speed_m_s: Greatest speed of any disc in the reference; 1 m/s in a scene in which nothing moves.
        rim_m_s: Greatest speed of any disc, or of any rim as seen from its centre: what errors of spins, times the
            radius, are divided by. The slip adds up the two, so a rim is as exact as the larger of them; a velocity is
            no less exact for a fast rim that slides.
        time_s: The scene's duration.
        energy_j: Kinetic energy of the movable discs at the start, that of turning with it.
        reach_m: Farthest that a coordinate can come to lie from the origin, which rounding is in proportion to.
    """

    length_m: float
    speed_m_s: float
    rim_m_s: float
    time_s: float
    energy_j: float
    reach_m: float


def scales_of(scene: Scene, reference: Trace) -> Scales:
    """Return the scene's own length, speed and time."""
    start = scene.arrays
    speed = float(np.max(np.hypot(*np.concatenate([start.velocity_m_s, *velocities(reference.impacts, "after")]).T)))
    rims = np.concatenate([start.surface_speed_m_s, *rim_speeds(reference, "after")])
    farthest = float(np.max(np.abs(np.concatenate([start.position_m, reference.final_position_m]))))
    return Scales(
        length_m=float(np.max(start.radius_m)),
        speed_m_s=speed or 1.0,
        rim_m_s=max(speed, float(np.max(np.abs(rims)))) or 1.0,
        time_s=scene.duration_s,
        energy_j=kinetic_energy(scene, start.velocity_m_s, start.spins if start.turns else None),
        reach_m=farthest + speed * scene.duration_s,
    )


def largest(values: Iterable[float], default: float = math.nan) -> float:
    """Return the value of the largest magnitude, with its sign; NaN where one of them is NaN, which `max` passes over.

    Args:
        values: The values.
        default: What to return where there are none.
    """
    found = default
    for k, value in enumerate(values):
        if math.isnan(value):
            return math.nan
        if k == 0 or abs(value) > abs(found):
            found = value
    return found
