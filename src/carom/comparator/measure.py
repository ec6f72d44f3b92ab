"""The errors of matched impacts and of final states, scaled by the scene's own length, speed and time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from carom.comparator.align import Alignment, Reach, align
from carom.comparator.finite import finite_impacts
from carom.comparator.scales import OwnScales, Scales, largest, own_scales_of
from carom.comparator.thresholds import THRESHOLDS
from carom.model.scene import Need
from carom.model.trace import Trace, kinetic_energy, rim_speeds, velocities

Array = NDArray[np.float64]

#: What makes the energy of a scene another one in the course of it.
_NOT_CONSERVED = frozenset(
    {Need.RESTITUTION, Need.GRAVITY, Need.DAMPING, Need.FRICTION, Need.DRIVEN_DISCS, Need.DRIVEN_WALLS}
)

#: A body slower than this part of the scene's speed rests, as far as rounding can tell, and has no direction.
AT_REST = 1e-12


@dataclass(frozen=True)
class ImpactError:
    """Errors of one matched impact, observed less reference.

    A velocity that nobody can tell from that after another impact of the body in the same step (`untold`) has none.

    Attributes:
        reference: Index in the reference's impacts.
        observed: Index in the observed impacts.
        reported_time_s: Error of the time that the method gives, seconds.
        effective_time_s: Error of the instant at which the path turned, seconds; NaN where that is not known.
        along_normal: Velocity error along the reference's normal, the worse of the two bodies, over the scene's speed.
        across_normal: The same across it.
        velocity: Length of the velocity error, the worse of the two bodies, over the scene's speed.
        spin: Error of the spin times the radius, the worse of the two bodies, over the scene's speed of rims; NaN where
            nothing turns.
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
    spin: float
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

    A metric is a field here, filled below and named in `docs/theory/scoring.md`: tables and JSON lines have all of
    them. The first eight are the largest in magnitude of those of the impacts (see `ImpactError`), with their signs. Of
    what ends, nothing is measured beyond a horizon, nor where the two runs end at different times; nor of spins where
    nothing turns.

    Attributes:
        energy: Final kinetic energy, over that at the start or, if that is more, over what driven bodies give and take
            in the reference, with its sign; 0 where there is neither.
        momentum: Length of the error of the final momentum of the movable discs, over their mass and the speed.
        final_position: Distance of a disc from its final position, over the scene's length.
        final_velocity: Final velocity of a disc, over the scene's speed.
        final_spin: Final spin of a disc times its radius, over the scene's speed of rims.
    """

    time_s: float = _called("time error")
    reported_time_s: float = _called("reported time")
    velocity: float = _called("velocity error")
    spin: float = _called("spin error")
    along_normal: float = _called("along the normal")
    across_normal: float = _called("across it")
    restitution: float = _called("restitution error")
    direction_rad: float = _called("direction error")
    energy: float = _called("energy error")
    momentum: float = _called("momentum error")
    final_position: float = _called("final position")
    final_velocity: float = _called("final velocity")
    final_spin: float = _called("final spin")


_OF_IMPACTS = ("time_s", "reported_time_s", "velocity", "spin", "along_normal", "across_normal", "direction_rad")


@dataclass(frozen=True)
class Measured:
    """All that is measured of a trace against a reference: which impact is which, its error, the largest of each kind.

    An error of a number that is itself NaN or infinite is infinite.

    Attributes:
        ends: Errors of each disc's final position (metres), velocity and rim (metres a second), shape ``(3, n)``; NaN
            where they are not measured.
    """

    reference: Trace
    alignment: Alignment
    errors: tuple[ImpactError, ...]
    largest: Errors
    ends: Array

    @cached_property
    def own(self) -> OwnScales:
        """What rounding of each impact of the reference, and of each disc's end, is in proportion to."""
        return own_scales_of(self.reference)


