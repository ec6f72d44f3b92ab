"""Errors of matched impacts and of final states, divided by the scene's own length, speed and time."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from carom.comparator.match_impacts import Alignment
from carom.comparator.non_finite import find_finite_impacts
from carom.comparator.scales import Array, Scales, compute_lengths, find_largest
from carom.comparator.thresholds import THRESHOLDS
from carom.core.impact_law import ContactFrictions, RoughBodies
from carom.model.energy import compute_kinetic_energies
from carom.model.scene import Need
from carom.model.trace import Trace, rim_speeds, velocities
from carom.support.structured_arrays import join_rows

#: Features with which a scene does not conserve kinetic energy.
_DRIVEN = {Need.DRIVEN_DISCS, Need.DRIVEN_WALLS}
_NOT_CONSERVED = _DRIVEN | {Need.RESTITUTION, Need.GRAVITY, Need.DAMPING, Need.TABLE_FRICTION, Need.FRICTION}

#: A body that is slower than this fraction of the scene's greatest speed counts as resting, so its direction is not
#: compared.
AT_REST = 1e-12

#: Number of impacts and discs at which a group of runs is full. The runs of a group are measured together. Larger
#: groups would need much memory, and save no time.
MOST_JOINED = 1000


@dataclass(frozen=True)
class ImpactError:
    """Errors of one matched impact: values of the run minus values of the reference.

    If a velocity of the run is unknown (see `unknown_velocities`), its error is 0.

    Attributes:
        reference: Index in the reference's impacts.
        observed: Index in the observed impacts.
        reported_time_s: Error of the time that the method reports, in seconds.
        effective_time_s: Error of the instant at which the straight paths before and after the impact meet, in seconds;
            NaN if that instant is unknown.
        along_normal: Component of the velocity error along the reference's normal, for the body with the larger error,
            divided by the scene's greatest speed.
        across_normal: Component of the velocity error perpendicular to the reference's normal, for the body with the
            larger error, divided by the scene's greatest speed.
        velocity: Magnitude of the velocity error, for the body with the larger error, divided by the scene's greatest
            speed.
        spin: Error of the rim speed (spin times radius), for the body with the larger error, divided by the scene's
            greatest disc or rim speed; NaN if no disc spins.
        direction_rad: Angle between observed and reference velocity after the impact, for the body with the larger
            angle. A body that rests in one of the traces is ignored.
        normal_rad: Angle between observed and reference normal.
        restitution: Ratio of the run's speeds of separation and approach along its own normal; NaN if the bodies did
            not approach.
        restitution_error: `restitution` minus the same ratio in the reference.
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
        """Error of the effective time; if that time is unknown, error of the reported time."""
        return self.reported_time_s if math.isnan(self.effective_time_s) else self.effective_time_s


#: Names of those fields of `ImpactError` that hold errors.
_IMPACT_ERRORS = tuple(one.name for one in fields(ImpactError) if one.name not in {"reference", "observed"})


def _declare_metric(name: str) -> float:
    """Declare a metric; tables show its `name`.

    If the metric has a unit, the name of its field ends with this unit.
    """
    metric: float = field(metadata={"name": name})
    return metric


@dataclass(frozen=True, slots=True)
class Errors:
    """Largest errors of one trace relative to another, by kind. A kind that was not measured is NaN (`energy`: 0).

    Each field is explained in `docs/theory/scoring.md`, and appears in all tables and results files. The first eight
    fields are errors of impacts (see `ImpactError`). Each of the first eight fields is the error of largest magnitude,
    with its sign. Final states are not measured beyond a horizon, or if the two runs end at different times. Spins are
    not measured if no disc spins.

    Attributes:
        energy: Error of the final kinetic energy, with its sign, divided by `Scales.energy_j`; 0 if this scale is 0.
        momentum: Magnitude of the error of the movable discs' final momentum, divided by their total mass and the
            scene's greatest speed.
        final_position: Largest error of a disc's final position, divided by the largest radius.
        final_velocity: Largest error of a disc's final velocity, divided by the scene's greatest speed.
        final_spin: Largest error of a disc's final rim speed (spin times radius), divided by the scene's greatest disc
            or rim speed.
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

    def list_final_errors(self) -> Array:
        """Return the final errors of energy, position, velocity and spin, without sign; 0 if not measured."""
        errors = np.abs([self.energy, self.final_position, self.final_velocity, self.final_spin])
        return np.where(np.isnan(errors), 0.0, errors)


class MatchedRun(NamedTuple):
    """A run whose impacts were matched with those of a reference."""

    reference: Trace
    observed: Trace
    alignment: Alignment


@dataclass(frozen=True)
class Measured:
    """Errors of a trace relative to a reference.

    If a number of the trace is NaN or infinite, its error is infinite.

    Attributes:
        of_impacts: Errors of the matched impacts by name, each of shape ``(m,)``. The names are those of `ImpactError`.
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
        """Indices of those impacts of the reference that have a match in the trace."""
        return [reference for reference, _ in self.alignment.matched]


