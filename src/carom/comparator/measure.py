"""The errors of matched impacts and of final states, scaled by the scene's own length, speed and time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carom.comparator.align import Alignment, align
from carom.comparator.finite import finite_impacts
from carom.comparator.scales import Scales, largest
from carom.comparator.score import Errors, ImpactError
from carom.comparator.thresholds import THRESHOLDS
from carom.scene import Need
from carom.trace import Trace, kinetic_energy

__all__ = ["Measured", "ends_together", "measure", "up_to"]

#: A body slower than this part of the scene's speed rests, as far as rounding can tell, and has no direction.
AT_REST = 1e-12


@dataclass(frozen=True)
class Measured:
    """All that is measured of one trace against a reference; what it means is for the verdict to say.

    What is NaN was not measured; an error of a number that is itself NaN or infinite is infinite.

    Attributes:
        alignment: Which impact is which.
        errors: One entry a matched impact.
        energy_error: Final kinetic energy less the reference's, over that at the start; where nothing moved, 0.
        momentum_error: Length of the error of the final momentum of the movable discs, over their mass and the speed.
        final_position_error: Largest distance of a disc from its final place, over the scene's length; not measured
            beyond a horizon, nor where the two runs end at different times.
        final_velocity_error: Largest error of a final velocity, over the scene's speed; as the place.
    """

    alignment: Alignment
    errors: tuple[ImpactError, ...]
    energy_error: float
    momentum_error: float
    final_position_error: float
    final_velocity_error: float

    @property
    def largest(self) -> Errors:
        """The largest of each kind of error."""
        return Errors(
            time_s=self.worst_time_s,
            reported_time_s=largest(error.reported_time_s for error in self.errors),
            velocity=self.worst_velocity,
            along_normal=largest(error.along_normal for error in self.errors),
            across_normal=largest(error.across_normal for error in self.errors),
            restitution=largest(e.restitution_error for e in self.errors if not math.isnan(e.restitution_error)),
            direction_rad=self.worst_direction_rad,
            energy=self.energy_error,
        )

    @property
    def worst_time_s(self) -> float:
        """Largest time error by magnitude, with its sign; NaN without a match."""
        return largest(error.time_s for error in self.errors)

    @property
    def worst_velocity(self) -> float:
        """Largest velocity error over the scene's speed; NaN without a match."""
        return largest(error.velocity for error in self.errors)

    @property
    def worst_direction_rad(self) -> float:
        """Largest direction error; NaN without a match."""
        return largest(error.direction_rad for error in self.errors)


def up_to(alignment: Alignment, observed: Trace, believed: int, until_s: float) -> Alignment:
    """Return what of an alignment lies within a horizon.

    Args:
        alignment: The alignment of the whole runs.
        observed: The observed trace.
        believed: How many of the reference's impacts are within the horizon.
        until_s: Until when it reaches, seconds.
    """
    times = observed.impacts["time_s"]
    return Alignment(
        matched=tuple((r, o) for r, o in alignment.matched if r < believed),
        missed=tuple(r for r in alignment.missed if r < believed),
        spurious=tuple(o for o in alignment.spurious if times[o] <= until_s),
        undecided=tuple(r for r in alignment.undecided if r < believed),
    )


