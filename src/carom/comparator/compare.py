"""Comparison of a run with a reference in five stages: range, alignment, errors, verdicts, grade."""

from __future__ import annotations

import math
from dataclasses import dataclass
from operator import attrgetter

import numpy as np

from carom.comparator.align_impacts import align_impacts
from carom.comparator.comparison_range import Baseline, find_range
from carom.comparator.grade_run import GradedRun, grade_run
from carom.comparator.grades import Grade
from carom.comparator.measure.consistency import Consistency
from carom.comparator.measure.contact import ContactScore
from carom.comparator.measure.errors import Errors, ImpactError
from carom.comparator.measure.friction_branch import WrongBranches
from carom.comparator.measure.local_errors import LocalErrors
from carom.comparator.measure.measured_run import measure_run
from carom.comparator.measure.simultaneous_impacts import ConventionMatch
from carom.comparator.measure.stepwise_score import LocalScore
from carom.comparator.non_finite import find_non_finite
from carom.comparator.scales import Scales
from carom.comparator.thresholds import THRESHOLDS
from carom.comparator.trace_checks import require_possible_trace
from carom.comparator.verdict import Finding, Verdict
from carom.comparator.verdicts.derive_verdicts import derive_verdicts
from carom.errors import InputError
from carom.model.trace import Trace
from carom.support.checks import check_instance
from carom.support.display import Shown


