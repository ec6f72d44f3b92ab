"""The cost of sampling: the largest errors of PIT over the phases of a step.

The phase at which an impact falls is chance: PIT may find it at once, or a step late, or not at all. So a run is
compared with PIT at `THRESHOLDS.phases` phases of the same step, for each of which the scene is shifted along its own
motion. It is also compared at the phases at which PIT is as late as the run itself.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from carom.comparator.align import ComparisonRange
from carom.comparator.finite import find_non_finite
from carom.comparator.measure import Measured, larger_error, measure
from carom.comparator.scales import Scales, compute_scales, largest
from carom.comparator.shift import even_phases, shifted_scenes
from carom.comparator.thresholds import THRESHOLDS
from carom.errors import InputError
from carom.model.scene import Scene
from carom.model.trace import Trace, rim_speeds, velocities
from carom.solvers.pic import solve_pic
from carom.solvers.pit.solve import solve_pit

Array = NDArray[np.float64]

#: Number of cached costs of scenes and steps. Every engine is compared with the same ones: all scenes of the catalogue
#: at three steps each. Costs at a run's own phases are rarely used again and have a smaller cache of their own.
KEPT = 1024
OWN_KEPT = 256


class ImpactErrors(NamedTuple):
    """Errors at each reliable impact of a reference, shape ``(m,)`` each.

    Attributes:
        velocity: Of the velocity after, over the scene's speed.
        spin: Of the spin times the radius, over the scene's speed of rims; 0 if no disc spins.
    """

    velocity: Array
    spin: Array


@dataclass(frozen=True)
class SamplingCost:
    """Errors of PIT at a step: at one phase of it, or the largest over its phases.

    Attributes:
        dt_s: The step, seconds.
        velocity: Velocity error at each reliable impact of the reference, over the scene's speed. The error of a missed
            impact is all that it changes. Over several phases it is the largest error up to each impact, because
            errors propagate from impact to impact.
        spin: The same for spins times radii, over the scene's speed of rims; 0 if no disc spins.
        found: The largest of both over the phases at which that impact and all before it are found; 0 where no phase
            finds them.
        found_off_s: The largest error of the impact's time at these phases, seconds.
        energy: Error of the final kinetic energy, over that at the start. Over several phases, this and the following
            are the largest of the scene's own phase and those at which no impact is missed or spurious.
        final_position: Largest distance of a disc from its final one, over the scene's length; 0 where not measured.
        final_velocity: Largest error of a final velocity, over the scene's speed; 0 where not measured.
        final_spin: Largest error of a final spin times its radius, over the scene's speed of rims; 0 where not
            measured.
        late_s: Largest error of a time, seconds, over all phases; infinite where an impact is missed or spurious.
        phases: Number of phases at which PIT was run.
        close_phases: Number of these at which all of its impacts are close.
    """

    dt_s: float
    velocity: Array
    spin: Array
    found: ImpactErrors
    found_off_s: Array
    energy: float
    final_position: float
    final_velocity: float
    final_spin: float
    late_s: float
    phases: int = 1
    close_phases: int = 0

    @classmethod
    def of(cls, dt_s: float, impact_errors: ImpactErrors, measured: Measured) -> SamplingCost:
        """Return the cost of one phase, from the errors of PIT at it."""
        worst, alignment = measured.largest, measured.alignment
        errors = (worst.final_position, worst.final_velocity, worst.final_spin)
        position, velocity, spin = (0.0 if math.isnan(error) else error for error in errors)
        whole = not (alignment.missed or alignment.spurious or alignment.undecided)
        late_s = largest((abs(error.time_s) for error in measured.errors), default=0.0) if whole else math.inf
        first_missed = min(alignment.missed, default=len(impact_errors.velocity))
        off_s = np.zeros(len(impact_errors.velocity))
        for error in measured.errors:
            off_s[error.reference] = abs(error.time_s)
        *found, off_s = (
            np.where(np.arange(len(off_s)) < first_missed, errors, 0.0) for errors in (*impact_errors, off_s)
        )
        return cls(
            dt_s, *impact_errors, ImpactErrors(*found), off_s, abs(worst.energy), position, velocity, spin, late_s
        )

    def is_close(self, velocity: Array, spin: Array) -> bool:
        """Whether errors at one phase are at most a small part of a step, or of the given costs up to each impact."""
        close, rounding = THRESHOLDS.close, THRESHOLDS.rounding
        return (
            self.late_s <= close * self.dt_s
            and bool(np.all(self.velocity <= close * velocity + rounding))
            and bool(np.all(self.spin <= close * spin + rounding))
        )


def measure_sampling_cost(
    reference: Trace,
    sampling: Trace,
    measured: Measured,
    scales: Scales,
    compared: ComparisonRange,
    own: Measured,
    float_bits: int,
) -> SamplingCost:
    """Measure the cost of sampling at the step of a run of PIT.

    Args:
        reference: The reference.
        sampling: PIT's run.
        measured: The errors of PIT's run: one phase.
        scales: The scales by which errors are divided.
        compared: The range in which the reference is reliable.
        own: The errors of the run that is compared with PIT. Where they are larger than at even phases, PIT is also run
            at the phases of its own lateness.
        float_bits: Width of that run's floats.
    """
    dt_s, cut = sampling.dt_s, not compared.is_whole_run
    costs = [SamplingCost.of(dt_s, measure_impact_errors(reference, measured, scales, compared.impacts), measured)]
    if not (dt_s and compared.impacts):
        return _worst_cost(costs)
    costs += _costs_at_even_phases(reference.scene, dt_s, compared.impacts, cut)
    cost = _worst_cost(costs)
    if phases := _find_own_phases(reference, own, cost, THRESHOLDS.ratio_known_of(float_bits)):
        at_own = _worst_cost([*costs, *_costs_at_phases(reference.scene, dt_s, compared.impacts, cut, phases)])
        # The number of close phases counts even phases only.
        cost = replace(at_own, phases=cost.phases, close_phases=cost.close_phases)
    return cost


def _worst_cost(costs: Sequence[SamplingCost]) -> SamplingCost:
    """Return the largest cost over some phases, the first of which is the scene's own."""
    velocity, spin = (_largest_up_to_each([getattr(cost, name) for cost in costs]) for name in ImpactErrors._fields)
    ends = [costs[0], *(cost for cost in costs[1:] if math.isfinite(cost.late_s))]
    return SamplingCost(
        dt_s=costs[0].dt_s,
        velocity=velocity,
        spin=spin,
        found=ImpactErrors(
            *(_largest_up_to_each([getattr(cost.found, name) for cost in costs]) for name in ImpactErrors._fields)
        ),
        found_off_s=_largest_up_to_each([cost.found_off_s for cost in costs]),
        energy=max(cost.energy for cost in ends),
        final_position=max(cost.final_position for cost in ends),
        final_velocity=max(cost.final_velocity for cost in ends),
        final_spin=max(cost.final_spin for cost in ends),
        late_s=largest(cost.late_s for cost in costs),
        phases=len(costs),
        close_phases=sum(cost.is_close(velocity, spin) for cost in costs),
    )


