"""First stage of a comparison: the part of a run that can be compared with its reference.

The range ends at the horizon, or when a disc starts to rest, slide or roll, or when a disc is crushed. If a disc
bounces infinitely often before it rests or is crushed, the range ends when its bounces become too weak or too frequent
for the step size.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from carom.comparator.horizon import RELIABLE_ERROR
from carom.comparator.match_impacts import Alignment, ComparisonRange, Pair, group_by_pair, match_impacts
from carom.comparator.scales import OwnScales, Scales, compute_own_scales, compute_scales
from carom.comparator.stepwise.resting_pairs import RESTING_STEPS
from carom.comparator.stepwise.scene_bodies import SceneBodies
from carom.comparator.thresholds import THRESHOLDS
from carom.errors import InputError
from carom.model.flights import free_flights
from carom.model.step_windows import LocalTruth
from carom.model.trace import Outcome, Trace, wall_index

Result = TypeVar("Result")


class Baseline:
    """The reference, and PIT's run with one step size.

    Values that depend only on the reference and PIT's run are computed once for all compared runs.

    Attributes:
        reference: The reference.
        pit: PIT's run; None if it was not given.
    """

    def __init__(self, reference: Trace, pit: Trace | None) -> None:
        self.reference, self.pit = reference, pit
        self._known: dict[Hashable, Any] = {}

    @cached_property
    def scales(self) -> Scales:
        """The speed, length, time and energy that errors in this scene are divided by."""
        return compute_scales(self.reference.scene, self.reference)

    def find_own_scales(self, trace: Trace) -> OwnScales:
        """Return the speeds and coordinates that determine the rounding errors of the reference or of PIT's run."""
        return self.compute_once((compute_own_scales, trace is self.pit), lambda: compute_own_scales(trace))

    @cached_property
    def unique(self) -> Baseline:
        """A copy of this baseline in which every impact of the reference counts as having a unique result."""
        return Baseline(replace(self.reference, ambiguous=()), self.pit)

    def compute_once(self, key: Hashable, compute: Callable[[], Result]) -> Result:
        """Return the result of `compute`, or the cached result of an earlier call with this key."""
        if key not in self._known:
            self._known[key] = compute()
        result: Result = self._known[key]
        return result


@dataclass(frozen=True, eq=False)
class ComparedRun:
    """Traces to compare, and the part of the run in which they are compared.

    Each stage of a comparison adds fields to the result of the previous stage.

    Attributes:
        baseline: The reference and PIT's run, which are the same for all compared runs.
        pit: The run of PIT with the same step size; None if it was not given.
        compared: The part of the run that is compared with the reference.
        pit_range: The part of the run that is compared with PIT; None without a PIT run.
        truth: Comparison of each step of the run with a PIC run that starts from the run's own state before the step.
            None if no states were recorded.
        before_tie_s: Time just before the first simultaneous impacts that have no unique result, in seconds. None if
            all results are unique, or if the first impact has no unique result.
    """

    baseline: Baseline
    reference: Trace
    observed: Trace
    pit: Trace | None
    scales: Scales
    compared: ComparisonRange
    pit_range: ComparisonRange | None
    truth: LocalTruth | None
    before_tie_s: float | None

    @classmethod
    def of(cls, before: ComparedRun, **new_fields: Any) -> Self:
        """Return a stage's result, which consists of the previous stage's fields and the new fields."""
        return cls(**{field.name: getattr(before, field.name) for field in fields(before)}, **new_fields)

    @property
    def has_nothing_compared(self) -> bool:
        """Whether the reference has no impact before the horizon, so that no impact is compared."""
        return not self.compared.is_whole_run and not self.compared.impacts

    @property
    def is_cut_short(self) -> bool:
        """Whether the run ended before the scene's end. The run may nevertheless report that it is complete."""
        completed = self.observed.outcome is Outcome.COMPLETED
        return not completed or self.observed.end_time_s < self.scales.time_s * (1.0 - THRESHOLDS.rounding)

    @property
    def has_other_ending(self) -> bool:
        """Whether the run did not end like the reference, for example because the run was interrupted.

        If discs rest or slide at the end of the reference, the run only has to be complete.
        """
        expected = Outcome.COMPLETED if self.reference.contact_s < math.inf else self.reference.outcome
        return self.observed.outcome is not expected or (expected is Outcome.COMPLETED and self.is_cut_short)

    @property
    def rounding(self) -> float:
        """Relative rounding error of a method that computes in floats of 32 or 64 bits."""
        return THRESHOLDS.rounding_of(self.observed.float_bits)

    @property
    def rounding_s(self) -> float:
        """Rounding error of a time, in seconds."""
        return THRESHOLDS.time_rounding_of(self.observed.float_bits, self.scales.time_s, self.observed.dt_s)

    @property
    def place_rounding(self) -> float:
        """Rounding error of a position after all steps of the run, relative to the largest coordinate."""
        steps = self.scales.time_s / self.observed.dt_s if self.observed.dt_s else 0.0
        return THRESHOLDS.place_rounding_of(self.observed.float_bits, steps)


