"""Scales of a scene: its own length, speed and time.

Errors are divided by these scales, so that scores do not depend on units.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from carom.model.energy import kinetic_energy, work_of_driven
from carom.model.scene import Scene
from carom.model.trace import Trace, rim_speeds, velocities

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Scales:
    """A length, speeds, a time and an energy by which the errors in one scene are divided.

    Attributes:
        length_m: Radius of the largest disc.
        speed_m_s: Greatest speed of any disc in the reference; 1 m/s if no disc moves.
        rim_m_s: Scale for errors of spin times radius: the greatest speed of any disc's centre, or of any rim relative
            to its centre, whichever is larger. In a contact, the speeds of centre and rim are added, so the larger
            speed determines the rounding error of a spin.
        time_s: The scene's duration in seconds.
        energy_j: The larger of two energies: the kinetic energy of the movable discs at the start, including rotation,
            and the absolute work of driven bodies, summed over the reference's impacts.
        reach_m: Upper bound on the magnitude of a coordinate. Rounding errors of positions are proportional to this
            bound.
    """

    length_m: float
    speed_m_s: float
    rim_m_s: float
    time_s: float
    energy_j: float
    reach_m: float


def compute_scales(scene: Scene, reference: Trace) -> Scales:
    """Compute the scene's own length, speed, time and energy."""
    start = scene.arrays
    # A falling disc is fastest just before an impact, or at the end.
    impact_velocities = (*velocities(reference.impacts, "before"), *velocities(reference.impacts, "after"))
    speeds = np.concatenate([start.velocity_m_s, *impact_velocities, reference.final_velocity_m_s])
    speed = float(np.max(np.hypot(*speeds.T)))
    rims = np.concatenate([start.surface_speed_m_s, *rim_speeds(reference, "after")])
    farthest = float(np.max(np.abs(np.concatenate([start.position_m, reference.final_position_m]))))
    return Scales(
        length_m=float(np.max(start.radius_m)),
        speed_m_s=speed or 1.0,
        rim_m_s=max(speed, float(np.max(np.abs(rims)))) or 1.0,
        time_s=scene.duration_s,
        energy_j=max(
            kinetic_energy(scene, start.velocity_m_s, start.spins if start.turns else None),
            float(np.sum(np.abs(work_of_driven(reference)))),
        ),
        reach_m=farthest + speed * scene.duration_s,
    )


@dataclass(frozen=True)
class OwnScales:
    """Speeds and coordinates that determine the rounding errors of each impact and of each disc's final state.

    Rounding errors are proportional to speed, and impacts propagate errors from body to body. So a body's speed means
    the greatest speed so far of this body, and of all bodies whose errors may have reached it. A disc may be slow
    because two large speeds cancelled. The slow disc then has the rounding errors of the two large speeds.

    Attributes:
        speed_m_s: Largest speed that influences each impact, shape ``(m,)``.
        rim_m_s: Largest speed or rim speed that influences each impact, shape ``(m,)``.
        final_speed_m_s: Largest speed that influences each disc's final velocity, shape ``(n,)``.
        final_rim_m_s: Largest speed or rim speed that influences each disc's final state, shape ``(n,)``.
        reach_m: Upper bound on the magnitude of the coordinates of each disc's rim, shape ``(n,)``.
    """

    speed_m_s: Array
    rim_m_s: Array
    final_speed_m_s: Array
    final_rim_m_s: Array
    reach_m: Array


def compute_own_scales(trace: Trace) -> OwnScales:
    """Compute the speeds and coordinates that determine the rounding errors of each impact and disc of a trace."""
    start, impacts = trace.scene.arrays, trace.impacts
    impact_velocities = np.stack([velocities(impacts, "before"), velocities(impacts, "after")])
    rims = np.stack([rim_speeds(trace, "before"), rim_speeds(trace, "after")])
    speed = np.hypot(*start.velocity_m_s.T).tolist()
    rim = np.maximum(speed, np.abs(start.surface_speed_m_s)).tolist()
    fastest = np.max(compute_lengths(impact_velocities), axis=(0, 1)).tolist()
    rims_fastest = np.max(np.abs(rims), axis=(0, 1)).tolist()
    of_impacts = np.zeros((2, len(impacts)))
    movable = start.movable.tolist()
    for k, pair in enumerate(zip(impacts["first"].tolist(), impacts["second"].tolist(), strict=True)):
        # Errors do not propagate through a body that never moves.
        bodies = [body for body in pair if body >= 0 and movable[body]]
        greatest_speed = max([fastest[k], *[speed[body] for body in bodies]])
        most_rim = max([greatest_speed, rims_fastest[k], *[rim[body] for body in bodies]])
        of_impacts[:, k] = greatest_speed, most_rim
        for body in bodies:
            speed[body], rim[body] = greatest_speed, most_rim
    at_end = np.maximum(speed, np.hypot(*trace.final_velocity_m_s.T))
    places = np.abs(np.concatenate([start.position_m, trace.final_position_m], axis=1))
    return OwnScales(
        speed_m_s=of_impacts[0],
        rim_m_s=of_impacts[1],
        final_speed_m_s=at_end,
        final_rim_m_s=np.maximum(rim, at_end),
        reach_m=np.max(places, axis=1) + start.radius_m + at_end * trace.scene.duration_s,
    )


def compute_lengths(vectors: Array) -> Array:
    """Return the lengths of vectors, whose two components are the last axis."""
    lengths: Array = np.hypot(vectors[..., 0], vectors[..., 1])
    return lengths


def compute_median(values: Array) -> float:
    """Return the median of values; NaN if a value is NaN.

    `numpy.median` is not used, because it needs time to import masked arrays.
    """
    ordered = np.sort(values)  # NaN is last
    one, other = ordered[[(len(ordered) - 1) // 2, len(ordered) // 2]].tolist()
    return math.nan if math.isnan(ordered[-1]) else one if one == other else (one + other) / 2


def find_largest(values: ArrayLike, default: float = math.nan) -> float:
    """Return the signed value with the largest magnitude; NaN if a value is NaN. In contrast, `max` ignores NaN.

    Args:
        values: The values, shape ``(k,)``.
        default: The result if there are no values.
    """
    array = np.asarray(values, dtype=np.float64)
    return float(array[np.abs(array).argmax()]) if len(array) else default  # the first NaN counts as largest
