"""Sections with the tables of a cross-check. Each column is one line here, and all media show it."""

from __future__ import annotations

import dataclasses
import math
import os
import statistics
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple

from carom.comparator import Errors, Horizon, ImpactError, Score
from carom.execution.phases import PhaseSpread
from carom.execution.plan import missing_profile_reason
from carom.execution.results import Results, Row
from carom.model.trace import Setting, Trace, pair_name
from carom.report import formatting
from carom.report.document import (
    DETAIL,
    IN_FULL,
    ON_PAPER,
    PAGE,
    TERMINAL,
    Block,
    Cell,
    Column,
    Legend,
    Lines,
    Media,
    Replays,
    Section,
    Table,
    Text,
)
from carom.report.grid import Grid, GridCell, GridColumn, GridRow, Mark, NotRun, mark_of, reasons_of
from carom.report.replay import replay_link, scene_replays
from carom.studies.cross_check.play_page import play_link

#: Largest number of runs and of impacts that are listed impact by impact.
MOST_TABLES = 4
MOST_IMPACTS = 40
#: Marks of cells that a reader can act on: install an engine, report a crash, raise a limit.
_ACTIONABLE = (Mark.UNAVAILABLE, Mark.CRASHED, Mark.TIMED_OUT, Mark.FAILED)

FIGURE_NOTE = (
    "Δv is the largest velocity error of a matched impact, over the greatest speed in the scene; where discs turn, RΔω "
    "is that of spin times radius, over the greatest speed of a disc or a rim, where that is more. Where all "
    "velocities and spins are right to rounding, it is told how many steps late or early an impact was found; where "
    "impacts are missed or invented, they are counted. PIC is compared with itself here: what it is worth, the known "
    "answers say."
)
SHORT_NOTE = (
    "0.075: largest velocity error, over the scene's greatest speed; or spin error, where that is more\n"
    "-1 +2: impacts missed and invented\n"
    "0.4 steps: velocities right to rounding, found this many steps late or early"
)
SPREAD_NOTE = (
    "Where in a step an impact falls is luck. Each cell was run again with its scene shifted along its own motion by "
    "parts of a step; where two discs meet, the share that PIT must miss has a closed form."
)
RUN_TIME_NOTE = (
    "Seconds for all steps of a scene over PIT's for the same scene and step: a ratio of two things timed in one run. "
    "Carom's PIT does not look at frames at which nothing can touch; below 1 is faster than it. Median over scenes, at "
    "each scene's coarsest step. The same bits again: in how many of the scenes that were timed all runs, each in "
    "a fresh world of one process, ended with the same positions and velocities."
)
SETTINGS_NOTE = (
    "Read back from the engine where it can be read, at the coarsest step of the first scene that the engine ran."
)


def mark_cell(mark: Mark) -> Cell:
    """Return a cell that shows a mark with its word."""
    return Cell(mark.word, css=mark.css, symbol=mark.symbol, style=mark.style)


def _with_note(note: str, table: Table) -> tuple[Block, ...]:
    """Return a note and its table; empty where the table has no row."""
    return (Text(note, table.only), table) if table.items else ()


def grid_sections(results: Results, grid: Grid) -> Iterator[Section]:
    """Yield the grid of all scenes and engines, and the cells that were not run."""
    columns = [Column("scene", partial(_scene, results))]
    columns += [Column(label, partial(_grid_cell, k), profile) for k, label, profile in _merge_columns(grid)]
    yield Section(
        f"Every scene on every engine, against PIC at {grid.step_phrase}",
        (
            legend(grid, IN_FULL - PAGE),
            Table(columns, grid.rows, css="grid", only=IN_FULL, cards=True),
            Text(FIGURE_NOTE, ON_PAPER),
            Text(SHORT_NOTE, DETAIL),
            Replays(partial(scene_replays, results, grid, play_link=play_link)),
        ),
        short="Every scene",
    )
    # The terminal shows reasons that a reader can act on, and those for which a method has no run.
    important = (entry for entry in grid.unrun if entry.everywhere or entry.mark in _ACTIONABLE)
    lines = (
        Lines(tuple(map(_describe_not_run, grid.unrun)), IN_FULL, folded=formatting.count(len(grid.unrun), "reason")),
        Lines(tuple(map(_describe_not_run, important)), TERMINAL),
        Lines(tuple(_not_installed(results, grid, in_full=True)), IN_FULL),
        Lines(tuple(_not_installed(results, grid, in_full=False)), TERMINAL),
        Lines(tuple(_missing_profiles(results, grid)), ON_PAPER),
    )
    yield Section("Not scored, and why", tuple(block for block in lines if block.items), level=3)


