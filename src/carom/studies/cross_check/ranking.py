"""Which method stands first: one order for the first line, the terminal's tables and the report."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Sequence

from carom.pages.grid import BROKEN, GRADED, Grid, GridColumn, Mark, mark_of
from carom.runs.results import Row

__all__ = ["RANKING_NOTE", "RIGHT", "merit", "ranked", "standing"]

#: Grades that leave nothing to pay for looking once a step.
RIGHT = frozenset({Mark.EXACT, Mark.EXACT_32, Mark.CLOSE})

RANKING_NOTE = (
    "The best stands first: most scenes exact or close, then fewest wrong or without an answer, then fewest worse than "
    "sampled; among equals the better grades, then the lower median error by PIT's."
)


def merit(marks: Sequence[Mark]) -> tuple[int, int, int]:
    """Return what puts the best method first: most scenes exact or close, fewest wrong, fewest worse than sampled."""
    right, wrong = sum(mark in RIGHT for mark in marks), sum(mark is Mark.WRONG or mark in BROKEN for mark in marks)
    return (-right, wrong, sum(mark in GRADED and mark not in RIGHT and mark is not Mark.SAMPLED for mark in marks))


def standing(rows: Sequence[Row | None]) -> tuple[int, int, int, int, float]:
    """Return the place of a method among others by its rows of the same scenes, one a scene: the least is the best.

    After its merit come the better grades, and the median of the price that it pays: 0 where no scene has one, as
    where nothing meets.
    """
    marks, order = [mark_of(row) for row in rows], list(Mark)
    paid = [row.score.price_paid for row in rows if row is not None and row.score is not None]
    known = [price for price in paid if not math.isnan(price)]
    return (*merit(marks), sum(map(order.index, marks)), statistics.median(known) if known else 0.0)


def ranked(grid: Grid, columns: Iterable[GridColumn]) -> list[GridColumn]:
    """Return methods in order, the best first; what ties stays in the order of the grid's columns."""
    return sorted(columns, key=lambda column: standing([cell.row for cell in grid.cells(column)]))
