"""A run with its verdicts, and properties that both the verdicts and the grade need."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from carom.comparator.grades import Grade
from carom.comparator.measure.measured_run import MeasuredRun
from carom.comparator.verdict import Finding


@dataclass(frozen=True, eq=False)
class JudgedRun(MeasuredRun):
    """Result of the fourth stage of a comparison: a run with its verdicts.

    Attributes:
        grade_before_tie: The run's grade before the first simultaneous impacts that have no unique result. None if all
            results are unique, or if the first impact has no unique result.
        drifts: Positions and angular momenta that do not agree with the run's own impacts. Checking once per step may
            cause such differences.
        contradictions: Contradictions between the run's own states, velocities, reported times and normals. Checking
            once per step can't cause such contradictions.
        findings: All verdicts, each with its reason.
    """

    grade_before_tie: Grade | None
    drifts: tuple[Finding, ...]
    contradictions: tuple[Finding, ...]
    findings: tuple[Finding, ...] = ()

    @property
    def has_misreports(self) -> bool:
        """Whether the run's reported impacts differ from those that its states show."""
        return self.reports is not None and not self.reports.agree

    @cached_property
    def has_exact_steps(self) -> bool:
        """Whether every step and the final state agree with PIC except for rounding.

        If a disc has several impacts in one step, only its state after the step is compared.
        """
        local = self.local_truth
        if local is None or local.grade is not Grade.EXACT or self.convention is not None:
            return False
        if self.has_other_ending or self.non_finite or self.drifts or self.contradictions:
            return False
        if self.has_misreports or self.measured.largest.final_spin > self.rounding:
            return False
        if self.compared.is_whole_run:
            return bool(np.all(self.measured.ends[:2] <= self.compute_end_rounding(self.measured, exactly=True)[:2]))
        # If the run is compared only up to a horizon, each disc's last impact is compared instead of its final state.
        # Earlier errors propagate to the last impact.
        latest: dict[int, float] = {}
        for error in self.measured.errors:
            row = self.reference.impacts[error.reference]
            latest |= dict.fromkeys((int(row["first"]), int(row["second"])), error.velocity)
        return bool(latest) and all(error <= self.rounding for disc, error in latest.items() if disc >= 0)

    @cached_property
    def has_diverged_before_miss(self) -> bool:
        """Whether the trajectory diverged from the reference's before any step missed or invented an impact.

        The result is false if the run's motion is correct and only its reports are wrong, or if simultaneous impacts
        have no unique result.
        """
        local, reports, diverged_s = self.local_truth, self.reports, self.diverged_s
        if local is None or reports is None or diverged_s is None or self.non_finite or self.convention is not None:
            return False
        if local.missed_own and not local.first_missed_s > diverged_s:
            return False
        if local.invented and (local.first_invented_s is None or local.first_invented_s <= diverged_s):
            return False
        missed, spurious = len(self.alignment.missed), len(self.alignment.spurious)
        if not reports.agree and spurious <= reports.unshown and missed <= reports.unreported:
            return False
        return not self.has_exact_steps

    @property
    def has_diverged(self) -> bool:
        """Whether the trajectory has diverged from the reference's, but no step misses or invents an impact."""
        local = self.local_truth
        if local is None or local.missed_own or local.invented or self.has_misreports:
            return False
        return self.has_diverged_before_miss and not self.has_other_ending
