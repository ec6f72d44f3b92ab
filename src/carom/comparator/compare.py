"""Comparison of a run with a reference trace in five stages."""

from __future__ import annotations

import math

import numpy as np

from carom.comparator.align_impacts import align_impacts
from carom.comparator.comparison_range import Baseline, ComparedRun, find_range
from carom.comparator.grade_run import grade_run, grade_trajectory
from carom.comparator.grades import Grade
from carom.comparator.measure.measured_run import measure_run
from carom.comparator.non_finite import find_non_finite
from carom.comparator.score import Score
from carom.comparator.thresholds import THRESHOLDS
from carom.comparator.trace_checks import require_possible_trace
from carom.comparator.verdicts.derive_verdicts import derive_verdicts
from carom.errors import InputError
from carom.model.trace import Trace
from carom.support.checks import check_instance


def compare(reference: Trace, observed: Trace, *, sampling: Trace | None = None, horizon: float | None = None) -> Score:
    """Compare a run's trace with a reference trace of the same scene, and return a score.

    Args:
        reference: The trace to compare with, usually from `carom.solve_pic`.
        observed: The trace to score.
        sampling: The trace of PIT with the same step size. With this trace, the score separates the errors of checking
            once per step from other errors.
        horizon: The part of the reference that is reliable: a number of impacts (an int) or a time in seconds (a
            float). After this part, each step is compared with a PIC run that starts from the observed trace's state
            before the step. None if the whole reference is reliable.

    Raises:
        InputError: The traces are of different scenes. A trace is impossible in its scene (see
            `require_possible_trace`). The step size of `sampling` is not that of the observed trace. The horizon is
            negative. The reference contains NaN or an infinity.

    Examples:
        >>> reference = carom.solve_pic("paper/missed")
        >>> score = carom.compare(reference, carom.solve_pit(reference.scene))
        >>> score.missed  # the numbers of the impacts
        (0,)
    """
    return Scorer(reference, sampling, horizon).score(observed)


class Scorer:
    """Compares many runs with one reference and one PIT run. The constructor's arguments are those of `compare`."""

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
                f"the step size of the observed trace is {step_s:g} s, but that of `sampling` is {pit_s:g} s: run PIT "
                "with the step size of the observed trace"
            )
        # NumPy's warnings are not needed, because a verdict reports NaN and infinite numbers.
        with np.errstate(all="ignore"):
            return _run_stages(self._baseline, observed, self._horizon)


def _require_scene(reference: Trace, trace_name: str, trace: Trace) -> None:
    if trace.scene != reference.scene:
        message = (
            f"the reference is of scene {reference.scene.name!r}, but {trace_name} is of scene {trace.scene.name!r}"
        )
        raise InputError(f"{message} (perhaps in another version): only traces of one scene can be compared")


def _run_stages(baseline: Baseline, observed: Trace, horizon: float | None) -> Score:
    compared = find_range(baseline, observed, horizon)
    aligned = align_impacts(compared)
    measured = measure_run(aligned)
    judged = derive_verdicts(measured, _grade_before_tie(compared))
    return grade_run(judged)


def _grade_before_tie(compared: ComparedRun) -> Grade | None:
    """Grade the part of the run before the first simultaneous impacts that have no unique result."""
    if compared.before_tie_s is None:
        return None
    before = find_range(compared.baseline.unique, compared.observed, compared.before_tie_s)
    return grade_trajectory(derive_verdicts(measure_run(align_impacts(before)), None))
