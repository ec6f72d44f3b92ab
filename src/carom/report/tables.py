"""The tables of a cross-check: a column is a line here, and every medium shows it."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

from carom.comparator import Score
from carom.comparator.verdict import THRESHOLDS
from carom.report import wording
from carom.report.document import ON_PAPER, PAGE, TERMINAL, Cell, Table
from carom.report.document import Column as Head
from carom.report.grid import NOT_PLANNED, Column, Grid, GridCell, reasons_of
from carom.report.marks import Mark, mark_of
from carom.runs.plan import missing_profile_reason
from carom.runs.results import Results, Row
from carom.trace import Setting, Trace, wall_index

__all__ = [
    "cell_table",
    "grid_table",
    "impact_tables",
    "known_table",
    "mark_cell",
    "profile_table",
    "run_time_table",
    "settings_table",
    "spread_table",
]

#: Impact by impact is for somebody who looks at one scene on an engine or two: more than this is for the report.
MOST_TABLES = 4
MOST_IMPACTS = 40


def mark_cell(mark: Mark, note: str = "") -> Cell:
    """Return a cell that shows a mark with its word."""
    return Cell(mark.word, note, css=mark.css, symbol=mark.symbol, style=mark.style)


def grid_table(grid: Grid, certified: Mapping[str, str]) -> Table:
    """Return every scene on every engine; `certified` says how far a scene's reference is, in a few words."""
    return Table(
        (Head("scene"), *(Head(column.label, column.profile) for column in grid.columns)),
        (
            ("all scenes", *(_tally(grid, column) for column in grid.columns)),
            *(
                (
                    Cell(row.scene.name, certified.get(row.scene.name, ""), title=row.scene.description),
                    *(_grid_cell(row.scene.name, cell) for cell in row.cells),
                )
                for row in grid.rows
            ),
        ),
        css="grid",
    )


def _tally(grid: Grid, column: Column) -> Cell:
    tally = grid.tally(column)
    return Cell(" ".join(f"{n}{mark.symbol}" for mark, n in tally), shares=tuple((mark.css, n) for mark, n in tally))


def _grid_cell(scene: str, cell: GridCell) -> Cell:
    return Cell(
        cell.mark.word,
        cell.figure,
        short=cell.compact or ("" if cell.mark.ran else cell.mark.word),
        title=f"{cell.column.name} on {scene}: {'; '.join(cell.reasons)}",
        css=cell.mark.css,
        symbol=cell.mark.symbol,
        style=cell.mark.style,
    )


def profile_table(results: Results, grid: Grid) -> Table:
    """Return engines down, profiles and variants across: what came of each, or why there is nothing."""
    columns = {(column.engine, column.profile): column for column in grid.columns}
    profiles = tuple(dict.fromkeys(row.job.profile for row in results.rows))
    rows = []
    for info in results.engines:
        cells = []
        for profile in profiles:
            column = columns.get((info.name, profile))
            if column is not None:
                cells.append(wording.listed([f"{n} {mark.word}" for mark, n in grid.tally(column)]))
            elif info.unavailable:
                cells.append(f"unavailable: {info.unavailable}")
            elif profile in info.profiles or info.capabilities is None:
                cells.append(NOT_PLANNED)
            else:
                cells.append(f"none: {missing_profile_reason(profile, info.capabilities)}")
        rows.append((info.name.upper() if info.engine == "Carom" else info.name, *cells))
    return Table((Head("engine"), *map(Head, profiles)), tuple(rows), css="profiles", only=ON_PAPER)


class _Line(NamedTuple):
    """A row of the cross-check with its column of the grid."""

    row: Row
    column: Column

    @property
    def score(self) -> Score | None:
        return self.row.score


def _lines(results: Results, grid: Grid) -> Iterator[_Line]:
    own = {(column.engine, column.profile): column for column in grid.columns}
    for row in results.rows:
        yield _Line(row, own[row.job.engine, row.job.profile])


def spread_table(results: Results, grid: Grid) -> Table:
    """Return every cell that was run at more phases than one; PIC, which no phase can change, is left out."""
    rows = []
    for row, column in _lines(results, grid):
        spread, dt_s = row.spread, row.job.dt_s
        if spread is None or not spread.phases or row.job.engine == "pic":
            continue
        closed = spread.pit_miss_probability
        rows.append(
            (
                row.job.scene.name,
                column.name,
                wording.step(dt_s),
                str(spread.phases),
                wording.number(spread.velocity_median),
                wording.number(spread.velocity_worst),
                wording.steps(spread.time_median_s, dt_s),
                wording.steps(spread.time_worst_s, dt_s),
                wording.percent(spread.miss_probability),
                "" if math.isnan(closed) else wording.percent(closed),
            )
        )
    return Table(
        (
            Head("scene"),
            Head("engine"),
            Head("step"),
            Head("phases"),
            Head("velocity error, median"),
            Head("velocity error, worst"),
            Head("time error, median"),
            Head("time error, worst"),
            Head("missed"),
            Head("PIT must miss"),
        ),
        tuple(rows),
        folded=wording.count(len(rows), "cell"),
        css="cells",
        only=ON_PAPER,
    )


