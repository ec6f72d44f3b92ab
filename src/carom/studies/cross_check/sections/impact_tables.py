"""Section with a table of impacts for each run."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

from carom.comparator import ImpactError, Score
from carom.model.trace import Trace, pair_name
from carom.report.document import Column, Media, Section, Table
from carom.studies.cross_check.grid import Grid
from carom.support import formatting

#: Largest number of runs for which tables of impacts are shown, and largest number of impacts in a table.
MOST_TABLES = 4
MOST_IMPACTS = 40


class _Impact(NamedTuple):
    """An impact of the reference, or an invented impact of a run, with the run's errors."""

    bodies: str
    time_s: float | None
    error: ImpactError | None
    outcome: str


def _build_error_column(head: str, digits: int, compute: Callable[[float, ImpactError], float]) -> Column:
    """Return a column with a number that is computed from an impact's exact time and the run's errors."""

    def format_error(impact: _Impact) -> str:
        value = math.nan if impact.error is None or impact.time_s is None else compute(impact.time_s, impact.error)
        return "" if math.isnan(value) else formatting.format_number(value, digits)

    return Column(head, format_error, number=True)


def _format_time(impact: _Impact) -> str:
    return "does not happen" if impact.time_s is None else formatting.format_number(impact.time_s, 9)


_REPORTED = _build_error_column("", 9, lambda time_s, error: time_s + error.reported_time_s)
_COLUMNS = (
    Column("bodies", lambda impact: impact.bodies),
    Column("PIC, s", _format_time, number=True),
    Column("reported, s", lambda impact: impact.outcome or _REPORTED.content_of(impact), number=True),
    _build_error_column("path turned, s", 9, lambda time_s, error: time_s + error.effective_time_s),
    _build_error_column("velocity error", 3, lambda _, error: error.velocity),
    _build_error_column("direction, degrees", 3, lambda _, error: math.degrees(error.direction_rad)),
    _build_error_column("restitution", 6, lambda _, error: error.restitution),
)
#: Additional column for scenes in which discs spin.
_SPIN_COLUMN = _build_error_column("spin error", 3, lambda _, error: error.spin)


def build_impact_tables_section(grid: Grid) -> Section:
    """Return a table of impacts for each run, if there are few runs."""
    runs = [(cell, cell.compared_run) for cell in grid.runs if cell.compared_run]
    tables = []
    for cell, (trace, score) in runs if len(runs) <= MOST_TABLES else ():
        reference = grid.results.references[cell.scene]
        step = formatting.format_instant(cell.line.dt_s)
        left_out = len(reference.impacts) - MOST_IMPACTS
        omission = [f"{left_out} more impacts are not shown"] if left_out > 0 else []
        table = Table(
            _COLUMNS if trace.spins is None else (*_COLUMNS, _SPIN_COLUMN),
            tuple(_list_impacts(score, trace, reference)),
            title=f"{cell.scene} on {cell.method.phrase}, dt = {step}: {cell.mark.sentence}",
            note="\n".join((*cell.reasons, *omission)),
            only=Media.DETAIL,
        )
        tables.append(table)
    return Section("Impacts of each run", tuple(tables), only=Media.DETAIL)


def _list_impacts(score: Score, trace: Trace, reference: Trace) -> Iterator[_Impact]:
    found = {error.reference: error for error in score.errors}
    for k, impact in enumerate(reference.impacts[:MOST_IMPACTS]):
        reason = "not found" if k in score.undecided else "missed"
        if k >= score.expected:
            reason = "not compared"
        yield _Impact(pair_name(impact), float(impact["time_s"]), found.get(k), "" if k in found else reason)
    for k in score.spurious:
        reported = formatting.format_number(float(trace.impacts[k]["time_s"]), 9)
        yield _Impact(pair_name(trace.impacts[k]), None, None, reported)
