"""What a comparison finds: errors, verdicts with their reasons, and a grade."""

from __future__ import annotations

import math
from dataclasses import dataclass

from carom.comparator.consistency import Consistency
from carom.comparator.convention import ConventionMatch
from carom.comparator.grade import Grade
from carom.comparator.local import LocalErrors
from carom.comparator.measure import Errors, ImpactError
from carom.comparator.scales import Scales
from carom.comparator.verdict import Finding, Verdict

__all__ = ["Score"]


@dataclass(frozen=True)
class Score:
    """How an observed trace compares with the reference.

    Attributes:
        expected: Number of impacts in the reference, up to the horizon.
        errors: One entry a matched impact.
        missed: Indices of missed reference impacts.
        spurious: Indices of observed impacts that the reference does not have.
        undecided: Indices of reference impacts too close to the end of the run to have been reported.
        total: The largest errors against the reference, kind by kind.
        sampling: The same of PIT at the same step against the reference: what sampling costs at this phase. None where
            PIT was not given.
        against_pit: The same of the observed trace against that PIT. None where PIT was not given.
        pit_missed: How many impacts that PIT misses; None where it was not given.
        price_paid: The largest velocity error over PIT's at worst over the phases of the same step; an impact that is
            missed is off by all that it changes. 1: the run pays the price of sampling; 0: none of it; above 1: it does
            worse than looking once a step. NaN where PIT was not given or there is no impact, infinite where sampling
            costs nothing or a number of the run is not finite.
        findings: Verdicts, each with its reason; at least one.
        grade: The grade.
        float_bits: Width of the floats that the method declares, to whose rounding *exact* is meant.
        scales: What errors were divided by.
        equals_pit: Whether it finds the very impacts that PIT finds, with all errors against PIT within rounding.
        edits: Edit distance of the two sequences of impacts.
        beyond_horizon: How many of the reference's impacts lie beyond the horizon, and were not compared.
        horizon_s: The horizon, seconds; None where the whole run is compared.
        local: Each impact against the analytic answer from the trace's own state before it.
        convention: Which of the admissible outcomes the trace took, where the scene has no unique answer.
        consistency: How far the trace is from what its own impacts and states lead to; None where one of its numbers is
            NaN or infinite.
    """

    expected: int
    errors: tuple[ImpactError, ...]
    missed: tuple[int, ...]
    spurious: tuple[int, ...]
    undecided: tuple[int, ...]
    total: Errors
    sampling: Errors | None
    against_pit: Errors | None
    pit_missed: int | None
    price_paid: float
    findings: tuple[Finding, ...]
    grade: Grade
    float_bits: int
    scales: Scales
    equals_pit: bool
    edits: int
    beyond_horizon: int
    horizon_s: float | None
    local: LocalErrors
    convention: ConventionMatch | None
    consistency: Consistency | None

    @property
    def own_velocity(self) -> float | None:
        """The velocity error that sampling does not explain: against PIT, or against the reference where that is less.

        A method that beats PIT is far from PIT for being right, and its distance to PIT is no error of its own.
        """
        if self.against_pit is None:
            return None
        beside_pit, total = self.against_pit.velocity, self.total.velocity
        return total if math.isnan(beside_pit) else min(total, beside_pit)  # PIT may miss what this run finds

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """The verdicts without their reasons."""
        return tuple(finding.verdict for finding in self.findings)

    # What `total` holds, by the names of 0.1.

    @property
    def time_error_s(self) -> float:
        """Largest time error, seconds, with its sign: `total.time_s`."""
        return self.total.time_s

    @property
    def velocity_error(self) -> float:
        """Largest velocity error of a matched impact, over the scene's speed: `total.velocity`."""
        return self.total.velocity

    @property
    def direction_error_rad(self) -> float:
        """Largest direction error: `total.direction_rad`."""
        return self.total.direction_rad

    @property
    def final_position_error(self) -> float:
        """Largest distance of a disc from its final place, over the scene's length: `total.final_position`."""
        return self.total.final_position

    @property
    def final_velocity_error(self) -> float:
        """Largest error of a final velocity, over the scene's speed: `total.final_velocity`."""
        return self.total.final_velocity

    @property
    def energy_error(self) -> float:
        """Error of the final kinetic energy, over that at the start, with its sign: `total.energy`."""
        return self.total.energy

    @property
    def momentum_error(self) -> float:
        """Error of the final momentum: `total.momentum`."""
        return self.total.momentum
