"""Discs on a table that slows each down by one deceleration, against its motion, until it stops: seen from above.

Paths are parabolas, straight ones, so that what is solved of discs that fall is solved of these: two of them meet by a
quartic, from one stop to the next.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.physics.features import Face
from carom.solvers.falling.bodies import FallingBodies
from carom.solvers.plain.bodies import Bodies
from carom.solvers.plain.instants import NEVER, Instant, after, between
from carom.trace import wall_body

if TYPE_CHECKING:
    from carom.driving import Course
    from carom.solvers.run import Start
    from carom.trace import ImpactRecord


class TableBodies(FallingBodies):
    """Positions and velocities on a table.

    Attributes:
        stops: When each disc stops; never, if it does not move.
    """

    def __init__(self, start: Start) -> None:
        super().__init__(start)
        self.stops: list[Instant] = [NEVER] * len(self)
        self._deceleration = start.table_deceleration_m_s2
        for i in range(len(self)):
            self._slow(i)

    def _slow(self, i: int) -> None:
        """Let the table act on disc `i`, which has a new velocity."""
        speed = math.hypot(self.vx[i], self.vy[i])
        if self.inverse_mass[i] == 0.0 or speed == 0.0:
            self.acceleration[i], self.stops[i] = (0.0, 0.0), NEVER
            return
        a = -self._deceleration  # times a unit vector: over the least of speeds it would be infinite
        self.acceleration[i] = (a * (self.vx[i] / speed), a * (self.vy[i] / speed))
        self.stops[i] = after(self.instant[i], speed / self._deceleration)

    def state_at(self, i: int, instant: Instant) -> tuple[float, float, float, float]:
        """Position and velocity of disc `i` at an instant, on its present parabola or where that has ended."""
        if instant < self.stops[i]:
            return super().state_at(i, instant)
        # At its middle speed to where it stops, so that no difference of two large ways is left.
        lasts = between(self.instant[i], self.stops[i])
        return self.x[i] + 0.5 * lasts * self.vx[i], self.y[i] + 0.5 * lasts * self.vy[i], 0.0, 0.0

    def bring_to(self, i: int, instant: Instant) -> None:
        """Bring disc `i` to an instant along its parabola."""
        has_stopped = instant >= self.stops[i]
        super().bring_to(i, instant)
        if has_stopped:
            self._slow(i)

    def contact_with_wall(self, i: int, k: int, again: bool) -> tuple[float, float, float]:
        """As of discs that fall; nothing pulls a disc back to what is flat, whatever rounding says of it."""
        approach, pull, gap_m = super().contact_with_wall(i, k, again)
        part = self.expected(i, k)
        return approach, 0.0 if part is None or isinstance(part.feature, Face) else pull, gap_m

    def _wait_for_wall(self, i: int, k: int, leg: Course, begin_s: float, *, just_left: bool) -> float:
        """As of discs that fall; a straight path does not come back to what is flat."""
        last = self.last_feature(i, k)
        self.never_met[i] = (last,) if isinstance(last, Face) else ()
        if self.finite[k] is None and self.last_partner[i] == wall_body(k):
            return math.inf
        return super()._wait_for_wall(i, k, leg, begin_s, just_left=just_left)

    def are_parting(self, first: int, second: int) -> bool:
        """As without a table of a disc and a wall; two discs, slowed down in other directions, may meet again."""
        return second < 0 and Bodies.are_parting(self, first, second)

    def collide_pair(self, i: int, j: int, *, elastic: bool = False) -> ImpactRecord:
        """Give discs `i` and `j` their velocities after the impact: see `Bodies.collide_pair`."""
        record = super().collide_pair(i, j, elastic=elastic)
        self._slow(i)
        self._slow(j)
        return record

    def collide_wall(self, i: int, k: int, *, elastic: bool = False) -> ImpactRecord:
        """Give disc `i` its velocity after its impact on wall `k`: see `Bodies.collide_wall`."""
        record = super().collide_wall(i, k, elastic=elastic)
        self._slow(i)
        return record

    def bounce(self, i: int, k: int, approach: float) -> ImpactRecord:
        """Give disc `i` its velocity after its impact on wall `k`: see `FallingBodies.bounce`."""
        record = super().bounce(i, k, approach)
        self._slow(i)
        return record
