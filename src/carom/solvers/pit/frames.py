"""PIT, periodic interference test: the source paper's Algorithm 1, to the letter.

At every frame instant, and nowhere else, each pair is asked: approaching? then: overlapping? then: new velocities,
along the line of centres as it stands at that frame. Positions are never corrected. So an impact is late by up to a
frame, its normal is turned by what the discs moved meanwhile, and one whose overlap falls between two frames is missed.
After their impact two bodies part until another one turns them: the law of impact leaves no approach, and what rounding
leaves of it (all that there is, where the restitution is 0) is none.

This is the definition, on plain floats: the compiled loop gives the same impacts, velocities and positions to the bit.
Under gravity discs move along exact parabolas between frames, so PIT is off by what checking once per frame costs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.solvers.impact_log import ImpactLog
from carom.solvers.plain.bodies import Bodies
from carom.trace import wall_body

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
        self.bodies = _bodies(start)
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
        bodies, log, n = self.bodies, self.log, len(self.bodies)
        if self.frames > 0:
            moved_s = self._moved_s()
            for i in range(n):
                if bodies.has_legs:
                    bodies.forget_ended_leg(i, moved_s)
                bodies.move_to(i, moved_s)
        for i in range(n):
            for j in range(i + 1, n):
                if bodies.pair_approaches_and_overlaps(i, j) and not bodies.are_parting(i, j):
                    log.add(bodies.collide_pair(i, j))
                    bodies.last_partner[i], bodies.last_partner[j] = j, i
        for i in range(n):
            for k in range(len(bodies.walls)):
                if bodies.wall_approaches_and_overlaps(i, k) and not bodies.are_parting(i, wall_body(k)):
                    bodies.find(i, k)
                    log.add(bodies.collide_wall(i, k))
                    bodies.last_partner[i] = wall_body(k)
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


def _bodies(start: Start) -> Bodies:
    if start.table_deceleration_m_s2:
        from carom.solvers.falling.table import TableBodies

        return TableBodies(start)
    if start.gravity_m_s2 == (0.0, 0.0):
        return Bodies(start)
    from carom.solvers.falling.bodies import FallingBodies

    return FallingBodies(start)
