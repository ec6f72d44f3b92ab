"""All that a verdict and a grade are derived from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carom.comparator.align import Reach
from carom.comparator.consistency import Consistency
from carom.comparator.contact import ContactScore
from carom.comparator.friction_branch import WrongBranches
from carom.comparator.grades import Grade
from carom.comparator.local import LocalErrors
from carom.comparator.measure import ImpactError, Measured
from carom.comparator.order import Order
from carom.comparator.sampling import Price
from carom.comparator.scales import Scales
from carom.comparator.simultaneous_impacts import ConventionMatch
from carom.comparator.stepwise.reports import ReportsAndStates
from carom.comparator.stepwise.score import LocalScore
from carom.comparator.thresholds import THRESHOLDS
from carom.model.trace import Outcome, Trace


@dataclass(frozen=True)
class Evidence:
    """All that a verdict is derived from: what a `Score` shows, and what that was found from.

    Attributes:
        reach: What of the reference is believed.
        measured: What was measured of the observed trace against it.
        sampling: What was measured of PIT at the same step; None where that was not run.
        against_pit: What was measured of the observed trace against that PIT; None as well.
        price: What PIT pays at worst over the phases of that step; None as well.
        consistency: None where the observed trace has a number that is NaN or infinite.
        branches: Which of its impacts took the wrong branch of friction.
        contact: How it does in contact; None where there is none, or its states were not kept.
        broken: Which number that is, empty where there is none.
        local_truth: Each step against PIC from the observed trace's own state; None where states were not looked at.
        reports: Where what it reports and what its states show part; None as well.
        pit_s: Times of the impacts of PIT; None where it was not run.
        up_to_tie: The grade up to the first instant that has no unique answer; None where there is none, or nothing
            before it.
    """

    reference: Trace
    observed: Trace
    scales: Scales
    reach: Reach
    measured: Measured
    sampling: Measured | None
    against_pit: Measured | None
    price: Price | None
    order: Order
    local: LocalErrors
    convention: ConventionMatch | None
    consistency: Consistency | None
    branches: WrongBranches
    contact: ContactScore | None
    broken: str
    local_truth: LocalScore | None
    reports: ReportsAndStates | None
    pit_s: NDArray[np.float64] | None
    up_to_tie: Grade | None

    @property
    def parted_s(self) -> float | None:
        """When the first impact is that the reference and the run do not share in this order, seconds; or None."""
        swapped = [a for a, _ in self.order.inverted]
        return _first_unshared(self.measured, self.reference, self.observed.impacts["time_s"], swapped)

    @property
    def pit_parted_s(self) -> float | None:
        """The same of PIT at this step."""
        if self.sampling is None or self.pit_s is None:
            return None
        return _first_unshared(self.sampling, self.reference, self.pit_s, ())

    @property
    def nothing_compared(self) -> bool:
        """Whether there is a horizon, and no impact of the reference before it."""
        return not self.reach.whole and not self.reach.impacts

    @property
    def cut_short(self) -> bool:
        """Whether the run ended before the scene did, whatever it calls that."""
        completed = self.observed.outcome is Outcome.COMPLETED
        return not completed or self.observed.end_time_s < self.scales.time_s * (1.0 - THRESHOLDS.rounding)

    @property
    def ended_otherwise(self) -> bool:
        """Whether the run ended otherwise than the reference; where discs come to rest nobody else must end."""
        asked = Outcome.COMPLETED if self.reference.contact_s < math.inf else self.reference.outcome
        return self.observed.outcome is not asked or (asked is Outcome.COMPLETED and self.cut_short)

    @property
    def rounding(self) -> float:
        """What counts as rounding in the floats that the method declares."""
        return THRESHOLDS.rounding_of(self.observed.float_bits)

    @property
    def rounding_s(self) -> float:
        """The same of a time, seconds."""
        return THRESHOLDS.time_rounding_of(self.observed.float_bits, self.scales.time_s, self.observed.dt_s)

    @property
    def place_rounding(self) -> float:
        """What rounding makes of a position in all steps of the run, over its own reach."""
        steps = self.scales.time_s / self.observed.dt_s if self.observed.dt_s else 0.0
        return THRESHOLDS.place_rounding_of(self.observed.float_bits, steps)

    def is_rounding(self, error: ImpactError, measured: Measured) -> bool:
        """Whether the errors of an impact's velocities and spins are rounding, of what led to it."""
        own, at, scales = measured.own, error.reference, self.scales
        return (
            error.velocity * scales.speed_m_s <= self.rounding * own.speed_m_s[at]
            and not error.spin * scales.rim_m_s > self.rounding * own.rim_m_s[at]
        )

    def end_rounding(self, measured: Measured, *, exactly: bool) -> NDArray[np.float64]:
        """What rounding of what led to them makes of final positions, velocities and rims, as `Measured.ends` has them.

        Narrow floats round a place further and further; *exact* ends at a hundredth of a step's travel, as of a time.
        """
        own = measured.own
        place = self.place_rounding * own.reach_m
        if exactly:
            step_m = own.final_speed_m_s * self.observed.dt_s
            # What never moves is not rounded step by step.
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