def measure(reference: Trace, observed: Trace, scales: Scales, reach: Reach) -> Measured:
    """Align a trace with the reference and measure every error within a horizon."""
    alignment = align(reference, observed).within(reach, observed.impacts["time_s"])
    # Final states can be compared where both runs end at one time, to its rounding.
    apart_s = abs(observed.end_time_s - reference.end_time_s)
    together = reach.whole and not apart_s > THRESHOLDS.rounding * scales.time_s
    momentum = position = velocity = spin = math.nan
    ends = np.full((3, len(reference.scene.discs)), math.nan)
    if together:
        momentum, ends = _momentum_error(reference, observed, scales), _end_errors(reference, observed)
        position, velocity = float(np.max(ends[0])) / scales.length_m, float(np.max(ends[1])) / scales.speed_m_s
        spin = float(np.max(ends[2])) / scales.rim_m_s
    # Where the reference's end is no answer, it is an answer still that elastic, smooth impacts alone conserve energy.
    energy_is_known = together or not reference.scene.needs & _NOT_CONSERVED
    errors = tuple(_impact_errors(reference, observed, alignment, scales))
    return Measured(
        reference=reference,
        alignment=alignment,
        errors=errors,
        largest=Errors(
            **{name: largest(getattr(error, name) for error in errors) for name in _OF_IMPACTS},
            restitution=largest(e.restitution_error for e in errors if not math.isnan(e.restitution_error)),
            energy=_energy_error(reference, observed, scales) if energy_is_known else 0.0,
            momentum=momentum,
            final_position=position,
            final_velocity=velocity,
            final_spin=spin,
        ),
        ends=ends,
    )


def worse(difference: Array) -> Array:
    """Return the length of the error of the worse of two bodies; shape ``(2, m, 2)`` to ``(m,)``."""
    lengths: Array = np.hypot(difference[..., 0], difference[..., 1]).max(axis=0)  # which keeps NaN
    return lengths


def restitutions(before: Array, after: Array, normal: Array) -> Array:
    """Return the relative velocity of two bodies along the normal after over that before; NaN where none approached.

    Args:
        before: Velocities of both bodies before, shape ``(2, m, 2)``.
        after: The same after.
        normal: From first to second, shape ``(m, 2)``.
    """
    approach = ((before[1] - before[0]) * normal).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(approach < 0.0, -((after[1] - after[0]) * normal).sum(axis=1) / approach, math.nan)


def _number(error: float) -> float:
    """Return the error, infinite where it is NaN: what is no number has no smaller error than any number."""
    return math.inf if math.isnan(error) else error


def _end_errors(reference: Trace, observed: Trace) -> Array:
    """Errors of each disc's final position, velocity and rim, shape ``(3, n)``; rims are NaN if no disc spins."""
    place = np.hypot(*(observed.final_position_m - reference.final_position_m).T)
    velocity = np.hypot(*(observed.final_velocity_m_s - reference.final_velocity_m_s).T)
    rim = np.full(len(place), math.nan)
    if reference.final_spin_rad_s is not None and observed.final_spin_rad_s is not None:
        rim = reference.scene.arrays.radius_m * np.abs(observed.final_spin_rad_s - reference.final_spin_rad_s)
        rim = np.where(np.isnan(rim), math.inf, rim)
    return np.stack([*(np.where(np.isnan(error), math.inf, error) for error in (place, velocity)), rim])


def _energy_error(reference: Trace, observed: Trace, scales: Scales) -> float:
    if scales.energy_j == 0.0:
        return 0.0
    found, expected = (
        kinetic_energy(reference.scene, trace.final_velocity_m_s, trace.final_spin_rad_s)
        for trace in (observed, reference)
    )
    return _number((found - expected) / scales.energy_j)


def _momentum_error(reference: Trace, observed: Trace, scales: Scales) -> float:
    start = reference.scene.arrays
    mass = np.where(start.movable, start.mass_kg, 0.0)
    if not mass.any():
        return 0.0
    difference = mass @ (observed.final_velocity_m_s - reference.final_velocity_m_s)
    return _number(float(np.hypot(*difference)) / (float(mass.sum()) * scales.speed_m_s))


