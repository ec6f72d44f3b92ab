"""Sections with every run: all cells at every step, their impacts, spread over phases, run times and settings."""

from __future__ import annotations

import dataclasses
import math
import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import NamedTuple

from carom.comparator import Errors, ImpactError, Score
from carom.execution.phases import PhaseSpread
from carom.model.trace import Trace, pair_name
from carom.report import formatting
from carom.report.document import Cell, Column, Media, Section, Table, Text
from carom.report.results_file.line_types import RowLine
from carom.studies.cross_check.cells import Grid, GridCell, GridColumn, keep_worst, omission_note

#: Largest number of listed cells: a browser takes seconds for this many.
MOST_CELLS = 10_000

#: Largest number of runs that have a table of impacts, and largest number of impacts in such a table.
MOST_TABLES = 4
MOST_IMPACTS = 40

SPREAD_NOTE = (
    "An engine can find an impact by luck, because a check happens to fall on it. So each run was repeated with "
    "starts shifted by fractions of a step. For two discs, a formula gives the fraction of starts at which PIT must "
    "miss the impact."
)
RUN_TIME_NOTE = (
    "Run time of all steps divided by PIT's for the same scene and step. Below 1 is faster than PIT. Medians "
    "over scenes."
)
RUN_TIME_DETAIL = (
    "Both times are measured in one session, at each scene's coarsest step. Carom's PIT skips frames at which "
    "nothing can touch. Bit-identical repeats: scenes in which all timed runs, each in a new world of one "
    "process, ended with the same positions and velocities."
)
SETTINGS_NOTE = (
    "Settings at the coarsest step of the first scene that the engine ran. Settings are read back from the engine "
    "where possible."
)


def build_spread_section(grid: Grid) -> Section:
    """Return all cells that were run at several phases, except for PIC, which does not depend on the phase."""
    cells = [
        (cell, cell.line.dt_s, cell.line.spread)
        for cell in grid.runs
        if cell.line.spread and cell.line.spread.phases and cell.column.engine != "pic"
    ]

    def build_column(head: str, say: Callable[[PhaseSpread, float], str]) -> Column:
        return Column(head, lambda item: say(item[2], item[1]))

    columns = (
        Column("scene", lambda item: item[0].scene),
        Column("engine", lambda item: item[0].column.name),
        Column("step", lambda item: formatting.format_step(item[1])),
        build_column("phases", lambda spread, _: str(spread.phases)),
        build_column("velocity error, median", lambda spread, _: formatting.format_number(spread.velocity_median)),
        build_column("velocity error, worst", lambda spread, _: formatting.format_number(spread.velocity_worst)),
        build_column("time error, median", lambda spread, dt_s: formatting.format_steps(spread.time_median_s, dt_s)),
        build_column("time error, worst", lambda spread, dt_s: formatting.format_steps(spread.time_worst_s, dt_s)),
        build_column("missed", lambda spread, _: formatting.format_percent(spread.miss_probability)),
        build_column(
            "PIT must miss", lambda spread, _: formatting.format_percent_or_blank(spread.pit_miss_probability)
        ),
    )
    table = Table(columns, cells, folded=formatting.format_count(len(cells), "cell"), css="cells", only=Media.ON_PAPER)
    return Section("Spread over phases", (table, Text(SPREAD_NOTE, Media.ON_PAPER)) if cells else ())


class _RunTimes(NamedTuple):
    """Run times of a method over PIT's, and whether its timed runs ended with the same bits."""

    column: GridColumn
    ratios: list[float]
    ends: list[int]


