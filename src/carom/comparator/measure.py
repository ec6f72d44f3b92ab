"""The errors of matched impacts and of final states, scaled by the scene's own length, speed and time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from carom.comparator.align import Alignment, align
from carom.comparator.finite import finite_impacts
from carom.comparator.scales import Scales, largest
from carom.comparator.thresholds import THRESHOLDS
from carom.scene import Need
from carom.trace import Trace, kinetic_energy

__all__ = ["Errors", "ImpactError", "Measured", "ends_together", "measure", "up_to", "velocity_errors"]

#: A body slower than this part of the scene's speed rests, as far as rounding can tell, and has no direction.
AT_REST = 1e-12


@dataclass(frozen=True)
class ImpactError:
    """Errors of one matched impact, observed less reference.

    Attributes:
        reference: Index in the reference's impacts.
        observed: Index in the observed impacts.
        reported_time_s: Error of the time that the method gives, seconds.
        effective_time_s: Error of the instant at which the path turned, seconds; NaN where that is not known.
        along_normal: Velocity error along the reference's normal, the worse of the two bodies, over the scene's speed.
        across_normal: The same across it.
        velocity: Length of the velocity error, the worse of the two bodies, over the scene's speed.
        direction_rad: Angle between observed and reference velocity after, the worse of the two bodies; a body that
            rests in either has none.
        normal_rad: Angle between observed and reference normal.
        restitution: Effective coefficient of restitution along the observed normal; NaN where nothing approached.
        restitution_error: The same less the reference's, which is along the reference's normal.
    """

    reference: int
    observed: int
    reported_time_s: float
    effective_time_s: float
    along_normal: float
    across_normal: float
    velocity: float
    direction_rad: float
    normal_rad: float
    restitution: float
    restitution_error: float

    @property
    def time_s(self) -> float:
        """Error of the effective time where it is known, else of the reported time."""
        return self.reported_time_s if math.isnan(self.effective_time_s) else self.effective_time_s


def _called(name: str) -> float:
    """A metric with its name in tables; its unit is told by the name of its field."""
    metric: float = field(metadata={"name": name})
    return metric


@dataclass(frozen=True)
class Errors:
    """The metrics: the largest error of each kind, of one trace against another. NaN where there is none.

    A metric is a field here, filled below and named in `docs/scoring.md`: tables and JSON lines have all of them. Those
    with a sign are observed less reference. Of what ends, nothing is measured beyond a horizon, nor where the two runs
    end at different times.

    Attributes:
        time_s: Effective time (reported where that is not known), seconds, with its sign.
        reported_time_s: Reported time, seconds, with its sign.
        velocity: Velocity after an impact, the worse of the two bodies, over the scene's speed.
        along_normal: Its part along the normal.
        across_normal: Its part across it.
        restitution: Effective coefficient of restitution, with its sign.
        direction_rad: Direction after an impact.
        energy: Final kinetic energy, over that at the start, with its sign; 0 where nothing moved at the start.
        momentum: Length of the error of the final momentum of the movable discs, over their mass and the speed.
        final_position: Distance of a disc from its final place, over the scene's length.
        final_velocity: Final velocity of a disc, over the scene's speed.
    """

    time_s: float = _called("time error")
    reported_time_s: float = _called("reported time")
    velocity: float = _called("velocity error")
    along_normal: float = _called("along the normal")
    across_normal: float = _called("across it")
    restitution: float = _called("restitution error")
    direction_rad: float = _called("direction error")
    energy: float = _called("energy error")
    momentum: float = _called("momentum error")
    final_position: float = _called("final place")
    final_velocity: float = _called("final velocity")


@dataclass(frozen=True)
class Measured:
    """All that is measured of one trace against a reference; what it means is for the verdict to say.

    An error of a number that is itself NaN or infinite is infinite.

    Attributes:
        alignment: Which impact is which.
        errors: One entry a matched impact.
        largest: The largest of each kind, and those of the end.
    """

    alignment: Alignment
    errors: tuple[ImpactError, ...]
    largest: Errors


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
    errors = _impact_errors(reference, observed, alignment, scales)
    return Measured(
        alignment=alignment,
        errors=errors,
        largest=Errors(
            time_s=largest(error.time_s for error in errors),
            reported_time_s=largest(error.reported_time_s for error in errors),
            velocity=largest(error.velocity for error in errors),
            along_normal=largest(error.along_normal for error in errors),
            across_normal=largest(error.across_normal for error in errors),
            restitution=largest(e.restitution_error for e in errors if not math.isnan(e.restitution_error)),
            direction_rad=largest(error.direction_rad for error in errors),
            energy=_energy_error(reference, observed, scales) if together or conserved else 0.0,
            momentum=momentum,
            final_position=position,
            final_velocity=velocity,
        ),
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


def velocity_errors(
    reference: Trace, observed: Trace, matched: Sequence[tuple[int, int]], scales: Scales
) -> NDArray[np.float64]:
    """Return the length of the velocity error of each matched impact, the worse of the two bodies, over the speed."""
    pairs = np.array(matched, dtype=np.intp).reshape(-1, 2)
    expected, found = reference.impacts[pairs[:, 0]], observed.impacts[pairs[:, 1]]
    worse = np.zeros(len(pairs))
    for name in ("velocity_first_after", "velocity_second_after"):
        worse = np.maximum(worse, np.hypot(*(found[name] - expected[name]).T))  # which keeps NaN
    worse /= scales.speed_m_s
    return np.where(finite_impacts(observed)[pairs[:, 1]], worse, math.inf)


def _impact_errors(reference: Trace, observed: Trace, alignment: Alignment, scales: Scales) -> tuple[ImpactError, ...]:
    effective, sound = observed.effective_time_s, finite_impacts(observed)
    velocities = velocity_errors(reference, observed, alignment.matched, scales).tolist()
    errors = []
    for (r, o), velocity in zip(alignment.matched, velocities, strict=True):
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
                velocity=_measured(velocity),
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
