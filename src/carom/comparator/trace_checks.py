"""Checks that a trace is possible in its scene. The accuracy of traces is not checked."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from carom.comparator.thresholds import THRESHOLDS
from carom.engines.api.checks import MANTISSA_BITS
from carom.errors import InputError
from carom.model.trace import Trace, body_name, wall_body, wall_index


def require_possible_trace(trace: Trace) -> None:
    """Raise an error for a trace that is impossible in its scene. Inaccurate traces are accepted.

    Raises:
        InputError: The trace's `float_bits` is neither 32 nor 64. An impact has a body that the scene does not have. A
        wall turns, or moves in another way than in the scene. Spins are missing although discs turn. The run continues
        after the scene's end.
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
    """Return, by field name, the velocity that the second body of each impact has in the scene; 0 for a disc.

    If a wall's velocity changes within the step of the impact, the velocity that is nearest to the reported one is
    returned.
    """
    start, impacts = trace.scene.arrays, trace.impacts
    due = {name: np.zeros((len(impacts), 2)) for name in ("velocity_second_before", "velocity_second_after")}
    for k in np.flatnonzero((impacts["second"] < 0) & (start.wall_drives is not None)).tolist():
        drive = start.drive_of_wall(wall_index(int(impacts["second"][k])))
        time_s = max(float(impacts["time_s"][k]), 0.0)  # a verdict reports a time before the start
        span = (time_s - (trace.dt_s or 0.0)) * (1.0 - 2.0**-40), time_s * (1.0 + 2.0**-40)
        legs = drive.velocities_within(*span) if math.isfinite(time_s) else [drive.velocity_at(0.0)]
        for name, velocities in due.items():
            reported = impacts[name][k].tolist()
            is_finite = all(map(math.isfinite, reported))
            velocities[k] = min(legs, key=lambda leg: math.dist(leg, reported)) if is_finite else reported
    return due
