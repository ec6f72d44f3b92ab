"""Comparison of a run with a reference trace in five stages."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from carom.comparator.align_impacts import align_impacts
from carom.comparator.comparison_range import Baseline, ComparedRun, find_range
from carom.comparator.grade_run import grade_run, grade_trajectory
from carom.comparator.grades import Grade
from carom.comparator.measure.measured_run import measure_run
from carom.comparator.non_finite import find_non_finite
from carom.comparator.score import Score
from carom.comparator.thresholds import THRESHOLDS
from carom.comparator.verdicts.derive_verdicts import derive_verdicts
from carom.engines.api.checks import MANTISSA_BITS
from carom.errors import InputError
from carom.model.trace import Trace, body_name, wall_body, wall_index
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
        names = f"of scene {reference.scene.name!r}, but {trace_name} is of scene {trace.scene.name!r}"
        hint = "(perhaps in another version): only traces of one scene can be compared"
        raise InputError(f"the reference is {names} {hint}")


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


def require_possible_trace(trace: Trace) -> None:
    """Raise an error for a trace that is impossible in its scene. Inaccurate traces are accepted.

    Raises:
        InputError: The trace's `float_bits` is neither 32 nor 64. An impact has a body that the scene does not have. A
            wall turns, or moves in another way than in the scene. Spins are missing although discs turn. The run
            continues after the scene's end.
    """
    scene, impacts, spins = trace.scene, trace.impacts, trace.spins
    source = f"the trace of {trace.method!r} of scene {scene.name!r}"
    if trace.float_bits not in MANTISSA_BITS:
        raise InputError(
            f"float_bits of {source} is {trace.float_bits}, but must be one of {sorted(MANTISSA_BITS)}; declare 32 "
            "for narrower floats"
        )
    for side, lowest in (("first", 0), ("second", wall_body(len(scene.walls) - 1) if scene.walls else 0)):
        body = impacts[side]
        for k in np.flatnonzero((body < lowest) | (body >= len(scene.discs)))[:1].tolist():
            number = int(body[k])
            raise InputError(
                f"{side} of impact {k} of {source} is {body_name(number)} ({number}): the number of discs is "
                f"{len(scene.discs)} (numbered from 0 up), the number of walls is {len(scene.walls)} (numbered from "
                f"{wall_body(0)} down), and only the second body can be a wall"
            )
    if scene.arrays.turns and (spins is None or trace.final_spin_rad_s is None):
        raise InputError(f"{source} has no spins, but discs turn in the scene: use a method that declares spin")
    if (impacts["second"] < 0).any():
        _require_wall_motion(trace, source)
    if math.isfinite(trace.end_time_s) and trace.end_time_s > scene.duration_s * (1.0 + THRESHOLDS.rounding):
        raise InputError(
            f"{source} ends at {trace.end_time_s:g} s, but the scene ends at {scene.duration_s:g} s: a trace must end "
            "with the state at the scene's end"
        )


def _require_wall_motion(trace: Trace, source: str) -> None:
    impacts, spins = trace.impacts, trace.spins
    checks = [(name, impacts[name], expected) for name, expected in _expected_wall_velocities(trace).items()]
    if spins is not None:
        no_spin = np.zeros((len(impacts), 1))
        checks += [(f"spin {name}", spins[name][:, None], no_spin) for name in ("second_before", "second_after")]
    for name, rows, wall_velocity in checks:
        rounding = 2.0 ** -(MANTISSA_BITS[trace.float_bits] // 2) * np.abs(wall_velocity)
        wrong = ((np.abs(rows - wall_velocity) > rounding) & np.isfinite(rows)).any(axis=1)
        for k in np.flatnonzero((impacts["second"] < 0) & wrong)[:1].tolist():
            shown_numbers, due = (", ".join(f"{value:g}" for value in values) for values in (rows[k], wall_velocity[k]))
            at_rest = "in the scene, this wall has 0"
            does = f"in the scene, this driven wall has {due}" if wall_velocity[k].any() else at_rest
            raise InputError(
                f"{name} of impact {k} of {source} is {shown_numbers}, but its second body is "
                f"{body_name(int(impacts['second'][k]))}: {does}"
            )


def _expected_wall_velocities(trace: Trace) -> dict[str, NDArray[np.float64]]:
    """Return the velocity that the scene gives the second body of each impact, by field name; 0 for a disc.

    If a wall's velocity changes within the step of the impact, the velocity that is nearest to the reported one is
    returned.
    """
    start, impacts = trace.scene.arrays, trace.impacts
    due = {name: np.zeros((len(impacts), 2)) for name in ("velocity_second_before", "velocity_second_after")}
    for k in np.flatnonzero((impacts["second"] < 0) & (start.wall_drives is not None)).tolist():
        drive = start.drive_of_wall(wall_index(int(impacts["second"][k])))
        time_s = max(float(impacts["time_s"][k]), 0.0)  # a verdict reports negative times
        span = (time_s - (trace.dt_s or 0.0)) * (1.0 - 2.0**-40), time_s * (1.0 + 2.0**-40)
        legs = drive.velocities_within(*span) if math.isfinite(time_s) else [drive.velocity_at(0.0)]
        for name, velocities in due.items():
            reported = impacts[name][k].tolist()
            is_finite = all(map(math.isfinite, reported))
            velocities[k] = min(legs, key=lambda leg: math.dist(leg, reported)) if is_finite else reported
    return due