def measure_errors(runs: Iterable[MatchedRun], scales: Scales) -> Iterator[Measured]:
    """Yield all errors of each run. All runs are of one scene, but may start at different phases of a step.

    Final states are only compared if the whole run was matched.
    """
    for batch in _group_small_runs(runs):
        errors = _measure_impact_errors(batch, scales)
        ends = np.cumsum([len(run.alignment.matched) for run in batch])[:-1]
        impact_errors, final_errors = np.split(errors, ends, axis=1), _measure_final_errors(batch, scales)
        yield from map(partial(_build_measured, scales), batch, impact_errors, *final_errors)


def _build_measured(
    scales: Scales, run: MatchedRun, impact_errors: Array, energy: float, momentum: float, ends: Array
) -> Measured:
    """Return all errors of a run. `impact_errors` has a row for each name in `_IMPACT_ERRORS`, and for `time_s`."""
    errors = dict(zip((*_IMPACT_ERRORS, "time_s"), impact_errors, strict=True))
    largest = {one.name: find_largest(errors[one.name]) for one in fields(Errors) if one.name in errors}
    restitution = errors["restitution_error"]
    largest["restitution"] = find_largest(restitution[~np.isnan(restitution)])
    final_position, final_velocity, final_spin = ends.max(axis=1).tolist()
    return Measured(
        reference=run.reference,
        alignment=run.alignment,
        of_impacts=errors,
        largest=Errors(
            **largest,
            energy=energy,
            momentum=momentum,
            final_position=final_position / scales.length_m,
            final_velocity=final_velocity / scales.speed_m_s,
            final_spin=final_spin / scales.rim_m_s,
        ),
        ends=ends,
    )


def _group_small_runs(runs: Iterable[MatchedRun]) -> Iterator[list[MatchedRun]]:
    """Group runs that are measured together. A group is complete when it reaches `MOST_JOINED`."""
    group, joined = list[MatchedRun](), 0
    for run in runs:
        group.append(run)
        joined += len(run.reference.impacts) + len(run.observed.impacts) + len(run.reference.final_position_m)
        if joined >= MOST_JOINED:
            yield group
            group, joined = [], 0
    if group:
        yield group


def larger_error(difference: Array) -> Array:
    """Return the larger of the two bodies' errors at each of m impacts, from vectors of shape ``(2, m, 2)``."""
    larger: Array = compute_lengths(difference).max(axis=0)  # NaN if an error is NaN
    return larger


def compute_restitutions(before: Array, after: Array, normal: Array) -> Array:
    """Compute the ratio of the speeds of separation and approach along the normal; NaN if the bodies did not approach.

    Args:
        before: Velocities of both bodies before the impacts, shape ``(2, m, 2)``.
        after: Velocities of both bodies after the impacts, shape ``(2, m, 2)``.
        normal: Unit vectors from the first to the second body, shape ``(m, 2)``.
    """
    approach = ((before[1] - before[0]) * normal).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(approach < 0.0, -((after[1] - after[0]) * normal).sum(axis=1) / approach, math.nan)