def _largest_up_to_each(errors: Sequence[Array]) -> Array:
    """Return the largest error of several runs up to each impact."""
    return np.maximum.accumulate(np.max(errors, axis=0))


def _find_own_phases(reference: Trace, own: Measured, cost: SamplingCost, known: float) -> tuple[float, ...]:
    """Return the phases, 0 to 1, at which PIT is as late as a run whose errors exceed a cost.

    They are a single phase where a run checks for overlap once per step.
    """
    found, phases = cost.found, dict[float, None]()
    for error in own.errors:
        at = error.reference
        is_worse = (
            error.velocity > found.velocity[at]
            or error.spin > found.spin[at]
            or abs(error.time_s) > cost.found_off_s[at]
        )
        if is_worse and error.time_s > 0.0:
            steps = (float(reference.impacts["time_s"][at]) + error.time_s) / cost.dt_s
            # A frame exactly a step late follows a frame that finds the impact at once; just before, it does not.
            just_before = (steps - 0.1 * known) % 1.0
            # Phases that differ only by rounding are the same.
            phases[round(just_before, 11)] = None
    return tuple(phases)[: THRESHOLDS.phases]


def measure_impact_errors(reference: Trace, measured: Measured, scales: Scales, reliable_impacts: int) -> ImpactErrors:
    """Return the error at each reliable impact: all that it changes where it is missed, 0 where undecided."""
    impact_errors = ImpactErrors(np.zeros(reliable_impacts), np.zeros(reliable_impacts))
    for error in measured.errors:
        impact_errors.velocity[error.reference] = error.velocity
        impact_errors.spin[error.reference] = 0.0 if math.isnan(error.spin) else error.spin
    missed = list(measured.alignment.missed)
    for errors, changed in zip(impact_errors, measure_changes(reference, scales), strict=True):
        errors[missed] = changed[missed]
    return impact_errors


