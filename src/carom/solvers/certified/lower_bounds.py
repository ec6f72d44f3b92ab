"""Rigorous float64 lower bounds of times of impact: they discard nearly all pairs, so that balls are for the few left.

Of each disc the table holds a float64 state at its exact reference instant with a bound on the error of every
coordinate. For two discs, with relative position d, known to e a coordinate, and relative velocity u, known to f,

    |d + u t|^2 - R^2  >=  a' t^2 - 2 B t + c'   for all t >= 0,
    c' = d.d - R^2 - 2 e |d|_1 - 2 e^2,   B = -d.u + e |u|_1 + f |d|_1 + 2 e f,   a' = u.u - 2 f |u|_1 - 2 f^2,

so the true discs do not touch before the least zero of the right side. The roundings of this are covered by what is
added to e and f: 16 units of 2^-53 of each disc's coordinates, radius and speed, where each term costs at most 6.
NumPy's warnings of overflow are for the caller to silence: what overflows is left to the balls.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from carom.trace import wall_body

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from carom.solvers.certified.bodies import BallBodies

__all__ = ["LowerBounds"]

#: Half a unit in the last place of 1.
UNIT = 2.0**-53
#: Bits of accuracy from which a ball's radius is no more than half a unit in the last place of its float64.
SHARP_BITS = 54
#: Least float64 error that is ever granted: far below it, products underflow.
TINY = 2.0**-500


class LowerBounds:
    """A lower bound of the time of impact for each disc (row) with each disc and each wall (columns).

    The bound of two discs stands in the row of the one that changed last; the other entry is infinity.
    """

    def __init__(self, bodies: BallBodies) -> None:
        self.bodies = bodies
        scene = bodies.scene
        n, walls = len(bodies), len(scene.walls)
        self.n = n
        self.table = np.full((n, n + walls), math.inf)
        self.least = np.full(n, math.inf)
        self.column = np.zeros(n, np.intp)
        self._state = np.zeros((7, n))  # reference, x, y, vx, vy, errors of position and velocity
        self._radius = np.array([disc.radius_m for disc in scene.discs])
        self._rim = self._radius * (1.0 + 8.0 * UNIT)
        self._rims = self._rim.tolist()
        self._fixed = np.array([disc.immovable for disc in scene.discs])
        self._walls = np.array(
            [
                (
                    *w.point_m,
                    *w.normal,
                    math.hypot(*w.normal) * (1 + 4 * UNIT),
                    max(map(abs, w.point_m)),
                    _span(w.normal),
                )
                for w in scene.walls
            ]
        ).T
        for i in range(n):
            self._load(i)
        for i in range(n):
            self._fill([i])
            self.table[i, :i] = math.inf
        self._find(np.arange(n))

    def changed(self, *discs: int) -> None:
        """Take over the state of discs after an impact, and bound their future anew."""
        moved = [i for i in discs if self.bodies.movable[i]]
        stale = self.column == moved[0]
        for i in moved:
            self._load(i)
            self.table[:, i] = math.inf
            stale |= self.column == i
            stale[i] = True
        self._fill(moved)
        if len(moved) == 2:
            self.table[moved[1], moved[0]] = math.inf  # it stands in the other's row, where they have not just met
        self._find(stale.nonzero()[0])

    def raise_to(self, i: int, column: int, bound: float) -> None:
        """Replace one bound by a better one."""
        self.table[i, column] = bound
        if self.column[i] == column:
            self._find(np.array([i]))
        elif bound < self.least[i]:
            self.least[i], self.column[i] = bound, column

    def earliest(self) -> tuple[float, int, int]:
        """Return the least bound of all, its row and its column."""
        i = int(self.least.argmin())
        return float(self.least[i]), i, int(self.column[i])

    def no_later_than(self, time: float) -> list[tuple[int, int]]:
        """Return rows and columns of all bounds up to a time."""
        rows = (self.least <= time).nonzero()[0].tolist()
        return [(i, column) for i in rows for column in (self.table[i] <= time).nonzero()[0].tolist()]

    def second(self, column: int) -> int:
        """Return the body number that a column stands for."""
        return column if column < self.n else wall_body(column - self.n)

    def _find(self, rows: NDArray[np.intp]) -> None:
        columns = self.table[rows].argmin(axis=1)
        self.column[rows] = columns
        self.least[rows] = self.table[rows, columns]

    def _load(self, i: int) -> None:
        bodies = self.bodies
        ball_x, ball_y, ball_vx, ball_vy = bodies.x[i], bodies.y[i], bodies.vx[i], bodies.vy[i]
        x, y, vx, vy = float(ball_x), float(ball_y), float(ball_vx), float(ball_vy)
        # Conversion cuts off less than a unit in the last place, and a sharp ball adds half of one: 3 halves of a unit.
        error = 19.0 * UNIT * (max(abs(x), abs(y)) + self._rims[i]) + TINY
        error_v = 19.0 * UNIT * max(abs(vx), abs(vy)) + TINY
        if ball_x.rel_accuracy_bits() < SHARP_BITS or ball_y.rel_accuracy_bits() < SHARP_BITS:
            error += float(ball_x.rad()) + float(ball_y.rad())
        if ball_vx.rel_accuracy_bits() < SHARP_BITS or ball_vy.rel_accuracy_bits() < SHARP_BITS:
            error_v += float(ball_vx.rad()) + float(ball_vy.rad())
        self._state[:, i] = (bodies.time[i], x, y, vx, vy, error, error_v)

    def _fill(self, rows: list[int]) -> None:
        times, errors, errors_v = self._state[0], self._state[5], self._state[6]
        places, speeds = self._state[1:3, None], self._state[3:5, None]
        own = self._state[:, rows, None]
        own_time, place, speed, error, error_v = own[0], own[1:3], own[3:5], own[5], own[6]
        start = np.maximum(times, own_time)
        wait, waits = start - own_time, start - times
        dx, dy = d = (places + speeds * waits) - (place + speed * wait)
        ux, uy = u = speeds - speed
        e = (errors + errors_v * waits) + (error + error_v * wait)
        f = errors_v + error_v
        (d1x, d1y), (u1x, u1y) = np.abs(d), np.abs(u)
        d1, u1 = d1x + d1y, u1x + u1y
        reach = self._radius + self._radius[rows, None]
        c = dx * dx + dy * dy - reach * reach - 2.0 * e * (d1 + e)
        b = e * u1 + f * (d1 + 2.0 * e) - (dx * ux + dy * uy)
        a = np.maximum(ux * ux + uy * uy - 2.0 * f * (u1 + f), 0.0)
        ac, bb = a * c, b * b
        root = bb - ac + (8.0 * UNIT) * (bb + np.abs(ac))
        # Where c <= 0, that is at the start already; where overflow leaves no number, balls will tell.
        wait_for = np.maximum(c, 0.0) / (b + np.sqrt(np.maximum(root, 0.0)))
        bound = (start + wait_for * (1.0 - 16.0 * UNIT)) * (1.0 - 4.0 * UNIT)
        np.copyto(bound, start, where=np.isnan(bound))
        bound[(b <= 0.0) | (root < 0.0)] = math.inf
        bodies, table = self.bodies, self.table
        table[rows, : self.n] = bound
        if self._walls.size:
            self._fill_walls(rows)
        for i in rows:
            row = table[i]
            row[i] = math.inf
            if self._fixed[i]:
                row[: self.n][self._fixed] = math.inf
            partner = bodies.partner[i]
            if partner is not None and partner >= 0 and bodies.have_just_met(i, partner):
                row[partner] = math.inf
            if partner is not None and partner < 0:
                row[self.n + wall_body(partner)] = math.inf

    def _fill_walls(self, rows: list[int]) -> None:
        time, x, y, vx, vy, error, error_v = self._state[:, rows, None]
        qx, qy, nx, ny, length, size, span = self._walls
        toward = error_v * span - (vx * nx + vy * ny)
        gap = (x - qx) * nx + (y - qy) * ny - self._rim[rows, None] * length - (error + 16.0 * UNIT * size) * span
        bound = (time + np.maximum(gap, 0.0) / toward * (1.0 - 16.0 * UNIT)) * (1.0 - 4.0 * UNIT)
        np.copyto(bound, time, where=np.isnan(bound))
        bound[toward <= 0.0] = math.inf
        bound[self._fixed[rows]] = math.inf
        self.table[rows, self.n :] = bound


def _span(normal: tuple[float, float]) -> float:
    return abs(normal[0]) + abs(normal[1])
