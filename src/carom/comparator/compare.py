"""Scoring one trace against another: align, measure, judge."""

from __future__ import annotations

import math

import numpy as np

from carom.comparator.believed import reach_of
from carom.comparator.consistency import consistency_of
from carom.comparator.convention import match_outcome
from carom.comparator.finite import not_finite
from carom.comparator.grade import equals_pit, grade
from carom.comparator.local import local_errors
from carom.comparator.measure import measure
from carom.comparator.order import order_of
from carom.comparator.sampling import paid_by, paid_of, price_of_sampling
from carom.comparator.scales import scales_of
from carom.comparator.score import Score
from carom.comparator.verdict import Evidence, findings
from carom.errors import InputError
from carom.scene import Need
from carom.trace import Outcome, Trace

__all__ = ["compare"]


def compare(reference: Trace, observed: Trace, *, sampling: Trace | None = None, horizon: float | None = None) -> Score:
    """Score an observed trace against a reference of the same scene.

    Args:
        reference: The truth, as a rule from `carom.solve_pic`.
        observed: What is scored.
        sampling: PIT at the same step, where it is to be told what sampling alone costs.
        horizon: Up to where the reference may be believed: a number of impacts (an int) or a time in seconds (a float).
            What lies beyond is held against the trace's own states only. None for the whole run.

    Raises:
        InputError: The traces are of different scenes, of one with friction or spin, the horizon is negative, or the
            reference has a number that is NaN or infinite.
    """
    scene = reference.scene
    if observed.scene != scene:
        message = f"the reference is of scene {scene.name!r}, the observed trace of {observed.scene.name!r}"
        raise InputError(f"{message}, or of another version of it: only traces of one scene can be compared")
    if turning := scene.needs & {Need.FRICTION, Need.SPIN}:
        what = " and ".join(sorted(need.value for need in turning))
        raise InputError(f"scene {scene.name!r} has {what}: it can be run, but traces of it are not scored yet")
    if broken := not_finite(reference):
        raise InputError(f"{broken} in the reference: nothing can be held against a number that is none")
    if sampling is not None and not_finite(sampling):
        sampling = None
    # What is no number makes more of its kind on every way; they are looked for by name, and not by warnings.
    with np.errstate(all="ignore"):
        return _score(reference, observed, sampling, horizon)


def _score(reference: Trace, observed: Trace, sampling: Trace | None, horizon: float | None) -> Score:
    scales = scales_of(reference.scene, reference)
    believed, until_s = reach = reach_of(reference, horizon)
    measured = measure(reference, observed, scales, reach)
    sampled = against_pit = price = None
    if sampling is not None:
        sampled = measure(reference, sampling, scales, reach)
        against_pit = measure(sampling, observed, scales, reach_of(sampling, until_s))
        price = price_of_sampling(reference, sampling, sampled, scales, reach)
    # Where a disc comes to rest the reference ends, and with it free flight.
    rest_s = reference.end_time_s if reference.outcome is Outcome.AT_REST else math.inf
    broken = not_finite(observed)
    evidence = Evidence(
        reference=reference,
        observed=observed,
        measured=measured,
        sampling=sampled,
        price=price,
        scales=scales,
        believed=believed,
        until_s=until_s,
        order=order_of(reference, observed, measured.alignment, believed, until_s),
        local=local_errors(observed, scales),
        convention=match_outcome(reference, observed, sampling, scales),
        consistency=None if broken else consistency_of(observed, scales, rest_s),
        broken=broken,
    )
    return Score(
        expected=believed,
        errors=measured.errors,
        missed=measured.alignment.missed,
        spurious=measured.alignment.spurious,
        undecided=measured.alignment.undecided,
        total=measured.largest,
        sampling=None if sampled is None else sampled.largest,
        against_pit=None if against_pit is None else against_pit.largest,
        pit_missed=None if sampled is None else len(sampled.alignment.missed),
        price_paid=_price_paid(evidence),
        findings=findings(evidence),
        grade=grade(evidence),
        float_bits=observed.float_bits,
        scales=scales,
        equals_pit=against_pit is not None and equals_pit(evidence, against_pit),
        edits=evidence.order.edits,
        beyond_horizon=len(reference.impacts) - believed,
        horizon_s=until_s if math.isfinite(until_s) else None,
        local=evidence.local,
        convention=evidence.convention,
        consistency=evidence.consistency,
    )


def _price_paid(evidence: Evidence) -> float:
    if evidence.price is None:
        return math.nan
    if evidence.broken:
        return math.inf
    paid = paid_of(evidence.reference, evidence.measured, evidence.scales, evidence.believed)
    return paid_by(paid, evidence.price, evidence.rounding)
