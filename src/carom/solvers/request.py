"""Checks of the arguments of a run, and a function that advances a run to its end."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from carom.errors import InputError
from carom.model.scene import Scene
from carom.model.sizes import find_span_problems
from carom.model.trace import Outcome, Samples
from carom.solvers.run import Progress, Run
from carom.support.checks import check_number
from carom.support.formatting import format_number as number_text
from carom.support.limits import LARGEST, MOST_STEPS, SMALLEST, format_limits


def advance_run(
    run: Run, end_s: float, max_impacts: int | None, samples_s: Sequence[float], progress: Progress | None
) -> tuple[Outcome, Samples | None]:
    """Advance a run to its end. Return the outcome, and the positions at the times `samples_s` if there are any.

    Args:
        run: The run.
        end_s: Time of the end.
        max_impacts: Stop after this many impacts; None for no limit.
        samples_s: Ascending times at which positions are sampled.
        progress: Function called from time to time with the number of impacts and the time so far.
    """
    outcome, reached, places = Outcome.COMPLETED, [], []
    for time_s in (*(time_s for time_s in samples_s if time_s <= end_s), end_s):
        outcome = run.advance_to(time_s, max_impacts, progress)
        if outcome is not Outcome.COMPLETED or not samples_s:
            break
        reached.append(time_s)
        places.append(run.positions())
    if not samples_s:
        return outcome, None
    if outcome is Outcome.COMPLETED:  # the last sample is the state at the end
        del reached[-1], places[-1]
    return outcome, Samples(np.array(reached), np.array(places).reshape(len(reached), *run.positions().shape))


def find_bending_force(scene: Scene) -> str:
    """Return the name of the force that changes velocities between impacts; an empty text if there is none."""
    if scene.gravity_m_s2 != (0.0, 0.0):
        return "gravity"
    if scene.damping_per_s:
        return "damping"
    return "a table that slows discs down" if scene.table_deceleration_m_s2 else ""


def check_end_time(scene: Scene, until_s: object) -> float:
    """Return `until_s`, the time at which a run shall stop, as a number.

    Raises:
        InputError: `until_s` is not a time within the limits.
    """
    end_s = check_number("until_s", until_s, least=0.0)
    if end_s > LARGEST:
        raise InputError(f"until_s {format_limits(0.0, LARGEST)}, got {end_s}")
    if end_s > scene.duration_s:
        for problem in find_span_problems(scene.arrays, scene.gravity_m_s2, end_s):
            raise InputError(f"until_s {problem.message}")
    return end_s


def compute_frames(scene: Scene, frame_rate_hz: object) -> tuple[float, int]:
    """Return the frame rate of a run, and the number of frames in the scene's duration.

    If `frame_rate_hz` is None, the scene's own frame rate is returned.

    Raises:
        InputError: The frame rate is not a positive number within the limits, or leads to more than `MOST_STEPS`
        frames.
    """
    if frame_rate_hz is None:
        frame_rate_hz = scene.frame_rate_hz
    rate = check_number("frame_rate_hz", frame_rate_hz, positive=True)
    if not SMALLEST <= rate <= LARGEST:
        raise InputError(f"frame_rate_hz {format_limits(SMALLEST, LARGEST)}, got {rate}")
    if rate > MOST_STEPS / scene.duration_s:
        raise InputError(
            f"frame_rate_hz must give at most {MOST_STEPS} frames in {scene.duration_s} s "
            f"({number_text(MOST_STEPS / scene.duration_s, 3)} Hz), got {rate}; lower it, or shorten the scene"
        )
    return rate, scene.step_count(1.0 / rate)
