"""Everything that verdicts and the grade are derived from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carom.comparator.align import ComparisonRange
from carom.comparator.consistency import Consistency
from carom.comparator.contact import ContactScore
from carom.comparator.friction_branch import WrongBranches
from carom.comparator.grades import Grade
from carom.comparator.local import LocalErrors
from carom.comparator.measure import ImpactError, Measured
from carom.comparator.order import Order
from carom.comparator.sampling import SamplingCost
from carom.comparator.scales import Scales
from carom.comparator.simultaneous_impacts import ConventionMatch
from carom.comparator.stepwise.reports import ReportComparison
from carom.comparator.stepwise.score import LocalScore
from carom.comparator.thresholds import THRESHOLDS
from carom.model.trace import Outcome, Trace


@dataclass(frozen=True)
class Evidence:
    """Everything that verdicts and the grade are derived from.

    Attributes:
        compared: The range in which the run is compared with the reference.
        measured: Errors of the observed trace against the reference.
        sampling: Errors of PIT at the same step against the reference; None where PIT was not run.
        against_pit: Errors of the observed trace against that PIT; None where PIT was not run.
        sampling_cost: Errors of PIT at worst over the phases of the step; None where PIT was not run.
        consistency: None where the observed trace has a number that is NaN or infinite.
        branches: The impacts that took the wrong branch of friction.
        contact: Score in contact; None where there is none, or states were not kept.
        non_finite: The first number that is NaN or infinite, as a clause; empty where there is none.
        local_truth: Each step against PIC from the observed trace's own state; None where states were not checked.
        reports: Comparison of reported impacts with states; None where states were not checked.
        pit_s: Times of the impacts of PIT; None where it was not run.
        grade_before_tie: The grade up to the first instant that has no unique answer; None where there is no such
            instant, or nothing before it.
    """

    reference: Trace
    observed: Trace
    scales: Scales
    compared: ComparisonRange
    measured: Measured
    sampling: Measured | None
    against_pit: Measured | None
    sampling_cost: SamplingCost | None
    order: Order
    local: LocalErrors
    convention: ConventionMatch | None
    consistency: Consistency | None
    branches: WrongBranches
    contact: ContactScore | None
    non_finite: str
    local_truth: LocalScore | None
    reports: ReportComparison | None
    pit_s: NDArray[np.float64] | None
    grade_before_tie: Grade | None

    @property
    def parted_s(self) -> float | None:
        """Time of the first impact that the reference and the run do not share in order, seconds; or None."""
        swapped = [a for a, _ in self.order.inverted]
        return _first_unshared(self.measured, self.reference, self.observed.impacts["time_s"], swapped)

    @property
    def pit_parted_s(self) -> float | None:
        """The same time of PIT at this step."""
        if self.sampling is None or self.pit_s is None:
            return None
        return _first_unshared(self.sampling, self.reference, self.pit_s, ())

    @property
    def has_nothing_compared(self) -> bool:
        """Whether there is a horizon and no impact of the reference before it."""
        return not self.compared.is_whole_run and not self.compared.impacts

    @property
    def is_cut_short(self) -> bool:
        """Whether the run ended before the scene did, whatever outcome it reports."""
        completed = self.observed.outcome is Outcome.COMPLETED
        return not completed or self.observed.end_time_s < self.scales.time_s * (1.0 - THRESHOLDS.rounding)

    @property
    def has_other_ending(self) -> bool:
        """Whether the run ended differently from the reference; after rest a run must complete the scene."""
        expected = Outcome.COMPLETED if self.reference.contact_s < math.inf else self.reference.outcome
        return self.observed.outcome is not expected or (expected is Outcome.COMPLETED and self.is_cut_short)

    @property
    def rounding(self) -> float:
        """Rounding error in the floats that the method declares."""
        return THRESHOLDS.rounding_of(self.observed.float_bits)

    @property
    def rounding_s(self) -> float:
        """Rounding error of a time, seconds."""
        return THRESHOLDS.time_rounding_of(self.observed.float_bits, self.scales.time_s, self.observed.dt_s)

    @property
    def place_rounding(self) -> float:
        """Rounding error of a position over all steps of the run, relative to its own extent."""
        steps = self.scales.time_s / self.observed.dt_s if self.observed.dt_s else 0.0
        return THRESHOLDS.place_rounding_of(self.observed.float_bits, steps)

    def is_rounding(self, error: ImpactError, measured: Measured) -> bool:
        """Whether the errors of an impact's velocities and spins are within the rounding of what led to it."""
        own, at, scales = measured.own, error.reference, self.scales
        return (
            error.velocity * scales.speed_m_s <= self.rounding * own.speed_m_s[at]
            and not error.spin * scales.rim_m_s > self.rounding * own.rim_m_s[at]
        )

    def end_rounding(self, measured: Measured, *, exactly: bool) -> NDArray[np.float64]:
        """Return the rounding errors of final positions, velocities and rims, in the rows of `Measured.ends`.

        The rounding of a position grows with each step in narrow floats. *Exact* allows at most a hundredth of a step's
        travel.
        """
        own = measured.own
        place = self.place_rounding * own.reach_m
        if exactly:
            step_m = own.final_speed_m_s * self.observed.dt_s
            # The position of a disc that never moves is not rounded at each step.
            most = np.where(own.final_speed_m_s > 0.0, THRESHOLDS.close * step_m, self.rounding * own.reach_m)
            place = np.minimum(place, most) if self.observed.dt_s else place
        return np.stack([place, self.rounding * own.final_speed_m_s, self.rounding * own.final_rim_m_s])


def _first_unshared(
    measured: Measured, reference: Trace, observed_s: NDArray[np.float64], swapped: Sequence[int]
) -> float | None:
    expected_s, alignment = reference.impacts["time_s"], measured.alignment
    times = [float(expected_s[k]) for k in (*alignment.missed, *swapped)]
    times += [float(observed_s[k]) for k in alignment.spurious]
    return min(times, default=None)
