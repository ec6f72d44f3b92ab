"""Ranking of methods: one order for the headline, the terminal's tables and the report."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Sequence

from carom.execution.results import Row
from carom.report.grid import BROKEN, GRADED, Grid, GridColumn, Mark, mark_of

#: Marks of runs without the errors of checking once per step.
RIGHT = frozenset({Mark.EXACT, Mark.EXACT_32, Mark.CLOSE})

#: Grades from best to worst.
_GRADES = tuple(dict.fromkeys(mark.css for mark in Mark if mark in GRADED and mark is not Mark.UNGRADED))

RANKING_NOTE = (
    "The best stands first: the grades of a method, counted from exact, 0, to wrong, 6, with 7 for no answer, have the "
    "least mean over the scenes where it has one; among equals, the lower median error over PIT's."
)


def count_outcomes(marks: Sequence[Mark]) -> tuple[int, int, int]:
    """Count outcomes as a sort key: most scenes exact or close, fewest wrong, fewest worse than sampled."""
    right, wrong = sum(mark in RIGHT for mark in marks), sum(mark is Mark.WRONG or mark in BROKEN for mark in marks)
    return (-right, wrong, sum(mark in GRADED and mark not in RIGHT and mark is not Mark.SAMPLED for mark in marks))


def compute_standing(rows: Sequence[Row | None]) -> tuple[float, float]:
    """Compute the sort key of a method from its rows of the same scenes, one per scene; the least is the best.

    It is the mean of its grades, then the median error over PIT's, which is 0 where no scene has one. A method without
    a grade is last.
    """
    places = [place for row in rows if (place := _grade_number(mark_of(row))) is not None]
    paid = [row.score.price_paid for row in rows if row is not None and row.score is not None]
    known = [price for price in paid if not math.isnan(price)]
    return statistics.fmean(places) if places else math.inf, statistics.median(known) if known else 0.0


def _grade_number(mark: Mark) -> int | None:
    if mark in BROKEN:
        return len(_GRADES)
    return _GRADES.index(mark.css) if mark.css in _GRADES else None


def rank_methods(grid: Grid, columns: Iterable[GridColumn]) -> list[GridColumn]:
    """Sort methods, the best first; ties stay in the order of the grid's columns."""
    return sorted(columns, key=lambda column: compute_standing([cell.row for cell in grid.cells(column)]))
