"""Errors of matched impacts and of final states, scaled by the scene's own length, speed and time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from carom.comparator.match_impacts import Alignment
from carom.comparator.non_finite import find_finite_impacts
from carom.comparator.scales import OwnScales, Scales, compute_own_scales, find_largest
from carom.comparator.thresholds import THRESHOLDS
from carom.core.impact_law import ContactFrictions, RoughBodies
from carom.model.energy import kinetic_energy
from carom.model.scene import Need
from carom.model.trace import Trace, rim_speeds, velocities

Array = NDArray[np.float64]

#: Features of scenes that change the energy. A scene with one of these does not conserve energy.
_NOT_CONSERVED = frozenset(
    {Need.RESTITUTION, Need.GRAVITY, Need.DAMPING, Need.FRICTION, Need.DRIVEN_DISCS, Need.DRIVEN_WALLS}
)

#: A body slower than this part of the scene's speed is at rest to rounding, and has no direction.
AT_REST = 1e-12


@dataclass(frozen=True)
class ImpactError:
    """Errors of one matched impact: observed minus reference.

    An unknown velocity has no error (see `unknown_velocities`).

    Attributes:
        reference: Index in the reference's impacts.
        observed: Index in the observed impacts.
        reported_time_s: Error of the time that the method reports, in seconds.
        effective_time_s: Error of the instant at which the path turned, in seconds; NaN if that instant is not known.
        along_normal: Velocity error along the reference's normal, for the worse of the two bodies, over the scene's
            speed.
        across_normal: Velocity error perpendicular to that normal, for the worse of the two bodies, over the scene's
            speed.
        velocity: Length of the velocity error, for the worse of the two bodies, over the scene's speed.
        spin: Error of the spin times the radius, for the worse of the two bodies, over the scene's rim speed; NaN if no
            disc spins.
        direction_rad: Angle between observed and reference velocity after the impact, for the worse of the two bodies.
            A body that rests in either trace is ignored.
        normal_rad: Angle between observed and reference normal.
        restitution: Effective coefficient of restitution along the observed normal; NaN if the bodies did not approach.
        restitution_error: `restitution` minus the restitution of the reference along the reference's normal.
    """

    reference: int
    observed: int
    reported_time_s: float
    effective_time_s: float
    along_normal: float
    across_normal: float
    velocity: float
    spin: float
    direction_rad: float
    normal_rad: float
    restitution: float
    restitution_error: float

    @property
    def time_s(self) -> float:
        """Error of the effective time if it is known, otherwise of the reported time."""
        return self.reported_time_s if math.isnan(self.effective_time_s) else self.effective_time_s


#: Names of those fields of `ImpactError` that hold errors.
_IMPACT_ERRORS = tuple(one.name for one in fields(ImpactError) if one.name not in {"reference", "observed"})


def _declare_metric(name: str) -> float:
    """Declare a metric by its name in tables. The name of the field ends with the unit, if the metric has one."""
    metric: float = field(metadata={"name": name})
    return metric


@dataclass(frozen=True, slots=True)
class Errors:
    """For each kind of error, the largest error of one trace against another; NaN if there is none.

    Each field is a metric, which is explained in `docs/theory/scoring.md` and appears in all tables and JSON lines. The
    first eight fields are errors of impacts (see `ImpactError`). Each is the error of largest magnitude, with its sign.
    Final states are not measured beyond a horizon, or if the two runs end at different times. Spins are not measured if
    no disc spins.

    Attributes:
        energy: Error of the final kinetic energy, with its sign, divided by the larger of two energies: the energy at
            the start, and the work of driven bodies in the reference. 0 if both are 0.
        momentum: Length of the error of the movable discs' final momentum, over their mass and the scene's speed.
        final_position: Largest error of a disc's final position, over the scene's length.
        final_velocity: Largest error of a disc's final velocity, over the scene's speed.
        final_spin: Largest error of a disc's final spin times its radius, over the scene's rim speed.
    """

    time_s: float = _declare_metric("time error")
    reported_time_s: float = _declare_metric("reported time")
    velocity: float = _declare_metric("velocity error")
    spin: float = _declare_metric("spin error")
    along_normal: float = _declare_metric("along the normal")
    across_normal: float = _declare_metric("across the normal")
    restitution: float = _declare_metric("restitution error")
    direction_rad: float = _declare_metric("direction error")
    energy: float = _declare_metric("energy error")
    momentum: float = _declare_metric("momentum error")
    final_position: float = _declare_metric("final position")
    final_velocity: float = _declare_metric("final velocity")
    final_spin: float = _declare_metric("final spin")


_LARGEST_OF_IMPACTS = ("reported_time_s", "velocity", "spin", "along_normal", "across_normal", "direction_rad")


@dataclass(frozen=True)
class Measured:
    """Errors of a trace against a reference.

    A number that is NaN or infinite has an infinite error.

    Attributes:
        of_impacts: Errors of the matched impacts by name: the fields of `ImpactError` and its `time_s`, shape ``(m,)``.
        ends: Errors of each disc's final position (metres), velocity and rim speed (metres per second), shape
            ``(3, n)``; NaN if they are not measured.
    """

    reference: Trace
    alignment: Alignment
    of_impacts: Mapping[str, Array]
    largest: Errors
    ends: Array

    @cached_property
    def errors(self) -> tuple[ImpactError, ...]:
        """Errors of each matched impact."""
        columns = zip(*(self.of_impacts[name].tolist() for name in _IMPACT_ERRORS), strict=True)
        return tuple(ImpactError(*pair, *errors) for pair, errors in zip(self.alignment.matched, columns, strict=True))

    @property
    def matched(self) -> list[int]:
        """Indices of the reference's matched impacts."""
        return [reference for reference, _ in self.alignment.matched]

    @cached_property
    def own(self) -> OwnScales:
        """Scales of rounding for each impact of the reference, and for each disc's final state."""
        return compute_own_scales(self.reference)


