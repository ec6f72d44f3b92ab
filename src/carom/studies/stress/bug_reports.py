"""Check whether an engine still has a reported bug."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
from numpy.typing import ArrayLike

from carom.catalogue import BugReport, KnownAnswer, Symptom
from carom.catalogue.entry import compute_deepest_overlap
from carom.execution.job import Method, Status
from carom.execution.pool import TaskRunner
from carom.model.energy import kinetic_energy
from carom.model.scene import Chain, Ring, Scene, Wall
from carom.model.trace import Outcome, Trace
from carom.studies.stress.failure_search import observe
from carom.studies.stress.result import CellEnding, CellResult, UnsavedResult
from carom.support.formatting import format_count, format_number

#: Smallest deviation that a result mentions, relative to the scene's greatest speed or energy. Users notice a deviation
#: of one per cent, and rounding errors in 32-bit floats are smaller than one per cent.
NOTICED = 0.01


def check_bug_report(bug_report: BugReport, method: Method, runner: TaskRunner) -> UnsavedResult:
    """Check whether a method has a reported bug. Return the result with the scene of the bug report."""
    scene = bug_report.scene
    answer = observe(scene, method, runner)
    if answer.status in {Status.UNAVAILABLE, Status.UNSUPPORTED}:
        not_run = CellResult(CellEnding.NOT_RUN, reason=answer.problem, status=answer.status)
        return UnsavedResult(not_run, (scene,))
    if answer.value is None:
        is_seen, figure, reason = bug_report.symptom is Symptom.NEVER_ENDS, math.inf, answer.problem
    else:
        is_seen, figure, reason = find_symptom(bug_report, answer.value)
    ending, value = CellEnding.SEEN if is_seen else CellEnding.NOT_SEEN, figure if math.isfinite(figure) else None
    reason = reason if is_seen or not reason else f"the reported bug does not occur, but {reason}"
    return UnsavedResult(CellResult(ending, value, reason=reason, runs=1, status=answer.status), (scene,))


def find_symptom(bug_report: BugReport, trace: Trace) -> tuple[bool, float, str]:
    """Return whether a trace shows the reported bug, the trace's deviation, and an explanation.

    The deviation is usually the largest error of a final velocity or known rim speed, divided by the scene's greatest
    speed. If the bug report is about energy, or the correct final velocities are unknown, the deviation is the energy
    error, divided by the scene's energy. If a trace does not show the bug, but deviates by more than a per cent, the
    explanation contains the deviation.
    """
    symptom, known, scene = bug_report.symptom, bug_report.known, bug_report.scene
    finite = bool(np.isfinite(trace.final_velocity_m_s).all() and np.isfinite(trace.final_position_m).all())
    if not finite or trace.outcome is Outcome.NON_FINITE:
        return symptom is Symptom.NOT_FINITE, math.inf, Outcome.NON_FINITE.value
    if trace.outcome not in {Outcome.COMPLETED, Outcome.STANDSTILL}:
        return symptom is Symptom.NEVER_ENDS, math.inf, "; ".join((trace.outcome.value, *trace.notes))
    velocity, energy = _compute_velocity_error(trace, known, scene), _compute_energy_error(trace, known, scene)
    of_energy = symptom in {Symptom.GAINS_ENERGY, Symptom.LOSES_ENERGY} or math.isnan(velocity)
    figure, quantity = (energy, "energy") if of_energy else (velocity, "greatest speed")
    threshold, missed = bug_report.smallest_error, _count_missed(trace, known)
    invented = len(trace.impacts) - (known.count or 0)
    depth = compute_deepest_overlap(trace, scene) / min(disc.radius_m for disc in scene.discs)
    wrong = f"velocities are wrong by {format_number(velocity)} times the scene's greatest speed"
    # For each symptom, whether the trace shows the symptom, and the explanation.
    symptoms = {
        Symptom.MISSES: (missed > 0 and abs(figure) > threshold, f"{_format_impacts(missed)} missed"),
        Symptom.INVENTS: (invented > 0, f"{_format_impacts(invented)} invented"),
        Symptom.ESCAPES: (
            not depth <= 1.0,
            f"a disc is {format_number(depth)} radii inside another body or beyond a wall",
        ),
        Symptom.GAINS_ENERGY: (energy > threshold, f"{format_number(energy)} of the energy is gained"),
        Symptom.LOSES_ENERGY: (energy < -threshold, f"{format_number(-energy)} of the energy is lost"),
        Symptom.WRONG_VELOCITY: (velocity > threshold, wrong),
        Symptom.NEVER_RESTS: (velocity > threshold, wrong),
    }
    is_seen, reason = symptoms.get(symptom, (False, ""))
    deviates = f"the result is wrong by {format_number(figure)} times the scene's {quantity}"
    if not is_seen:
        reason = deviates if abs(figure) > NOTICED else ""
    return is_seen, figure, reason


def _compute_velocity_error(trace: Trace, known: KnownAnswer, scene: Scene) -> float:
    if known.final_velocity_m_s is None:
        return math.nan
    speeds = [math.hypot(*disc.velocity_m_s) for disc in scene.discs]
    speeds += [math.hypot(*(impact.velocity_first_after or (0.0, 0.0))) for impact in known.impacts]
    error = np.hypot(*(trace.final_velocity_m_s - np.array(known.final_velocity_m_s)).T)
    if known.final_spin_rad_s is not None and trace.final_spin_rad_s is not None:
        rims = scene.arrays.radius_m * (trace.final_spin_rad_s - np.array(known.final_spin_rad_s))
        error = np.maximum(error, np.abs(rims))
    return float(np.max(error)) / (max(speeds) or 1.0)


def _compute_energy_error(trace: Trace, known: KnownAnswer, scene: Scene) -> float:
    """Return the error of the final mechanical energy, divided by the energy at the start."""
    weight = np.array([0.0 if disc.immovable else disc.mass_kg for disc in scene.discs])
    floor = min(map(_find_height, scene.walls), default=0.0)

    def compute_energy(place: ArrayLike, velocity: ArrayLike) -> float:
        height = (np.array(place) - [0.0, floor]) @ np.array(scene.gravity_m_s2)
        return kinetic_energy(scene, np.array(velocity)) - float(weight @ height)

    at_start = compute_energy(scene.arrays.position_m, scene.arrays.velocity_m_s)
    found = compute_energy(trace.final_position_m, trace.final_velocity_m_s)
    if known.final_velocity_m_s is None:
        expected = at_start if known.final_kinetic_energy_j is None else known.final_kinetic_energy_j
    elif known.final_position_m is None:
        expected = kinetic_energy(scene, np.array(known.final_velocity_m_s))
    else:
        expected = compute_energy(known.final_position_m, known.final_velocity_m_s)
    return (found - expected) / at_start if at_start else 0.0


def _find_height(wall: Wall | Chain | Ring) -> float:
    """Return the height of a wall; for a chain, the height of its lowest point."""
    if isinstance(wall, Wall):
        return wall.point_m[1]
    return wall.centre_m[1] if isinstance(wall, Ring) else min(y for _, y in wall.points_m)


def _format_impacts(count: int) -> str:
    return format_count(count, "impact is", "impacts are")


def _count_missed(trace: Trace, known: KnownAnswer) -> int:
    """Return the number of known impacts that are missing in the trace."""
    expected = Counter((impact.first, impact.second) for impact in known.impacts)
    found = Counter(zip(trace.impacts["first"].tolist(), trace.impacts["second"].tolist(), strict=True))
    return (expected - found).total()
