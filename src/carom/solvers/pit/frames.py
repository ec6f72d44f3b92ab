"""PIT, periodic interference test: the source paper's Algorithm 1, to the letter.

At every frame instant, and nowhere else, each pair is asked: approaching? then: overlapping? then: new velocities,
along the line of centres as it stands at that frame. Positions are never corrected. So an impact is late by up to a
frame, its normal is turned by what the discs moved meanwhile, and one whose overlap falls between two frames is missed.
After their impact two bodies separate until another one turns them: `carom.solvers.pit.separation`.

This is the definition, on plain floats: the compiled loop gives the same impacts, velocities and positions to the bit.
Under gravity discs move along exact parabolas between frames, so PIT is off by what checking once per frame costs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.solvers.impact_log import ImpactLog
from carom.solvers.pit.separation import FALLING, SLOWING, STRAIGHT, Separations
from carom.solvers.plain.bodies import Bodies

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from carom.solvers.pit.clock import FrameClock
    from carom.solvers.run import RunImpacts, Start


class PlainFrameLoop:
    """Algorithm 1 from frame to frame, in the shape of the compiled loop.

    Within a frame the pairs are tested in the order of their indices, then the walls; each test sees the velocities
    that the earlier ones of the frame left.

    Attributes:
        frames: Frames passed, each of which is looked at.
        log: The impacts so far.
    """

    def __init__(self, start: Start, clock: FrameClock) -> None:
        self.bodies, motion = _bodies(start)
        self.separations = Separations(self.bodies, motion)
        self.clock = clock
        self.log = ImpactLog(start)
        self.frames = 0

    @property
    def counts(self) -> dict[str, int]:
        """Work so far, by name: every test is made at every frame."""
        n = len(self.bodies)
        tests = n * (n - 1) // 2 + n * len(self.bodies.walls)
        looked_at = {"frames_looked_at": self.frames, "frames_skipped": 0}
        return {"frames": self.frames, **looked_at, "pair_tests": self.frames * tests}

    @property
    def recorded(self) -> RunImpacts:
        """The impacts so far, as a run shows them."""
        return self.log

    def run(self, until: int, most: int, work: float) -> None:  # noqa: ARG002 - all are asked after every frame
        """Move every disc to the next frame, and test for interference there."""
        bodies, separations, log, n = self.bodies, self.separations, self.log, len(self.bodies)
        now_s = self._moved_s() if self.frames > 0 else 0.0
        if self.frames > 0:
            for i in range(n):
                if bodies.has_legs:
                    bodies.forget_ended_leg(i, now_s)
                bodies.move_to(i, now_s)
        for i in range(n):
            for j in range(i + 1, n):
                if bodies.pair_approaches_and_overlaps(i, j) and not separations.are_separating(i, j, now_s):
                    record = bodies.collide_pair(i, j)
                    log.add(record)
                    separations.note_pair(i, j, record.normal, now_s)
        for i in range(n):
            for k in range(len(bodies.walls)):
                if bodies.wall_approaches_and_overlaps(i, k) and not separations.is_leaving_wall(i, k, now_s):
                    bodies.find(i, k)
                    log.add(bodies.collide_wall(i, k))
                    separations.note_wall(i, k, now_s)
        self.frames += 1

    def positions(self, time: float) -> NDArray[np.float64]:
        """Return where the discs are at a time not before the last frame passed, metres, shape ``(n, 2)``."""
        return self.bodies.positions_at(time)

    def velocities(self, time: float) -> NDArray[np.float64]:
        """Return the velocities at such a time, metres a second, shape ``(n, 2)``."""
        return self.bodies.velocities_at(time)

    def _moved_s(self) -> float:
        """Return how long discs without damping take to where they are at the next frame."""
        return self.clock.time_s(self.frames)

    def present_spins(self) -> NDArray[np.float64] | None:
        """Return the spins, radians a second, shape ``(n,)``; None if no disc spins."""
        return self.bodies.spins()


def _bodies(start: Start) -> tuple[Bodies, int]:
    """Return the bodies of a start, and their kind of motion."""
    if start.table_deceleration_m_s2:
        from carom.solvers.falling.table import TableBodies

        return TableBodies(start), SLOWING
    if start.gravity_m_s2 == (0.0, 0.0):
        return Bodies(start), STRAIGHT
    from carom.solvers.falling.bodies import FallingBodies

    return FallingBodies(start), FALLING
