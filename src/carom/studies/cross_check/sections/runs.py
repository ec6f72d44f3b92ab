"""Sections on all runs: results at different phases, run times, settings, and the numbers of every run and impact."""

from __future__ import annotations

import dataclasses
import math
import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import NamedTuple

from carom.comparator import Errors, ImpactError, Score
from carom.execution.job import Method
from carom.model.trace import Trace, pair_name
from carom.report.document import Cell, Column, Media, Section, Table, Text
from carom.report.results_file.lines import RowLine
from carom.studies.cross_check.grid import Grid, GridCell, select_worst
from carom.support import formatting

#: Largest number of rows in the table of all runs. A browser takes seconds to show a table of this length.
MOST_CELLS = 10_000

#: Largest number of runs for which tables of impacts are shown, and largest number of impacts in a table.
MOST_TABLES = 4
MOST_IMPACTS = 40

SPREAD_NOTE = (
    "An engine finds an impact by luck if one of its checks happens to come while the discs overlap. Therefore each "
    "run was repeated at several phases (shifts by fractions of a step). For two discs, a formula gives the fraction "
    "of phases at which PIT must miss the impact."
)
RUN_TIME_NOTE = (
    "Each number is a method's run time divided by PIT's run time for the same scene and step size. The median is over "
    "scenes. A method with a number below 1 is faster than PIT."
)
RUN_TIME_DETAIL = (
    "The times are for all steps of a run, with each scene's largest step size. A method and PIT are timed in the same "
    "session. Carom's PIT skips frames at which nothing can touch. 'Bit-identical repeats' counts scenes in which all "
    "timed runs ended with the same positions and velocities. Each run created a new simulation in the same process."
)
SETTINGS_NOTE = (
    "The settings are those of the first scene that the engine ran, at the largest step size. Carom reads settings "
    "back from the engine where possible."
)


def build_spread_section(grid: Grid) -> Section:
    """Return a section on runs that were repeated at several phases.

    PIC is omitted, because it does not depend on the phase.
    """
    cells = [one for one in grid.runs if one.line.spread and one.line.spread.phases and one.method.engine != "pic"]
    number, percent, steps = formatting.format_number, formatting.format_percent, formatting.format_steps
    percent_or_blank = formatting.format_percent_or_blank
    columns = (
        Column("scene", lambda cell: cell.scene),
        Column("engine", lambda cell: cell.method.title),
        Column("step", lambda cell: formatting.format_step(cell.line.dt_s)),
        Column("phases", lambda cell: str(cell.line.spread.phases)),
        Column("velocity error, median", lambda cell: number(cell.line.spread.velocity_median)),
        Column("velocity error, worst", lambda cell: number(cell.line.spread.velocity_worst)),
        Column("time error, median", lambda cell: steps(cell.line.spread.time_median_s, cell.line.dt_s)),
        Column("time error, worst", lambda cell: steps(cell.line.spread.time_worst_s, cell.line.dt_s)),
        Column("missed", lambda cell: percent(cell.line.spread.miss_probability)),
        Column("PIT must miss", lambda cell: percent_or_blank(cell.line.spread.pit_miss_probability)),
    )
    table = Table(columns, cells, folded=formatting.format_count(len(cells), "cell"), css="cells", only=Media.ON_PAPER)
    return Section("Spread over phases", (table, Text(SPREAD_NOTE, Media.ON_PAPER)) if cells else ())


def build_run_time_section(grid: Grid) -> Section:
    """Return the measured run times at each scene's largest step size."""
    lines = {method: [cell.line for cell in grid.list_cells(method)] for method in grid.methods}
    timings = {method: [line.timing for line in own_lines if line.timing] for method, own_lines in lines.items()}
    ends = {method: [one.ends for one in own if one.ends is not None] for method, own in timings.items()}
    ratios = {
        method: [line.time_ratio for line in own_lines if line.time_ratio is not None]
        for method, own_lines in lines.items()
    }
    medians = {method: statistics.median(own_ratios) for method, own_ratios in ratios.items() if own_ratios}

    def format_repeats(method: Method) -> str:
        return f"{ends[method].count(1)} of {len(ends[method])}" if ends[method] else "-"

    def build_median_cell(method: Method) -> Cell:
        return Cell(formatting.format_ratio(medians[method]), part=medians[method] / max(medians.values()))

    columns = (
        Column("engine", lambda method: method.title),
        Column("median", build_median_cell, number=True),
        Column("range", lambda method: " to ".join(formatting.format_ratio(end(ratios[method])) for end in (min, max))),
        Column("scenes", lambda method: str(len(ratios[method])), number=True),
        Column("bit-identical repeats", format_repeats, number=True),
    )
    table = Table(columns, list(medians), css="times", only=Media.ON_PAPER)
    notes = (Text(RUN_TIME_NOTE, Media.ON_PAPER), Text(RUN_TIME_DETAIL, Media.ON_PAPER, folded=True))
    return Section("Run time", (table, *notes) if medians else ())


