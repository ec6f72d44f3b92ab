"""The tables of a cross-check: a column is a line here, and every medium shows it."""

from __future__ import annotations

import dataclasses
import math
import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple, TypeAlias, TypeVar

from carom.comparator import Errors, ImpactError, Score
from carom.comparator.thresholds import THRESHOLDS
from carom.report import wording
from carom.report.document import DETAIL, IN_FULL, ON_PAPER, PAGE, Cell, Share, Table
from carom.report.document import Column as Head
from carom.report.grid import NOT_PLANNED, Column, Grid, GridCell, reasons_of
from carom.report.marks import Mark, mark_of
from carom.report.overview import replay_link
from carom.runs.phases import PhaseSpread
from carom.runs.plan import missing_profile_reason
from carom.runs.results import Results, Row
from carom.scenes import KnownAnswer
from carom.trace import Setting, Trace, pair_name

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


Item = TypeVar("Item")
Columns: TypeAlias = Sequence[tuple[Head | str, Callable[[Item], Cell | str]]]


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
        only=IN_FULL,
    )


def _tally(grid: Grid, column: Column) -> Cell:
    tally = grid.tally(column)
    return Cell(
        " ".join(f"{n}{mark.symbol}" for mark, n in tally),
        shares=tuple(Share(mark.css, n, mark.symbol, mark.style) for mark, n in tally),
    )


