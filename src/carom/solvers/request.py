"""Checked arguments of a PIC run, and the loop that advances a run to its end."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.errors import InputError
from carom.model.scene import Scene
from carom.model.sizes import find_span_problems
from carom.model.trace import Outcome, Samples
from carom.solvers.options import PLAIN, RunOptions
from carom.solvers.run import Progress, Run
from carom.support.checks import check_count, check_number, check_times
from carom.support.formatting import format_number as number_text
from carom.support.limits import LARGEST, MOST_STEPS, SMALLEST, format_limits


class Request(NamedTuple):
    """Checked arguments of `carom.solve_pic`, except for the scene: the goal of a run, and the data to record."""

    end_s: float
    max_impacts: int | None
    options: RunOptions
    samples_s: tuple[float, ...]  # ascending
    progress: Progress | None

    @classmethod
    def checked(
        cls,
        scene: Scene,
        max_impacts: int | None,
        until_s: float | None,
        record: str,
        window_s: tuple[float, float],
        sample_times_s: object,
        contact_duration_s: float,
        progress: Progress | None,
    ) -> Request:
        """Check the arguments of `carom.solve_pic`.

        Raises:
            InputError: An argument is outside its range, or not supported under gravity or with damping; the message
                names the argument.
        """
        options = RunOptions.of(record, window_s, contact_duration_s)
        if options.contact_duration_s and (law := _find_bending_law(scene)):
            raise InputError(f"contact_duration_s must be 0 in a scene with {law}, got {options.contact_duration_s}")
        return cls(
            scene.duration_s if until_s is None else _check_end_time(scene, until_s),
            None if max_impacts is None else check_count("max_impacts", max_impacts),
            options,
            tuple(check_times("sample_times_s", sample_times_s)),
            progress,
        )

    @property
    def is_plain(self) -> bool:
        """Whether all arguments have their defaults, so that a faster function can be used."""
        return self.max_impacts != 0 and self[2:] == (PLAIN, (), None)

    def advance_run(self, run: Run) -> tuple[Outcome, Samples | None]:
        """Advance a run to its end. Return the outcome, and the samples if any were requested."""
        outcome, reached, places = Outcome.COMPLETED, [], []
        for time_s in (*(time_s for time_s in self.samples_s if time_s <= self.end_s), self.end_s):
            outcome = run.advance_to(time_s, self.max_impacts, self.progress)
            if outcome is not Outcome.COMPLETED or not self.samples_s:
                break
            reached.append(time_s)
            places.append(run.positions())
        if not self.samples_s:
            return outcome, None
        if outcome is Outcome.COMPLETED:  # the last sample is the state at the end
            del reached[-1], places[-1]
        return outcome, Samples(np.array(reached), np.array(places).reshape(len(reached), *run.positions().shape))


def _find_bending_law(scene: Scene) -> str:
    """Return the name of a force that changes velocities between impacts; empty if the scene has none."""
    laws = {
        "gravity": scene.gravity_m_s2 != (0.0, 0.0),
        "damping": scene.damping_per_s,
        "a table that slows discs down": scene.table_deceleration_m_s2,
    }
    return next((law for law, acts in laws.items() if acts), "")


def _check_end_time(scene: Scene, until_s: object) -> float:
    end_s = check_number("until_s", until_s, least=0.0)
    if end_s > LARGEST:
        raise InputError(f"until_s {format_limits(0.0, LARGEST)}, got {end_s}")
    if end_s > scene.duration_s:
        for problem in find_span_problems(scene.arrays, scene.gravity_m_s2, end_s):
            raise InputError(f"until_s {problem.message}")
    return end_s


def compute_frames(scene: Scene, frame_rate_hz: object) -> tuple[float, int]:
    """Return the frame rate, by default the scene's own, and the number of frames in the scene's duration.

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
