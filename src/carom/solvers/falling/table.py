"""Discs on a table that slows each down by one deceleration, against its motion, until it stops: seen from above.

Paths are parabolas, straight ones, so that what is solved of discs that fall is solved of these: two of them meet by a
quartic, from one stop to the next.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.solvers.falling.bodies import FallingBodies
from carom.solvers.plain.instants import NEVER, Instant, after, between

if TYPE_CHECKING:
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