def build_run_time_section(grid: Grid) -> Section:
    """Return the measured run times at each scene's coarsest step."""
    found = []
    for column in grid.columns.values():
        lines = [cell.line for cell in grid.list_cells(column)]
        ratios = [line.time_ratio for line in lines if line.time_ratio is not None]
        ends = [line.timing.ends for line in lines if line.timing is not None and line.timing.ends is not None]
        if ratios:
            found.append(_RunTimes(column, ratios, ends))
    medians = {times.column: statistics.median(times.ratios) for times in found}

    def build_median_cell(times: _RunTimes) -> Cell:
        return Cell(formatting.format_ratio(medians[times.column]), part=medians[times.column] / max(medians.values()))

    columns = (
        Column("engine", lambda times: times.column.name),
        Column("median", build_median_cell, number=True),
        Column(
            "range", lambda times: " to ".join(map(formatting.format_ratio, (min(times.ratios), max(times.ratios))))
        ),
        Column("scenes", lambda times: str(len(times.ratios)), number=True),
        Column(
            "bit-identical repeats",
            lambda times: f"{times.ends.count(1)} of {len(times.ends)}" if times.ends else "-",
            number=True,
        ),
    )
    table = Table(columns, found, css="times", only=Media.ON_PAPER)
    notes = (Text(RUN_TIME_NOTE, Media.ON_PAPER), Text(RUN_TIME_DETAIL, Media.ON_PAPER, folded=True))
    return Section("Run time", (table, *notes) if found else ())


def build_settings_section(grid: Grid) -> Section:
    """Return the settings used at the first scene's coarsest step, and how they vary with step and scene."""
    profiles = {info.name: info.profiles for info in grid.results.engines}
    used = formatting.group_by((cell.column, cell.line) for cell in grid.runs if cell.line.settings is not None)
    first = {column: min(lines, key=lambda line: line.refinement) for column, lines in used.items()}
    columns = (
        Column("engine", lambda column: column.name),
        Column("profile", lambda column: Cell(_describe_profile(column, profiles), css="prose")),
        Column("used on", lambda column: first[column].scene),
        Column(
            "settings", lambda column: Cell("; ".join(_describe_settings(first[column], used[column])), css="prose")
        ),
    )
    table = Table(columns, list(used), css="settings", only=Media.ON_PAPER)
    return Section("Settings used", (table, Text(SETTINGS_NOTE, Media.ON_PAPER)) if used else (), level=3)


def _describe_profile(column: GridColumn, profiles: Mapping[str, Mapping[str, str]]) -> str:
    """Describe a profile, and the settings that replace its own."""
    method = column.method
    own = profiles.get(method.engine, {}).get(method.profile, "")
    if not method.tried:
        return own
    values = ", ".join(f"{name} = {formatting.format_setting(value)}" for name, value in method.tried)
    return f"With settings that no profile has: {values}. Other settings are those of {method.profile}: {own}"


def _describe_settings(here: RowLine, lines: Sequence[RowLine]) -> Iterator[str]:
    """Yield each setting of a run, and whether it varies with the step or the scene."""
    same_scene = [line for line in lines if line.scene == here.scene]
    same_step = [line for line in lines if line.dt_s == here.dt_s and line.scene != here.scene]
    for name, value in (here.settings or {}).items():
        on = [
            what
            for what, others in (("step", same_scene), ("scene", same_step))
            if any((other.settings or {}).get(name) != value for other in others)
        ]
        said = f" (varies with the {formatting.join_words(on, 'and the')})" if on else ""
        yield f"{name} = {formatting.format_setting(value)}{said}"


def build_cells_section(grid: Grid) -> Section:
    """Return all cells at all steps."""
    columns = (
        Column("scene", lambda cell: cell.scene),
        Column("engine", lambda cell: cell.column.label),
        Column("profile", lambda cell: cell.column.profile),
        Column("step", lambda cell: formatting.format_step(cell.line.dt_s)),
        Column("grade", lambda cell: dataclasses.replace(cell.mark.cell, title="")),
        Column(
            "expected / missed / invented",
            lambda cell: f"{cell.expected} / {cell.missed} / {cell.invented}" if cell.scored else formatting.ABSENT,
        ),
        Column("error / PIT's", lambda cell: formatting.format_number(cell.cost, 3)),
        *(
            Column(metric.metadata["name"], partial(_format_metric, metric.name))
            for metric in dataclasses.fields(Errors)
        ),
        Column("verdicts", lambda cell: Cell("; ".join(cell.reasons), css="prose")),
    )
    cells = keep_worst(grid.runs, MOST_CELLS, lambda cell: (cell,))
    table = Table(
        columns, cells, folded=formatting.format_count(len(cells), "cell"), css="cells", only=Media.PAGE, packed=True
    )
    return Section("All cells at all steps", (table, *omission_note(cells, grid.runs, "runs", Media.PAGE)))


