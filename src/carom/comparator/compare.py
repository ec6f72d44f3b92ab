"""Scoring one trace against another: align, measure, judge."""

from __future__ import annotations

import math

from carom.comparator.measure import measure, scales_of
from carom.comparator.score import Score
from carom.comparator.verdict import findings, grade
from carom.errors import InputError
from carom.trace import Trace

__all__ = ["compare"]


def compare(reference: Trace, observed: Trace, *, sampling: Trace | None = None) -> Score:
    """Score an observed trace against a reference of the same scene.

    Args:
        reference: The truth, as a rule from `carom.solve_pic`.
        observed: What is scored.
        sampling: PIT at the same step, where it is to be told what sampling alone costs.

    Raises:
        InputError: The traces are of different scenes.
    """
    scene = reference.scene
    if observed.scene != scene:
        message = f"the reference is of scene {scene.name!r}, the observed trace of {observed.scene.name!r}"
        raise InputError(f"{message}, or of another version of it: only traces of one scene can be compared")
    scales = scales_of(scene, reference)
    measured = measure(reference, observed, scales)
    sampled = None if sampling is None else measure(reference, sampling, scales)
    return Score(
        expected=len(reference.impacts),
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
        findings=findings(reference, observed, measured, sampled, scales),
        grade=grade(reference, observed, measured, sampled, scales),
        scales=scales,
    )
