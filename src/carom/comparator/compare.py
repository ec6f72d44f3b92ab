"""Scoring one trace against another: align, measure, judge."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from carom.comparator.measure import measure, scales_of
from carom.comparator.score import Finding, Score, Verdict
from carom.comparator.verdict import findings, grade
from carom.errors import InputError
from carom.trace import Outcome, Trace

__all__ = ["compare"]


def compare(
    reference: Trace, observed: Trace, *, sampling: Trace | None = None, horizon_s: float | None = None
) -> Score:
    """Score an observed trace against a reference of the same scene.

    Args:
        reference: The truth, as a rule from `carom.solve_pic`.
        observed: What is scored.
        sampling: PIT at the same step, where it is to be told what sampling alone costs.
        horizon_s: Time up to which the reference may be believed, as `carom.horizon` finds it; None for all of it. What
            comes later is not scored, and the score says so.

    Raises:
        InputError: The traces are of different scenes, or the horizon is not a time.
    """
    scene = reference.scene
    if observed.scene != scene:
        message = f"the reference is of scene {scene.name!r}, the observed trace of {observed.scene.name!r}"
        raise InputError(f"{message}, or of another version of it: only traces of one scene can be compared")
    scales = scales_of(scene, reference)
    if horizon_s is not None and not horizon_s >= 0:
        raise InputError(f"horizon_s must be 0 or more, got {horizon_s}")
    measured = measure(reference, observed, scales, horizon_s)
    sampled = None if sampling is None else measure(reference, sampling, scales, horizon_s)
    believed = _believed(reference, horizon_s)
    beyond = () if believed is reference else (_beyond(believed, reference, horizon_s),)
    return Score(
        expected=len(believed.impacts),
        errors=measured.errors,
        missed=measured.alignment.missed,
        spurious=measured.alignment.spurious,
        undecided=measured.alignment.undecided,
        time_error_s=measured.worst_time_s,
        velocity_error=measured.worst_velocity,
        direction_error_rad=measured.worst_direction_rad,
        final_position_error=measured.final_position_error,
        final_velocity_error=measured.final_velocity_error,
        energy_error=measured.energy_error,
        momentum_error=measured.momentum_error,
        sampling_velocity_error=math.nan if sampled is None else sampled.worst_velocity,
        sampling_missed=None if sampled is None else len(sampled.alignment.missed),
        findings=(*findings(believed, observed, measured, sampled, scales), *beyond),
        grade=grade(believed, observed, measured, sampled, scales),
        scales=scales,
        horizon_s=None if believed is reference else horizon_s,
    )


def _believed(reference: Trace, horizon_s: float | None) -> Trace:
    """Return the reference up to the horizon; itself where that covers all of it."""
    if horizon_s is None or horizon_s >= reference.scene.duration_s:
        return reference
    count = int(np.searchsorted(reference.impacts["time_s"], horizon_s, side="right"))
    ambiguous = tuple(k for k in reference.ambiguous if k < count)
    # A reference that ends where a disc comes to rest is whole up to there, and asks of nobody to end too.
    outcome = Outcome.COMPLETED if reference.outcome is Outcome.AT_REST else reference.outcome
    return replace(reference, impacts=reference.impacts[:count], ambiguous=ambiguous, outcome=outcome)


def _beyond(believed: Trace, reference: Trace, horizon_s: float | None) -> Finding:
    kept = f"the first {len(believed.impacts)} of {len(reference.impacts)} impacts are"
    return Finding(Verdict.BEYOND_HORIZON, f"the reference may be believed to {horizon_s:.6g} s: {kept} scored")
