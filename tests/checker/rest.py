"""Whether a run that ends because a disc rests ends rightly: such a disc there is, and gravity presses it where it is.

A disc rests on a wall or on an immovable disc if it touches it to rounding, is pressed against it, and has too little
speed to leave it by more than rounding: a hop is ``v^2 / (2 a)`` high. A solver may take that speed away.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tests.checker.flights import UNIT, Flights
from tests.checker.report import Violation
from tests.checker.watch import Stretch

from carom import DiscArrays
from carom.trace import Outcome

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Rests:
    """Which discs rest when a run ends.

    Attributes:
        speed_m_s: Bound on the speed that each may have lost by it, shape ``(n,)``; 0 for one that does not rest.
    """

    speed_m_s: Floats


def resting(start: DiscArrays, stretch: Stretch, flights: Flights) -> Rests | None:
    """Return which discs rest at the end of a stretch; None where its run goes on, or ends for another reason."""
    if stretch.outcome is not Outcome.AT_REST:
        return None
    last = flights.last[-1]
    (x, y), (vx, vy) = stretch.position_m[-1].T, stretch.velocity_m_s[-1].T
    gx, gy = flights.gravity_m_s2
    error, size = flights.error_m[last], flights.size_m[last]
    speed = np.zeros(len(start))

    def touch(gap: Floats, nx: Floats, ny: Floats, around: Floats, reach: Floats, other: Floats) -> None:
        bound = error + UNIT * (16 * np.maximum(size, other) + 4 * reach)
        pull = nx * gx + ny * gy + around
        hop = np.sqrt(2.0 * np.maximum(-pull, 0.0) * bound) + flights.velocity_error(last)
        there = start.movable & (np.abs(gap) <= bound) & (pull < 0.0) & (np.abs(vx * nx + vy * ny) <= hop)
        speed[there] = np.maximum(speed, hop)[there]

    for qx, qy, wx, wy in start.half_planes():
        nx, ny = np.full_like(x, wx), np.full_like(x, wy)
        there = np.full_like(x, max(abs(qx), abs(qy)))
        touch((x - qx) * nx + (y - qy) * ny - start.radius_m, nx, ny, np.zeros_like(x), start.radius_m, there)
    for fixed in np.flatnonzero(~start.movable).tolist():
        dx, dy = x - x[fixed], y - y[fixed]
        distance = np.hypot(dx, dy)
        distance[fixed] = math.inf
        reach = start.radius_m + start.radius_m[fixed]
        nx, ny = dx / distance, dy / distance
        around = (nx * vy - ny * vx) ** 2 / distance
        touch(distance - reach, nx, ny, around, reach, np.full_like(x, np.abs(stretch.position_m[-1, fixed]).max()))
    return Rests(speed)


def broken_end(stretch: Stretch, rests: Rests | None) -> list[Violation]:
    """Return the end of a run at rest where nothing rests."""
    if rests is None or rests.speed_m_s.any():
        return []
    return [Violation("end", -1, (), float(stretch.time_s[-1]), math.inf, 0.0, "it ended at rest, and no disc rests")]
