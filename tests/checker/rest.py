"""Whether a run that ends because a disc rests ends rightly: such a disc there is, and gravity presses it where it is.

A disc rests on a wall or on an immovable disc if it touches it to rounding, is pressed against it, and has too little
speed to leave it by more than rounding: a hop is ``v^2 / (2 a)`` high. A solver may take that speed away, and what slip
friction takes in the hops without end that are left: then the slip is no faster than before, and the angular momentum
about the point of contact is kept.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tests.checker.flights import UNIT, Flights
from tests.checker.report import Violation
from tests.checker.watch import Stretch

from carom import DiscArrays
from carom.model.trace import Outcome

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Rests:
    """Which discs rest when a run ends.

    Attributes:
        speed_m_s: Bound on the speed that each may have lost by it, shape ``(n,)``; 0 for one that does not rest.
        on: Which discs rest on each wall and each immovable disc, with the unit normals from there to them.
    """

    speed_m_s: Floats
    on: tuple[tuple[NDArray[np.bool_], Floats, Floats], ...]

    def landed(
        self, start: DiscArrays, velocity: tuple[Floats, Floats], spins: tuple[Floats, Floats], known: Floats
    ) -> NDArray[np.bool_]:
        """Return which discs may have come to rest so, turned by friction.

        Args:
            start: The discs.
            velocity: Before, as the last impacts left it, and after, shape ``(n, 2)`` each.
            spins: Before and after, shape ``(n,)`` each.
            known: What rounding makes of a velocity.
        """
        rim = [start.radius_m * spin for spin in spins]
        right = np.zeros(len(start), dtype=np.bool_)
        for there, nx, ny in self.on:
            away = [v[:, 0] * nx + v[:, 1] * ny for v in velocity]
            along = [v[:, 1] * nx - v[:, 0] * ny for v in velocity]
            size = known + 8 * UNIT * np.max(np.abs([*rim, *along]), axis=0)
            kept = np.abs(along[1] - along[0] + start.inertia * (rim[1] - rim[0])) <= size
            slower = np.abs(along[1] - rim[1]) <= np.abs(along[0] - rim[0]) + size
            right |= there & kept & slower & (np.abs(away[1] - away[0]) <= self.speed_m_s + size)
        return right


def find_resting(start: DiscArrays, stretch: Stretch, flights: Flights) -> Rests | None:
    """Return which discs rest at the end of a stretch; None where its run goes on, or ends for another reason."""
    if stretch.outcome is not Outcome.AT_REST:
        return None
    last = flights.last[-1]
    (x, y), (vx, vy) = stretch.position_m[-1].T, stretch.velocity_m_s[-1].T
    gx, gy = flights.gravity_m_s2
    error, size = flights.error_m[last], flights.size_m[last]
    speed, on = np.zeros(len(start)), []

    def touch(gap: Floats, nx: Floats, ny: Floats, around: Floats, reach: Floats, other: Floats) -> None:
        bound = error + UNIT * (16 * np.maximum(size, other) + 4 * reach)
        pull = nx * gx + ny * gy + around
        hop = np.sqrt(2.0 * np.maximum(-pull, 0.0) * bound) + flights.velocity_error(last)
        there = start.movable & (np.abs(gap) <= bound) & (pull < 0.0) & (np.abs(vx * nx + vy * ny) <= hop)
        speed[there] = np.maximum(speed, hop)[there]
        on.append((there, nx, ny))

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
    return Rests(speed, tuple(on))


def find_end_violations(stretch: Stretch, rests: Rests | None) -> list[Violation]:
    """Return the end of a run at rest where nothing rests."""
    if rests is None or rests.speed_m_s.any():
        return []
    return [Violation("end", -1, (), float(stretch.time_s[-1]), math.inf, 0.0, "it ended at rest, and no disc rests")]
