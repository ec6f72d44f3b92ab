"""PIT under gravity: the source paper's Algorithm 1, its discs on exact parabolas between the frames.

What is sampled is the overlap, and nothing else: free fall itself has no error, so that what PIT is off by is what
looking once a frame costs. Engines add to it the error of their integrator.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.solvers.ballistic.bodies import FallingBodies
from carom.solvers.impact_log import ImpactLog

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from carom.scene import Scene

__all__ = ["BallisticFrames"]


class BallisticFrames:
    """A PIT run under gravity, taken forward frame by frame; pairs first, then walls, as `FrameSampledRun` does."""

    def __init__(self, scene: Scene) -> None:
        self.bodies = FallingBodies(scene)
        self.log = ImpactLog(scene)
        self.time_s = 0.0
        self.pair_tests = 0

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
                if bodies.inverse_mass[i] > 0.0 and bodies.wall_approaches_and_overlaps(i, k):
                    log.add(bodies.collide_wall(i, k))
        self.pair_tests += n * (n - 1) // 2 + n * walls
        for i in range(n):
            bodies.move_to(i, next_frame_s)
        self.time_s = next_frame_s

    def advance_frames(self, frames_s: Sequence[float]) -> None:
        """Advance to each of these frames, in their order."""
        for frame_s in frames_s:
            self.advance_frame(frame_s)

    @property
    def counts(self) -> dict[str, int]:
        """Work so far."""
        return {"pair_tests": self.pair_tests}

    def positions(self) -> NDArray[np.float64]:
        """Centres now, metres, shape ``(n, 2)``."""
        return self.bodies.all_at((self.time_s, 0.0))[0]

    def velocities(self) -> NDArray[np.float64]:
        """Velocities now, metres a second, shape ``(n, 2)``."""
        return self.bodies.velocities()
