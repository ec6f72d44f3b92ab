"""Pictures of faults: the source paper's cases under PIT, and the worst runs, each next to its reference."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

from carom.execution.results import Results
from carom.model.trace import Trace
from carom.report import formatting
from carom.report.document import ON_PAPER, Pair, Pairs, Section, Text
from carom.report.grid import Grid, GridCell, Mark
from carom.report.picture import draw_pair
from carom.studies.cross_check.tables import mark_cell
from carom.support.limits import MOST_DISCS_DRAWN

#: Group of the source paper's four cases, which are always shown for the paper's method, PIT.
PAPER_GROUP = "paper"
WORST_SHOWN = 3
_RANK = {Mark.SAMPLED: 1, Mark.INACCURATE: 2, Mark.PARTED: 3, Mark.PARTED_INACCURATE: 4, Mark.WRONG: 5}

PICTURE_NOTE = (
    "The reference next to the run, drawn to one scale. Outline with a number: a disc at the start; tinted: at an "
    "impact; filled: at the end. Dots are the frames that a run looks at; dashed: those just before and just after "
    "what is missed. Where everything moves along one line, position is drawn against time."
)


class Divergence(NamedTuple):
    """One run next to its reference."""

    cell: GridCell
    reference: Trace
    observed: Trace


def picture_sections(results: Results, grid: Grid) -> Iterator[Section]:
    """Yield the sections with pictures of runs."""
    paper, worst = find_divergences(results, grid)
    if paper or worst:
        yield Section("What goes wrong", (Text(PICTURE_NOTE, ON_PAPER),))
    for heading, shown in (("The source paper's cases, by PIT", paper), ("The worst of the other scenes", worst)):
        if shown:
            yield Section(heading, (Pairs(tuple(map(_pair, shown))),), level=3)


def _pair(entry: Divergence) -> Pair:
    """Return a picture with the method, the step, and every verdict with its numbers."""
    cell, reference, observed = entry
    scene, name, row = reference.scene, cell.column.name, cell.row
    said = f"{name} at {formatting.step(row.job.dt_s) if row else ''}: {'; '.join(cell.reasons)}."
    missed = row.score.missed if row and row.score else ()
    labels = (f"Exact: {scene.name}, by PIC", f"{scene.name}: {said}")
    return Pair(
        scene.name,
        mark_cell(cell.mark),
        (
            f"PIC: {formatting.count(len(reference.impacts), 'impact')}",
            f"{name}: {formatting.count(len(observed.impacts), 'impact')}",
        ),
        partial(draw_pair, reference, observed, missed, labels),
        tuple(filter(None, (scene.description, said))),
    )


def find_divergences(
    results: Results, grid: Grid, *, most_discs: int = MOST_DISCS_DRAWN
) -> tuple[tuple[Divergence, ...], tuple[Divergence, ...]]:
    """Find the paper's cases under PIT, and the worst runs of other scenes, no scene twice, the worst first.

    Args:
        results: The cross-check.
        grid: Its grid.
        most_discs: Scenes of more discs are left out.
    """
    drawn = [row for row in grid.rows if len(row.scene.discs) <= most_discs]
    cells = [cell for row in drawn for cell in row.cells]
    of_paper = [cell for row in drawn if row.scene.name.startswith(f"{PAPER_GROUP}/") for cell in row.cells]
    paper = [cell for cell in of_paper if cell.column.engine == "pit"]
    paper_scenes = {cell.row.job.scene.name for cell in paper if cell.row is not None}
    worst: dict[str, GridCell] = {}
    for cell in sorted(cells, key=_badness, reverse=True):
        name = cell.row.job.scene.name if cell.row else ""
        if _badness(cell)[0] and name not in paper_scenes:
            worst.setdefault(name, cell)
    return (_with_traces(results, paper), _with_traces(results, list(worst.values())[:WORST_SHOWN]))


def _badness(cell: GridCell) -> tuple[int, float, bool, float, float]:
    """Return the sort key of a run: grade, share of wrong impacts, engines before PIT, velocity, energy."""
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
