"""Scoring one trace against another: align, measure, judge."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np

from carom.comparator.align import Reach
from carom.comparator.consistency import Consistency, consistency_of
from carom.comparator.contact import ContactScore, contact_score, without_contacts
from carom.comparator.evidence import Evidence
from carom.comparator.findings import findings, lucky_phase
from carom.comparator.finite import not_finite
from carom.comparator.friction_branch import WrongBranches, wrong_branches
from carom.comparator.grade import equals_pit, grade, grade_of_trajectory
from carom.comparator.grades import Grade
from carom.comparator.horizon import before_tie, reach_of
from carom.comparator.local import LocalErrors, local_errors
from carom.comparator.measure import Errors, ImpactError, measure
from carom.comparator.order import order_of
from carom.comparator.sampling import paid_of, price_of_sampling
from carom.comparator.scales import Scales, largest, scales_of
from carom.comparator.simultaneous_impacts import ConventionMatch, match_outcome
from carom.comparator.step_findings import has_left
from carom.comparator.stepwise.reports import reports_and_states, shown_by_states
from carom.comparator.stepwise.score import LocalScore, local_score
from carom.comparator.thresholds import THRESHOLDS
from carom.comparator.validate_trace import require_sound
from carom.comparator.verdict import Finding, Verdict
from carom.comparator.zeno import before_rest
from carom.errors import InputError
from carom.model.trace import Outcome, Trace
from carom.support.display import Shown


@dataclass(frozen=True, repr=False)
class Score(Shown):
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
        pit_missed: Indices of reference impacts that PIT misses; None where it was not given.
        price_paid: The largest velocity error over PIT's at worst over the phases of the same step, or the largest spin
            error over PIT's where that is more; an impact that is missed is off by all that it changes. 1: the run pays
            the price of sampling; 0: none of it; above 1: it does worse than sampling does. Where sampling costs
            velocities and spins nothing and they are right, it costs time: the largest error of a time over
            PIT's at worst, or over a step where that is longer. NaN where PIT was not given, there is no impact, or
            the scene has no unique answer; infinite where sampling costs nothing, a number of the run is not finite,
            or it ended early with impacts still to come.
        findings: Verdicts, each with its reason; at least one.
        grade: The grade.
        float_bits: Width of the floats that the method declares, to whose rounding *exact* is meant.
        scales: What errors were divided by.
        equals_pit: Whether it finds the very impacts that PIT finds, with all errors against PIT within rounding.
        edits: Edit distance of the two sequences of impacts.
        beyond_horizon: How many of the reference's impacts lie beyond the horizon, and were not compared.
        horizon_s: The horizon, seconds: where the reference is no longer reliable, or where a disc comes to rest, to
            slide or to roll if that is earlier. None where the whole run is compared.
        local: Each impact against the analytic answer from the trace's own state before it.
        convention: Which of the admissible outcomes the trace took, where the scene has no unique answer.
        consistency: How far the trace is from what its own impacts and states lead to; None where one of its numbers is
            NaN or infinite.
        branches: Which of its impacts took the wrong branch of friction.
        local_truth: Each of its steps against PIC from its own state, to the end of the run; None where its states were
            not looked at.
        parted_s: When its trajectory left the reference's, if it did so before it passed through anything; else None.
        pit_parted_s: When PIT's did; None where it did not, or was not given.
        contact: How it does where discs slide, roll and rest; None where nothing does, or its states were not kept.
        lucky_phase: At how many phases of the step PIT is as right, and of how many, where the run has PIT's impacts
            and is called exact or close, and PIT is not so at all of them; else None.
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
        reference: The truth, as a rule from `carom.solve_pic`.
        observed: What is scored.
        sampling: PIT at the same step, where it is to be told what sampling alone costs.
        horizon: Up to where the reference is reliable: a number of impacts (an int) or a time in seconds (a float).
            What lies beyond is compared with the trace's own states only. None for the whole run.

    Raises:
        InputError: The traces are of different scenes, one of them can't be of its scene (see `sound.require_sound`),
            `sampling` has another step than the observed trace, the horizon is negative, or the reference has a number
            that is NaN or infinite.
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
    if broken := not_finite(reference):
        raise InputError(f"{broken} in the reference: nothing can be compared with what is no number")
    if sampling is not None and not_finite(sampling):
        sampling = None
    # What is no number makes more of its kind on every way; they are looked for by name, and not by warnings.
    with np.errstate(all="ignore"):
        return _score(reference, observed, sampling, horizon)


def _score(reference: Trace, observed: Trace, sampling: Trace | None, horizon: float | None) -> Score:
    scales, given = scales_of(reference.scene, reference), reach_of(reference, horizon)
    reach, tie = before_rest(reference, given, observed.dt_s, sampling), before_tie(reference)
    up_to_tie = None
    if tie is not None and tie.until_s < reach.until_s:
        # What is certain before a tie is so whatever follows it.
        unique = replace(reference, ambiguous=())
        up_to_tie = grade_of_trajectory(_evidence(unique, observed, sampling, scales, tie, None))
    evidence = _evidence(reference, observed, sampling, scales, reach, up_to_tie)
    found = findings(evidence)
    graded, like_pit = grade(evidence), equals_pit(evidence)
    lucky, price = None, evidence.price
    if like_pit and graded in {Grade.EXACT, Grade.CLOSE} and price is not None and price.as_close < price.phases:
        lucky = (price.as_close, price.phases)
        found = lucky_phase(found, *lucky)
    measured, sampled, against_pit = evidence.measured, evidence.sampling, evidence.against_pit
    return Score(
        expected=reach.impacts,
        errors=measured.errors,
        missed=measured.alignment.missed,
        spurious=measured.alignment.spurious,
        undecided=measured.alignment.undecided,
        total=measured.largest,
        sampling=None if sampled is None else sampled.largest,
        against_pit=None if against_pit is None else against_pit.largest,
        pit_missed=None if sampled is None else sampled.alignment.missed,
        price_paid=_price_paid(evidence),
        findings=found,
        grade=graded,
        float_bits=observed.float_bits,
        scales=scales,
        equals_pit=like_pit,
        edits=evidence.order.edits,
        beyond_horizon=len(reference.impacts) - reach.impacts,
        horizon_s=None if reach.whole else reach.until_s,
        local=evidence.local,
        convention=evidence.convention,
        consistency=evidence.consistency,
        branches=evidence.branches,
        local_truth=evidence.local_truth,
        parted_s=evidence.parted_s if has_left(evidence) else None,
        pit_parted_s=evidence.pit_parted_s,
        lucky_phase=lucky,
        contact=evidence.contact,
    )


def _with_turns_up_to(trace: Trace, until_s: float) -> Trace:
    """Return a trace of whose impacts nobody knows when those turned paths that are later than a time."""
    turned_s = trace.impacts["time_s"] if trace.effective_time_s is None else trace.effective_time_s
    return replace(trace, effective_time_s=np.where(trace.impacts["time_s"] > until_s, math.nan, turned_s))


def _evidence(
    reference: Trace, observed: Trace, sampling: Trace | None, scales: Scales, reach: Reach, up_to_tie: Grade | None
) -> Evidence:
    """Return all that a verdict is derived from, within a reach."""
    measured = measure(reference, observed, scales, reach)
    sampled = against_pit = price = None
    if sampling is not None:
        sampled = measure(reference, sampling, scales, reach)
        against_pit = measure(sampling, observed, scales, reach_of(sampling, reach.until_s))
        price = price_of_sampling(reference, sampling, sampled, scales, reach, measured, observed.float_bits)
    broken, truth, possible = not_finite(observed), observed.local_truth, observed
    if reference.outcome is Outcome.CRUSHED:  # from there on no state is possible
        truth = None if truth is None else truth.before(reach.until_s)
        possible = _with_turns_up_to(observed, reference.end_time_s)
    if truth is not None and (missed := measured.alignment.missed):
        shown = shown_by_states(reference, missed, truth, observed.dt_s)
        told = tuple(number for number in missed if number not in shown)
        measured = replace(measured, alignment=replace(measured.alignment, missed=told))
    if measured.alignment.spurious and reference.modes is not None:
        kept = without_contacts(reference, observed, measured.alignment.spurious)
        measured = replace(measured, alignment=replace(measured.alignment, spurious=kept))
    return Evidence(
        reference=reference,
        observed=observed,
        scales=scales,
        reach=reach,
        measured=measured,
        sampling=sampled,
        against_pit=against_pit,
        price=price,
        order=order_of(reference, observed, measured.alignment),
        local=local_errors(observed, scales),
        convention=match_outcome(reference, observed, sampling, scales),
        consistency=None if broken else consistency_of(possible, scales, reference.contact_s),
        contact=None if broken else contact_score(reference, observed, scales),
        branches=wrong_branches(observed, scales, THRESHOLDS.rounding_of(observed.float_bits)),
        broken=broken,
        local_truth=None if truth is None else local_score(truth, scales, observed.float_bits, reach.until_s),
        reports=None if truth is None else reports_and_states(observed, truth, reach.until_s),
        pit_s=None if sampling is None else sampling.impacts["time_s"],
        up_to_tie=up_to_tie,
    )


def _price_paid(evidence: Evidence) -> float:
    if evidence.price is None or evidence.convention is not None:
        return math.nan
    if evidence.broken:
        return math.inf
    if not evidence.reach.impacts:
        return math.nan
    if evidence.ended_otherwise and evidence.measured.alignment.undecided:
        return math.inf
    paid = paid_of(evidence.reference, evidence.measured, evidence.scales, evidence.reach.impacts)
    ratios = []
    for errors, costs in zip(paid, (evidence.price.velocity, evidence.price.spin), strict=True):
        most, worst = float(np.max(errors)), float(costs[-1])
        # 0 over 0 is 0, and an error where sampling costs none is infinitely worse.
        ratios.append(0.0 if most <= evidence.rounding else most / worst if worst > THRESHOLDS.rounding else math.inf)
    step_s = evidence.observed.dt_s or evidence.price.dt_s
    costs_nothing = max(float(evidence.price.velocity[-1]), float(evidence.price.spin[-1])) <= THRESHOLDS.rounding
    if costs_nothing and max(ratios) == 0.0 and step_s:
        # Velocities suffer nothing from looking late: time is what is paid. PIT pays a step of it an impact, and what
        # earlier ones hand on adds up to what it pays at worst.
        late_s = largest((error.time_s for error in evidence.measured.errors), default=0.0)
        return 0.0 if abs(late_s) <= evidence.rounding_s else abs(late_s) / max(step_s, evidence.price.late_s)
    return max(ratios)
