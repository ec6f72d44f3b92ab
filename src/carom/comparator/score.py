"""Score: the result of comparing a run with a reference."""

from __future__ import annotations

import math
from dataclasses import dataclass
from operator import attrgetter

from carom.comparator.grades import Grade
from carom.comparator.measure.consistency import Consistency
from carom.comparator.measure.contact import ContactScore
from carom.comparator.measure.errors import Errors, ImpactError
from carom.comparator.measure.local_errors import LocalErrors
from carom.comparator.measure.simultaneous_impacts import ConventionMatch
from carom.comparator.measure.stepwise_score import LocalScore
from carom.comparator.scales import Scales
from carom.comparator.verdict import Finding, Verdict
from carom.support.display import Shown


@dataclass(frozen=True, repr=False)
class Score(Shown):
    """Result of the comparison of a run's trace with the reference.

    Attributes:
        expected: Number of the reference's impacts up to the horizon.
        errors: The errors of each matched impact.
        missed: Indices of the reference's impacts that the run misses.
        spurious: Indices of the run's impacts that the reference does not have.
        undecided: Indices of the reference's impacts that are so close to the end of the run that the run may not have
            reported them yet.
        total: The run's largest error of each kind, relative to the reference.
        sampling: The largest errors of PIT with the same step size, relative to the reference. None without a PIT run.
        against_pit: The run's largest errors, relative to PIT with the same step size. None without a PIT run.
        pit_missed: Indices of the reference's impacts that PIT misses; None without a PIT run.
        price_paid: The run's largest velocity error, divided by PIT's largest velocity error over the phases of the
            step. If the ratio of the spin errors is larger, that ratio is used. For a missed impact, the error is the
            whole change of velocity or spin that the impact causes. The value is 0 for an exact run, 1 for a run as
            inaccurate as PIT, and above 1 for a worse run. If all velocities and spins of both PIT and the run are
            exact, the value is the ratio of the largest time errors. PIT's time error then counts as at least one step.
            The value is NaN without a PIT run, without an impact, or if simultaneous impacts have no unique result. The
            value is infinite if the run has an error and PIT has none, if a number of the run is not finite, or if the
            run ended too early to report all impacts.
        findings: At least one verdict, each with its reason.
        grade: The grade.
        float_bits: Width of the method's floats: 32 or 64 bits. Errors within the rounding of these floats count as
            exact.
        scales: The length, speeds, time and energy that errors are divided by.
        equals_pit: Whether the run finds the same impacts as PIT, and differs from PIT only by rounding.
        edits: Edit distance between the sequences of impacts in the run and in the reference.
        beyond_horizon: Number of the reference's impacts beyond the horizon, which were not compared.
        horizon_s: End of the compared part of the run, in seconds. The part ends at the horizon, or when bounces before
            a lasting contact become too small for the step. None if the whole run is compared.
        local: Errors of each impact, relative to the exact impact that follows from the trace's own state before it.
        convention: If simultaneous impacts have no unique result: the possible outcome that is nearest to the run's
            outcome. None if all results are unique.
        consistency: Contradictions between the trace's own impacts and states; None if one of its numbers is NaN or
            infinite.
        local_truth: Score of the single steps, each compared with PIC from the run's own state; None if states were not
            stored.
        diverged_s: Time in seconds at which the trajectory diverged from the reference's. None if the trajectory did
            not diverge, or if an earlier step missed or invented an impact.
        pit_diverged_s: Time in seconds at which PIT's trajectory diverged; None if it did not diverge, or without a PIT
            run.
        contact: Score of the time in which discs slide, roll or rest. None if there is no such time, or if states were
            not stored.
        lucky_phase: Number of phases of the step at which PIT is as accurate as the run, and number of phases that were
            tried. The numbers are given only if an exact or close run equals PIT, but PIT is less accurate at some
            phases; otherwise None.

    Examples:
        >>> reference = carom.solve_pic("paper/late")
        >>> observed = carom.solve_pit(reference.scene)
        >>> score = carom.compare(reference, observed, sampling=observed)
        >>> score.grade.name, score.missed
        ('SAMPLED', ())
    """

    expected: int
    errors: tuple[ImpactError, ...]
    missed: tuple[int, ...]
    spurious: tuple[int, ...]
    undecided: tuple[int, ...]
    total: Errors
    sampling: Errors | None
    against_pit: Errors | None
    pit_missed: tuple[int, ...] | None
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
    local_truth: LocalScore | None
    diverged_s: float | None
    pit_diverged_s: float | None
    lucky_phase: tuple[int, int] | None
    contact: ContactScore | None

    @property
    def own_velocity(self) -> float | None:
        """The velocity error that sampling does not explain: the smaller of the errors relative to PIT and to PIC.

        The error relative to PIC is also considered, because a method that is more accurate than PIT differs from PIT.
        """
        if self.against_pit is None:
            return None
        pit_difference, total = self.against_pit.velocity, self.total.velocity
        return total if math.isnan(pit_difference) else min(total, pit_difference)  # NaN if PIT has no matched impact

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """The verdicts, without their reasons."""
        return tuple(finding.verdict for finding in self.findings)

    # Version 0.1 used these names for errors in `total`.
    time_error_s = property(attrgetter("total.time_s"))
    velocity_error = property(attrgetter("total.velocity"))
    direction_error_rad = property(attrgetter("total.direction_rad"))
    final_position_error = property(attrgetter("total.final_position"))
    final_velocity_error = property(attrgetter("total.final_velocity"))
    energy_error = property(attrgetter("total.energy"))
    momentum_error = property(attrgetter("total.momentum"))
