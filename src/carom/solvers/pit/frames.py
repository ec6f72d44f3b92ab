"""PIT, periodic interference test: the source paper's Algorithm 1, to the letter.

At every frame instant, and nowhere else, each pair is asked: approaching? then: overlapping? then: new velocities,
along the line of centres as it stands at that frame. Positions are never corrected. So an impact is late by up to a
frame, its normal is turned by what the discs moved meanwhile, and one whose overlap falls between two frames is missed.

This is the definition, on plain floats: the compiled run gives the same impacts, velocities and positions to the bit.

Under gravity discs move along exact parabolas between the frames. What is sampled is the overlap, and nothing else:
free fall itself has no error, so that what PIT is off by is what looking once a frame costs. Engines add to it the
error of their integrator.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.solvers.impact_log import ImpactLog
from carom.solvers.pit.run import FrameRun
from carom.solvers.plain.bodies import Bodies

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from carom.scene import Scene
    from carom.solvers.pit.clock import FrameClock

__all__ = ["FrameSampledRun"]


class FrameSampledRun(FrameRun):
    """A PIT run, taken forward frame by frame.

    Within a frame the pairs are tested in the order of their indices, then the walls; each test sees the velocities
    that the earlier ones of the frame left.
    """

    def __init__(self, scene: Scene, clock: FrameClock) -> None:
        super().__init__(clock)
        self.bodies = _bodies(scene)
        self.log = self._log = ImpactLog(scene)
        self._frames = 0

    @property
    def frames(self) -> int:
        """Frames passed."""
        return self._frames

    @property
    def counts(self) -> dict[str, int]:
        """Work so far."""
        n = len(self.bodies)
        tests = n * (n - 1) // 2 + n * len(self.bodies.walls)
        return {
            "frames": self._frames,
            "frames_looked_at": self._frames,
            "frames_skipped": 0,
            "pair_tests": self._frames * tests,
        }

    def pass_frames(self, until: int, max_impacts: int | None) -> None:  # noqa: ARG002 - asked for after every frame
        """Move every disc to the next frame, and test for interference there."""
        bodies, log = self.bodies, self._log
        n, walls = len(bodies), len(bodies.walls)
        if self._frames > 0:
            frame_s = self.clock.time_s(self._frames)
            for i in range(n):
                bodies.move_to(i, frame_s)
        for i in range(n):
            for j in range(i + 1, n):
                if bodies.pair_approaches_and_overlaps(i, j):
                    log.add(bodies.collide_pair(i, j))
        for i in range(n):
            for k in range(walls):
                if bodies.wall_approaches_and_overlaps(i, k):
                    log.add(bodies.collide_wall(i, k))
        self._frames += 1

    def positions(self) -> NDArray[np.float64]:
        """Centres now, metres, shape ``(n, 2)``."""
        return self.bodies.positions_at(self.time_s)

    def velocities(self) -> NDArray[np.float64]:
        """Velocities now, metres a second, shape ``(n, 2)``."""
        return self.bodies.velocities_at(self.time_s)


def _bodies(scene: Scene) -> Bodies:
    if scene.gravity_m_s2 == (0.0, 0.0):
        return Bodies(scene)
    from carom.solvers.falling.bodies import FallingBodies

    return FallingBodies(scene)