def known_table(results: Results) -> Table:
    """Return every known answer, in the order of the scenes, with PIC's deviation from it."""
    rows = []
    for name, (answer, deviation) in results.known.items():
        sign = "✓" if deviation <= THRESHOLDS.rounding else "✗"
        found = "an impact is missing or wrong" if math.isinf(deviation) else wording.number(deviation)
        source = f"{answer.source}. Convention: {answer.convention}" if answer.convention else answer.source
        impacts = "not known" if answer.count is None else str(answer.count)
        rows.append((name, Cell(source, css="prose"), impacts, f"{sign} {found}"))
    heads = (Head("scene"), Head("source"), Head("impacts", number=True), Head("deviation of PIC", number=True))
    return Table(heads, tuple(rows), only=ON_PAPER)


def run_time_table(grid: Grid) -> Table:
    """Return the run times that were measured, at each scene's coarsest step, in units of what PIT takes."""
    found = []
    for column in grid.columns:
        ratios = [cell.row.time_ratio for cell in grid.cells(column) if cell.row and cell.row.time_ratio is not None]
        if ratios:
            found.append((column, statistics.median(ratios), min(ratios), max(ratios), len(ratios)))
    slowest = max((median for _, median, *_ in found), default=1.0)
    return Table(
        (Head("engine"), Head("median", number=True), Head("least to greatest"), Head("scenes", number=True)),
        tuple(
            (
                column.name,
                Cell(wording.ratio(median), part=median / slowest),
                f"{wording.ratio(low)} to {wording.ratio(high)}",
                str(scenes),
            )
            for column, median, low, high, scenes in found
        ),
        css="times",
        only=ON_PAPER,
    )


def settings_table(results: Results, grid: Grid) -> Table:
    """Return the settings that the first scene's coarsest step used, and how they vary with the step and the scene."""
    profiles = {info.name: info.profiles for info in results.engines}
    rows = []
    for column in grid.columns:
        runs = [
            row
            for row in results.rows
            if (row.job.engine, row.job.profile) == (column.engine, column.profile) and row.trace is not None
        ]
        if not runs:
            continue
        first = min(runs, key=lambda row: row.job.refinement)
        values = [
            f"{name} = {wording.setting(value)}" + (f" ({varies})" if (varies := _variation(name, first, runs)) else "")
            for name, value in _settings(first).items()
        ]
        stands_for = profiles.get(column.engine, {}).get(column.profile, "")
        rows.append(
            (column.name, Cell(stands_for, css="prose"), first.job.scene.name, Cell("; ".join(values), css="prose"))
        )
    heads = (Head("engine"), Head("what the profile stands for"), Head("used on"), Head("settings"))
    return Table(heads, tuple(rows), css="settings", only=ON_PAPER)


def _settings(row: Row) -> Mapping[str, Setting]:
    return row.trace.settings if row.trace is not None else {}


def _variation(name: str, first: Row, runs: list[Row]) -> str:
    """Say on what a setting depends: two runs of one scene differ in the step, two at one step in the scene."""
    here = _settings(first)[name]
    scene = first.job.scene.name
    with_step = any(row.job.scene.name == scene and _settings(row).get(name) != here for row in runs)
    at_same_step = [row for row in runs if row.job.dt_s == first.job.dt_s and row.job.scene.name != scene]
    with_scene = any(_settings(row).get(name) != here for row in at_same_step)
    on = [what for what, varies in (("step", with_step), ("scene", with_scene)) if varies]
    return f"varies with the {wording.listed(on, 'and the')}" if on else ""


def _scored(say: Callable[[Score, Row], str]) -> Callable[[_Line], str]:
    """Return what a column says of a row that was scored; others are absent."""
    return lambda line: wording.ABSENT if line.score is None else say(line.score, line.row)


def _matched(say: Callable[[Score, Row], str]) -> Callable[[_Line], str]:
    """Return what a column says of a row that has an impact in common with the reference; others are absent."""
    return _scored(lambda score, row: say(score, row) if score.errors else wording.ABSENT)