def measure_changes(reference: Trace, scales: Scales) -> ImpactErrors:
    """Return the change of velocity and spin at each impact of a reference, of the more changed body."""
    velocity = larger_error(velocities(reference.impacts, "after") - velocities(reference.impacts, "before"))
    spin = np.max(np.abs(rim_speeds(reference, "after") - rim_speeds(reference, "before")), axis=0)
    return ImpactErrors(velocity / scales.speed_m_s, spin / scales.rim_m_s)


@lru_cache(maxsize=KEPT)
def _costs_at_even_phases(scene: Scene, dt_s: float, reliable_impacts: int, cut: bool) -> tuple[SamplingCost, ...]:
    """Return the cost at each even phase after the first, which is the scene's own."""
    return _costs_at_phases.__wrapped__(scene, dt_s, reliable_impacts, cut, even_phases(THRESHOLDS.phases)[1:])


@lru_cache(maxsize=OWN_KEPT)
def _costs_at_phases(
    scene: Scene, dt_s: float, reliable_impacts: int, cut: bool, phases: tuple[float, ...]
) -> tuple[SamplingCost, ...]:
    """Return the cost at each of some phases, as far as the same impacts happen there.

    With `cut`, the scene has more than `reliable_impacts` impacts, beyond a horizon, and final states are not known.
    """
    reference = solve_pic(scene, max_impacts=reliable_impacts if cut else None)
    return tuple(_measure_costs(reference, dt_s, reliable_impacts, cut, phases))


def _measure_costs(
    reference: Trace, dt_s: float, reliable_impacts: int, cut: bool, phases: tuple[float, ...]
) -> Iterator[SamplingCost]:
    """Yield the cost at each phase whose shifted scene can be solved and has the same first impact."""
    scales = compute_scales(reference.scene, reference)
    bodies = reference.impacts[["first", "second"]][:reliable_impacts]
    for moved in shifted_scenes(reference, dt_s, phases):
        try:
            truth = solve_pic(moved, max_impacts=reliable_impacts + 1)
            pit = solve_pit(moved, frame_rate_hz=1.0 / dt_s)
        except InputError:
            continue
        count = min(len(truth.impacts), reliable_impacts)
        same = truth.impacts[["first", "second"]][:count] == bodies[:count]
        agreed = count if same.all() else int(np.argmin(same))
        if not agreed or find_non_finite(truth) or find_non_finite(pit):
            continue
        whole = not cut and agreed == reliable_impacts == len(truth.impacts)
        until_s = math.inf if whole else float(truth.impacts["time_s"][agreed - 1])
        found = measure(truth, pit, scales, ComparisonRange(agreed, until_s))
        padding = (0, reliable_impacts - agreed)
        impact_errors = (np.pad(errors, padding) for errors in measure_impact_errors(truth, found, scales, agreed))
        yield SamplingCost.of(dt_s, ImpactErrors(*impact_errors), found)
