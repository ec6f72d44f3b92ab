"""Terminal summary: the errors of each run of one scene, or the number of scenes per grade."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

from carom.comparator import Score, Verdict
from carom.comparator.thresholds import THRESHOLDS
from carom.execution.results import Results, Row
from carom.report import formatting
from carom.report.document import DETAIL, TERMINAL, Column, Table
from carom.report.grid import Grid, GridColumn, Mark, mark_of
from carom.studies.cross_check.ranking import compute_standing, rank_methods

#: Grades that share a column of counts, by its heading.
_COUNTED = {
    "exact": (Mark.EXACT, Mark.EXACT_32),
    "close": (Mark.CLOSE,),
    "sampled": (Mark.SAMPLED,),
    "inaccurate": (Mark.INACCURATE,),
    "parted": (Mark.PARTED, Mark.PARTED_INACCURATE),
    "wrong": (Mark.WRONG,),
}

NOTE = "Largest errors; time: + is late; n/a: missed or parted; ×: error over PIT's error"  # noqa: RUF001 - the sign of the table


def run_tables(results: Results, grid: Grid, scene: str) -> tuple[Table, ...]:
    """Return one table of errors per step of a scene, the coarsest step and the best run first."""
    scored = _find_scored_runs(results, scene)
    by_step = formatting.together((run.row.job.dt_s, run) for run in scored)
    columns = (
        Column("method", lambda run: _method(grid, run.row)),
        Column("impacts", lambda run: _impacts(run.score), number=True),
        Column("time", lambda run: _time(run.score, run.row.job.dt_s), number=True, under="ms"),
        Column("velocity", lambda run: _percent(run.score, run.score.total.velocity), number=True, under="%"),
        Column("angle", lambda run: _direction(run.score), number=True, under="°"),
        Column("energy", lambda run: _energy(run.score), number=True, under="%"),
        Column("grade", _grade),
    )
    titles = {dt_s: f"at {formatting.step(dt_s)}" if len(by_step) > 1 else "" for dt_s in by_step}
    marks = {mark_of(run.row): None for run in scored}
    words = {mark.symbol: "exact" if mark in _COUNTED["exact"] else mark.word for mark in marks}
    note = f"{', '.join(f'{symbol} {word}' for symbol, word in words.items())}. {NOTE}"
    return tuple(
        Table(columns, runs, title=titles[dt_s], note=note if dt_s == min(by_step) else "", only=TERMINAL | DETAIL)
        for dt_s, runs in by_step.items()
    )


def verdict_lines(results: Results, grid: Grid, scene: str, *, full: bool) -> tuple[str, ...]:
    """Return one line per run of a scene that is not exact, the best first: its verdicts, in full with the numbers.

    Where there are several steps, the short lines are of the coarsest step only.
    """
    runs = _find_scored_runs(results, scene)
    coarsest = max((run.row.job.dt_s for run in runs), default=0.0)
    several = full and any(run.row.job.dt_s != coarsest for run in runs)
    said: dict[str, str] = {}
    for row, score in runs:
        if mark_of(row) in _COUNTED["exact"] or (row.job.dt_s != coarsest and not full):
            continue
        found = (f"{one.verdict.value} ({one.reason})" if full else one.verdict.value for one in score.findings)
        name, step = _method(grid, row), f", {formatting.step(row.job.dt_s)}" if several else ""
        said.setdefault(f"{name}: {'; '.join(found)}", f"{name}{step}")  # the same line at each step is shown once
    return tuple(line.replace(line.partition(":")[0], name, 1) for line, name in said.items())


def counts_table(grid: Grid, methods: Sequence[GridColumn]) -> Table:
    """Return one row per method, the best first: its number of scenes by grade."""
    columns = (
        Column("method", lambda method: method.name),
        *(Column(name, partial(_count, grid, marks), number=True) for name, marks in _COUNTED.items()),
        Column("n/a", partial(_not_graded, grid), number=True),
    )
    return Table(
        columns, rank_methods(grid, methods), only=TERMINAL, note="n/a: not graded or not run; -v lists the reasons"
    )


def _count(grid: Grid, marks: Sequence[Mark], method: GridColumn) -> str:
    return str(sum(cell.mark in marks for cell in grid.cells(method)) or "")


def _not_graded(grid: Grid, method: GridColumn) -> str:
    graded = {mark for marks in _COUNTED.values() for mark in marks}
    return str(sum(cell.mark not in graded for cell in grid.cells(method)) or "")


def _method(grid: Grid, row: Row) -> str:
    return grid.columns[row.job.method].name


class _Run(NamedTuple):
    """A run that has a score."""

    row: Row
    score: Score


def _find_scored_runs(results: Results, scene: str) -> list[_Run]:
    """Find the scored runs of a scene, the best first; PIC's only where there is no other."""
    runs = [_Run(row, row.score) for row in results.rows if row.job.scene.name == scene and row.score is not None]
    runs = [run for run in runs if run.row.job.method.engine != "pic"] or runs
    return sorted(runs, key=lambda run: (-run.row.job.dt_s, compute_standing([run.row])))


def _impacts(score: Score) -> str:
    invented = f" +{len(score.spurious)}" if score.spurious else ""
    return f"{score.expected - len(score.missed) - len(score.undecided)}/{score.expected}{invented}"


def _has_diverged(score: Score) -> bool:
    """Whether the trajectory left the reference's, after which errors of impacts are chance."""
    return Verdict.PARTED in score.verdicts


def _time(score: Score, dt_s: float) -> str:
    error_s = score.total.time_s
    if math.isnan(error_s) or _has_diverged(score):
        return formatting.ABSENT
    if abs(error_s) <= THRESHOLDS.time_rounding_of(score.float_bits, score.scales.time_s, dt_s):
        return "0"
    return f"{'+' if error_s > 0.0 else '-'}{formatting.number(abs(error_s) * 1e3, 3)}"


def _energy(score: Score) -> str:
    shown = _percent(score, score.total.energy)
    return f"+{shown}" if score.total.energy > 0.0 and shown not in ("0", formatting.ABSENT) else shown


def _percent(score: Score, part: float) -> str:
    if _has_diverged(score):
        return formatting.ABSENT
    return "0" if abs(part) <= THRESHOLDS.rounding_of(score.float_bits) else formatting.number(100.0 * part)


def _direction(score: Score) -> str:
    turned = score.total.direction_rad
    if math.isnan(turned) or _has_diverged(score):
        return formatting.ABSENT
    return "0" if turned <= THRESHOLDS.rounding_of(score.float_bits) else formatting.number(math.degrees(turned))


def _grade(run: _Run) -> str:
    """Return the symbol of the grade, and the error over that of PIT."""
    mark, paid = mark_of(run.row), run.score.price_paid
    if mark in _COUNTED["exact"] or math.isnan(paid) or not run.score.errors:
        return f"{mark.symbol} float32" if mark is Mark.EXACT_32 else mark.symbol
    return f"{mark.symbol} {formatting.ratio(paid).replace(' ', '')}"