def build_settings_section(grid: Grid) -> Section:
    """Return a section with the settings of each profile, and which settings vary with the step size or the scene."""
    profiles = {info.name: info.profiles for info in grid.results.engines}
    used = formatting.group_by((cell.method, cell.line) for cell in grid.runs if cell.line.settings is not None)
    first = {method: min(lines, key=lambda line: line.refinement) for method, lines in used.items()}
    columns = (
        Column("engine", lambda method: method.title),
        Column("profile", lambda method: Cell(_describe_profile(method, profiles), css="prose")),
        Column("used on", lambda method: first[method].scene),
        Column("settings", lambda one: Cell("; ".join(_describe_settings(first[one], used[one])), css="prose")),
    )
    table = Table(columns, list(used), css="settings", only=Media.ON_PAPER)
    return Section("Settings used", (table, Text(SETTINGS_NOTE, Media.ON_PAPER)) if used else (), level=3)


def _describe_profile(method: Method, profiles: Mapping[str, Mapping[str, str]]) -> str:
    """Describe a profile, and the settings that the user has replaced."""
    profile_text = profiles.get(method.engine, {}).get(method.profile, "")
    if not method.overrides:
        return profile_text
    values = ", ".join(f"{name} = {formatting.format_setting(value)}" for name, value in method.overrides)
    return f"Replaced settings: {values}. All other settings are those of {method.profile}: {profile_text}"


def _describe_settings(row_line: RowLine, lines: Sequence[RowLine]) -> Iterator[str]:
    """Yield each setting of a run with its value, and whether the value varies with the step size or the scene."""
    same_scene = [line for line in lines if line.scene == row_line.scene]
    same_step = [line for line in lines if line.dt_s == row_line.dt_s and line.scene != row_line.scene]
    for name, value in (row_line.settings or {}).items():
        by = {"step": same_scene, "scene": same_step}
        on = [dimension for dimension, own in by.items() if any((one.settings or {}).get(name) != value for one in own)]
        variation = f" (varies with the {formatting.join_words(on, 'and the')})" if on else ""
        yield f"{name} = {formatting.format_setting(value)}{variation}"


def build_cells_section(grid: Grid) -> Section:
    """Return a section with one row for each cell, at all step sizes."""
    columns = (
        Column("scene", lambda cell: cell.scene),
        Column("engine", lambda cell: cell.method.heading),
        Column("profile", lambda cell: cell.method.profile_shown),
        Column("step", lambda cell: formatting.format_step(cell.line.dt_s)),
        Column("grade", lambda cell: cell.mark.cell._replace(title="")),
        Column(
            "expected / missed / invented",
            lambda cell: f"{cell.expected} / {cell.missed} / {cell.invented}" if cell.scored else formatting.ABSENT,
        ),
        Column("error / PIT's", lambda cell: formatting.format_number(cell.cost, 3)),
        *(Column(one.metadata["name"], partial(_format_metric, one.name)) for one in dataclasses.fields(Errors)),
        Column("verdicts", lambda cell: Cell("; ".join(cell.reasons), css="prose")),
    )
    cells, note = select_worst(grid.runs, MOST_CELLS, lambda cell: (cell,))
    folded = formatting.format_count(len(cells), "cell")
    table = Table(columns, cells, note=note, folded=folded, css="cells", only=Media.PAGE, packed=True)
    return Section("All cells at all steps", (table,))


def _format_metric(name: str, cell: GridCell) -> str:
    """Format a metric of a cell with the unit that the metric's name contains."""
    error: float = getattr(cell.errors, name)
    if name.endswith("_s") and not math.isnan(error):
        return f"{formatting.format_seconds(error)} ({formatting.format_steps(error, cell.line.dt_s)})"
    if name.endswith("_rad") and not math.isnan(error):
        return f"{formatting.format_number(math.degrees(error), 3)}°"
    return formatting.format_number(error, 3)


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
_IMPACT_COLUMNS = (
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
            _IMPACT_COLUMNS if trace.spins is None else (*_IMPACT_COLUMNS, _SPIN_COLUMN),
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