@dataclass(frozen=True, repr=False)
class Score(Shown):
    """Result of comparing an observed trace with the reference.

    Attributes:
        expected: Number of impacts in the reference, up to the horizon.
        errors: One entry per matched impact.
        missed: Indices of missed reference impacts.
        spurious: Indices of observed impacts that the reference does not have.
        undecided: Indices of reference impacts that are so close to the end of the run that they may not have been
            reported yet.
        total: The largest error of each kind against the reference.
        sampling: The largest errors of PIT with the same step size against the reference. These errors are
            the cost of sampling at this phase. None without PIT.
        against_pit: Errors of the observed trace against that PIT run. None without PIT.
        pit_missed: Indices of reference impacts that PIT misses; None without PIT.
        price_paid: The run's largest velocity error, divided by PIT's largest velocity error over the phases of the
            step. If the ratio of the spin errors is larger, that ratio is used. The error of a missed impact is
            the whole change that the impact causes. The value is 0 for an exact run, 1 for a run as inaccurate as PIT,
            and above 1 for a worse run. If sampling changes no velocity or spin, and the run's velocities and spins are
            right, times are compared instead. In this case, the run's largest time error is divided by PIT's largest
            time error, or by one step if one step is longer. NaN without PIT, without an impact, or if the scene has no
            unique answer. Infinite if the run has an error and PIT has none, if a number of the run is not finite, or
            if the run ended before its last impact.
        findings: At least one verdict, each with its reason.
        grade: The grade.
        float_bits: Width of the floats that the method declares. *Exact* means exact to their rounding.
        scales: The scales that errors are divided by.
        equals_pit: Whether the run finds the same impacts as PIT, and differs from PIT only by rounding.
        edits: Edit distance of the two sequences of impacts.
        beyond_horizon: Number of the reference's impacts beyond the horizon, which were not compared.
        horizon_s: The horizon, seconds: when the reference stops being reliable, or when a disc first starts to rest,
            slide or roll, whichever is earlier. None if the whole run is compared.
        local: Errors of each impact against the analytic answer from the trace's own state before that impact.
        convention: The admissible outcome that the trace took if the scene has no unique answer; otherwise None.
        consistency: Contradictions between the trace's own impacts and states; None if one of its numbers is NaN or
            infinite.
        branches: The impacts in which bodies stuck instead of sliding, or slid instead of sticking.
        local_truth: Each step compared with PIC from the run's own state, to the end of the run; None if states were
            not checked.
        parted_s: Time at which the trajectory diverged from the reference's. None if it did not diverge, or if a step
            missed or invented an impact before.
        pit_parted_s: The same time for PIT; None if PIT did not diverge or was not given.
        contact: Score of the time in which discs slide, roll or rest. None if there is no such time, or if states were
            not kept.
        lucky_phase: Number of phases of the step at which PIT is as accurate as the run, and number of phases that were
            tried. None unless the run is exact or close, has PIT's impacts, and PIT is less accurate at some phases.

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
    branches: WrongBranches
    local_truth: LocalScore | None
    parted_s: float | None
    pit_parted_s: float | None
    lucky_phase: tuple[int, int] | None
    contact: ContactScore | None

    @property
    def own_velocity(self) -> float | None:
        """The velocity error that sampling does not explain: the smaller of the errors against PIT and the reference.

        A method that is better than PIT differs from PIT, but this difference is no error.
        """
        if self.against_pit is None:
            return None
        pit_difference, total = self.against_pit.velocity, self.total.velocity
        return total if math.isnan(pit_difference) else min(total, pit_difference)  # NaN if PIT has no matched impact

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """The verdicts, without their reasons."""
        return tuple(finding.verdict for finding in self.findings)

    # Aliases of the errors in `total`, for version 0.1.
    time_error_s = property(attrgetter("total.time_s"))
    velocity_error = property(attrgetter("total.velocity"))
    direction_error_rad = property(attrgetter("total.direction_rad"))
    final_position_error = property(attrgetter("total.final_position"))
    final_velocity_error = property(attrgetter("total.final_velocity"))
    energy_error = property(attrgetter("total.energy"))
    momentum_error = property(attrgetter("total.momentum"))


def compare(reference: Trace, observed: Trace, *, sampling: Trace | None = None, horizon: float | None = None) -> Score:
    """Score an observed trace against a reference of the same scene.

    Args:
        reference: The reference, usually from `carom.solve_pic`.
        observed: The trace to score.
        sampling: The trace of PIT with the same step size. With this trace, the cost of sampling is separated from
            other errors.
        horizon: The part of the reference that is reliable: a number of impacts (an int) or a time in seconds (a
            float). Later steps are only compared stepwise, from the trace's own states. None for the whole run.

    Raises:
        InputError: The traces are of different scenes, a trace is impossible in its scene (see
            `require_possible_trace`), `sampling` has another step than the observed trace, the horizon is
            negative, or the reference contains NaN or an infinity.

    Examples:
        >>> reference = carom.solve_pic("paper/missed")
        >>> score = carom.compare(reference, carom.solve_pit(reference.scene))
        >>> score.missed  # the numbers of the impacts
        (0,)
    """
    return Scorer(reference, sampling, horizon).score(observed)


class Scorer:
    """Scores many runs against one reference, and PIT with one step size. The arguments are those of `compare`."""

    def __init__(self, reference: Trace, sampling: Trace | None, horizon: float | None) -> None:
        check_instance("reference", reference, Trace)
        if sampling is not None:
            check_instance("sampling", sampling, Trace)
            _require_scene(reference, "sampling", sampling)
            require_possible_trace(sampling)
        require_possible_trace(reference)
        if non_finite := find_non_finite(reference):
            raise InputError(f"{non_finite} in the reference: a reference must have finite numbers only")
        self._pit_s = sampling.dt_s if sampling else 0.0
        self._horizon = horizon
        self._baseline = Baseline(reference, None if sampling is None or find_non_finite(sampling) else sampling)

    def score(self, observed: Trace) -> Score:
        """Score an observed trace."""
        check_instance("observed", observed, Trace)
        reference, step_s, pit_s = self._baseline.reference, observed.dt_s, self._pit_s
        _require_scene(reference, "the observed trace", observed)
        require_possible_trace(observed)
        if 0.0 < step_s < math.inf and pit_s and abs(step_s - pit_s) > THRESHOLDS.rounding * pit_s:
            raise InputError(
                f"the step size of the observed trace is {step_s:g} s, but that of sampling is {pit_s:g} s: run PIT "
                "with the step size of the observed trace"
            )
        # NaN and infinities have a verdict. NumPy's warnings would only repeat that verdict.
        with np.errstate(all="ignore"):
            return _build_score(_run_stages(self._baseline, observed, self._horizon))


def _require_scene(reference: Trace, what: str, trace: Trace) -> None:
    """Raise an error if a trace is of another scene than the reference."""
    if trace.scene != reference.scene:
        message = f"the reference is of scene {reference.scene.name!r}, {what} of {trace.scene.name!r}"
        raise InputError(f"{message} or of another version of it: only traces of one scene can be compared")


def _build_score(graded: GradedRun) -> Score:
    return Score(
        expected=graded.compared.impacts,
        errors=graded.measured.errors,
        missed=graded.alignment.missed,
        spurious=graded.alignment.spurious,
        undecided=graded.alignment.undecided,
        total=graded.measured.largest,
        sampling=None if graded.sampling is None else graded.sampling.largest,
        against_pit=None if graded.measured_against_pit is None else graded.measured_against_pit.largest,
        pit_missed=None if graded.pit_alignment is None else graded.pit_alignment.missed,
        price_paid=graded.price_paid,
        findings=graded.findings,
        grade=graded.grade,
        float_bits=graded.observed.float_bits,
        scales=graded.scales,
        equals_pit=graded.equals_pit,
        edits=graded.edits,
        beyond_horizon=len(graded.reference.impacts) - graded.compared.impacts,
        horizon_s=None if graded.compared.is_whole_run else graded.compared.until_s,
        local=graded.local,
        convention=graded.convention,
        consistency=graded.consistency,
        branches=graded.branches,
        local_truth=graded.local_truth,
        parted_s=graded.parted_s if graded.has_diverged_before_miss else None,
        pit_parted_s=graded.pit_parted_s,
        lucky_phase=graded.lucky_phase,
        contact=graded.contact,
    )


def _run_stages(baseline: Baseline, observed: Trace, horizon: float | None) -> GradedRun:
    """Run the five stages of a comparison. Each stage extends the result of the previous one."""
    compared = find_range(baseline, observed, horizon)
    aligned = align_impacts(compared)
    measured = measure_run(aligned)
    grade_before_tie = None
    if compared.before_tie_s is not None:  # a fault before the tie counts, so that part is graded alone
        grade_before_tie = _run_stages(baseline.unique, observed, compared.before_tie_s).trajectory_grade
    judged = derive_verdicts(measured, grade_before_tie)
    return grade_run(judged)