def measure_errors(reference: Trace, observed: Trace, alignment: Alignment, scales: Scales) -> Measured:
    """Measure every error of an aligned trace. Final states are only measured if the whole run was aligned."""
    # Final states are comparable only if both runs end at the same time, to rounding.
    end_difference_s = abs(observed.end_time_s - reference.end_time_s)
    ends_together = alignment.is_whole_run and not end_difference_s > THRESHOLDS.rounding * scales.time_s
    momentum, ends = math.nan, np.full((3, len(reference.scene.discs)), math.nan)
    if ends_together:
        momentum, ends = _measure_momentum_error(reference, observed, scales), _measure_end_errors(reference, observed)
    # If impacts conserve energy, the final energy is known even if the reference's final state is not reliable.
    is_energy_known = ends_together or not reference.scene.needs & _NOT_CONSERVED
    errors = _measure_impact_errors(reference, observed, alignment, scales)
    restitution = errors["restitution_error"]
    return Measured(
        reference=reference,
        alignment=alignment,
        of_impacts=errors,
        largest=Errors(
            **{name: find_largest(errors[name]) for name in ("time_s", *_LARGEST_OF_IMPACTS)},
            restitution=find_largest(restitution[~np.isnan(restitution)]),
            energy=_measure_energy_error(reference, observed, scales) if is_energy_known else 0.0,
            momentum=momentum,
            final_position=float(np.max(ends[0])) / scales.length_m,
            final_velocity=float(np.max(ends[1])) / scales.speed_m_s,
            final_spin=float(np.max(ends[2])) / scales.rim_m_s,
        ),
        ends=ends,
    )


def larger_error(difference: Array) -> Array:
    """Return the length of the larger error of two bodies; shape ``(2, m, 2)`` to ``(m,)``."""
    lengths: Array = np.hypot(difference[..., 0], difference[..., 1]).max(axis=0)  # keeps NaN
    return lengths


