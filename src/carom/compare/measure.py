"""The errors of matched impacts and of final states, scaled by the scene's own length, speed and time."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from carom.compare.align import Alignment
from carom.compare.score import ImpactError, Scales
from carom.scene import Scene
from carom.trace import Trace, kinetic_energy

__all__ = ["impact_errors", "momentum_error", "scales_of"]


def scales_of(scene: Scene, reference: Trace) -> Scales:
    """Return the scene's own length, speed and time. A scene in which nothing moves has speed 1 m/s."""
    start = np.array([disc.velocity_m_s for disc in scene.discs])
    after = (reference.impacts["velocity_first_after"], reference.impacts["velocity_second_after"])
    speed = float(np.max(np.hypot(*np.concatenate([start, *after]).T)))
    return Scales(
        length_m=max(disc.radius_m for disc in scene.discs),
        speed_m_s=speed or 1.0,
        time_s=scene.duration_s,
        energy_j=kinetic_energy(scene, start),
    )


def impact_errors(reference: Trace, observed: Trace, alignment: Alignment, scales: Scales) -> tuple[ImpactError, ...]:
    """Measure every matched impact."""
    effective = observed.effective_time_s
    errors = []
    for r, o in alignment.matched:
        expected, found = reference.impacts[r], observed.impacts[o]
        normal = expected["normal"]
        difference = np.array(
            [found[name] - expected[name] for name in ("velocity_first_after", "velocity_second_after")]
        )
        along = difference @ normal
        across = difference @ np.array([-normal[1], normal[0]])
        reference_time = float(expected["time_s"])
        errors.append(
            ImpactError(
                reference=r,
                observed=o,
                reported_time_s=float(found["time_s"]) - reference_time,
                effective_time_s=math.nan if effective is None else float(effective[o]) - reference_time,
                along_normal=float(np.max(np.abs(along))) / scales.speed_m_s,
                across_normal=float(np.max(np.abs(across))) / scales.speed_m_s,
                velocity=float(np.max(np.hypot(*difference.T))) / scales.speed_m_s,
                direction_rad=max(
                    _angle(found[name], expected[name]) for name in ("velocity_first_after", "velocity_second_after")
                ),
                normal_rad=_angle(found["normal"], normal),
                restitution=_restitution(found),
            )
        )
    return tuple(errors)


def _angle(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Angle between two vectors, radians; 0 where either is zero and so has no direction."""
    return abs(math.atan2(float(a[0] * b[1] - a[1] * b[0]), float(a @ b)))


def _restitution(impact: np.void) -> float:
    before = float((impact["velocity_second_before"] - impact["velocity_first_before"]) @ impact["normal"])
    after = float((impact["velocity_second_after"] - impact["velocity_first_after"]) @ impact["normal"])
    return -after / before if before < 0 else math.nan


def momentum_error(scene: Scene, reference: Trace, observed: Trace, scales: Scales) -> float:
    """Length of the error of the final momentum of the movable discs, over their mass times the scene's speed."""
    mass = np.array([0.0 if disc.immovable else disc.mass_kg for disc in scene.discs])
    if not mass.any():
        return 0.0
    difference = mass @ (observed.final_velocity_m_s - reference.final_velocity_m_s)
    return float(np.hypot(*difference)) / (float(mass.sum()) * scales.speed_m_s)