def _merge_columns(grid: Grid) -> Iterator[tuple[int, str, str]]:
    """Yield number and heading of each column; profiles of Carom's own method that agree are merged."""
    columns = list(grid.columns.values())

    def content(k: int) -> list[tuple[Mark, str]]:
        return [(row.cells[k].mark, row.cells[k].figure) for row in grid.rows]

    for k, column in enumerate(columns):
        same = [j for j, other in enumerate(columns) if column.own and other.engine == column.engine]
        if len(same) < 2 or any(content(j) != content(k) for j in same):
            yield k, column.label, column.profile
        elif k == same[-1]:
            yield k, column.label, ""


def legend(grid: Grid, only: Media) -> Legend:
    """Return the meanings of the marks of a grid."""
    return Legend(tuple((mark_cell(mark), mark.meaning) for mark in grid.marks), only)


def _scene(results: Results, row: GridRow) -> Cell:
    """Return a scene's name, with how far its reference is certified."""
    found = results.certified.get(row.scene.name, "")
    if isinstance(found, Horizon):
        reach = f"certified to impact {found.certified}"
    else:
        reach = found.partition(";")[0].partition(":")[0]
    return Cell(row.scene.name, reach, title=row.scene.description)


def _grid_cell(k: int, row: GridRow) -> Cell:
    """Return the cell of a scene in the k-th column."""
    cell: GridCell = row.cells[k]
    return dataclasses.replace(
        mark_cell(cell.mark),
        note=cell.figure,
        link=replay_link(cell),
        short=cell.compact or ("" if cell.mark.ran else cell.mark.word),
        title="" if cell.has_replay else f"{cell.column.name} on {row.scene.name}: {'; '.join(cell.reasons)}",
    )


def _describe_not_run(entry: NotRun) -> str:
    where = "every scene" if entry.everywhere else formatting.listed(entry.scenes)
    return f"{formatting.listed(entry.columns)}, {entry.mark.word} on {where}: {entry.reason}"


def _not_installed(results: Results, grid: Grid, *, in_full: bool) -> Iterator[str]:
    """Describe engines that were not run because they are not installed, unless asked for by name."""
    run = {method.engine for method in grid.columns}
    missing = [info for info in results.engines if info.missing and info.name not in run]
    if in_full:
        here = f"{Path.cwd()}{os.sep}"  # reports go to others: below the working folder, paths begin there
        yield from (f"{info.name} is not run: {info.unavailable.replace(here, '')}" for info in missing)
    elif missing:
        yield (
            f"Not installed: {formatting.listed([info.name for info in missing])}; 'carom engines' says how to get "
            "them."
        )


def _missing_profiles(results: Results, grid: Grid) -> Iterator[str]:
    """Describe why an engine does not have a profile that others were run with."""
    profiles = dict.fromkeys(method.profile for method, column in grid.columns.items() if not column.own)
    for info in results.engines:
        for profile in profiles:
            if info.available and info.capabilities is not None and not info.own_profiles([profile]):
                yield f"{info.name} has no profile {profile}: {missing_profile_reason(profile, info.capabilities)}"


def _spread_column(say: Callable[[PhaseSpread, float], str]) -> Callable[[Row], str]:
    """Return a column's text as a function of a row's spread over phases and its step."""
    return lambda row: "" if row.spread is None else say(row.spread, row.job.dt_s)


def spread_section(results: Results, grid: Grid) -> Section:
    """Return every cell that was run at several phases; PIC, which does not depend on the phase, is left out."""
    rows = [row for row in results.rows if row.spread is not None and row.spread.phases and row.job.engine != "pic"]
    columns = (
        Column("scene", lambda row: row.job.scene.name),
        Column("engine", lambda row: grid.columns[row.job.method].name),
        Column("step", lambda row: formatting.step(row.job.dt_s)),
        Column("phases", _spread_column(lambda spread, _: str(spread.phases))),
        Column("velocity error, median", _spread_column(lambda spread, _: formatting.number(spread.velocity_median))),
        Column("velocity error, worst", _spread_column(lambda spread, _: formatting.number(spread.velocity_worst))),
        Column("time error, median", _spread_column(lambda spread, dt_s: formatting.steps(spread.time_median_s, dt_s))),
        Column("time error, worst", _spread_column(lambda spread, dt_s: formatting.steps(spread.time_worst_s, dt_s))),
        Column("missed", _spread_column(lambda spread, _: formatting.percent(spread.miss_probability))),
        Column("PIT must miss", _spread_column(lambda spread, _: formatting.share(spread.pit_miss_probability))),
    )
    folded = formatting.count(len(rows), "cell")
    table = Table(columns, rows, folded=folded, css="cells", only=ON_PAPER)
    return Section("Spread over phases", _with_note(SPREAD_NOTE, table))