def measure(reference: Trace, observed: Trace, scales: Scales, horizon: tuple[int, float] | None = None) -> Measured:
    """Align a trace with the reference and measure every error.

    Args:
        reference: The reference.
        observed: The observed trace.
        scales: What errors are divided by.
        horizon: How many of the reference's impacts may be believed, and until when; None for all.
    """
    alignment = align(reference, observed)
    momentum = position = velocity = math.nan
    whole = horizon is None or not math.isfinite(horizon[1])
    if horizon is not None and not whole:
        alignment = up_to(alignment, observed, *horizon)
    together = whole and ends_together(reference, observed)
    if together:
        momentum = _momentum_error(reference, observed, scales)
        position = _largest_row(observed.final_position_m - reference.final_position_m) / scales.length_m
        velocity = _largest_row(observed.final_velocity_m_s - reference.final_velocity_m_s) / scales.speed_m_s
    # Where the reference's end is no answer, it is an answer still that elastic impacts alone conserve energy.
    conserved = not reference.scene.needs & {Need.RESTITUTION, Need.GRAVITY}
    return Measured(
        alignment=alignment,
        errors=_impact_errors(reference, observed, alignment, scales),
        energy_error=_energy_error(reference, observed, scales) if together or conserved else 0.0,
        momentum_error=momentum,
        final_position_error=position,
        final_velocity_error=velocity,
    )


def ends_together(reference: Trace, observed: Trace) -> bool:
    """Whether two runs end at one time, to its rounding, so that their final states can be compared."""
    apart = abs(observed.end_time_s - reference.end_time_s)
    return not apart > THRESHOLDS.rounding * reference.scene.duration_s


def _measured(error: float) -> float:
    """Return the error, infinite where it is NaN: what is no number has no smaller error than any number."""
    return math.inf if math.isnan(error) else error


def _largest_row(difference: NDArray[np.float64]) -> float:
    return _measured(float(np.max(np.hypot(*difference.T))))


def _energy_error(reference: Trace, observed: Trace, scales: Scales) -> float:
    if scales.energy_j == 0.0:
        return 0.0
    scene = reference.scene
    found = kinetic_energy(scene, observed.final_velocity_m_s)
    return _measured((found - kinetic_energy(scene, reference.final_velocity_m_s)) / scales.energy_j)


def _impact_errors(reference: Trace, observed: Trace, alignment: Alignment, scales: Scales) -> tuple[ImpactError, ...]:
    effective, sound = observed.effective_time_s, finite_impacts(observed)
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
        if not sound[o]:
            errors.append(ImpactError(r, o, *[math.inf] * 9))
            continue
        errors.append(
            ImpactError(
                reference=r,
                observed=o,
                reported_time_s=float(found["time_s"]) - reference_time,
                effective_time_s=math.nan if effective is None else float(effective[o]) - reference_time,
                along_normal=_measured(float(np.max(np.abs(along))) / scales.speed_m_s),
                across_normal=_measured(float(np.max(np.abs(across))) / scales.speed_m_s),
                velocity=_largest_row(difference) / scales.speed_m_s,
                direction_rad=largest(
                    _angle(found[name], expected[name], AT_REST * scales.speed_m_s)
                    for name in ("velocity_first_after", "velocity_second_after")
                ),
                normal_rad=_angle(found["normal"], normal, 0.0),
                restitution=_restitution(found),
                restitution_error=_restitution(found) - _restitution(expected),
            )
        )
    return tuple(errors)


def _angle(a: NDArray[np.float64], b: NDArray[np.float64], nothing: float) -> float:
    """Angle between two vectors, radians; 0 where either is no longer than `nothing` and so has no direction."""
    if min(math.hypot(*a), math.hypot(*b)) <= nothing:
        return 0.0
    return abs(math.atan2(float(a[0] * b[1] - a[1] * b[0]), float(a @ b)))


def _restitution(impact: np.void) -> float:
    before = float((impact["velocity_second_before"] - impact["velocity_first_before"]) @ impact["normal"])
    after = float((impact["velocity_second_after"] - impact["velocity_first_after"]) @ impact["normal"])
    return -after / before if before < 0 else math.nan


def _momentum_error(reference: Trace, observed: Trace, scales: Scales) -> float:
    mass = np.array([0.0 if disc.immovable else disc.mass_kg for disc in reference.scene.discs])
    if not mass.any():
        return 0.0
    difference = mass @ (observed.final_velocity_m_s - reference.final_velocity_m_s)
    return _measured(float(np.hypot(*difference)) / (float(mass.sum()) * scales.speed_m_s))