def find_range(baseline: Baseline, observed: Trace, horizon: float | None) -> ComparedRun:
    """Find the range in which a run can be compared with its reference.

    Args:
        baseline: The reference, and PIT's run with the same step size.
        observed: The run.
        horizon: The horizon, as in `carom.compare`.

    Raises:
        InputError: The horizon is negative or not a number.
    """
    reference, pit, dt_s = baseline.reference, baseline.pit, observed.dt_s
    reliable = comparison_range(reference, horizon)
    key = (clip_before_rest, reliable, dt_s)
    compared = baseline.compute_once(key, lambda: clip_before_rest(reference, reliable, dt_s, pit))
    truth, tie_s = observed.local_truth, None
    if reference.outcome is Outcome.CRUSHED and truth is not None:  # a disc has no possible state after it is crushed
        truth = truth.clip_to(compared.until_s)
    if reference.ambiguous:
        times = reference.impacts["time_s"]
        # Because of rounding, one of the simultaneous impacts may have a slightly earlier time.
        tie_s = float(times[min(reference.ambiguous)]) - RELIABLE_ERROR * reference.scene.duration_s
        if not (tie_s < compared.until_s and np.any(times < tie_s)):
            tie_s = None
    pit_range = None if pit is None else comparison_range(pit, compared.until_s)
    return ComparedRun(baseline, reference, observed, pit, baseline.scales, compared, pit_range, truth, tie_s)


def comparison_range(reference: Trace, horizon: float | None) -> ComparisonRange:
    """Return the part of a run up to a horizon, which is given as in `carom.compare`.

    Raises:
        InputError: The horizon is negative or not a number.
    """
    times, count = reference.impacts["time_s"], len(reference.impacts)
    if horizon is not None and (isinstance(horizon, bool) or not horizon >= 0):
        raise InputError(f"the horizon must be a number of impacts (int) or a time in seconds (float), got {horizon!r}")
    if horizon is None or horizon >= (count if isinstance(horizon, int) else reference.scene.duration_s):
        return ComparisonRange(count, math.inf)
    if isinstance(horizon, int):  # the range ends just before the first unreliable impact
        return ComparisonRange(horizon, float(np.nextafter(times[horizon], -math.inf)))
    return ComparisonRange(int(np.searchsorted(times, horizon, side="right")), float(horizon))


def clip_before_rest(
    reference: Trace, compared: ComparisonRange, dt_s: float, pit: Trace | None = None
) -> ComparisonRange:
    """End the compared range where a bouncing disc becomes so slow that steps of this size can't show its bounces.

    A disc can have infinitely many impacts just before it rests. The range ends before the first impact whose closing
    speed is at most the speed gained by falling for `RESTING_STEPS` steps. A method that checks once per step can't
    distinguish such a slow disc from a resting disc. If PIT's run is given, the range also ends at the first bounce
    that PIT misses or invents.
    """
    impacts, times = reference.impacts, reference.impacts["time_s"]
    if reference.scene.gravity_m_s2 == (0.0, 0.0) and reference.contact_s == math.inf:
        return compared
    if reference.outcome is Outcome.CRUSHED:
        until_s = _find_crush_limit(reference, dt_s, pit)
    else:
        change = impacts["velocity_first_before"] - impacts["velocity_second_before"]
        closing = np.sum(change * impacts["normal"], axis=1)
        weak = closing <= RESTING_STEPS * math.hypot(*reference.scene.gravity_m_s2) * dt_s
        bounces = _find_last_bounces(reference)
        if reference.contact_s == math.inf or reference.outcome is Outcome.GLIDES:  # a gliding disc does not rest
            weak &= np.isin(np.arange(len(impacts)), [row for rows in bounces.values() for row in rows])
        ends_s = [reference.contact_s, *np.nextafter(times[weak][:1], -math.inf).tolist()]
        if pit is not None and bounces:
            alignment = match_impacts(reference, pit)
            ends_s += [_find_end_of_pit_bounces(reference, pair, bounces[pair][0], pit, alignment) for pair in bounces]
        until_s = min(ends_s)
    count = int(np.searchsorted(times, until_s, side="right"))
    return compared if compared.until_s <= until_s else ComparisonRange(min(count, compared.impacts), until_s)


def _find_crush_limit(reference: Trace, dt_s: float, pit: Trace | None) -> float:
    """Return the time after which the impacts of a disc between two closing walls are too frequent for this step size.

    As the walls crush the disc, the times between its impacts become ever shorter. After the returned time, each impact
    follows the previous impact within two steps, so a method that checks once per step misses impacts. If PIT's run is
    given and misses or invents an earlier impact of the disc, the result is one step before that impact.
    """
    impacts, times = reference.impacts, reference.impacts["time_s"]
    disc = int(impacts["first"][-1])
    rows = np.flatnonzero((impacts["first"] == disc) | (impacts["second"] == disc))
    breaks = np.flatnonzero(np.diff(times[rows]) > 2.0 * dt_s)
    begin = int(breaks[-1]) + 1 if len(breaks) else 0
    until_s = float(np.nextafter(times[rows[begin]], -math.inf))
    if pit is None:
        return until_s
    alignment = match_impacts(reference, pit)
    unmatched = [*impacts[list(alignment.missed)], *pit.impacts[list(alignment.spurious)]]
    lost_s = [float(impact["time_s"]) for impact in unmatched if disc in (impact["first"], impact["second"])]
    return min(until_s, min(lost_s, default=math.inf) - dt_s)