def compute_restitutions(before: Array, after: Array, normal: Array) -> Array:
    """Compute effective coefficients of restitution along the normal; NaN if the bodies did not approach.

    Args:
        before: Velocities of both bodies before, shape ``(2, m, 2)``.
        after: Velocities of both bodies after, shape ``(2, m, 2)``.
        normal: Unit vectors from the first to the second body, shape ``(m, 2)``.
    """
    approach = ((before[1] - before[0]) * normal).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(approach < 0.0, -((after[1] - after[0]) * normal).sum(axis=1) / approach, math.nan)


def build_impact_bodies(trace: Trace, rims: Array) -> tuple[tuple[RoughBodies, RoughBodies], ContactFrictions]:
    """Return the first and the second body of each impact just before the impact, and their friction.

    Args:
        trace: The trace.
        rims: Rim speeds of the first and the second body of each impact, shape ``(2, m)``.
    """
    start, second, velocity = trace.scene.arrays, trace.impacts["second"], velocities(trace.impacts, "before")
    wall, discs = second < 0, (trace.impacts["first"], np.maximum(second, 0))
    masses = (start.mass_kg[discs[0]], np.where(wall, math.inf, start.mass_kg[discs[1]]))
    one, two = (RoughBodies(velocity[k], rims[k], masses[k], start.inertia[discs[k]]) for k in (0, 1))
    sticking = np.where(wall, start.wall_tangential_restitution, start.tangential_restitution)
    return (one, two), ContactFrictions(start.friction_of(second), sticking)


def _replace_nan_by_infinity(error: float) -> float:
    """Return the error, or infinity if it is NaN."""
    return math.inf if math.isnan(error) else error


def _measure_end_errors(reference: Trace, observed: Trace) -> Array:
    """Return errors of each disc's final position, velocity and rim speed (NaN if no disc spins), shape ``(3, n)``."""
    place = np.hypot(*(observed.final_position_m - reference.final_position_m).T)
    velocity = np.hypot(*(observed.final_velocity_m_s - reference.final_velocity_m_s).T)
    rim = np.full(len(place), math.nan)
    if reference.final_spin_rad_s is not None and observed.final_spin_rad_s is not None:
        rim = reference.scene.arrays.radius_m * np.abs(observed.final_spin_rad_s - reference.final_spin_rad_s)
        rim = np.where(np.isnan(rim), math.inf, rim)
    return np.stack([*(np.where(np.isnan(error), math.inf, error) for error in (place, velocity)), rim])


def _measure_energy_error(reference: Trace, observed: Trace, scales: Scales) -> float:
    if scales.energy_j == 0.0:
        return 0.0
    found, expected = (
        kinetic_energy(reference.scene, trace.final_velocity_m_s, trace.final_spin_rad_s)
        for trace in (observed, reference)
    )
    return _replace_nan_by_infinity((found - expected) / scales.energy_j)


def _measure_momentum_error(reference: Trace, observed: Trace, scales: Scales) -> float:
    start = reference.scene.arrays
    mass = np.where(start.movable, start.mass_kg, 0.0)
    if not mass.any():
        return 0.0
    difference = mass @ (observed.final_velocity_m_s - reference.final_velocity_m_s)
    return _replace_nan_by_infinity(float(np.hypot(*difference)) / (float(mass.sum()) * scales.speed_m_s))