def _impact_counts(score: Score, _: Row) -> str:
    return f"{score.expected} / {len(score.missed)} / {len(score.spurious)}"


def _time_error(score: Score, row: Row) -> str:
    return f"{wording.seconds(score.time_error_s)} ({wording.steps(score.time_error_s, row.job.dt_s)})"


#: The columns of the table of every cell: heading, and what it says of a row. Another one is another line.
_CELL_COLUMNS: tuple[tuple[str, Callable[[_Line], Cell | str]], ...] = (
    ("scene", lambda line: line.row.job.scene.name),
    ("engine", lambda line: line.column.label),
    ("profile", lambda line: line.column.profile),
    ("step", lambda line: wording.step(line.row.job.dt_s)),
    ("grade", lambda line: mark_cell(mark_of(line.row))),
    (
        "expected / missed / invented",
        _scored(lambda score, _: f"{score.expected} / {len(score.missed)} / {len(score.spurious)}"),
    ),
    ("time error", _matched(_time_error)),
    ("velocity error", _matched(lambda score, _: wording.number(score.velocity_error, 3))),
    ("direction error", _matched(lambda score, _: f"{wording.number(math.degrees(score.direction_error_rad), 3)}°")),
    ("energy error", _scored(lambda score, _: wording.number(score.energy_error, 3))),
    ("verdicts", lambda line: Cell("; ".join(reasons_of(line.row)), css="prose")),
)


def cell_table(results: Results, grid: Grid) -> Table:
    """Return every cell that was asked for, at every step."""
    rows = tuple(tuple(say(line) for _, say in _CELL_COLUMNS) for line in _lines(results, grid))
    heads = tuple(Head(head) for head, _ in _CELL_COLUMNS)
    return Table(heads, rows, folded=wording.count(len(rows), "cell"), css="cells", only=PAGE)


def impact_tables(results: Results) -> Iterator[Table]:
    """Yield a table of impacts for each row that was run, where there are few enough rows to read one by one."""
    rows = [row for row in results.rows if row.trace is not None and row.score is not None]
    if len(rows) <= MOST_TABLES:
        for row in rows:
            yield _impact_table(row, row.score, row.trace, results.references[row.job.scene.name])


def _impact_table(row: Row, score: Score | None, trace: Trace | None, reference: Trace) -> Table:
    assert score is not None and trace is not None  # noqa: S101, PT018 - the caller chose rows that were run
    job = row.job
    by_reference = {error.reference: error for error in score.errors}
    rows: list[tuple[str, ...]] = []
    for k, impact in enumerate(reference.impacts[:MOST_IMPACTS]):
        time = float(impact["time_s"])
        bodies = _bodies(int(impact["first"]), int(impact["second"]))
        error = by_reference.get(k)
        if error is None:
            rows.append((bodies, f"{time:.9g}", _not_found(k, score), "", "", "", ""))
            continue
        rows.append(
            (
                bodies,
                f"{time:.9g}",
                f"{time + error.reported_time_s:.9g}",
                "" if math.isnan(error.effective_time_s) else f"{time + error.effective_time_s:.9g}",
                f"{error.velocity:.3g}",
                f"{math.degrees(error.direction_rad):.3g}",
                "" if math.isnan(error.restitution) else f"{error.restitution:.6g}",
            )
        )
    if len(reference.impacts) > MOST_IMPACTS:
        rows.append((f"and {len(reference.impacts) - MOST_IMPACTS} more", "", "", "", "", "", ""))
    for k in score.spurious:
        impact = trace.impacts[k]
        bodies = _bodies(int(impact["first"]), int(impact["second"]))
        rows.append((bodies, "does not happen", f"{float(impact['time_s']):.9g}", "", "", "", ""))
    numbers = ("PIC, s", "reported, s", "path turned, s", "velocity error", "direction, degrees", "restitution")
    return Table(
        (Head("bodies"), *(Head(name, number=True) for name in numbers)),
        tuple(rows),
        title=f"{job.scene.name} on {job.engine} ({job.profile}), dt = {job.dt_s:.6g} s: {score.grade.value}",
        note="\n".join(reasons_of(row)),
        only=TERMINAL,
    )


def _not_found(k: int, score: Score) -> str:
    if k >= score.expected:
        return "beyond the horizon"
    return "not found" if k in score.undecided else "missed"


def _bodies(first: int, second: int) -> str:
    return f"{first} - {second}" if second >= 0 else f"{first} - wall {wall_index(second)}"
