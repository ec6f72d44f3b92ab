"""Rigorous float64 lower bounds of times of impact: they discard nearly all pairs, so that balls are for the few left.

Of each disc the table holds a float64 state at its exact reference instant with a bound on the error of every
coordinate. For two discs, with relative position d, known to e a coordinate, and relative velocity u, known to f,

    |d + u t|^2 - R^2  >=  a' t^2 - 2 B t + c'   for all t >= 0,
    c' = d.d - R^2 - 2 e |d|_1 - 2 e^2,   B = -d.u + e |u|_1 + f |d|_1 + 2 e f,   a' = u.u - 2 f |u|_1 - 2 f^2,

so the true discs do not touch before the least zero of the right side. The roundings of this are covered by what is
added to e and f: 16 units of 2^-53 of each disc's coordinates, radius and speed, where each term costs at most 6.

The bounds come in three forms with the same roundings: plain Python on lists for few discs, where a call of NumPy costs
more than all the arithmetic; NumPy; and, after many impacts, compiled. NumPy's warnings of overflow are for the caller
to silence.

Under gravity the states are those in the falling frame, where the bounds of pairs hold as they are; walls get none.

Where products overflow, nothing is known but that the impact is not before the start of both paths: that is the bound
then. Where they underflow, they are off by some 2^-1075: in a', B and c' what e and f hold at least covers it, in
B^2 - a' c' and in the quotient a term of its own.
"""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.physics.compilation import Recipe, addresses, compiled_unit, compiler_installed, is_cached
from carom.solvers.certified.bound_kernel import DISC_COLUMNS, FLOOR, TINY, UNIT, begin, raise_bound, renew
from carom.trace import wall_body

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from carom.solvers.certified.bodies import BallBodies

__all__ = ["CACHED_FROM", "COMPILED_FROM", "PLAIN_UP_TO", "LowerBounds", "impacts_so_far", "load_compiled"]

#: Bits of accuracy from which a ball's radius is no more than half a unit in the last place of its float64.
SHARP_BITS = 54
#: Columns of the table up to which plain Python is quicker than NumPy.
PLAIN_UP_TO = 16
#: Impacts in this process from which the compiled form pays for being compiled, and for being loaded where that was
#: done before: at 64 discs so many take NumPy as long (``python -m carom.bench.switch``).
COMPILED_FROM = 10_000
CACHED_FROM = 100
_impacts = [0]

_FLOATS, _INTEGERS = "float64*", "int64*"
_TABLE = (_FLOATS, _FLOATS, _INTEGERS, _INTEGERS)
_RECIPES = (
    Recipe(renew, "int64", (_FLOATS, _FLOATS, _INTEGERS, *_TABLE, *("int64",) * 4)),
    Recipe(raise_bound, "int64", (*_TABLE, "int64", "int64", "float64", "float64", "int64", "int64")),
)


def _compiled_pays() -> bool:
    """Whether so many impacts have been bounded that more are to be expected than the compiled form costs."""
    if _impacts[0] < CACHED_FROM or not compiler_installed():
        return False
    return _impacts[0] >= COMPILED_FROM or _were_cached()


@functools.cache
def _were_cached() -> bool:
    return all(map(is_cached, _RECIPES))


def load_compiled() -> None:
    """Load the compiled form now, so that what follows is bounded by it from the first impact on."""
    for each in _RECIPES:
        compiled_unit(each)
    _impacts[0] = max(_impacts[0], COMPILED_FROM)


def impacts_so_far() -> int:
    """Return how many impacts NumPy has bounded in this process."""
    return _impacts[0]


