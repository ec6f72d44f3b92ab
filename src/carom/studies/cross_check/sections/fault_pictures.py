"""Pictures of faults: PIT's runs of the scenes from the paper that inspired Carom, and the worst other runs.

Each run is shown next to PIC's run.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial

from carom.model.trace import Trace
from carom.report.document import Media, Pair, Pairs, Section, Text
from carom.studies.cross_check.grid import Grid, GridCell
from carom.support import formatting
from carom.support.limits import MOST_DISCS_DRAWN

#: Group of the four scenes from the paper that inspired Carom. PIT, the paper's method, is always shown in these
#: scenes.
PAPER_GROUP = "paper"
WORST_SHOWN = 3

PICTURE_NOTE = (
    "PIC's run is shown next to each run, to the same scale. If everything moves along one line, position is drawn "
    "against time. A disc has an outline and a number at the start, a tint at an impact, and a fill at the end. Dots "
    "are frames. Dashed discs show the frames around a missed impact."
)


def build_picture_sections(grid: Grid) -> Iterator[Section]:
    """Yield the sections with pictures of runs."""
    paper, worst = find_divergences(grid)
    if paper or worst:
        yield Section("What goes wrong", (Text(PICTURE_NOTE, Media.ON_PAPER),))
    for heading, runs in (("PIT on the source paper's scenes", paper), ("The worst runs of other scenes", worst)):
        if runs:
            yield Section(heading, (Pairs(tuple(_build_pair(grid, cell) for cell in runs)),), level=3)


def _build_pair(grid: Grid, cell: GridCell) -> Pair:
    """Return pictures of the reference and the run, with the method, the step size, and all verdicts."""
    assert cell.compared_run is not None  # noqa: S101 - `find_divergences` only returns cells with a run
    reference, (observed, _) = grid.results.references[cell.scene], cell.compared_run
    scene, name = reference.scene, cell.method.title
    sentence = f"{name} at {formatting.format_step(observed.dt_s)}: {'; '.join(cell.reasons)}."
    labels = (f"Exact: {scene.name}, by PIC", f"{scene.name}: {sentence}")
    due, found = (formatting.format_count(len(trace.impacts), "impact") for trace in (reference, observed))
    sides = (f"PIC: {due}", f"{name}: {found}")
    draw = partial(_draw_pair, reference, observed, cell.line.missed or (), labels)
    return Pair(scene.name, cell.mark.cell, sides, draw, tuple(filter(None, (scene.description, sentence))))


def _draw_pair(reference: Trace, observed: Trace, missed: Sequence[int], labels: tuple[str, str]) -> list[str]:
    from carom.report.picture import draw_pair  # imported here, because only a page contains pictures

    return draw_pair(reference, observed, missed, labels)


def find_divergences(grid: Grid) -> tuple[tuple[GridCell, ...], tuple[GridCell, ...]]:
    """Find PIT's runs of the paper's scenes, and the worst runs of other scenes.

    The second result contains one run for each of the `WORST_SHOWN` worst scenes, worst first. Scenes with too many
    discs for a picture are omitted.
    """
    drawable = [name for name, one in grid.results.references.items() if len(one.scene.discs) <= MOST_DISCS_DRAWN]
    cells = [cell for row in grid.rows if row.name in drawable for cell in row.cells if cell.compared_run]
    paper = [cell for cell in cells if cell.scene.startswith(f"{PAPER_GROUP}/") and cell.method.engine == "pit"]
    paper_scenes = {cell.scene for cell in paper}
    worst: dict[str, GridCell] = {}
    for cell in sorted(cells, key=_compute_severity, reverse=True):
        if (cell.mark.rank or 0) > 1 and cell.scene not in paper_scenes:
            worst.setdefault(cell.scene, cell)
    return tuple(paper), tuple(worst.values())[:WORST_SHOWN]


def _compute_severity(cell: GridCell) -> tuple[int, float, bool, float, float]:
    """Return a sort key, which is largest for the worst run.

    The key consists of the grade, the fraction of wrong impacts, whether an engine ran the scene, the velocity error
    and the energy error.
    """
    velocity = 0.0 if math.isnan(cell.errors.velocity) else cell.errors.velocity
    share = (cell.missed + cell.invented) / max(1, cell.expected)
    return (cell.mark.rank or 0, share, not cell.method.is_own, velocity, abs(cell.errors.energy))
