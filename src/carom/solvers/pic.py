"""PIC, predicted instant of collision: event-driven, without frames.

Every pair's next impact is solved for; the earliest one is carried out at its instant, and only the discs that took
part are predicted again. All impacts come in their order, however many there are between two frames.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.errors import InputError
from carom.solvers.bodies import Bodies, require_supported
from carom.solvers.event_queue import EventQueue
from carom.solvers.impact_log import ImpactLog
from carom.trace import Outcome, Trace, impact_array, wall_body

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from carom.scene import Scene

__all__ = ["EventDrivenRun", "solve_pic"]


class EventDrivenRun:
    """A PIC run that can be taken forward in as many pieces as one likes; the pieces do not change the result.

    A disc's position is moved only when the disc itself collides, and a pair is predicted from the later of its discs'
    own clocks: no prediction depends on where the caller happened to pause.
    """

    def __init__(self, scene: Scene) -> None:
        require_supported(scene, "PIC")
        self.bodies = Bodies(scene)
        self.log = ImpactLog(scene)
        self.time_s = 0.0
        self.predictions = 0
        self._queue = EventQueue(len(self.bodies))
        for i in range(len(self.bodies)):
            self._predict(i, range(i + 1, len(self.bodies)))

    def advance_to(self, time_s: float, max_impacts: int | None = None) -> Outcome:
        """Carry out every impact up to and including `time_s`, or until `max_impacts` in all have been carried out."""
        while (event := self._queue.peek()) is not None and event[0] <= time_s:
            if max_impacts is not None and len(self.log.records) >= max_impacts:
                return Outcome.MAX_IMPACTS
            self._carry_out(*event)
            if self.log.at_standstill:
                return Outcome.STANDSTILL
        self.time_s = max(self.time_s, time_s)
        return Outcome.COMPLETED

    def positions(self) -> NDArray[np.float64]:
        """Centres now, metres, shape ``(n, 2)``."""
        return self.bodies.positions_at(self.time_s)

    def velocities(self) -> NDArray[np.float64]:
        """Velocities now, metres a second, shape ``(n, 2)``."""
        return self.bodies.velocities()

    def _predict(self, i: int, partners: range) -> None:
        """Predict disc `i` against each of `partners` but itself, and against every wall."""
        bodies, queue = self.bodies, self._queue
        for j in partners:
            if j != i:
                first, second = (i, j) if i < j else (j, i)
                queue.predict(bodies.pair_impact_time(first, second), first, second)
        for k in range(len(bodies.walls)):
            queue.predict(bodies.wall_impact_time(i, k), i, wall_body(k))
        self.predictions += len(partners) + len(bodies.walls)

    def _carry_out(self, time_s: float, first: int, second: int) -> None:
        # A prediction can round to just before an impact already carried out; time never runs backwards.
        self.time_s = max(self.time_s, time_s)
        bodies = self.bodies
        record = bodies.collide(first, second, self.time_s)
        self.log.add(record, bodies.resolution_s(record))
        everybody = range(len(bodies))
        for body in (first, second):
            if body >= 0 and bodies.inverse_mass[body] > 0.0:
                self._queue.void(body)
        # An immovable disc's path has not changed: what was predicted for it with others still stands.
        for body in (first, second):
            if body >= 0 and bodies.inverse_mass[body] > 0.0:
                self._predict(body, everybody)


def solve_pic(scene: Scene, *, max_impacts: int | None = None) -> Trace:
    """Run a scene by event-driven PIC, the reference that everything else is held to.

    Args:
        scene: The scene; discs and walls of any number, no gravity.
        max_impacts: Stop after this many impacts; None for no limit.

    Returns:
        The trace. Its final state is that at `scene.duration_s`, or at the last impact where the run ended before.

    Raises:
        InputError: The scene has gravity, or `max_impacts` is negative.
    """
    if max_impacts is not None and max_impacts < 0:
        raise InputError(f"max_impacts must be 0 or more, got {max_impacts}")
    run = EventDrivenRun(scene)
    outcome = run.advance_to(scene.duration_s, max_impacts)
    return Trace(
        method="pic",
        scene=scene,
        impacts=impact_array(run.log.records),
        final_position_m=run.positions(),
        final_velocity_m_s=run.velocities(),
        end_time_s=run.time_s,
        outcome=outcome,
        ambiguous=tuple(run.log.ambiguous),
        counts={"predictions": run.predictions},
    )