class LowerBounds:
    """A lower bound of the time of impact for each disc (row) with each disc and each wall (columns).

    The bound of two discs stands in the row of the one that changed last; the other entry is infinity.

    Attributes:
        form: "plain", "numpy" or "compiled".
        rivals: How many bounds, the raised one among them, were not above the time given to `raise_to`; 2 for more.
    """

    def __init__(self, bodies: BallBodies, form: str | None = None) -> None:
        self.bodies = bodies
        scene = bodies.scene
        n, walls = len(bodies), len(scene.walls)
        self.n, self.width = n, n + walls
        self.rivals = 0
        self.form = form or ("plain" if self.width <= PLAIN_UP_TO else "numpy")
        self._chosen = form is not None
        self._state: Any = np.zeros((DISC_COLUMNS, n))
        self._state[7] = [disc.radius_m for disc in scene.discs]
        self._state[8] = self._state[7] * (1.0 + 8.0 * UNIT)
        self._state[9] = [disc.immovable for disc in scene.discs]
        self._rims = self._state[8].tolist()
        self._fixed = self._state[9] != 0.0
        edges = [
            (*w.point_m, *w.normal, math.hypot(*w.normal) * (1 + 4 * UNIT), max(map(abs, w.point_m)), _span(w.normal))
            for w in scene.walls
        ]
        self._walls = np.array(edges).T.copy()
        if bodies.falls:  # no bound for parabolas: as where products overflow, it is the start of the path
            self._walls[:] = math.nan
        self._containers: list[Any] = [
            self._state.ravel(),
            self._walls.ravel(),
            np.full(n, -1, np.int64),
            np.full(n * self.width, math.inf),
            np.full(n, math.inf),
            np.zeros(n, np.int64),
            np.zeros(2, np.int64),
        ]
        if self.form == "plain":
            self._containers = [array.tolist() for array in self._containers]
        self._flat, _, self._skip, self._flat_table, self.least, self.column, self._found = self._containers
        self._renew: Callable[..., int] = renew
        self._raise: Callable[..., int] = raise_bound
        self._arguments = self._containers
        for i in range(n):
            self._load(i)
        if self.form == "plain":
            plain: Any = begin  # mypy counts no unpacked list
            self._best = plain(*self._containers, n, walls)
        else:
            self.table = self._flat_table.reshape(n, self.width)
            for i in range(n):
                self._fill([i])
                self.table[i, :i] = math.inf
            self._find(np.arange(n))
            self._best = int(self.least.argmin())
        if self.form == "compiled":
            self._compile()

    def changed(self, *discs: int) -> None:
        """Take over the state of discs after an impact, and bound their future anew."""
        moved = [i for i in discs if self.bodies.movable[i]]
        for i in moved:
            self._load(i)
        if self.form != "numpy":
            self._best = self._renew(*self._arguments, moved[0], moved[-1], self.n, self.width - self.n)
            return
        stale = self.column == moved[0]
        for i in moved:
            self.table[:, i] = math.inf
            stale |= self.column == i
            stale[i] = True
        self._fill(moved)
        if len(moved) == 2:
            self.table[moved[1], moved[0]] = math.inf  # it stands in the other's row, where they have not just met
        self._find(stale.nonzero()[0])
        self._best = int(self.least.argmin())
        _impacts[0] += 1
        if not self._chosen and _compiled_pays():
            self._compile()

    def raise_to(self, i: int, column: int, bound: float, until: float) -> None:
        """Replace one bound by a better one, and count in `rivals` the bounds that are not above `until`."""
        if self.form != "numpy":
            self._best = self._raise(*self._arguments[3:], i, column, bound, until, self.n, self.width)
            self.rivals = int(self._found[1])
            return
        self.table[i, column] = bound
        self._find(np.array([i]))
        rows = (self.least <= until).nonzero()[0]
        self.rivals = min(2, int((self.table[rows] <= until).sum()))
        self._best = int(self.least.argmin())

    def earliest(self) -> tuple[float, int, int]:
        """Return the least bound of all, its row and its column."""
        i = self._best
        return float(self.least[i]), i, int(self.column[i])

    def at(self, i: int, column: int) -> float:
        """Return one bound."""
        return float(self._flat_table[i * self.width + column])

    def no_later_than(self, time: float) -> list[tuple[int, int]]:
        """Return rows and columns of all bounds up to a time."""
        if self.form == "plain":
            return [divmod(k, self.width) for k, bound in enumerate(self._flat_table) if bound <= time]
        rows = (self.least <= time).nonzero()[0].tolist()
        return [(i, column) for i in rows for column in (self.table[i] <= time).nonzero()[0].tolist()]

    def second(self, column: int) -> int:
        """Return the body number that a column stands for."""
        return column if column < self.n else wall_body(column - self.n)

    def _compile(self) -> None:
        """Go on with the compiled form, on the same arrays."""
        self._renew, self._raise = (compiled_unit(each).ctypes for each in _RECIPES)
        self._arguments = addresses(*self._containers)
        self.form = "compiled"

    def _find(self, rows: NDArray[np.intp]) -> None:
        columns = self.table[rows].argmin(axis=1)
        self.column[rows] = columns
        self.least[rows] = self.table[rows, columns]

    def _load(self, i: int) -> None:
        bodies, state, n = self.bodies, self._flat, self.n
        ball_x, ball_y, ball_vx, ball_vy = bodies.x[i], bodies.y[i], bodies.vx[i], bodies.vy[i]
        x, y, vx, vy = float(ball_x), float(ball_y), float(ball_vx), float(ball_vy)
        # Conversion is off by less than a unit in the last place, and a sharp ball adds half of one: 3 halves in all.
        error = 19.0 * UNIT * (max(abs(x), abs(y)) + self._rims[i]) + TINY
        error_v = 19.0 * UNIT * max(abs(vx), abs(vy)) + TINY
        if ball_x.rel_accuracy_bits() < SHARP_BITS or ball_y.rel_accuracy_bits() < SHARP_BITS:
            error += float(ball_x.rad()) + float(ball_y.rad())
        if ball_vx.rel_accuracy_bits() < SHARP_BITS or ball_vy.rel_accuracy_bits() < SHARP_BITS:
            error_v += float(ball_vx.rad()) + float(ball_vy.rad())
        state[i], state[n + i], state[2 * n + i] = bodies.time[i], x, y
        state[3 * n + i], state[4 * n + i], state[5 * n + i], state[6 * n + i] = vx, vy, error, error_v
        partner = bodies.partner[i]
        if partner is None:
            return
        if partner < 0:
            self._skip[i] = -1 if bodies.falls else n + wall_body(partner)
        else:
            self._skip[i] = partner if bodies.have_just_met(i, partner) else -1

    def _fill(self, rows: list[int]) -> None:
        table = self.table
        table[rows, : self.n] = self._pair_bounds(rows)
        if self._walls.size:
            table[rows, self.n :] = self._wall_bounds(rows)
        for i in rows:
            row = table[i]
            row[i] = math.inf
            if self._fixed[i]:
                row[: self.n][self._fixed] = math.inf
            if self._skip[i] >= 0:
                row[self._skip[i]] = math.inf

    def _pair_bounds(self, rows: list[int]) -> NDArray[np.float64]:
        times, errors, errors_v, radius = self._state[0], self._state[5], self._state[6], self._state[7]
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
        reach = radius + radius[rows, None]
        c = dx * dx + dy * dy - reach * reach - 2.0 * e * (d1 + e)
        b = e * u1 + f * (d1 + 2.0 * e) - (dx * ux + dy * uy)
        a = np.maximum(ux * ux + uy * uy - 2.0 * f * (u1 + f), 0.0)
        ac, bb = a * c, b * b
        size = bb + np.abs(ac)
        root = bb - ac + (8.0 * UNIT * size + FLOOR)
        wait_for = np.maximum(c, 0.0) / (b + np.sqrt(np.maximum(root, 0.0))) * (1.0 - 16.0 * UNIT) - FLOOR
        bound: NDArray[np.float64] = (start + np.maximum(wait_for, 0.0)) * (1.0 - 4.0 * UNIT)
        bound[root < 0.0] = math.inf
        np.copyto(bound, start, where=~(size < math.inf))
        bound[(b <= 0.0) & (b > -math.inf)] = math.inf
        return bound

    def _wall_bounds(self, rows: list[int]) -> NDArray[np.float64]:
        time, x, y, vx, vy, error, error_v = self._state[:7, rows, None]
        qx, qy, nx, ny, length, size, span = self._walls
        toward = error_v * span - (vx * nx + vy * ny)
        rim = self._state[8, rows, None]
        gap = (x - qx) * nx + (y - qy) * ny - rim * length - (error + 16.0 * UNIT * size) * span
        wait = np.maximum(gap, 0.0) / toward * (1.0 - 16.0 * UNIT) - FLOOR
        bound: NDArray[np.float64] = (time + np.maximum(wait, 0.0)) * (1.0 - 4.0 * UNIT)
        np.copyto(bound, time, where=~((gap < math.inf) & (toward < math.inf)))
        bound[(toward <= 0.0) & (toward > -math.inf)] = math.inf
        bound[self._fixed[rows]] = math.inf
        return bound


def _span(normal: tuple[float, float]) -> float:
    return abs(normal[0]) + abs(normal[1])
