"""Run with its verdicts, and the facts on which both verdicts and the grade depend."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from carom.comparator.grades import Grade
from carom.comparator.measure.measured_run import MeasuredRun
from carom.comparator.verdict import Finding


@dataclass(frozen=True)
class JudgedRun(MeasuredRun):
    """A run with its verdicts.

    Attributes:
        grade_before_tie: The grade up to the first instant that has no unique answer; None without such an instant, or
            without an impact before that instant.
        drifts: Positions and angular momenta that do not follow from the run's own impacts; sampling may explain them.
        contradictions: Contradictions of the run's own states, velocities, stamps and normals, which sampling can't
            explain.
        findings: All verdicts, each with its reason.
    """

    grade_before_tie: Grade | None
    drifts: tuple[Finding, ...]
    contradictions: tuple[Finding, ...]
    findings: tuple[Finding, ...] = ()

    @cached_property
    def has_exact_steps(self) -> bool:
        """Whether every step and the final state agree with PIC to rounding.

        If velocities between several impacts of a disc in one step are unknown, only the state after the step counts.
        """
        local = self.local_truth
        if local is None or local.grade is not Grade.EXACT or self.convention is not None:
            return False
        if (
            (self.reports is not None and not self.reports.agree)
            or self.has_other_ending
            or self.non_finite
            or self.measured.largest.final_spin > self.rounding
            or self.drifts
            or self.contradictions
        ):
            return False
        if self.compared.is_whole_run:
            return bool(np.all(self.measured.ends[:2] <= self.compute_end_rounding(self.measured, exactly=True)[:2]))
        # Before a horizon, each disc's last impact replaces its final state, because errors propagate.
        latest: dict[int, float] = {}
        for error in self.measured.errors:
            row = self.reference.impacts[error.reference]
            latest |= dict.fromkeys((int(row["first"]), int(row["second"])), error.velocity)
        return bool(latest) and all(error <= self.rounding for disc, error in latest.items() if disc >= 0)

    @cached_property
    def has_diverged_before_miss(self) -> bool:
        """Whether the trajectory diverged from the reference's before any step missed or invented an impact.

        This is false if wrong reports explain all differences, or if the scene has no unique answer.
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
        """Whether the trajectory has diverged from the reference's although no step or report is wrong by itself."""
        local, reports = self.local_truth, self.reports
        if local is None or local.missed_own or local.invented or (reports is not None and not reports.agree):
            return False
        return self.has_diverged_before_miss and not self.has_other_ending
