"""The columns of the event-driven kernel, built from a start, and the call of its two forms: plain, and compiled."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.physics.compilation import Recipe, addresses, compiled_unit
from carom.physics.wall_time import wall_time
from carom.solvers import kernel
from carom.solvers.cells import choose_grid, near_walls
from carom.solvers.layout import (
    BATCH,
    CAPACITY,
    CLOCKS,
    FIELD,
    LAST,
    LEAVE,
    MOVES,
    NOBODY,
    OWN_TIME,
    PAIR,
    PARTNER,
    RADIUS,
    RECORD,
    ROW,
    SLOTS,
    TALLIES,
    VX,
    VY,
    Columns,
    X,
    Y,
)
from carom.solvers.prediction import pair_event_time
from carom.solvers.tournament import level_offsets

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from carom.disc_arrays import DiscArrays
    from carom.physics.compilation import Unit
    from carom.solvers.layout import Column

__all__ = ["KernelState", "compiled_kernel", "kernel_recipe"]

_BODY = "float64*"

#: Bytes of a cache line.
_LINE = 64

#: Discs from which it pays to look ahead, since their columns no longer fit into a cache: with it, a run of 8,000 discs
#: took 1.01 of its time without, one of 16,000 .91, one of 30,000 .78 (a processor with 1 MB of cache to itself).
_AHEAD_FROM = 10_000


def kernel_recipe(solution: Callable[[Column, int, int], float] = pair_event_time) -> Recipe:
    """Return what the compiled kernel is made of; the solutions of a pair and of a wall are units of their own.

    Args:
        solution: What stands in for `pair_event_time`, of the same name: benchmarks time the kernel without it.
    """
    pair = Recipe(solution, "float64", (_BODY, "int64", "int64"))
    wall = Recipe(wall_time, "float64", ("float64",) * 9)
    columns = tuple(f"{np.dtype(kind).name}*" for kind in _TYPES.values())
    return Recipe(kernel.run, "int64", (*columns, "float64*", "float64", "int64"), (pair, wall))


def compiled_kernel(solution: Callable[[Column, int, int], float] = pair_event_time) -> Unit:
    """Return `carom.solvers.kernel.run` compiled, see `kernel_recipe`."""
    return compiled_unit(kernel_recipe(solution))


#: The columns of a state, and the type of each as an array.
_TYPES = {
    "body": np.float64,
    "link": np.int32,
    "cells": np.int32,
    "nearby": np.int32,
    "field": np.float64,
    "walls": np.float64,
    "near_wall": np.uint8,
    "inverse_mass": np.float64,
    "last_impact": np.float64,
    "tree": np.float64,
    "winner": np.int32,
    "clock": np.float64,
    "tally": np.int64,
    "law": np.float64,
    "size": np.int64,
}


@dataclass(frozen=True)
class KernelState:
    """All that a run consists of; the containers are fixed, the kernel changes what they hold.

    Attributes:
        columns: Paths, the impact counts in `link`, `clock`, `tally` and `last_impact` are the state proper; the rest
            follows from them. There is no room for impacts yet.
    """

    columns: Columns

    @classmethod
    def of(
        cls,
        start: DiscArrays,
        contact_duration_s: float = 0.0,
        wider: float = 1.0,
        window: tuple[float, float] = (-math.inf, math.inf),
    ) -> KernelState:
        """Return the state at the start, as arrays; nothing is predicted yet.

        Args:
            start: The discs and walls.
            contact_duration_s: Contact time of the TC model, 0 for none.
            wider: Factor on the width of a cell; infinity for a single one.
            window: Impacts reported within these times are kept.
        """
        n = len(start)
        rows = np.zeros((n, ROW))
        rows[:, X : Y + 1] = start.position_m
        rows[:, VX : VY + 1] = start.velocity_m_s
        rows[:, OWN_TIME] = 0.0
        rows[:, RADIUS] = start.radius_m
        rows[:, PAIR] = rows[:, LEAVE] = math.inf
        link = np.zeros((n, ROW), np.int32)
        link[:, PARTNER] = link[:, LAST] = NOBODY
        link[:, MOVES] = np.isfinite(start.mass_kg)
        low, high = start.position_m.min(axis=0), start.position_m.max(axis=0)
        grid = choose_grid(
            (float(low[0]), float(low[1])), (float(high[0]), float(high[1])), start.largest_reach, n, wider
        )
        size = (grid[3] + 2) * (grid[4] + 2)
        near = near_walls(grid, start.walls, float(start.radius_m.max()))
        levels, length = level_offsets(n)
        columns = Columns(
            rows.ravel(),
            link.ravel(),
            np.full(size * SLOTS + n, NOBODY, np.int32),
            np.zeros(BATCH, np.int32),
            np.zeros(FIELD),
            np.array(start.walls, np.float64).ravel(),
            near,
            1.0 / start.mass_kg,
            np.full(n if contact_duration_s > 0 else 0, -math.inf),
            np.full(length, math.inf),
            np.zeros(length, np.int32),
            np.zeros(CLOCKS),
            np.zeros(TALLIES, np.int64),
            np.array([start.restitution, start.wall_restitution, contact_duration_s, *grid[:3], *window]),
            np.array(
                [
                    n,
                    len(start.walls),
                    *grid[3:],
                    grid[3] + 2,
                    size * SLOTS,
                    0,
                    int(n >= _AHEAD_FROM),
                    len(levels) - 1,
                    *levels,
                ],
                np.int64,
            ),
            np.zeros(0),
        )
        return cls(columns).as_arrays()

    def as_lists(self) -> KernelState:
        """Return a copy on lists, for the plain kernel: Python reads a list many times faster than an array."""
        lists = {name: np.asarray(getattr(self.columns, name)).tolist() for name in _TYPES}
        return KernelState(self.columns._replace(**lists))

    def as_arrays(self) -> KernelState:
        """Return a copy on arrays of the types that the compiled kernel takes.

        They lie in one piece of memory, for which a system takes large pages if it is large: that leaves far fewer of
        them to be looked up. Each begins at a cache line, so that a row of eight floats is one.
        """
        columns: dict[str, Any] = {name: np.asarray(getattr(self.columns, name), kind) for name, kind in _TYPES.items()}
        lines = {name: -(-column.nbytes // _LINE) for name, column in columns.items()}
        room = np.empty((sum(lines.values()) + 1) * _LINE, np.uint8)
        begin = -room.ctypes.data % _LINE
        for name, column in columns.items():
            columns[name] = room[begin : begin + column.nbytes].view(column.dtype)
            columns[name][:] = column
            begin += lines[name] * _LINE
        return KernelState(self.columns._replace(**columns))

    def run(self, compiled: Unit | None, records: Column, until: float, impacts: int) -> int:
        """Take the state forward, see `carom.solvers.kernel.run`; as plain Python where `compiled` is None."""
        columns = self.columns._replace(records=records)
        columns.size[CAPACITY] = len(records) // RECORD
        if compiled is None:
            return kernel.run(*columns, until, impacts)
        return int(compiled.ctypes(*addresses(*columns), until, impacts))

    def paths(self) -> NDArray[np.float64]:
        """Return position, velocity and own time of each disc, shape ``(n, 8)``, in the columns of the layout."""
        return np.asarray(self.columns.body, np.float64).reshape(-1, ROW)

    @property
    def nbytes(self) -> int:
        """Bytes that the arrays take; 0 where they are lists."""
        return sum(getattr(column, "nbytes", 0) for column in self.columns)
