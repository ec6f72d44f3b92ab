"""Section with all cells at all step sizes, one row for each run."""

from __future__ import annotations

import dataclasses
import math
from functools import partial

from carom.comparator import Errors
from carom.report import formatting
from carom.report.document import Cell, Column, Media, Section, Table
from carom.studies.cross_check.grid import Grid, GridCell, keep_worst, omission_note

#: Largest number of listed cells: a browser takes seconds for this many.
MOST_CELLS = 10_000


def build_cells_section(grid: Grid) -> Section:
    """Return all cells at all step sizes."""
    columns = (
        Column("scene", lambda cell: cell.scene),
        Column("engine", lambda cell: cell.column.label),
        Column("profile", lambda cell: cell.column.profile),
        Column("step", lambda cell: formatting.format_step(cell.line.dt_s)),
        Column("grade", lambda cell: dataclasses.replace(cell.mark.cell, title="")),
        Column(
            "expected / missed / invented",
            lambda cell: f"{cell.expected} / {cell.missed} / {cell.invented}" if cell.scored else formatting.ABSENT,
        ),
        Column("error / PIT's", lambda cell: formatting.format_number(cell.cost, 3)),
        *(Column(one.metadata["name"], partial(_format_metric, one.name)) for one in dataclasses.fields(Errors)),
        Column("verdicts", lambda cell: Cell("; ".join(cell.reasons), css="prose")),
    )
    cells = keep_worst(grid.runs, MOST_CELLS, lambda cell: (cell,))
    folded = formatting.format_count(len(cells), "cell")
    table = Table(columns, cells, folded=folded, css="cells", only=Media.PAGE, packed=True)
    return Section("All cells at all steps", (table, *omission_note(cells, grid.runs, "runs", Media.PAGE)))


def _format_metric(name: str, cell: GridCell) -> str:
    """Format a metric of a cell; the metric's name contains its unit."""
    error: float = getattr(cell.errors, name)
    if name.endswith("_s") and not math.isnan(error):
        return f"{formatting.format_seconds(error)} ({formatting.format_steps(error, cell.line.dt_s)})"
    if name.endswith("_rad") and not math.isnan(error):
        return f"{formatting.format_number(math.degrees(error), 3)}°"
    return formatting.format_number(error, 3)