def _find_last_bounces(reference: Trace) -> dict[Pair, list[int]]:
    """Find series of ever lower bounces of discs on fixed bodies. Return the bounces' indices by pair of bodies."""
    scene, impacts = reference.scene, reference.impacts
    found = {}
    for disc in np.flatnonzero(scene.arrays.movable).tolist():
        rows = np.flatnonzero((impacts["first"] == disc) | (impacts["second"] == disc))
        if not len(rows):
            continue
        pair = (int(impacts["first"][rows[-1]]), int(impacts["second"][rows[-1]]))
        other = pair[1] if pair[0] == disc else pair[0]
        fixed = other < 0 or scene.discs[other].immovable
        loses = float(scene.arrays.restitution_of(np.array([other]))[0]) < 1.0
        along = float(impacts["normal"][rows[-1]] @ np.array(scene.gravity_m_s2))
        if fixed and loses and (along if pair[0] == disc else -along) > 0.0:
            other_impacts = np.flatnonzero((impacts["first"][rows] != pair[0]) | (impacts["second"][rows] != pair[1]))
            found[pair] = rows[other_impacts[-1] + 1 if len(other_impacts) else 0 :].tolist()
    return found


def _find_end_of_pit_bounces(reference: Trace, pair: Pair, first_row: int, pit: Trace, alignment: Alignment) -> float:
    """Return the time up to which PIT finds the final bounces of a pair; infinity if PIT finds all of them.

    PIT finds each bounce late, so the disc flies slightly too long or too short until the next bounce. When the
    differences of flight times add up to the time between two bounces, PIT has a spurious impact. PIT may also find the
    disc so deep in the body that gravity pulls the disc back before the disc has left the body.
    """
    expected_s, found_s = reference.impacts["time_s"], pit.impacts["time_s"]
    expected = group_by_pair(reference.impacts)[pair]
    found = group_by_pair(pit.impacts).get(pair, [])
    stuck = _find_falling_back(pit, found)
    begin_s, reference_of = float(expected_s[first_row]), {o: r for r, o in alignment.matched}
    for nth, k in enumerate(found):
        if found_s[k] <= begin_s:
            continue
        if k in alignment.spurious:
            return float(found_s[k]) - pit.dt_s
        if stuck[nth] and nth + 1 < len(expected):
            # If earlier impacts were missed or invented, PIT's impact `k` is not this bounce, so it does not count.
            is_matched = reference_of.get(k) == expected[nth] and expected_s[expected[nth]] <= found_s[k]
            is_before_next = found_s[k] < expected_s[expected[nth + 1]]
            return float(found_s[k]) - (0.0 if is_matched and is_before_next else pit.dt_s)
    return math.inf


def _find_falling_back(trace: Trace, impacts: list[int]) -> NDArray[np.bool_]:
    """Return, for each given impact of one pair, whether gravity pulls the disc back before the bodies separate.

    The pair overlaps by `depth` when the impact is found, and then separates at the speed `parting`. Gravity
    accelerates the bodies towards each other by `pull`. The bodies separate only if ``parting^2 > 2 pull depth``.
    """
    scene, bodies = trace.scene, SceneBodies(trace.scene)
    row_of_impact, radius = {k: nth for nth, k in enumerate(impacts)}, scene.arrays.radius_m
    falls_back, place = np.zeros(len(impacts), dtype=np.bool_), np.array([disc.position_m for disc in scene.discs])
    pulled = np.array([(0.0, 0.0) if disc.immovable else scene.gravity_m_s2 for disc in scene.discs])
    for flight in free_flights(trace):
        if flight.impact == len(trace.impacts):
            break
        place[flight.disc] = flight.position_at(flight.end_s)
        if (nth := row_of_impact.get(flight.impact)) is None:
            continue
        impact = trace.impacts[flight.impact]
        first, second, normal = int(impact["first"]), int(impact["second"]), impact["normal"]
        if second >= 0:
            pull = (pulled[first] - pulled[second]) @ normal
            depth = radius[first] + radius[second] - math.hypot(*(place[second] - place[first]))
        else:
            pull = pulled[first] @ normal
            x, y = place[first].tolist()
            depth = radius[first] - bodies.measure_wall_distance(wall_index(second), x, y, flight.end_s)[0]
        parting = (impact["velocity_second_after"] - impact["velocity_first_after"]) @ normal
        falls_back[nth] = parting**2 <= 2.0 * pull * max(depth, 0.0)
    return falls_back
