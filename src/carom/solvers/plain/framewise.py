"""PIC as the source paper's Algorithm 2: frame by frame, stopping at each impact on the way to the next frame.

The printed algorithm carries out one impact a frame; its own figure 9 needs several. Here a frame goes on until no
impact is left in it, which is what the figure shows. The impacts are those of the event-driven form, found by other
means: every pair is solved for anew at each frame and after each impact. A disc's stored position is that of its last
impact, and its position at a frame is computed from there, so frames add no rounding, and the impacts come out
identical to the bit.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from carom.solvers.impact_log import ImpactLog
from carom.solvers.kernel import EPOCH_IMPACTS
from carom.solvers.plain.bodies import Bodies, require_supported
from carom.solvers.request import frames_of
from carom.solvers.units import units_of
from carom.trace import Outcome, Trace, impact_array, wall_body, wall_index

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from carom.scene import Scene
    from carom.solvers.falling.run import BallisticRun

__all__ = ["FramewiseRun", "framewise_run", "solve_pic_framewise"]


class FramewiseRun:
    """A run of Algorithm 2, taken forward frame by frame."""

    def __init__(self, scene: Scene) -> None:
        require_supported(scene, "PIC")
        self.bodies = Bodies(scene)
        self.log = ImpactLog(scene)
        self.time_s = 0.0
        self.predictions = 0
        self.notes: tuple[str, ...] = ()
        self._now_s = 0.0  # since the epoch
        self._reported_s = 0.0
        self._kept: dict[tuple[int, int], float] = {}

    def advance_frame(self, next_frame_s: float, *, closed: bool = False) -> Outcome:
        """Go to the next frame instant, stopping at every impact before it (and, where `closed`, on it)."""
        bodies = self.bodies
        while True:
            time_s, first, second = min(self._upcoming(), default=(math.inf, 0, 0))
            reported_s = max(self._reported_s, bodies.since_start(time_s))
            if reported_s > next_frame_s or (reported_s == next_frame_s and not closed):
                break
            self._now_s = max(self._now_s, time_s)
            self._reported_s = max(self._reported_s, bodies.since_start(self._now_s))
            self.time_s = self._reported_s
            record = bodies.collide(first, second, self._now_s)._replace(time_s=self._reported_s)
            self.log.add(record, bodies.resolution_s(record))
            self._forget(first, second)
            if self.log.at_standstill:
                return Outcome.STANDSTILL
            if len(self.log.records) % (EPOCH_IMPACTS * len(bodies)) == 0:
                bodies.begin_epoch(self._now_s)
                self._now_s = 0.0
                self._kept.clear()
        self.time_s = next_frame_s
        return Outcome.COMPLETED

    def positions(self) -> NDArray[np.float64]:
        """Centres now, metres, shape ``(n, 2)``."""
        return self.bodies.positions_at(self.bodies.since_epoch(self.time_s))

    def velocities(self) -> NDArray[np.float64]:
        """Velocities now, metres a second, shape ``(n, 2)``."""
        return self.bodies.velocities()

    @property
    def counts(self) -> dict[str, int]:
        """Work so far."""
        return {"predictions": self.predictions}

    def _upcoming(self) -> Iterator[tuple[float, int, int]]:
        bodies = self.bodies
        n = len(bodies)
        self.predictions += n * (n - 1) // 2 + n * len(bodies.walls)
        for i in range(n):
            for j in range(i + 1, n):
                yield self._solved(i, j), i, j
            for k in range(len(bodies.walls)):
                yield self._solved(i, wall_body(k)), i, wall_body(k)

    def _solved(self, first: int, second: int) -> float:
        """Return when two bodies meet. While neither path changes, the answer is kept: it would be the same."""
        key = (first, second)
        if key not in self._kept:
            bodies = self.bodies
            self._kept[key] = (
                bodies.wall_impact_time(first, wall_index(second))
                if second < 0
                else bodies.pair_impact_time(first, second)
            )
        return self._kept[key]

    def _forget(self, first: int, second: int) -> None:
        """Drop what was kept of two bodies whose paths have changed."""
        changed = {body for body in (first, second) if body >= 0}
        self._kept = {key: time for key, time in self._kept.items() if not changed.intersection(key)}


def framewise_run(scene: Scene) -> FramewiseRun | BallisticRun:
    """Return a run that can be taken forward frame by frame.

    Under gravity it is the event-driven one: a disc's state is that at its last impact, so that frames change nothing.
    """
    if scene.gravity_m_s2 != (0.0, 0.0):
        from carom.solvers.falling.run import BallisticRun

        return BallisticRun(scene)
    return FramewiseRun(scene)


def solve_pic_framewise(scene: Scene, *, frame_rate_hz: float | None = None) -> Trace:
    """Run a scene by Algorithm 2 of the source paper, all impacts of a frame included.

    Args:
        scene: The scene.
        frame_rate_hz: Frames a second; the scene's own by default.

    Raises:
        InputError: The frame rate is not a positive number, or gives frames without end.
    """
    rate, frames = frames_of(scene, frame_rate_hz)
    units = units_of(scene)
    run = framewise_run(units.scene(scene))
    outcome = Outcome.COMPLETED
    for frame in range(1, frames + 1):
        last = frame == frames
        frame_s = units.of_seconds(scene.duration_s if last else frame / rate)
        outcome = run.advance_frame(frame_s, closed=last) if isinstance(run, FramewiseRun) else run.advance_to(frame_s)
        if outcome is not Outcome.COMPLETED:
            break
    trace = Trace(
        method="pic (Algorithm 2)",
        scene=scene,
        impacts=impact_array(run.log.records),
        final_position_m=run.positions(),
        final_velocity_m_s=run.velocities(),
        end_time_s=run.time_s,
        outcome=outcome,
        dt_s=units.of_seconds(1.0 / rate),
        ambiguous=tuple(run.log.ambiguous),
        counts={"frames": frames, **run.counts},
        notes=run.notes,
    )
    return units.trace(trace, scene)
