"""Which runs are shown as pictures: the paper's cases, then the worst of the others."""

from __future__ import annotations

import math
from dataclasses import dataclass

from carom.report.grid import Grid, GridCell
from carom.report.marks import Mark
from carom.runs.execute import MOST_DISCS_DRAWN
from carom.runs.results import Results
from carom.trace import Trace

__all__ = ["PAPER_GROUP", "Divergence", "divergences"]

#: The source paper's four cases are always shown, under the method that the paper shows them of.
PAPER_GROUP = "paper"
WORST_SHOWN = 6

_RANK = {Mark.SAMPLED: 1, Mark.INACCURATE: 2, Mark.WRONG: 3}


@dataclass(frozen=True)
class Divergence:
    """One run beside its reference."""

    cell: GridCell
    reference: Trace
    observed: Trace

    @property
    def scene_name(self) -> str:
        """Name of the scene."""
        return self.reference.scene.name


def divergences(
    results: Results, grid: Grid, *, most_discs: int = MOST_DISCS_DRAWN
) -> tuple[tuple[Divergence, ...], tuple[Divergence, ...]]:
    """Return the paper's cases under PIT, and the worst runs of other scenes, no scene twice, the worst first.

    Args:
        results: The cross-check.
        grid: Its grid.
        most_discs: Scenes of more discs are left out.
    """
    cells = [(row.group, cell) for row in grid.rows if len(row.scene.discs) <= most_discs for cell in row.cells]
    paper = [cell for group, cell in cells if group == PAPER_GROUP and cell.column.engine == "pit"]
    taken = {cell.row.job.scene.name for cell in paper if cell.row is not None}
    worst: dict[str, GridCell] = {}
    for _, cell in sorted(cells, key=lambda item: _badness(item[1]), reverse=True):
        name = cell.row.job.scene.name if cell.row else ""
        if _badness(cell)[0] and name not in taken:
            worst.setdefault(name, cell)
    return (_with_traces(results, paper), _with_traces(results, list(worst.values())[:WORST_SHOWN]))


def _badness(cell: GridCell) -> tuple[int, float, bool, float, float]:
    """Order of shame: grade, share of impacts missed or invented, engines before PIT, velocity, energy."""
    score = cell.row.score if cell.row is not None else None
    rank = _RANK.get(cell.mark, 0)
    if score is None or not rank:
        return (0, 0.0, False, 0.0, 0.0)
    counted = (len(score.missed) + len(score.spurious)) / max(1, score.expected)
    velocity = 0.0 if math.isnan(score.total.velocity) else score.total.velocity
    return (rank, counted, not cell.column.own, velocity, abs(score.total.energy))


def _with_traces(results: Results, cells: list[GridCell]) -> tuple[Divergence, ...]:
    return tuple(
        Divergence(cell, results.references[cell.row.job.scene.name], cell.row.trace)
        for cell in cells
        if cell.row is not None and cell.row.trace is not None and cell.row.job.scene.name in results.references
    )