def _impact_errors(reference: Trace, observed: Trace, alignment: Alignment, scales: Scales) -> Iterator[ImpactError]:
    if not alignment.matched:
        return
    r, o = np.array(alignment.matched, dtype=np.intp).T
    expected, found, told = reference.impacts[r], observed.impacts[o], ~untold(observed)[:, o]
    effective = np.full(len(o), math.nan) if observed.effective_time_s is None else observed.effective_time_s[o]
    normal, after, true_after = expected["normal"], velocities(found, "after"), velocities(expected, "after")
    difference = np.where(told[:, :, None], after - true_after, 0.0)
    across = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
    restitution = restitutions(velocities(found, "before"), after, found["normal"])
    restitution[~told.all(axis=0)] = math.nan
    parts = (_largest_part(difference, normal), _largest_part(difference, across), worse(difference))
    columns = (
        found["time_s"] - expected["time_s"],
        effective - expected["time_s"],
        *(np.where(np.isnan(part), math.inf, part) / scales.speed_m_s for part in parts),
        _spin_errors(reference, observed, r, o, told) / scales.rim_m_s,
        np.where(told, _angles(after, true_after, AT_REST * scales.speed_m_s), 0.0).max(axis=0),
        _angles(found["normal"], normal, 0.0),
        restitution,
        restitution - restitutions(velocities(expected, "before"), true_after, normal),
    )
    sound = finite_impacts(observed)[o]
    errors = np.where(sound, columns, math.inf).T.tolist()
    for k, (reference_index, observed_index) in enumerate(alignment.matched):
        yield ImpactError(reference_index, observed_index, *errors[k])


def untold(trace: Trace) -> NDArray[np.bool_]:
    """Return which velocities after an impact nobody can tell: shape ``(2, m)``, the first bodies first.

    Where a disc has several contacts in one step, and the method does not say what each of them did, the state at the
    end of the step is that after the last of them: of the others there is none.
    """
    found = np.zeros((2, len(trace.impacts)), dtype=np.bool_)
    if trace.effective_time_s is None or trace.state_before is None:
        return found
    shared = np.isnan(trace.effective_time_s) & np.isnan(trace.state_before["position_first"]).all(axis=1)
    begun, later = trace.state_before["time_s"], set[tuple[int, float]]()
    for k in np.flatnonzero(shared)[::-1].tolist():
        for side, name in enumerate(("first", "second")):
            step = (int(trace.impacts[name][k]), float(begun[k]))
            found[side, k] = step in later and step[0] >= 0
            later.add(step)
    return found


def _spin_errors(
    reference: Trace, observed: Trace, r: NDArray[np.intp], o: NDArray[np.intp], told: NDArray[np.bool_]
) -> Array:
    """Largest error of a rim's speed after each matched impact, shape ``(m,)``; NaN if no disc spins."""
    if reference.spins is None or observed.spins is None:
        return np.full(len(r), math.nan)
    apart = np.abs(rim_speeds(observed, "after")[:, o] - rim_speeds(reference, "after")[:, r])
    off: Array = np.where(told, apart, 0.0).max(axis=0)
    return np.where(np.isnan(off), math.inf, off)


def _largest_part(difference: Array, direction: Array) -> Array:
    """Largest part along a direction of the difference of either body's velocity, shape ``(2, m, 2)`` to ``(m,)``."""
    parts: Array = np.abs(np.matmul(difference.transpose(1, 0, 2), direction[:, :, None])).max(axis=(1, 2))
    return parts


def _angles(a: Array, b: Array, nothing: float) -> Array:
    """Angles between vectors, radians; 0 where either is no longer than `nothing` and so has no direction."""
    turned = np.arctan2(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0], (a * b).sum(axis=-1))
    shorter = np.minimum(np.hypot(a[..., 0], a[..., 1]), np.hypot(b[..., 0], b[..., 1]))
    return np.where(shorter <= nothing, 0.0, np.abs(turned))