def _format_metric(name: str, cell: GridCell) -> str:
    """Format a metric of a cell; the metric's name contains its unit."""
    error: float = getattr(cell.errors, name)
    if name.endswith("_s") and not math.isnan(error):
        return f"{formatting.format_seconds(error)} ({formatting.format_steps(error, cell.line.dt_s)})"
    if name.endswith("_rad") and not math.isnan(error):
        return f"{formatting.format_number(math.degrees(error), 3)}°"
    return formatting.format_number(error, 3)


class _Impact(NamedTuple):
    """An impact of the reference, or a spurious one, with its errors in a run."""

    bodies: str
    time_s: float | None
    error: ImpactError | None
    otherwise: str


def _build_error_column(head: str, digits: int, say: Callable[[float, ImpactError], float]) -> Column:
    """Return a column with a number that is computed from a found impact's exact time and errors."""

    def format_error(impact: _Impact) -> str:
        value = math.nan if impact.error is None or impact.time_s is None else say(impact.time_s, impact.error)
        return "" if math.isnan(value) else formatting.format_number(value, digits)

    return Column(head, format_error, number=True)


_REPORTED = _build_error_column("", 9, lambda time_s, error: time_s + error.reported_time_s)
_COLUMNS = (
    Column("bodies", lambda impact: impact.bodies),
    Column(
        "PIC, s",
        lambda impact: "does not happen" if impact.time_s is None else formatting.format_number(impact.time_s, 9),
        number=True,
    ),
    Column("reported, s", lambda impact: impact.otherwise or _REPORTED.say(impact), number=True),
    _build_error_column("path turned, s", 9, lambda time_s, error: time_s + error.effective_time_s),
    _build_error_column("velocity error", 3, lambda _, error: error.velocity),
    _build_error_column("direction, degrees", 3, lambda _, error: math.degrees(error.direction_rad)),
    _build_error_column("restitution", 6, lambda _, error: error.restitution),
)
#: Additional column if discs turn.
_SPIN_COLUMN = _build_error_column("spin error", 3, lambda _, error: error.spin)


def build_impact_tables_section(grid: Grid) -> Section:
    """Return a table of impacts for each run, if there are few runs."""
    ran = [(cell, cell.row) for cell in grid.runs if cell.row and cell.row.trace is not None and cell.row.score]
    tables = []
    for cell, row in ran if len(ran) <= MOST_TABLES else ():
        reference, score, trace = grid.results.references[cell.scene], row.score, row.trace
        assert score is not None and trace is not None  # noqa: S101, PT018 - chosen above
        left_out = len(reference.impacts) - MOST_IMPACTS
        more = [f"{left_out} more impacts are not shown"] if left_out > 0 else []
        table = Table(
            _COLUMNS if trace.spins is None else (*_COLUMNS, _SPIN_COLUMN),
            tuple(_list_impacts(score, trace, reference)),
            title=f"{cell.scene} on {row.job.method.phrase}, dt = {formatting.format_instant(row.job.dt_s)}: "
            f"{cell.mark.sentence}",
            note="\n".join((*cell.reasons, *more)),
            only=Media.DETAIL,
        )
        tables.append(table)
    return Section("Impacts of each run", tuple(tables), only=Media.DETAIL)


def _list_impacts(score: Score, trace: Trace, reference: Trace) -> Iterator[_Impact]:
    found = {error.reference: error for error in score.errors}
    for k, impact in enumerate(reference.impacts[:MOST_IMPACTS]):
        otherwise = "not compared" if k >= score.expected else "not found" if k in score.undecided else "missed"
        yield _Impact(pair_name(impact), float(impact["time_s"]), found.get(k), "" if k in found else otherwise)
    for k in score.spurious:
        reported = formatting.format_number(float(trace.impacts[k]["time_s"]), 9)
        yield _Impact(pair_name(trace.impacts[k]), None, None, reported)
