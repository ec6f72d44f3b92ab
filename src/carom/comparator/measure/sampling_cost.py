"""The cost of sampling: the largest errors that PIT has because it checks for overlap only once per step.

The phase of an impact is a matter of chance: PIT may find the impact at once, or a step late, or not at all. So a run
is compared with PIT at `THRESHOLDS.phases` phases of the step. For each phase, the scene starts slightly later or
earlier on the same paths. The run is also compared with PIT at the phases at which PIT is as late as the run.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from carom.comparator.align_impacts import AlignedRun
from carom.comparator.match_impacts import ComparisonRange, match_impacts
from carom.comparator.measure.errors import MatchedRun, Measured, larger_error, measure_errors
from carom.comparator.non_finite import find_non_finite
from carom.comparator.scales import Array, Scales, compute_scales, find_largest
from carom.comparator.shifted_scenes import build_shifted_scenes, list_even_phases
from carom.comparator.thresholds import THRESHOLDS
from carom.errors import InputError
from carom.model.scene import Scene
from carom.model.trace import Trace, rim_speeds, velocities
from carom.solvers.pic import solve_pic
from carom.solvers.pit.solve import solve_pit

#: Number of cached results, one per scene, step size and choice of phases. This number suffices for all scenes of the
#: catalogue at three step sizes each.
_MOST_CACHED = 1024


@dataclass(frozen=True)
class SamplingCost:
    """Errors of PIT with one step size, either at one phase of the step or as the largest errors over several phases.

    Arrays have shape ``(2, m)``, with a column for each reliable impact of the reference. The first row has velocity
    errors after the impact, divided by the scene's greatest speed. The second row has errors of spin times radius,
    divided by the scene's greatest disc or rim speed. The second row is 0 if no disc spins.

    Attributes:
        dt_s: The step size, in seconds.
        errors: Errors of velocity and spin. The error of a missed impact is the whole change that the impact causes.
            For several phases, each value is the largest error up to this impact, because errors propagate from impact
            to impact.
        found: The largest errors over those phases at which PIT finds the impact and all earlier impacts; 0 if there is
            no such phase.
        found_off_s: The largest error of the impact's time over the same phases as in `found`, in seconds, shape
            ``(m,)``.
        final: Final errors, see `Errors.list_final_errors`. For several phases, each value is the largest over phase 0
            and all phases at which PIT has no missed or spurious impact.
        late_s: Largest error of an impact's time at any of the phases, in seconds; infinite if an impact is missed or
            spurious.
        phases: Number of phases at which PIT was run.
        close_phases: Number of phases at which all of PIT's impacts deserve the grade *close*.
    """

    dt_s: float
    errors: Array
    found: Array
    found_off_s: Array
    final: Array
    late_s: float
    phases: int = 1
    close_phases: int = 0

    @classmethod
    def of(cls, dt_s: float, measured: Measured, scales: Scales, impacts: int) -> SamplingCost:
        """Return the cost of sampling at one phase, from PIT's errors at that phase.

        `impacts` is the number of reliable impacts.
        """
        errors = measure_impact_errors(measured, scales, impacts)
        worst, alignment, matched = measured.largest, measured.alignment, measured.matched
        all_found = not (alignment.missed or alignment.spurious or alignment.undecided)
        late_s = (abs(worst.time_s) if matched else 0.0) if all_found else math.inf
        first_missed, off_s = min(alignment.missed, default=impacts), np.zeros(impacts)
        off_s[matched] = np.abs(measured.of_impacts["time_s"])
        is_found = np.arange(len(off_s)) < first_missed
        found, found_off_s = np.where(is_found, errors, 0.0), np.where(is_found, off_s, 0.0)
        return cls(dt_s, errors, found, found_off_s, worst.list_final_errors(), late_s)

    @classmethod
    def combine(cls, costs: Sequence[SamplingCost]) -> SamplingCost:
        """Return the largest errors over several phases.

        The first item must contain the errors at phase 0.
        """
        all_errors, late_s = np.array([cost.errors for cost in costs]), np.array([cost.late_s for cost in costs])
        errors, found, off_s = (
            np.maximum.accumulate(np.max([getattr(cost, name) for cost in costs], axis=0), axis=-1)
            for name in ("errors", "found", "found_off_s")
        )
        final = np.max([costs[0].final, *(cost.final for cost in costs[1:] if math.isfinite(cost.late_s))], axis=0)
        # Impacts have grade *close* if time errors divided by the step size are at most `part`, and other errors
        # divided by PIT's largest error so far are at most `part`.
        part, rounding, dt_s = THRESHOLDS.close, THRESHOLDS.rounding, costs[0].dt_s
        is_close = (late_s <= part * dt_s) & (all_errors <= part * errors + rounding).all(axis=(1, 2))
        return cls(dt_s, errors, found, off_s, final, find_largest(late_s), len(costs), int(is_close.sum()))


def measure_sampling_cost(aligned: AlignedRun, pit: Trace, measured: Measured, measured_run: Measured) -> SamplingCost:
    """Measure PIT's largest errors over the phases of a step, with the step size of `pit`.

    Args:
        aligned: The compared traces.
        pit: PIT's run.
        measured: The errors of PIT's run at phase 0, at which the scene is not shifted.
        measured_run: The errors of the run that is compared with PIT. If the run's errors are larger than PIT's errors
            at evenly spread phases, PIT also runs at the phases at which PIT is as late as the run.
    """
    reference, impacts, cut = aligned.reference, aligned.compared.impacts, not aligned.compared.is_whole_run

    def measure_even_phases() -> tuple[list[SamplingCost], SamplingCost]:
        costs = [SamplingCost.of(pit.dt_s, measured, aligned.scales, impacts)]
        if pit.dt_s and impacts:
            phases = list_even_phases(THRESHOLDS.phases)[1:]  # at phase 0, the scene is not shifted
            costs += _measure_costs_at_phases(reference.scene, pit.dt_s, impacts, cut, phases)
        return costs, SamplingCost.combine(costs)

    costs, cost = aligned.baseline.compute_once((measure_sampling_cost, aligned.compared), measure_even_phases)
    if not (pit.dt_s and impacts):
        return cost
    if phases := _find_own_phases(measured_run, cost, THRESHOLDS.ratio_known_of(aligned.observed.float_bits)):
        own_costs = _measure_costs_at_phases(reference.scene, pit.dt_s, impacts, cut, phases)
        # `close_phases` counts evenly spread phases only.
        return replace(SamplingCost.combine([*costs, *own_costs]), phases=cost.phases, close_phases=cost.close_phases)
    return cost


def _find_own_phases(measured_run: Measured, cost: SamplingCost, known: float) -> tuple[float, ...]:
    """Return the phases at which PIT is as late as the run, for impacts at which the run's errors exceed PIT's.

    A phase is a number from 0 to 1. If the run checks for overlap once per step, all its impacts give the same phase.
    """
    errors, impacts = measured_run.of_impacts, measured_run.matched
    (velocity, spin), late_s = cost.found[:, impacts], errors["time_s"]
    is_worse = (errors["velocity"] > velocity) | (errors["spin"] > spin) | (late_s > cost.found_off_s[impacts])
    is_late = is_worse & (late_s > 0.0)
    steps = (measured_run.reference.impacts["time_s"][impacts][is_late] + late_s[is_late]) / cost.dt_s
    # If a step ended exactly at the impact, PIT might find the impact at once instead of a whole step late. So slightly
    # smaller phases are returned. Phases that differ by rounding only are merged.
    phases = dict.fromkeys(round(just_before % 1.0, 11) for just_before in (steps - 0.1 * known).tolist())
    return tuple(phases)[: THRESHOLDS.phases]


def measure_impact_errors(measured: Measured, scales: Scales, impacts: int) -> Array:
    """Return the velocity and spin errors at the first `impacts` impacts of a reference, shape ``(2, impacts)``.

    The error of a missed impact is the whole change of velocity or spin. The errors of impacts that are too close to
    the end of the run are 0.
    """
    found = np.zeros((2, impacts))
    velocity, spin = measured.of_impacts["velocity"], measured.of_impacts["spin"]
    found[:, measured.matched] = velocity, np.where(np.isnan(spin), 0.0, spin)
    if missed := list(measured.alignment.missed):
        found[:, missed] = measure_changes(measured.reference, scales)[:, missed]
    return found


def measure_changes(reference: Trace, scales: Scales) -> Array:
    """Return the velocity and spin change at each impact, for the body with the larger change, shape ``(2, m)``."""
    velocity = larger_error(velocities(reference.impacts, "after") - velocities(reference.impacts, "before"))
    spin = np.max(np.abs(rim_speeds(reference, "after") - rim_speeds(reference, "before")), axis=0)
    return np.stack([velocity / scales.speed_m_s, spin / scales.rim_m_s])


@lru_cache(maxsize=_MOST_CACHED)
def _measure_costs_at_phases(
    scene: Scene, dt_s: float, reliable_impacts: int, cut: bool, phases: tuple[float, ...]
) -> tuple[SamplingCost, ...]:
    """Return PIT's errors at each given phase, up to the first impact that differs from the impacts of `scene`.

    If `cut` is true, only impacts up to a horizon are compared, and final states are not compared.
    """
    reference = solve_pic(scene, max_impacts=reliable_impacts if cut else None)
    scales = compute_scales(scene, reference)
    runs = _run_shifted_scenes(reference, dt_s, phases, reliable_impacts, cut)
    return tuple(SamplingCost.of(dt_s, measured, scales, reliable_impacts) for measured in measure_errors(runs, scales))


def _run_shifted_scenes(
    reference: Trace, dt_s: float, phases: Iterable[float], reliable_impacts: int, cut: bool
) -> Iterator[MatchedRun]:
    """Run shifted scenes with PIT and PIC, and match the impacts before PIC's first difference from `reference`."""
    for shifted_scene in build_shifted_scenes(reference, dt_s, phases):
        try:
            truth = solve_pic(shifted_scene, max_impacts=reliable_impacts + 1)
            pit = solve_pit(shifted_scene, frame_rate_hz=1.0 / dt_s)
        except InputError:
            continue
        count = min(len(truth.impacts), reliable_impacts)
        expected, found = reference.impacts[:count], truth.impacts[:count]
        differs = (expected["first"] != found["first"]) | (expected["second"] != found["second"])
        agreed = int(differs.argmax()) if differs.any() else count
        if not agreed or find_non_finite(truth) or find_non_finite(pit):
            continue
        is_whole_run = not cut and agreed == reliable_impacts == len(truth.impacts)
        until_s = math.inf if is_whole_run else float(truth.impacts["time_s"][agreed - 1])
        yield MatchedRun(truth, pit, match_impacts(truth, pit, ComparisonRange(agreed, until_s)))