def _grid_cell(scene: str, cell: GridCell) -> Cell:
    return Cell(
        cell.mark.word,
        cell.figure,
        link=replay_link(cell),
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


def _lines(results: Results, grid: Grid) -> Iterator[_Line]:
    own = {(column.engine, column.profile): column for column in grid.columns}
    for row in results.rows:
        yield _Line(row, own[row.job.engine, row.job.profile])


def _spread(say: Callable[[PhaseSpread, float], str]) -> Callable[[_Line], str]:
    """Return what a column says of a row's spread over phases, and its step."""
    return lambda line: "" if line.row.spread is None else say(line.row.spread, line.row.job.dt_s)


_SPREAD_COLUMNS: Columns[_Line] = (
    ("scene", lambda line: line.row.job.scene.name),
    ("engine", lambda line: line.column.name),
    ("step", lambda line: wording.step(line.row.job.dt_s)),
    ("phases", _spread(lambda spread, _: str(spread.phases))),
    ("velocity error, median", _spread(lambda spread, _: wording.number(spread.velocity_median))),
    ("velocity error, worst", _spread(lambda spread, _: wording.number(spread.velocity_worst))),
    ("time error, median", _spread(lambda spread, dt_s: wording.steps(spread.time_median_s, dt_s))),
    ("time error, worst", _spread(lambda spread, dt_s: wording.steps(spread.time_worst_s, dt_s))),
    ("missed", _spread(lambda spread, _: wording.percent(spread.miss_probability))),
    ("PIT must miss", _spread(lambda spread, _: wording.share(spread.pit_miss_probability))),
)


def spread_table(results: Results, grid: Grid) -> Table:
    """Return every cell that was run at more phases than one; PIC, which no phase can change, is left out."""
    lines = [
        line
        for line in _lines(results, grid)
        if line.row.spread is not None and line.row.spread.phases and line.row.job.engine != "pic"
    ]
    return Table.made(_SPREAD_COLUMNS, lines, folded=wording.count(len(lines), "cell"), css="cells", only=ON_PAPER)


def _known_deviation(item: tuple[str, tuple[KnownAnswer, float]]) -> str:
    deviation = item[1][1]
    sign = "✓" if deviation <= THRESHOLDS.rounding else "✗"
    return f"{sign} {'an impact is missing or wrong' if math.isinf(deviation) else wording.number(deviation)}"


def _known_source(item: tuple[str, tuple[KnownAnswer, float]]) -> Cell:
    answer = item[1][0]
    convention = f". Convention: {answer.convention}" if answer.convention else ""
    return Cell(f"{answer.source}{convention}", css="prose")


def known_table(results: Results) -> Table:
    """Return every known answer, in the order of the scenes, with PIC's deviation from it."""
    columns: Columns[tuple[str, tuple[KnownAnswer, float]]] = (
        ("scene", lambda item: item[0]),
        ("source", _known_source),
        (Head("impacts", number=True), lambda item: "not known" if item[1][0].count is None else str(item[1][0].count)),
        (Head("deviation of PIC", number=True), _known_deviation),
    )
    return Table.made(columns, results.known.items(), only=ON_PAPER)


def run_time_table(grid: Grid) -> Table:
    """Return the run times that were measured, at each scene's coarsest step, in units of what PIT takes."""
    cells = {column: [cell.row for cell in grid.cells(column) if cell.row] for column in grid.columns}
    ratios = {column: [row.time_ratio for row in rows if row.time_ratio is not None] for column, rows in cells.items()}
    found = [(column, times) for column, times in ratios.items() if times]
    slowest = max((statistics.median(times) for _, times in found), default=1.0)
    columns: Columns[tuple[Column, list[float]]] = (
        ("engine", lambda item: item[0].name),
        (Head("median", number=True), lambda item: _meter(statistics.median(item[1]), slowest)),
        ("least to greatest", lambda item: f"{wording.ratio(min(item[1]))} to {wording.ratio(max(item[1]))}"),
        (Head("scenes", number=True), lambda item: str(len(item[1]))),
    )
    return Table.made(columns, found, css="times", only=ON_PAPER)


def _meter(ratio: float, of: float) -> Cell:
    return Cell(wording.ratio(ratio), part=ratio / of)


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


def _scored(say: Callable[[Score], str]) -> Callable[[_Line], str]:
    """Return what a column says of a row that was scored; others are absent."""
    return lambda line: wording.ABSENT if line.row.score is None else say(line.row.score)


def _metric(name: str) -> Callable[[_Line], str]:
    """Return what a column says of one of the metrics, whose unit its name tells."""

    def say(line: _Line) -> str:
        if line.row.score is None:
            return wording.ABSENT
        error: float = getattr(line.row.score.total, name)
        if name.endswith("_s") and not math.isnan(error):
            return f"{wording.seconds(error)} ({wording.steps(error, line.row.job.dt_s)})"
        if name.endswith("_rad") and not math.isnan(error):
            return f"{wording.number(math.degrees(error), 3)}°"
        return wording.number(error, 3)

    return say


#: The columns of the table of every cell: heading, and what it says of a row. Another one is another line; every metric
#: of `Errors` has its own.
_CELL_COLUMNS: Columns[_Line] = (
    ("scene", lambda line: line.row.job.scene.name),
    ("engine", lambda line: line.column.label),
    ("profile", lambda line: line.column.profile),
    ("step", lambda line: wording.step(line.row.job.dt_s)),
    ("grade", lambda line: mark_cell(mark_of(line.row))),
    (
        "expected / missed / invented",
        _scored(lambda score: f"{score.expected} / {len(score.missed)} / {len(score.spurious)}"),
    ),
    ("price paid", _scored(lambda score: wording.number(score.price_paid, 3))),
    *((metric.metadata["name"], _metric(metric.name)) for metric in dataclasses.fields(Errors)),
    ("verdicts", lambda line: Cell("; ".join(reasons_of(line.row)), css="prose")),
)


def cell_table(results: Results, grid: Grid) -> Table:
    """Return every cell that was asked for, at every step."""
    folded = wording.count(len(results.rows), "cell")
    return Table.made(_CELL_COLUMNS, _lines(results, grid), folded=folded, css="cells", only=PAGE)


class _Found(NamedTuple):
    """An impact of the reference, or one that a run has invented, and what the run has of it."""

    bodies: str
    time_s: float | None
    error: ImpactError | None
    otherwise: str

    @property
    def true_time(self) -> str:
        return "does not happen" if self.time_s is None else f"{self.time_s:.9g}"


def _found(say: Callable[[float, ImpactError], str]) -> Callable[[_Found], str]:
    """Return what a column says of an impact that was found, from its true time and its errors."""
    return lambda impact: "" if impact.error is None or impact.time_s is None else say(impact.time_s, impact.error)


_IMPACT_COLUMNS: Columns[_Found] = (
    ("bodies", lambda impact: impact.bodies),
    (Head("PIC, s", number=True), lambda impact: impact.true_time),
    (
        Head("reported, s", number=True),
        lambda impact: impact.otherwise or _found(lambda time, e: f"{time + e.reported_time_s:.9g}")(impact),
    ),
    (Head("path turned, s", number=True), _found(lambda time, e: _unless_nan(time + e.effective_time_s, 9))),
    (Head("velocity error", number=True), _found(lambda _, e: f"{e.velocity:.3g}")),
    (Head("direction, degrees", number=True), _found(lambda _, e: f"{math.degrees(e.direction_rad):.3g}")),
    (Head("restitution", number=True), _found(lambda _, e: _unless_nan(e.restitution, 6))),
)


def impact_tables(results: Results) -> Iterator[Table]:
    """Yield a table of impacts for each row that was run, where there are few enough rows to read one by one."""
    rows = [row for row in results.rows if row.trace is not None and row.score is not None]
    if len(rows) > MOST_TABLES:
        return
    for row in rows:
        if row.trace is not None and row.score is not None:
            job, reference = row.job, results.references[row.job.scene.name]
            left_out = len(reference.impacts) - MOST_IMPACTS
            more = f"\n{left_out} more impacts are not shown" if left_out > 0 else ""
            yield Table.made(
                _IMPACT_COLUMNS,
                _impacts(row.score, row.trace, reference),
                title=f"{job.scene.name} on {job.engine} ({job.profile}), dt = {job.dt_s:.6g} s: "
                f"{row.score.grade.value}",
                note="\n".join(reasons_of(row)) + more,
                only=DETAIL,
            )


def _impacts(score: Score, trace: Trace, reference: Trace) -> Iterator[_Found]:
    found = {error.reference: error for error in score.errors}
    for k, impact in enumerate(reference.impacts[:MOST_IMPACTS]):
        otherwise = "" if k in found else _not_found(k, score)
        yield _Found(pair_name(impact), float(impact["time_s"]), found.get(k), otherwise)
    for k in score.spurious:
        yield _Found(pair_name(trace.impacts[k]), None, None, f"{float(trace.impacts[k]['time_s']):.9g}")


def _not_found(k: int, score: Score) -> str:
    if k >= score.expected:
        return "beyond the horizon"
    return "not found" if k in score.undecided else "missed"


def _unless_nan(value: float, digits: int) -> str:
    return "" if math.isnan(value) else f"{value:.{digits}g}"