class _RunTimes(NamedTuple):
    """Run times of a column of the grid, over PIT's."""

    column: GridColumn
    ratios: list[float]
    ends: list[int]

    @property
    def repeats(self) -> str:
        """Number of scenes in which all timed runs ended in the same bits."""
        return f"{self.ends.count(1)} of {len(self.ends)}" if self.ends else "-"

    @property
    def median(self) -> float:
        """The median ratio."""
        return statistics.median(self.ratios)


def run_time_section(grid: Grid) -> Section:
    """Return the measured run times at each scene's coarsest step."""
    rows = {column: [cell.row for cell in grid.cells(column) if cell.row] for column in grid.columns.values()}
    every = [
        _RunTimes(
            column,
            [row.time_ratio for row in own if row.time_ratio is not None],
            [row.timing.ends for row in own if row.timing is not None and row.timing.ends is not None],
        )
        for column, own in rows.items()
    ]
    found = [times for times in every if times.ratios]
    slowest = max((times.median for times in found), default=1.0)
    columns = (
        Column("engine", lambda times: times.column.name),
        Column("median", lambda times: Cell(formatting.ratio(times.median), part=times.median / slowest), number=True),
        Column(
            "least to greatest",
            lambda times: f"{formatting.ratio(min(times.ratios))} to {formatting.ratio(max(times.ratios))}",
        ),
        Column("scenes", lambda times: str(len(times.ratios)), number=True),
        Column("the same bits again", lambda times: times.repeats, number=True),
    )
    return Section("Run time", _with_note(RUN_TIME_NOTE, Table(columns, found, css="times", only=ON_PAPER)))


def settings_section(results: Results, grid: Grid) -> Section:
    """Return the settings used at the first scene's coarsest step, and how they vary with step and scene."""
    profiles = {info.name: info.profiles for info in results.engines}
    runs: dict[GridColumn, list[Row]] = {
        column: [row for row in results.rows if row.job.method == method and row.trace is not None]
        for method, column in grid.columns.items()
    }
    found = [(column, min(own, key=lambda row: row.job.refinement), own) for column, own in runs.items() if own]
    columns = (
        Column("engine", lambda item: item[0].name),
        Column(
            "what the profile stands for",
            lambda item: Cell(_describe_profile(item[0], profiles), css="prose"),
        ),
        Column("used on", lambda item: item[1].job.scene.name),
        Column("settings", lambda item: Cell("; ".join(_values(item[1], item[2])), css="prose")),
    )
    table = Table(columns, found, css="settings", only=ON_PAPER)
    return Section("Settings really used", (table, Text(SETTINGS_NOTE, ON_PAPER)) if found else (), level=3)


def _describe_profile(column: GridColumn, profiles: Mapping[str, Mapping[str, str]]) -> str:
    """Describe a profile, and the settings tried instead of its own."""
    method = column.method
    own = profiles.get(method.engine, {}).get(method.profile, "")
    if not method.tried:
        return own
    values = ", ".join(f"{name} = {formatting.setting(value)}" for name, value in method.tried)
    return f"Tried, and no profile's own: {values}. Instead of these, {method.profile}: {own}"


def _values(first: Row, runs: list[Row]) -> Iterator[str]:
    for name, value in _settings(first).items():
        varies = _variation(name, first, runs)
        yield f"{name} = {formatting.setting(value)}" + (f" ({varies})" if varies else "")


def _settings(row: Row) -> Mapping[str, Setting]:
    return row.trace.settings if row.trace is not None else {}


def _variation(name: str, first: Row, runs: list[Row]) -> str:
    """Describe whether a setting varies with the step or the scene."""
    here = _settings(first)[name]
    scene = first.job.scene.name
    with_step = any(row.job.scene.name == scene and _settings(row).get(name) != here for row in runs)
    at_same_step = [row for row in runs if row.job.dt_s == first.job.dt_s and row.job.scene.name != scene]
    with_scene = any(_settings(row).get(name) != here for row in at_same_step)
    on = [what for what, varies in (("step", with_step), ("scene", with_scene)) if varies]
    return f"varies with the {formatting.listed(on, 'and the')}" if on else ""


def _score_column(say: Callable[[Score], str]) -> Callable[[Row], str]:
    """Return a column's text as a function of a score; rows without a score are absent."""
    return lambda row: formatting.ABSENT if row.score is None else say(row.score)


def _metric(name: str, row: Row) -> str:
    """Format a metric of a row; the metric's name contains its unit."""
    if row.score is None:
        return formatting.ABSENT
    error: float = getattr(row.score.total, name)
    if name.endswith("_s") and not math.isnan(error):
        return f"{formatting.seconds(error)} ({formatting.steps(error, row.job.dt_s)})"
    if name.endswith("_rad") and not math.isnan(error):
        return f"{formatting.number(math.degrees(error), 3)}°"
    return formatting.number(error, 3)