def build_impact_bodies(trace: Trace, rims: Array) -> tuple[tuple[RoughBodies, RoughBodies], ContactFrictions]:
    """Return the state of both bodies just before each impact, and the friction between them.

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


def _measure_final_errors(runs: Sequence[MatchedRun], scales: Scales) -> tuple[list[float], list[float], Array]:
    """Return the errors of final energy and momentum of k runs, and their `Measured.ends`, shape ``(k, 3, n)``."""
    references, observed = [run.reference for run in runs], [run.observed for run in runs]
    # Final states are comparable only if both runs end at the same time, except for rounding.
    apart_s = np.array([abs(found.end_time_s - expected.end_time_s) for expected, found, _ in runs])
    is_whole_run = np.array([alignment.is_whole_run for _, _, alignment in runs])
    ends_together = is_whole_run & ~(apart_s > THRESHOLDS.rounding * scales.time_s)
    scene, start = references[0].scene, references[0].scene.arrays
    mass = np.where(start.movable, start.mass_kg, 0.0)
    (true_velocity, true_spin), (velocity, spin) = map(_stack_final_motions, (references, observed))
    place = np.array([found.final_position_m - expected.final_position_m for expected, found, _ in runs])
    change, spun = velocity - true_velocity, start.radius_m * np.abs(spin - true_spin)
    ends = np.stack([compute_lengths(place), compute_lengths(change), spun], axis=1)
    momentum = np.hypot(*(mass @ change).T) / (mass.sum() * scales.speed_m_s or 1.0)
    energy = np.zeros(len(runs))
    if scales.energy_j:
        expected_j = compute_kinetic_energies(scene, true_velocity, true_spin)
        energy = (compute_kinetic_energies(scene, velocity, spin) - expected_j) / scales.energy_j
    energy, momentum, ends = (np.where(np.isnan(errors), math.inf, errors) for errors in (energy, momentum, ends))
    ends[~_have_spins(runs), 2] = math.nan
    ends[~ends_together], momentum[~ends_together] = math.nan, math.nan
    if scene.needs & _NOT_CONSERVED:
        # If impacts conserve energy, the final energy is known even if the reference's final state is not reliable.
        energy[~ends_together] = 0.0
    return energy.tolist(), momentum.tolist(), ends


def _stack_final_motions(traces: Sequence[Trace]) -> tuple[Array, Array]:
    """Return the final velocities and spins of traces, shapes ``(k, n, 2)`` and ``(k, n)``; 0 for unknown spins."""
    spins = (trace.final_spin_rad_s for trace in traces)
    velocity = np.array([trace.final_velocity_m_s for trace in traces])
    return velocity, np.array([np.zeros(velocity.shape[1]) if spin is None else spin for spin in spins])


def _have_spins(runs: Sequence[MatchedRun]) -> NDArray[np.bool_]:
    return np.array([run.reference.spins is not None and run.observed.spins is not None for run in runs])


def _measure_impact_errors(runs: Sequence[MatchedRun], scales: Scales) -> Array:
    """Return the errors of the matched impacts of all runs: the fields of `ImpactError`, and `time_s` as the last row.

    All runs are measured together. Most runs have so few impacts that measuring all runs takes little longer than
    measuring one run.
    """
    matched = [(run, *np.array(run.alignment.matched, dtype=np.intp).reshape(-1, 2).T) for run in runs]
    expected = join_rows([run.reference.impacts[r] for run, r, _ in matched])
    found = join_rows([run.observed.impacts[o] for run, _, o in matched])
    known = ~np.concatenate([unknown_velocities(run.observed)[:, o] for run, _, o in matched], axis=1)
    normal, after, true_after = expected["normal"], velocities(found, "after"), velocities(expected, "after")
    difference = np.where(known[:, :, None], after - true_after, 0.0)
    across = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
    true_rims = np.concatenate([rim_speeds(run.reference, "after")[:, r] for run, r, _ in matched], axis=1)
    spun = np.concatenate([rim_speeds(run.observed, "after")[:, o] for run, _, o in matched], axis=1) - true_rims
    restitution = compute_restitutions(velocities(found, "before"), after, found["normal"])
    restitution[~known.all(axis=0)] = math.nan
    parts = (
        _find_largest_part(difference, normal) / scales.speed_m_s,
        _find_largest_part(difference, across) / scales.speed_m_s,
        larger_error(difference) / scales.speed_m_s,
        np.where(known, np.abs(spun), 0.0).max(axis=0) / scales.rim_m_s,
    )
    errors = np.array(
        [
            found["time_s"] - expected["time_s"],
            np.concatenate([_list_effective_times(run.observed)[o] for run, _, o in matched]) - expected["time_s"],
            *np.where(np.isnan(parts), math.inf, parts),
            np.where(known, _compute_angles(after, true_after, AT_REST * scales.speed_m_s), 0.0).max(axis=0),
            _compute_angles(found["normal"], normal, 0.0),
            restitution,
            restitution - compute_restitutions(velocities(expected, "before"), true_after, normal),
        ]
    )
    has_spins = np.repeat(_have_spins(runs), [len(r) for _, r, _ in matched])
    errors[_IMPACT_ERRORS.index("spin"), ~has_spins] = math.nan
    errors[:, ~np.concatenate([find_finite_impacts(run.observed)[o] for run, _, o in matched])] = math.inf
    reported_s, effective_s = errors[:2]
    return np.concatenate([errors, np.where(np.isnan(effective_s), reported_s, effective_s)[None]])


def _list_effective_times(trace: Trace) -> Array:
    return np.full(len(trace.impacts), math.nan) if trace.effective_time_s is None else trace.effective_time_s


def unknown_velocities(trace: Trace) -> NDArray[np.bool_]:
    """Return whether each body's velocity after an impact is unknown, shape ``(2, m)``, first bodies in the first row.

    If a disc has several contacts in one step, the method may report only the state after the last contact. The
    velocities after the disc's earlier contacts of the step are then unknown.
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


def _find_largest_part(difference: Array, direction: Array) -> Array:
    """Return the larger of the two bodies' velocity differences along a direction."""
    parts: Array = np.abs(np.matmul(difference.transpose(1, 0, 2), direction[:, :, None])).max(axis=(1, 2))
    return parts


def _compute_angles(a: Array, b: Array, negligible: float) -> Array:
    """Return angles between vectors, in radians. An angle is 0 if one of the vectors is at most `negligible` long."""
    angle_rad = np.arctan2(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0], (a * b).sum(axis=-1))
    shorter = np.minimum(compute_lengths(a), compute_lengths(b))
    return np.where(shorter <= negligible, 0.0, np.abs(angle_rad))
