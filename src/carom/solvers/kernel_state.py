"""The arrays of the event-driven kernel, built from a start, and the kernel's two forms: plain Python, and compiled."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.physics.compilation import compiled, compiled_error_free
from carom.physics.pair_time import exact_pair_time
from carom.solvers import kernel
from carom.solvers.cells import choose_grid, near_walls
from carom.solvers.layout import (
    CLOCKS,
    INVERSE_MASS,
    LAST,
    NOBODY,
    OWN_TIME,
    PARTNER,
    RADIUS,
    ROW,
    TALLIES,
    TIMES,
    VX,
    VY,
    X,
    Y,
)
from carom.solvers.tournament import level_offsets

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from carom.solvers.disc_arrays import DiscArrays
    from carom.solvers.layout import Column
    from carom.solvers.prediction import Grid

__all__ = ["KernelState", "compiled_kernel", "plain_kernel"]

#: What the compiled kernel is made of, callees first.
_MODULES = (
    "carom.physics.double_double",
    "carom.physics.pair_time",
    "carom.physics.wall_time",
    "carom.physics.impact_law",
    "carom.solvers.tournament",
    "carom.solvers.cells",
    "carom.solvers.prediction",
    "carom.solvers.collision",
    "carom.solvers.kernel",
)


def plain_kernel() -> SimpleNamespace:
    """Return the kernel as plain Python."""
    return SimpleNamespace(run=kernel.run, error_free=exact_pair_time)


def compiled_kernel() -> SimpleNamespace:
    """Return the kernel compiled by numba."""
    return SimpleNamespace(run=compiled(*_MODULES).run, error_free=compiled_error_free())


#: The containers of a state, and the type of each as an array.
_TYPES = {
    "body": np.float64,
    "link": np.int32,
    "walls": np.float64,
    "heads": np.int32,
    "near_wall": np.uint8,
    "times": np.float64,
    "tree": np.float64,
    "levels": np.int64,
    "clock": np.float64,
    "tally": np.int64,
}


@dataclass(frozen=True)
class KernelState:
    """All that a run consists of; the containers are fixed, the kernel changes what they hold.

    Attributes:
        body: Paths; the state proper. So are `link`'s impact counts, `clock` and `tally`; the rest follows from them.
        link: Cells and predictions.
        walls: Four floats a wall.
        heads: First disc of each cell.
        near_wall: Whether a wall is near each cell.
        times: Predicted impact and exit of each disc.
        tree: Tournament tree of the lesser of the two.
        levels: Offsets of its levels.
        clock: Times.
        tally: Counts.
        grid: Corner, width, columns and rows of the cells.
        laws: Restitution of discs, of walls, and contact time of the TC model.
    """

    body: Column
    link: Column
    walls: Column
    heads: Column
    near_wall: Column
    times: Column
    tree: Column
    levels: Column
    clock: Column
    tally: Column
    grid: Grid
    laws: tuple[float, float, float]

    @classmethod
    def of(cls, start: DiscArrays, contact_duration_s: float = 0.0, wider: float = 1.0) -> KernelState:
        """Return the state at the start, as arrays; nothing is predicted yet.

        Args:
            start: The discs and walls.
            contact_duration_s: Contact time of the TC model, 0 for none.
            wider: Factor on the width of a cell; infinity for a single one.
        """
        n = len(start)
        body = _cache_lines(n * ROW)
        rows = body.reshape(n, ROW)
        rows[:, X : Y + 1] = start.position_m
        rows[:, VX : VY + 1] = start.velocity_m_s
        rows[:, OWN_TIME] = 0.0
        rows[:, RADIUS] = start.radius_m
        rows[:, INVERSE_MASS] = 1.0 / start.mass_kg
        link = np.zeros((n, ROW), np.int32)
        link[:, PARTNER] = link[:, LAST] = NOBODY
        low, high = start.position_m.min(axis=0), start.position_m.max(axis=0)
        grid = choose_grid(
            (float(low[0]), float(low[1])), (float(high[0]), float(high[1])), start.largest_reach, n, wider
        )
        size = (grid[3] + 2) * (grid[4] + 2)
        near = np.array(near_walls(grid, start.walls, float(start.radius_m.max())), np.uint8)
        levels, length = level_offsets(n)
        tree = _cache_lines(length)
        tree[:] = math.inf
        return cls(
            body,
            link.ravel(),
            np.array(start.walls, np.float64).ravel(),
            np.full(size, NOBODY, np.int32),
            near,
            np.full(n * TIMES, math.inf),
            tree,
            np.array(levels, np.int64),
            np.zeros(CLOCKS),
            np.zeros(TALLIES, np.int64),
            grid,
            (start.restitution, start.wall_restitution, contact_duration_s),
        )

    def as_lists(self) -> KernelState:
        """Return a copy on lists, for the plain kernel: Python reads a list many times faster than an array."""
        columns: dict[str, Any] = {name: np.asarray(getattr(self, name)).tolist() for name in _TYPES}
        return replace(self, **columns)

    def as_arrays(self) -> KernelState:
        """Return a copy on arrays of the types that the compiled kernel takes."""
        columns: dict[str, Any] = {name: np.array(getattr(self, name), kind) for name, kind in _TYPES.items()}
        for name in ("body", "tree"):
            aligned = _cache_lines(len(columns[name]))
            aligned[:] = columns[name]
            columns[name] = aligned
        return replace(self, **columns)

    def run(
        self, form: SimpleNamespace, records: Column, until: float, impacts: int, window: tuple[float, float]
    ) -> int:
        """Take the state forward, see `carom.solvers.kernel.run`."""
        return int(
            form.run(
                self.body,
                self.link,
                self.walls,
                self.heads,
                self.near_wall,
                self.times,
                self.tree,
                self.levels,
                self.clock,
                self.tally,
                records,
                self.grid,
                self.laws,
                until,
                impacts,
                window,
                form.error_free,
            )
        )

    def paths(self) -> NDArray[np.float64]:
        """Return position, velocity and own time of each disc, shape ``(n, 8)``, in the columns of the layout."""
        return np.asarray(self.body, np.float64).reshape(-1, ROW)

    @property
    def nbytes(self) -> int:
        """Bytes that the arrays take; 0 where they are lists."""
        return sum(getattr(getattr(self, name), "nbytes", 0) for name in _TYPES)


def _cache_lines(length: int) -> NDArray[np.float64]:
    """Return an array of zeros that begins at a cache line (64 bytes), so that a row of eight floats is one line."""
    room = np.zeros(length + 8)
    skip = (-room.ctypes.data % 64) // 8
    return room[skip : skip + length]