def _measure_impact_errors(reference: Trace, observed: Trace, alignment: Alignment, scales: Scales) -> dict[str, Array]:
    """Return the errors of the matched impacts: the fields of `ImpactError` and its `time_s`."""
    if not alignment.matched:
        return dict.fromkeys(("time_s", *_IMPACT_ERRORS), np.zeros(0))
    r, o = np.array(alignment.matched, dtype=np.intp).T
    expected, found, known = reference.impacts[r], observed.impacts[o], ~unknown_velocities(observed)[:, o]
    effective = np.full(len(o), math.nan) if observed.effective_time_s is None else observed.effective_time_s[o]
    normal, after, true_after = expected["normal"], velocities(found, "after"), velocities(expected, "after")
    difference = np.where(known[:, :, None], after - true_after, 0.0)
    across = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
    restitution = compute_restitutions(velocities(found, "before"), after, found["normal"])
    restitution[~known.all(axis=0)] = math.nan
    parts = (_find_largest_part(difference, normal), _find_largest_part(difference, across), larger_error(difference))
    columns = (
        found["time_s"] - expected["time_s"],
        effective - expected["time_s"],
        *(np.where(np.isnan(part), math.inf, part) / scales.speed_m_s for part in parts),
        _measure_spin_errors(reference, observed, r, o, known) / scales.rim_m_s,
        np.where(known, _compute_angles(after, true_after, AT_REST * scales.speed_m_s), 0.0).max(axis=0),
        _compute_angles(found["normal"], normal, 0.0),
        restitution,
        restitution - compute_restitutions(velocities(expected, "before"), true_after, normal),
    )
    errors = dict(zip(_IMPACT_ERRORS, np.where(find_finite_impacts(observed)[o], columns, math.inf), strict=True))
    reported, turned = errors["reported_time_s"], errors["effective_time_s"]
    return errors | {"time_s": np.where(np.isnan(turned), reported, turned)}


def unknown_velocities(trace: Trace) -> NDArray[np.bool_]:
    """Return whether the velocity of each body after an impact is unknown: shape ``(2, m)``, the first bodies first.

    If a disc has several contacts in one step, the method may not report the effect of each. The state at the end of
    such a step is the state after the last contact. The velocities after the other contacts are not known.
    """
    found = np.zeros((2, len(trace.impacts)), dtype=np.bool_)
    if trace.effective_time_s is None or trace.state_before is None:
        return found
    shared = np.isnan(trace.effective_time_s) & np.isnan(trace.state_before["position_first"]).all(axis=1)
    begin_s, later = trace.state_before["time_s"], set[tuple[int, float]]()
    for k in np.flatnonzero(shared)[::-1].tolist():
        for side, name in enumerate(("first", "second")):
            step = (int(trace.impacts[name][k]), float(begin_s[k]))
            found[side, k] = step in later and step[0] >= 0
            later.add(step)
    return found


def _measure_spin_errors(
    reference: Trace, observed: Trace, r: NDArray[np.intp], o: NDArray[np.intp], known: NDArray[np.bool_]
) -> Array:
    """Return the largest rim-speed error after each matched impact, shape ``(m,)``; NaN if no disc spins."""
    if reference.spins is None or observed.spins is None:
        return np.full(len(r), math.nan)
    differences = np.abs(rim_speeds(observed, "after")[:, o] - rim_speeds(reference, "after")[:, r])
    errors: Array = np.where(known, differences, 0.0).max(axis=0)
    return np.where(np.isnan(errors), math.inf, errors)


def _find_largest_part(difference: Array, direction: Array) -> Array:
    """Return the largest velocity difference of either body along a direction, shape ``(2, m, 2)`` to ``(m,)``."""
    parts: Array = np.abs(np.matmul(difference.transpose(1, 0, 2), direction[:, :, None])).max(axis=(1, 2))
    return parts


def _compute_angles(a: Array, b: Array, negligible: float) -> Array:
    """Return angles between vectors, in radians; 0 where a vector is at most `negligible` long and has no direction."""
    angle_rad = np.arctan2(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0], (a * b).sum(axis=-1))
    shorter = np.minimum(np.hypot(a[..., 0], a[..., 1]), np.hypot(b[..., 0], b[..., 1]))
    return np.where(shorter <= negligible, 0.0, np.abs(angle_rad))