def cell_sections(results: Results, grid: Grid) -> Iterator[Section]:
    """Yield all cells at all steps and, where there are few, the impacts of each."""
    columns = (
        Column("scene", lambda row: row.job.scene.name),
        Column("engine", lambda row: grid.columns[row.job.method].label),
        Column("profile", lambda row: row.job.method.profile_shown),
        Column("step", lambda row: formatting.step(row.job.dt_s)),
        Column("grade", lambda row: mark_cell(mark_of(row))),
        Column(
            "expected / missed / invented",
            _score_column(lambda score: f"{score.expected} / {len(score.missed)} / {len(score.spurious)}"),
        ),
        Column("error / PIT's", _score_column(lambda score: formatting.number(score.price_paid, 3))),
        *(Column(metric.metadata["name"], partial(_metric, metric.name)) for metric in dataclasses.fields(Errors)),
        Column("verdicts", lambda row: Cell("; ".join(reasons_of(row)), css="prose")),
    )
    cells = formatting.count(len(results.rows), "cell")
    table = Table(columns, results.rows, folded=cells, css="cells", only=PAGE, packed=True)
    yield Section("Every cell, at every step", (table,))
    yield Section("Impact by impact", tuple(_impact_tables(results)), only=DETAIL)


class _ImpactRow(NamedTuple):
    """An impact of the reference or a spurious one, with its errors in a run."""

    bodies: str
    time_s: float | None
    error: ImpactError | None
    otherwise: str

    @property
    def true_time(self) -> str:
        return "does not happen" if self.time_s is None else formatting.number(self.time_s, 9)


def _error_column(say: Callable[[float, ImpactError], str]) -> Callable[[_ImpactRow], str]:
    """Return a column's text as a function of a found impact's true time and errors."""
    return lambda impact: "" if impact.error is None or impact.time_s is None else say(impact.time_s, impact.error)


_IMPACT_COLUMNS = (
    Column("bodies", lambda impact: impact.bodies),
    Column("PIC, s", lambda impact: impact.true_time, number=True),
    Column(
        "reported, s",
        lambda impact: (
            impact.otherwise or _error_column(lambda time, e: formatting.number(time + e.reported_time_s, 9))(impact)
        ),
        number=True,
    ),
    Column("path turned, s", _error_column(lambda time, e: _unless_nan(time + e.effective_time_s, 9)), number=True),
    Column("velocity error", _error_column(lambda _, e: formatting.number(e.velocity, 3)), number=True),
    Column(
        "direction, degrees",
        _error_column(lambda _, e: formatting.number(math.degrees(e.direction_rad), 3)),
        number=True,
    ),
    Column("restitution", _error_column(lambda _, e: _unless_nan(e.restitution, 6)), number=True),
)
#: A further column where discs turn.
_SPIN_COLUMN = Column("spin error", _error_column(lambda _, e: _unless_nan(e.spin, 3)), number=True)


def _impact_tables(results: Results) -> Iterator[Table]:
    """Yield a table of impacts for each row that was run, if there are few rows."""
    ran = [(row, row.trace, row.score) for row in results.rows if row.trace is not None and row.score is not None]
    for row, trace, score in ran if len(ran) <= MOST_TABLES else ():
        job, reference = row.job, results.references[row.job.scene.name]
        left_out = len(reference.impacts) - MOST_IMPACTS
        more = [f"{left_out} more impacts are not shown"] if left_out > 0 else []
        yield Table(
            _IMPACT_COLUMNS if trace.spins is None else (*_IMPACT_COLUMNS, _SPIN_COLUMN),
            tuple(_impacts(score, trace, reference)),
            title=f"{job.scene.name} on {job.method.phrase}, dt = "
            f"{formatting.instant(job.dt_s)}: "
            f"{mark_of(row).sentence}",
            note="\n".join((*reasons_of(row), *more)),
            only=DETAIL,
        )


def _impacts(score: Score, trace: Trace, reference: Trace) -> Iterator[_ImpactRow]:
    found = {error.reference: error for error in score.errors}
    for k, impact in enumerate(reference.impacts[:MOST_IMPACTS]):
        otherwise = "" if k in found else _not_found(k, score)
        yield _ImpactRow(pair_name(impact), float(impact["time_s"]), found.get(k), otherwise)
    for k in score.spurious:
        yield _ImpactRow(
            pair_name(trace.impacts[k]), None, None, formatting.number(float(trace.impacts[k]["time_s"]), 9)
        )


def _not_found(k: int, score: Score) -> str:
    if k >= score.expected:
        return "not compared"
    return "not found" if k in score.undecided else "missed"


def _unless_nan(value: float, digits: int) -> str:
    return "" if math.isnan(value) else f"{value:.{digits}g}"
