"""The spread of a cell's errors over sub-step phases, in words."""

from __future__ import annotations

import math
from typing import NamedTuple

from carom.report import wording
from carom.report.grid import Column, Grid
from carom.runner import Results

__all__ = ["SpreadLine", "spread_lines"]


class SpreadLine(NamedTuple):
    """One cell over its phases."""

    scene: str
    column: Column
    dt: str
    phases: int
    velocity_median: str
    velocity_worst: str
    time_median: str
    time_worst: str
    missed: str
    pit_missed: str
    coarsest: bool


def spread_lines(results: Results, grid: Grid) -> tuple[SpreadLine, ...]:
    """Return every cell that was run at more phases than one; PIC, which no phase can change, is left out."""
    own = {(column.engine, column.profile): column for column in grid.columns}
    lines = []
    for row in results.rows:
        spread, dt_s = row.spread, row.cell.dt_s
        if spread is None or not spread.phases or row.cell.engine == "pic":
            continue
        closed = spread.pit_miss_probability
        lines.append(
            SpreadLine(
                scene=row.cell.scene.name,
                column=own[row.cell.engine, row.cell.profile],
                dt=wording.step(dt_s),
                phases=spread.phases,
                velocity_median=wording.number(spread.velocity_median),
                velocity_worst=wording.number(spread.velocity_worst),
                time_median=wording.steps(spread.time_median_s, dt_s),
                time_worst=wording.steps(spread.time_worst_s, dt_s),
                missed=wording.percent(spread.miss_probability),
                pit_missed="" if math.isnan(closed) else wording.percent(closed),
                coarsest=row.cell.refinement == 0,
            )
        )
    return tuple(lines)
