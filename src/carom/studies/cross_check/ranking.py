"""Which method stands first: one order for the first line, the terminal's tables and the report."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Sequence

from carom.execution.results import Row
from carom.report.grid import BROKEN, GRADED, Grid, GridColumn, Mark, mark_of

#: Grades that leave nothing to pay for checking once per step.
RIGHT = frozenset({Mark.EXACT, Mark.EXACT_32, Mark.CLOSE})

#: From best to worst, of what a method has an answer to.
_GRADES = tuple(dict.fromkeys(mark.css for mark in Mark if mark in GRADED and mark is not Mark.UNGRADED))

RANKING_NOTE = (
    "The best stands first: the grades of a method, counted from exact, 0, to wrong, 6, with 7 for no answer, have the "
    "least mean over the scenes where it has one; among equals, the lower median error over PIT's."
)


def merit(marks: Sequence[Mark]) -> tuple[int, int, int]:
    """Return what puts the best method first: most scenes exact or close, fewest wrong, fewest worse than sampled."""
    right, wrong = sum(mark in RIGHT for mark in marks), sum(mark is Mark.WRONG or mark in BROKEN for mark in marks)
    return (-right, wrong, sum(mark in GRADED and mark not in RIGHT and mark is not Mark.SAMPLED for mark in marks))


def standing(rows: Sequence[Row | None]) -> tuple[float, float]:
    """Return the place of a method among others by its rows of the same scenes, one a scene: the least is the best.

    It is the mean of its grades, and then the median of the price that it pays: 0 where no scene has one, as where
    nothing meets. One without a grade stands last.
    """
    places = [place for row in rows if (place := _place(mark_of(row))) is not None]
    paid = [row.score.price_paid for row in rows if row is not None and row.score is not None]
    known = [price for price in paid if not math.isnan(price)]
    return statistics.fmean(places) if places else math.inf, statistics.median(known) if known else 0.0


def _place(mark: Mark) -> int | None:
    if mark in BROKEN:
        return len(_GRADES)
    return _GRADES.index(mark.css) if mark.css in _GRADES else None


def ranked(grid: Grid, columns: Iterable[GridColumn]) -> list[GridColumn]:
    """Return methods in order, the best first; what ties stays in the order of the grid's columns."""
    return sorted(columns, key=lambda column: standing([cell.row for cell in grid.cells(column)]))
