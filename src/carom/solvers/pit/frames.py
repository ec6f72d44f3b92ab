"""PIT, periodic interference test: the source paper's Algorithm 1, to the letter.

At every frame instant, and nowhere else, each pair is asked: approaching? then: overlapping? then: new velocities,
along the line of centres as it stands at that frame. Positions are never corrected. So an impact is late by up to a
frame, its normal is turned by what the discs moved meanwhile, and one whose overlap falls between two frames is missed.

`FrameSampledRun` is that, and the definition. `SkippingRun` and `ManyDiscsRun` leave out what can find nothing, and
give the same impacts, velocities and positions to the bit.

Under gravity discs move along exact parabolas between the frames. What is sampled is the overlap, and nothing else:
free fall itself has no error, so that what PIT is off by is what looking once a frame costs. Engines add to it the
error of their integrator.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.errors import InputError
from carom.solvers.impact_log import ImpactLog
from carom.solvers.pit.many import ManyDiscsRun
from carom.solvers.pit.skipping import SkippingRun
from carom.solvers.plain.bodies import Bodies
from carom.trace import Outcome, Trace, impact_array

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from carom.scene import Scene

__all__ = ["FrameSampledRun", "ManyDiscsRun", "SkippingRun", "pit_run", "solve_pit"]

#: Pairs of bodies from which on arrays are faster than plain floats. Measured with `carom.bench.pit`:
#: the two meet between 32 and 64 discs in a box.
MANY_PAIRS = 1000

#: Frames handed to a run at a time.
FRAMES_AT_ONCE = 2**16


class FrameSampledRun:
    """A PIT run, taken forward frame by frame.

    Within a frame the pairs are tested in the order of their indices, then the walls; each test sees the velocities
    that the earlier ones of the frame left.
    """

    def __init__(self, scene: Scene) -> None:
        self.bodies = _bodies(scene)
        self.log = ImpactLog(scene)
        self.time_s = 0.0
        self.pair_tests = 0
        self.frames = 0

    def advance_frame(self, next_frame_s: float) -> None:
        """Test for interference at the present frame instant, then move every disc to the next one."""
        bodies, log = self.bodies, self.log
        n, walls = len(bodies), len(bodies.walls)
        for i in range(n):
            for j in range(i + 1, n):
                if bodies.pair_approaches_and_overlaps(i, j):
                    log.add(bodies.collide_pair(i, j))
        for i in range(n):
            for k in range(walls):
                if bodies.wall_approaches_and_overlaps(i, k):
                    log.add(bodies.collide_wall(i, k))
        self.pair_tests += n * (n - 1) // 2 + n * walls
        for i in range(n):
            bodies.move_to(i, next_frame_s)
        self.time_s = next_frame_s
        self.frames += 1

    def advance_frames(self, frames_s: Sequence[float]) -> None:
        """Test at the present frame and on to each of the following ones; the last is reached, not tested at."""
        for frame_s in frames_s:
            self.advance_frame(frame_s)

    @property
    def counts(self) -> dict[str, int]:
        """Work so far."""
        return {
            "frames": self.frames,
            "frames_looked_at": self.frames,
            "frames_skipped": 0,
            "pair_tests": self.pair_tests,
        }

    def positions(self) -> NDArray[np.float64]:
        """Centres now, metres, shape ``(n, 2)``."""
        return self.bodies.positions_at(self.time_s)

    def velocities(self) -> NDArray[np.float64]:
        """Velocities now, metres a second, shape ``(n, 2)``."""
        return self.bodies.velocities()


def _bodies(scene: Scene) -> Bodies:
    if scene.gravity_m_s2 == (0.0, 0.0):
        return Bodies(scene)
    from carom.solvers.falling.bodies import FallingBodies

    return FallingBodies(scene)


PitRun = FrameSampledRun | SkippingRun | ManyDiscsRun


def pit_run(scene: Scene, *, skipping: bool = True) -> PitRun:
    """Return a PIT run at the start of a scene.

    Args:
        scene: The scene.
        skipping: Whether to leave out looks that can find nothing; the result is the same to the bit. Under gravity
            none is left out.
    """
    if not skipping or scene.gravity_m_s2 != (0.0, 0.0):
        return FrameSampledRun(scene)
    n = len(scene.discs)
    return ManyDiscsRun(scene) if n * (n - 1) // 2 + n * len(scene.walls) > MANY_PAIRS else SkippingRun(scene)


def solve_pit(scene: Scene, *, frame_rate_hz: float | None = None, skipping: bool = True) -> Trace:
    """Run a scene by PIT.

    Frame k stands at ``k / frame_rate_hz``, from 0 to the last one before `scene.duration_s`.

    Args:
        scene: The scene.
        frame_rate_hz: Frames a second; the scene's own by default.
        skipping: Whether to leave out looks that can find nothing; only the work counts differ.

    Raises:
        InputError: The frame rate is not a positive number.
    """
    rate = scene.frame_rate_hz if frame_rate_hz is None else frame_rate_hz
    if not 0 < rate < math.inf:
        raise InputError(f"frame_rate_hz must be a positive number, got {rate}")
    run = pit_run(scene, skipping=skipping)
    frames = scene.step_count(1.0 / rate)
    # In parts: a long run of millions of frames would otherwise begin with a list of them.
    for first in range(1, frames + 1, FRAMES_AT_ONCE):
        last = min(first + FRAMES_AT_ONCE, frames + 1)
        run.advance_frames([scene.duration_s if k == frames else k / rate for k in range(first, last)])
    return Trace(
        method="pit",
        scene=scene,
        impacts=impact_array(run.log.records),
        final_position_m=run.positions(),
        final_velocity_m_s=run.velocities(),
        end_time_s=run.time_s,
        outcome=Outcome.COMPLETED,
        dt_s=1.0 / rate,
        ambiguous=run.log.ambiguous(),
        counts=run.counts,
    )
