"""Result of the third stage of a comparison: all errors from which verdicts and the grade are derived."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carom.comparator.align_impacts import AlignedRun
from carom.comparator.measure.consistency import Consistency, find_turn_times, measure_consistency
from carom.comparator.measure.contact import ContactScore, score_contact
from carom.comparator.measure.errors import MatchedRun, Measured, measure_errors
from carom.comparator.measure.friction_branch import WrongBranches, find_wrong_branches
from carom.comparator.measure.local_errors import LocalErrors, measure_local_errors
from carom.comparator.measure.reported_impacts import ReportComparison, compare_reports_with_states
from carom.comparator.measure.sampling_cost import SamplingCost, measure_sampling_cost
from carom.comparator.measure.simultaneous_impacts import ConventionMatch, match_outcome
from carom.comparator.measure.stepwise_score import LocalScore, score_steps
from carom.comparator.non_finite import find_non_finite
from carom.comparator.thresholds import THRESHOLDS
from carom.model.trace import Outcome


@dataclass(frozen=True, eq=False)
class MeasuredRun(AlignedRun):
    """All errors from which verdicts and the grade are derived.

    Attributes:
        measured: Errors of the run relative to the reference.
        sampling: Errors of PIT with the same step size relative to the reference; None without PIT.
        measured_against_pit: Errors of the run relative to PIT with the same step size; None without PIT.
        sampling_cost: Largest errors of PIT over the phases of the step; None without PIT.
        local: Errors of each impact, relative to the exact impact that follows from the run's own state before it.
        convention: If simultaneous impacts have no unique result, the possible outcome that is nearest to the run's
            outcome; otherwise None.
        consistency: Contradictions between the run's states and its reported impacts; None if a number of the run is
            NaN or infinite.
        contact: Score of the time in which discs slide, roll or rest; None if there is no such time, or if states were
            not stored.
        branches: The impacts in which bodies stick although they should slide, or slide although they should stick.
        non_finite: Description of the first number that is NaN or infinite; empty if there is none.
        local_truth: Score of the single steps, each compared with PIC from the run's own state; None if states were not
            stored.
        reports: Differences between the impacts that the run reports and those that its states show; None if states
            were not stored.
    """

    measured: Measured
    sampling: Measured | None
    measured_against_pit: Measured | None
    sampling_cost: SamplingCost | None
    local: LocalErrors
    convention: ConventionMatch | None
    consistency: Consistency | None
    contact: ContactScore | None
    branches: WrongBranches
    non_finite: str
    local_truth: LocalScore | None
    reports: ReportComparison | None

    def are_impacts_rounding(self, measured: Measured) -> bool:
        """Whether rounding explains all velocity and spin errors of impacts."""
        own_scales, impacts = self.baseline.find_own_scales(measured.reference), measured.matched
        velocity = measured.of_impacts["velocity"] * self.scales.speed_m_s
        rim = measured.of_impacts["spin"] * self.scales.rim_m_s
        is_rounding = velocity <= self.rounding * own_scales.speed_m_s[impacts]
        return bool((is_rounding & ~(rim > self.rounding * own_scales.rim_m_s[impacts])).all())

    def compute_end_rounding(self, measured: Measured, *, exactly: bool) -> NDArray[np.float64]:
        """Return the largest rounding errors of final positions, velocities and rim speeds; see `Measured.ends`.

        In 32-bit floats, the rounding error of a position grows with each step. If `exactly` is true, this error is
        limited to a hundredth of the displacement in a step, as grade *exact* requires.
        """
        own_scales = self.baseline.find_own_scales(measured.reference)
        place = self.place_rounding * own_scales.reach_m
        if exactly and self.observed.dt_s:
            step_m = own_scales.final_speed_m_s * self.observed.dt_s
            # The position of a disc that never moves is not rounded at each step.
            most_m = np.where(step_m > 0.0, THRESHOLDS.close * step_m, self.rounding * own_scales.reach_m)
            place = np.minimum(place, most_m)
        return np.stack([place, self.rounding * own_scales.final_speed_m_s, self.rounding * own_scales.final_rim_m_s])


def measure_run(aligned: AlignedRun) -> MeasuredRun:
    """Measure a run's errors relative to the reference, contradictions within the run, and the errors of each step."""
    reference, observed, pit, scales = aligned.reference, aligned.observed, aligned.pit, aligned.scales
    matched, sampled, against_pit, cost = MatchedRun(reference, observed, aligned.alignment), None, None, None
    if pit is None or aligned.pit_alignment is None or aligned.against_pit is None:
        (measured,) = measure_errors([matched], scales)
    else:
        sampling, key = MatchedRun(reference, pit, aligned.pit_alignment), (measure_errors, aligned.compared)
        sampled = aligned.baseline.compute_once(key, lambda: next(measure_errors([sampling], scales)))
        measured, against_pit = measure_errors([matched, MatchedRun(pit, observed, aligned.against_pit)], scales)
        cost = measure_sampling_cost(aligned, pit, sampled, measured)
    non_finite, truth, until_s, possible = find_non_finite(observed), aligned.truth, aligned.compared.until_s, observed
    if reference.outcome is Outcome.CRUSHED:  # a disc has no state after it is crushed
        is_after_end = observed.impacts["time_s"] > reference.end_time_s
        possible = replace(observed, effective_time_s=np.where(is_after_end, math.nan, find_turn_times(observed)))
    return MeasuredRun.of(
        aligned,
        measured=measured,
        sampling=sampled,
        measured_against_pit=against_pit,
        sampling_cost=cost,
        local=measure_local_errors(observed, scales),
        convention=match_outcome(reference, observed, pit, scales),
        consistency=None if non_finite else measure_consistency(possible, scales, reference.contact_s),
        contact=None if non_finite else score_contact(aligned),
        branches=find_wrong_branches(observed, scales, aligned.rounding),
        non_finite=non_finite,
        local_truth=None if truth is None else score_steps(truth, scales, observed.float_bits, until_s),
        reports=None if truth is None else compare_reports_with_states(observed, truth, until_s),
    )
