"""Scoring one trace against another: align, measure, judge."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from carom.compare.align import align
from carom.compare.measure import impact_errors, momentum_error, scales_of
from carom.compare.score import ImpactError, Scales, Score
from carom.compare.verdict import findings, grade
from carom.errors import InputError
from carom.trace import Trace, kinetic_energy

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
    alignment = align(reference, observed)
    errors = impact_errors(reference, observed, alignment, scales)
    energy = _energy_error(reference, observed, scales)
    sampled = missed_by_sampling = None
    if sampling is not None:
        sampling_alignment = align(reference, sampling)
        sampled = impact_errors(reference, sampling, sampling_alignment, scales)
        missed_by_sampling = len(sampling_alignment.missed)
    return Score(
        expected=len(reference.impacts),
        errors=errors,
        missed=alignment.missed,
        spurious=alignment.spurious,
        undecided=alignment.undecided,
        time_error_s=max((error.time_s for error in errors), key=abs, default=math.nan),
        velocity_error=_largest(errors, "velocity"),
        direction_error_rad=_largest(errors, "direction_rad"),
        final_position_error=_largest_row(observed.final_position_m - reference.final_position_m) / scales.length_m,
        final_velocity_error=_largest_row(observed.final_velocity_m_s - reference.final_velocity_m_s)
        / scales.speed_m_s,
        energy_error=energy,
        momentum_error=momentum_error(scene, reference, observed, scales),
        sampling_velocity_error=math.nan if sampled is None else _largest(sampled, "velocity"),
        sampling_missed=missed_by_sampling,
        findings=findings(reference, observed, alignment, errors, energy, scales),
        grade=grade(reference, observed, alignment, errors, energy, scales, sampled),
        scales=scales,
    )


def _energy_error(reference: Trace, observed: Trace, scales: Scales) -> float:
    """Final kinetic energy less the reference's, over that at the start; where nothing moved, nothing can be lost."""
    if scales.energy_j == 0.0:
        return 0.0
    scene = reference.scene
    found = kinetic_energy(scene, observed.final_velocity_m_s)
    return (found - kinetic_energy(scene, reference.final_velocity_m_s)) / scales.energy_j


def _largest(errors: tuple[ImpactError, ...], name: str) -> float:
    return max((float(getattr(error, name)) for error in errors), default=math.nan)


def _largest_row(difference: NDArray[np.float64]) -> float:
    return float(np.max(np.hypot(*difference.T)))
