"""Comparison of an observed trace with a reference: range, alignment, errors, verdicts, grade."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np

from carom.comparator.align import ComparisonRange
from carom.comparator.consistency import Consistency, measure_consistency
from carom.comparator.contact import ContactScore, drop_contact_starts, score_contact
from carom.comparator.evidence import Evidence
from carom.comparator.findings import add_phase_dependence, derive_findings
from carom.comparator.finite import find_non_finite
from carom.comparator.friction_branch import WrongBranches, find_wrong_branches
from carom.comparator.grade import grade_run, grade_trajectory, has_pit_results
from carom.comparator.grades import Grade
from carom.comparator.horizon import clip_before_tie, comparison_range
from carom.comparator.local import LocalErrors, measure_local_errors
from carom.comparator.measure import Errors, ImpactError, measure
from carom.comparator.order import compare_order
from carom.comparator.sampling import measure_impact_errors, measure_sampling_cost
from carom.comparator.scales import Scales, compute_scales, largest
from carom.comparator.simultaneous_impacts import ConventionMatch, match_outcome
from carom.comparator.step_findings import has_diverged_before_miss
from carom.comparator.stepwise.reports import compare_reports_with_states, find_shown_by_states
from carom.comparator.stepwise.score import LocalScore, score_steps
from carom.comparator.thresholds import THRESHOLDS
from carom.comparator.validate_trace import require_sound
from carom.comparator.verdict import Finding, Verdict
from carom.comparator.zeno import clip_before_rest
from carom.errors import InputError
from carom.model.trace import Outcome, Trace
from carom.support.display import Shown


@dataclass(frozen=True, repr=False)
class Score(Shown):
    """How an observed trace compares with the reference.

    Attributes:
        expected: Number of impacts in the reference, up to the horizon.
        errors: One entry per matched impact.
        missed: Indices of missed reference impacts.
        spurious: Indices of observed impacts that the reference does not have.
        undecided: Indices of reference impacts too close to the end of the run to have been reported.
        total: The largest errors against the reference, kind by kind.
        sampling: The same errors of PIT at the same step: what sampling costs at this phase. None where PIT was not
            given.
        against_pit: The same errors of the observed trace against that PIT. None where PIT was not given.
        pit_missed: Indices of reference impacts that PIT misses; None where it was not given.
        price_paid: The largest velocity error over PIT's at worst over the phases of the same step, or the largest spin
            error over PIT's where that is larger. The error of a missed impact is all that it changes. 1: the run has
            the whole cost of sampling; 0: none of it; above 1: it is worse than sampling. Where sampling changes no
            velocity or spin and they are right, times are compared: the largest error of a time over PIT's at
            worst, or over a step where that is longer. NaN where PIT was not given, there is no impact, or the scene
            has no unique answer. Infinite where sampling costs nothing, a number of the run is not finite, or it
            ended early with impacts still to come.
        findings: Verdicts, each with its reason; at least one.
        grade: The grade.
        float_bits: Width of the floats that the method declares; *exact* means to their rounding.
        scales: The scales by which errors were divided.
        equals_pit: Whether it finds the same impacts as PIT, with all errors against PIT within rounding.
        edits: Edit distance of the two sequences of impacts.
        beyond_horizon: Number of the reference's impacts beyond the horizon, which were not compared.
        horizon_s: The horizon, seconds: where the reference stops being reliable, or where a disc starts to rest, slide
            or roll if that is earlier. None where the whole run is compared.
        local: Each impact against the analytic answer from the trace's own state before it.
        convention: The admissible outcome that the trace took, where the scene has no unique answer.
        consistency: How far the trace deviates from what its own impacts and states imply; None where one of its
            numbers is NaN or infinite.
        branches: The impacts that took the wrong branch of friction.
        local_truth: Each of its steps against PIC from its own state, to the end of the run; None where its states
            were not checked.
        parted_s: Time at which its trajectory left the reference's, if that was before it passed through anything; else
            None.
        pit_parted_s: The same time of PIT; None where PIT did not leave it, or was not given.
        contact: Score of the time in which discs slide, roll and rest; None where none does, or states were not kept.
        lucky_phase: Number of phases of the step at which PIT is as right, and the number of all phases. Only where
            the run has PIT's impacts, is exact or close, and PIT is not as right at every phase; else None.
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
        """The velocity error that sampling does not explain: against PIT, or against the reference where that is less.

        A method that is better than PIT is far from PIT because it is right; that distance is not its own error.
        """
        if self.against_pit is None:
            return None
        pit_difference, total = self.against_pit.velocity, self.total.velocity
        return total if math.isnan(pit_difference) else min(total, pit_difference)  # PIT may miss what this run finds

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """The verdicts without their reasons."""
        return tuple(finding.verdict for finding in self.findings)

    # Errors of `total` under the names of version 0.1.
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
        sampling: PIT at the same step, to separate the cost of sampling from other errors.
        horizon: Up to where the reference is reliable: a number of impacts (an int) or a time in seconds (a float).
            Beyond it, steps are compared from the trace's own states only. None for the whole run.

    Raises:
        InputError: The traces are of different scenes, one of them can't be of its scene (see
            `validate_trace.require_sound`), `sampling` has another step than the observed trace, the horizon is
            negative, or the reference has a number that is NaN or infinite.
    """
    scene = reference.scene
    for what, trace in {"the observed trace": observed, "sampling": sampling}.items():
        if trace is not None and trace.scene != scene:
            message = f"the reference is of scene {scene.name!r}, {what} of {trace.scene.name!r}"
            raise InputError(f"{message}, or of another version of it: only traces of one scene can be compared")
    for trace in (reference, observed, sampling):
        if trace is not None:
            require_sound(trace)
    step_s, pit_s = observed.dt_s, sampling.dt_s if sampling else 0.0
    if 0.0 < step_s < math.inf and pit_s and abs(step_s - pit_s) > THRESHOLDS.rounding * pit_s:
        raise InputError(
            f"the observed trace has a step of {step_s:g} s, sampling one of {pit_s:g} s: a run is compared with PIT "
            "at its own step; run PIT at that"
        )
    if non_finite := find_non_finite(reference):
        raise InputError(f"{non_finite} in the reference: nothing can be compared with what is no number")
    if sampling is not None and find_non_finite(sampling):
        sampling = None
    # NaN and infinities are reported by name; NumPy's warnings about them would repeat that.
    with np.errstate(all="ignore"):
        return _score(reference, observed, sampling, horizon)


def _score(reference: Trace, observed: Trace, sampling: Trace | None, horizon: float | None) -> Score:
    scales, given = compute_scales(reference.scene, reference), comparison_range(reference, horizon)
    compared, tie = clip_before_rest(reference, given, observed.dt_s, sampling), clip_before_tie(reference)
    grade_before_tie = None
    if tie is not None and tie.until_s < compared.until_s:
        # A fault before a tie is certain, whatever follows the tie.
        unique = replace(reference, ambiguous=())
        grade_before_tie = grade_trajectory(_collect_evidence(unique, observed, sampling, scales, tie, None))
    evidence = _collect_evidence(reference, observed, sampling, scales, compared, grade_before_tie)
    found = derive_findings(evidence)
    graded, like_pit = grade_run(evidence), has_pit_results(evidence)
    lucky, cost = None, evidence.sampling_cost
    if like_pit and graded in {Grade.EXACT, Grade.CLOSE} and cost is not None and cost.close_phases < cost.phases:
        lucky = (cost.close_phases, cost.phases)
        found = add_phase_dependence(found, *lucky)
    measured, sampled, against_pit = evidence.measured, evidence.sampling, evidence.against_pit
    return Score(
        expected=compared.impacts,
        errors=measured.errors,
        missed=measured.alignment.missed,
        spurious=measured.alignment.spurious,
        undecided=measured.alignment.undecided,
        total=measured.largest,
        sampling=None if sampled is None else sampled.largest,
        against_pit=None if against_pit is None else against_pit.largest,
        pit_missed=None if sampled is None else sampled.alignment.missed,
        price_paid=_compute_price_paid(evidence),
        findings=found,
        grade=graded,
        float_bits=observed.float_bits,
        scales=scales,
        equals_pit=like_pit,
        edits=evidence.order.edits,
        beyond_horizon=len(reference.impacts) - compared.impacts,
        horizon_s=None if compared.is_whole_run else compared.until_s,
        local=evidence.local,
        convention=evidence.convention,
        consistency=evidence.consistency,
        branches=evidence.branches,
        local_truth=evidence.local_truth,
        parted_s=evidence.parted_s if has_diverged_before_miss(evidence) else None,
        pit_parted_s=evidence.pit_parted_s,
        lucky_phase=lucky,
        contact=evidence.contact,
    )


def _with_turns_up_to(trace: Trace, until_s: float) -> Trace:
    """Return the trace without the effective times of impacts later than a time."""
    turned_s = trace.impacts["time_s"] if trace.effective_time_s is None else trace.effective_time_s
    return replace(trace, effective_time_s=np.where(trace.impacts["time_s"] > until_s, math.nan, turned_s))


def _collect_evidence(
    reference: Trace,
    observed: Trace,
    sampling: Trace | None,
    scales: Scales,
    compared: ComparisonRange,
    grade_before_tie: Grade | None,
) -> Evidence:
    """Measure everything that verdicts and the grade are derived from, within a range."""
    measured = measure(reference, observed, scales, compared)
    sampled = against_pit = cost = None
    if sampling is not None:
        sampled = measure(reference, sampling, scales, compared)
        against_pit = measure(sampling, observed, scales, comparison_range(sampling, compared.until_s))
        cost = measure_sampling_cost(reference, sampling, sampled, scales, compared, measured, observed.float_bits)
    non_finite, truth, possible = find_non_finite(observed), observed.local_truth, observed
    if reference.outcome is Outcome.CRUSHED:  # after that no state is possible
        truth = None if truth is None else truth.before(compared.until_s)
        possible = _with_turns_up_to(observed, reference.end_time_s)
    if truth is not None and (missed := measured.alignment.missed):
        shown = find_shown_by_states(reference, missed, truth, observed.dt_s)
        still_missed = tuple(number for number in missed if number not in shown)
        measured = replace(measured, alignment=replace(measured.alignment, missed=still_missed))
    if measured.alignment.spurious and reference.modes is not None:
        spurious = drop_contact_starts(reference, observed, measured.alignment.spurious)
        measured = replace(measured, alignment=replace(measured.alignment, spurious=spurious))
    return Evidence(
        reference=reference,
        observed=observed,
        scales=scales,
        compared=compared,
        measured=measured,
        sampling=sampled,
        against_pit=against_pit,
        sampling_cost=cost,
        order=compare_order(reference, observed, measured.alignment),
        local=measure_local_errors(observed, scales),
        convention=match_outcome(reference, observed, sampling, scales),
        consistency=None if non_finite else measure_consistency(possible, scales, reference.contact_s),
        contact=None if non_finite else score_contact(reference, observed, scales),
        branches=find_wrong_branches(observed, scales, THRESHOLDS.rounding_of(observed.float_bits)),
        non_finite=non_finite,
        local_truth=None if truth is None else score_steps(truth, scales, observed.float_bits, compared.until_s),
        reports=None if truth is None else compare_reports_with_states(observed, truth, compared.until_s),
        pit_s=None if sampling is None else sampling.impacts["time_s"],
        grade_before_tie=grade_before_tie,
    )


def _compute_price_paid(evidence: Evidence) -> float:
    """Return the run's largest error over that of sampling; see `Score.price_paid`."""
    cost = evidence.sampling_cost
    if cost is None or evidence.convention is not None:
        return math.nan
    if evidence.non_finite:
        return math.inf
    if not evidence.compared.impacts:
        return math.nan
    if evidence.has_other_ending and evidence.measured.alignment.undecided:
        return math.inf
    impact_errors = measure_impact_errors(
        evidence.reference, evidence.measured, evidence.scales, evidence.compared.impacts
    )
    ratios = []
    for errors, costs in zip(impact_errors, (cost.velocity, cost.spin), strict=True):
        largest_error, largest_cost = float(np.max(errors)), float(costs[-1])
        if largest_error <= evidence.rounding:
            ratios.append(0.0)  # also 0 over 0
        else:  # an error is infinitely worse where sampling costs nothing
            ratios.append(largest_error / largest_cost if largest_cost > THRESHOLDS.rounding else math.inf)
    step_s = evidence.observed.dt_s or cost.dt_s
    is_free = max(float(cost.velocity[-1]), float(cost.spin[-1])) <= THRESHOLDS.rounding
    if is_free and max(ratios) == 0.0 and step_s:
        # Late detection changes no velocity here, only times. PIT is late by up to a step per impact, and the lateness
        # of earlier impacts adds up.
        late_s = largest((error.time_s for error in evidence.measured.errors), default=0.0)
        return 0.0 if abs(late_s) <= evidence.rounding_s else abs(late_s) / max(step_s, cost.late_s)
    return max(ratios)
