"""First sections of a report: a table of methods, and for a single scene also a table of its impacts."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

from carom.comparator import Verdict
from carom.execution.job import Method
from carom.report.document import Block, Cell, Column, Legend, Lines, Media, Section, Share, Table, Text
from carom.report.impact_rows import build_impact_rows
from carom.report.outcome_marks import RIGHT, Mark
from carom.studies.cross_check.grid import RANKING_NOTE, Grid, GridCell, compute_standing
from carom.support import formatting

#: Largest number of rows in the table of impacts.
MOST_IMPACT_ROWS = 40
#: Largest number of columns with methods on a terminal.
MOST_METHOD_COLUMNS = 3

METHOD_NOTE = (
    "The numbers after - and + count missed and invented impacts over all scenes. In each scene, a method's largest "
    "error is divided by PIT's. The error in the table is the median over scenes."
)
METHOD_DETAIL = (
    "The error is the largest velocity or spin error, divided by PIT's largest error at any phase of the step. 1 is "
    "the error of checking once per step, and 0 is no error. Scenes without a unique answer have no error. The cell of "
    "a group of scenes shows how many of the graded scenes are exact or close, and links to the worst scene. "
    f"{Mark.WRONG.symbol} in a corner of a cell means that an impact is missed in one or more scenes of the group. "
)
SCENE_NOTE = (
    "Each row shows the largest errors of a run. Times with + are late. n/a means that no impact was found, or that "
    "the trajectory diverged. A number with \N{MULTIPLICATION SIGN} is the error divided by PIT's."
)

#: Column headings, each with the outcomes that are counted in this column.
_COUNTED = {
    "exact": (Mark.EXACT, Mark.EXACT_32),
    "close": (Mark.CLOSE,),
    "sampled": (Mark.SAMPLED,),
    "inaccurate": (Mark.INACCURATE,),
    "diverged": (Mark.DIVERGED, Mark.DIVERGED_INACCURATE),
    "wrong": (Mark.WRONG,),
}


def build_methods_section(grid: Grid) -> Section:
    """Return a section with a table of all methods, best first.

    For a single scene, the section also has the errors of each run.
    """
    methods, is_single_scene = grid.compared, len(grid.rows) == 1
    heading = f"{grid.rows[0].name}: every" if is_single_scene else "Every"
    blocks: tuple[Block, ...] = (
        *(_build_run_tables(grid) if is_single_scene else (_build_counts_table(grid, methods),)),
        _build_method_table(grid, methods),
        Legend(tuple((mark.cell, mark.meaning) for mark in grid.marks), Media.PAGE),
        Text(METHOD_NOTE, Media.IN_FULL),
        Text(METHOD_DETAIL + RANKING_NOTE, Media.ON_PAPER, folded=True),
    )
    title = f"{heading} method against PIC, at {grid.step_phrase}"
    return Section(title, blocks if methods else (), short="Every method")


def _build_method_table(grid: Grid, methods: Sequence[Method]) -> Table:
    """Return a table with one row per method, which summarises its grades, wrong impacts and errors."""
    numbers = (
        Column("impacts", lambda method: _format_lost(grid.list_cells(method)), "- +", number=True),
        Column("error", lambda method: _format_cost(grid.list_cells(method)), "/ PIT's", number=True),
    )
    if len(grid.rows) == 1:
        columns: tuple[Column, ...] = (
            Column("grade", lambda method: _build_linked_cell(grid.list_cells(method)[0])),
            *numbers,
        )
    else:
        groups = formatting.group_by((_read_group(row.name), row.name) for row in grid.rows)
        columns = (
            Column("scenes by grade", lambda method: _build_grade_bar(grid.list_cells(method))),
            *numbers,
            *(_build_group_column(grid, name, names) for name, names in groups.items()),
            Column("worst scene", lambda method: _build_worst_scene_cell(grid.list_cells(method))),
        )
    name = Column("method", lambda method: Cell(method.heading, method.profile_shown, short=method.title))
    return Table((name, *columns), methods, css="methods", only=Media.IN_FULL)


def _build_linked_cell(cell: GridCell) -> Cell:
    return cell.mark.cell._replace(title=f"{cell.mark.sentence}. {'; '.join(cell.reasons)}", link=cell.link)


def _build_shares(cells: Sequence[GridCell]) -> tuple[Share, ...]:
    found = [cell.mark for cell in cells]
    return tuple(Share(m.css, found.count(m), m.symbol, m.style) for m in Mark if m in found)


def _build_grade_bar(cells: Sequence[GridCell]) -> Cell:
    shares = _build_shares(cells)
    return Cell(" ".join(f"{share.size}{share.symbol}" for share in shares), shares=shares)


def _format_lost(cells: Sequence[GridCell]) -> str:
    missed, invented = sum(cell.missed for cell in cells), sum(cell.invented for cell in cells)
    return formatting.format_missed_and_invented(missed, invented)


def _format_cost(cells: Sequence[GridCell]) -> str:
    known = [cell.cost for cell in cells if not math.isnan(cell.cost)]
    return formatting.format_number(statistics.median(known)) if known else formatting.ABSENT


def _find_worst(cells: Sequence[GridCell]) -> GridCell | None:
    """Find the run with the worst grade; None if no run is graded.

    Runs with the same grade are compared by their number of missed and invented impacts, then by their error.
    """

    def severity(cell: GridCell) -> tuple[int, int, float]:
        return (cell.mark.rank or 0, cell.missed + cell.invented, 0.0 if math.isnan(cell.cost) else cell.cost)

    return max((cell for cell in cells if cell.mark.rank is not None), key=severity, default=None)


def _build_worst_scene_cell(cells: Sequence[GridCell]) -> Cell:
    cell = _find_worst(cells)
    return Cell(cell.scene, title="; ".join(cell.reasons), link=cell.link) if cell and cell.mark.rank else Cell("")


def _read_group(scene: str) -> str:
    """Return a scene's group, the part of its name before the slash; ``others`` if there is no slash."""
    group, slash, _ = scene.partition("/")
    return group if slash else "others"


def _build_group_column(grid: Grid, name: str, scenes: Sequence[str]) -> Column:
    under = formatting.format_count(len(scenes), "scene")
    return Column(name, partial(_build_group_cell, grid, scenes), under, only=Media.PAGE)


def _build_group_cell(grid: Grid, names: Sequence[str], method: Method) -> Cell:
    """Return a cell that counts a group's scenes with grades *exact* and *close*, and that links to the worst scene."""
    cells = [cell for cell in grid.list_cells(method) if cell.scene in names]
    worst, graded = _find_worst(cells), [cell.mark for cell in cells if cell.mark.rank is not None]
    if worst is None:
        return Cell("", shares=_build_shares(cells))
    missed = sum(cell.has_miss for cell in cells)
    title = f"worst: {worst.scene}, {worst.mark.word}: {'; '.join(worst.reasons)}"
    return Cell(
        f"{sum(mark in RIGHT for mark in graded)} of {len(graded)}",
        title=f"an impact is missed in {formatting.format_count(missed, 'scene')}; {title}" if missed else title,
        css="share",
        link=worst.link,
        shares=_build_shares(cells),
        corner=Mark.WRONG.symbol if missed else "",
    )


def find_first_replay(grid: Grid) -> Cell | None:
    """Return a link to the replay of the worst run of an engine; None if no replay shows an error.

    If runs have the same grade, runs that miss an impact are preferred, and then scenes with few impacts. Without runs
    of engines, the link leads to a run of one of Carom's own methods.
    """
    graded = [cell for row in grid.rows for cell in row.cells if cell.mark.rank and cell.compared_run]
    engines = [cell for cell in graded if not cell.method.is_own] or graded
    if not engines:
        return None
    cell = min(engines, key=lambda cell: (-(cell.mark.rank or 0), not cell.missed, cell.expected))
    does = "miss an impact" if cell.missed else f"at {cell.scene}"
    return Cell(f"Watch {cell.method.title} {does}", link=cell.link)


def _build_counts_table(grid: Grid, methods: Sequence[Method]) -> Table:
    """Return a table with one row per method: its numbers of scenes by grade."""

    def count(marks: Sequence[Mark], method: Method) -> str:
        return str(sum(cell.mark in marks for cell in grid.list_cells(method)) or "")

    counted = {**_COUNTED, "n/a": tuple(mark for mark in Mark if mark.rank is None)}
    columns = [Column("method", lambda method: method.title)]
    columns += [Column(name, partial(count, marks), number=True) for name, marks in counted.items()]
    return Table(columns, methods, only=Media.TERMINAL, note="n/a means not graded or not run; -v lists the reasons")


def _list_scored_runs(grid: Grid) -> list[GridCell]:
    """Return the scored runs, sorted by step size (largest first), then by quality."""
    methods = grid.compared
    runs = [cell for cell in grid.runs if cell.scored and cell.method in methods]
    return sorted(runs, key=lambda cell: (-cell.line.dt_s, compute_standing([cell])))


def _build_run_tables(grid: Grid) -> tuple[Table, ...]:
    """Return one table of errors for each step size of the scene."""
    runs = _list_scored_runs(grid)
    by_step = formatting.group_by((cell.line.dt_s, cell) for cell in runs)
    columns = (
        Column("method", lambda cell: cell.method.title),
        Column("impacts", _format_found, number=True),
        _error_column("time", "ms", lambda cell: cell.time_error_s, 1e3, sign=True, limit=0.0),
        _error_column("velocity", "%", lambda cell: cell.errors.velocity, 100.0),
        _error_column("angle", "°", lambda cell: cell.errors.direction_rad, math.degrees(1.0)),
        _error_column("energy", "%", lambda cell: cell.errors.energy, 100.0, sign=True),
        Column("grade", _format_grade),
    )
    words = dict.fromkeys(f"{cell.mark.symbol} {cell.mark.css.replace('-', ' ')}" for cell in runs)
    return tuple(
        Table(
            columns,
            step_runs,
            title=f"at {formatting.format_step(dt_s)}" if len(by_step) > 1 else "",
            note=f"{', '.join(words)}. {SCENE_NOTE}" if dt_s == min(by_step) else "",
            only=Media.TERMINAL | Media.DETAIL,
        )
        for dt_s, step_runs in by_step.items()
    )


def _format_found(cell: GridCell) -> str:
    invented = f" +{cell.invented}" if cell.invented else ""
    return f"{cell.expected - cell.missed - cell.undecided}/{cell.expected}{invented}"


def _error_column(head: str, under: str, read: Callable[[GridCell], float], unit: float, **limits: Any) -> Column:
    return Column(head, lambda cell: _format_error(cell, read(cell), unit, **limits), under, number=True)


def _format_error(cell: GridCell, value: float, unit: float, *, sign: bool = False, limit: float | None = None) -> str:
    """Format an error. For a diverged trajectory, no error is shown, because the error would depend on chance.

    Args:
        cell: The cell.
        value: The error; NaN if it is unknown.
        unit: Factor that converts the error to the unit of the column.
        sign: Whether to show the sign of a positive error.
        limit: Errors up to this size are shown as 0. If None, the limit is the rounding error of the engine's floats.
    """
    if math.isnan(value) or cell.has_verdict(Verdict.DIVERGED):
        return formatting.ABSENT
    if abs(value) <= (cell.rounding if limit is None else limit):
        return "0"
    plus = "+" if sign and value > 0.0 else ""
    return f"{plus}{formatting.format_number(unit * value, 3 if limit == 0.0 else 2)}"


def _format_grade(cell: GridCell) -> str:
    """Return the symbol of the grade, and the error divided by PIT's."""
    if cell.mark in _COUNTED["exact"] or math.isnan(cell.cost) or not cell.matched:
        return f"{cell.mark.symbol} float32" if cell.mark is Mark.EXACT_32 else cell.mark.symbol
    return f"{cell.mark.symbol} {formatting.format_ratio(cell.cost).replace(' ', '')}"


def build_impacts_section(grid: Grid) -> Section:
    """Return a section with a single scene's impacts by method, and each run's verdicts; empty for several scenes."""
    methods = grid.compared
    if len(grid.rows) != 1 or not methods:
        return Section("", ())
    impacts = _find_impacts(grid, methods)
    # A terminal only has space for few methods.
    media = Media.EVERYWHERE if len(methods) <= MOST_METHOD_COLUMNS else Media.IN_FULL
    columns = [
        Column("bodies", lambda impact: impact.bodies),
        Column("time, s", lambda impact: impact.time_text, number=True),
        *(Column(method.heading, partial(_format_impact_result, method), method.profile_shown) for method in methods),
    ]
    left_out = len(impacts) - MOST_IMPACT_ROWS
    note = f"{left_out} more impacts are not shown" if left_out > 0 else ""
    runs = _list_scored_runs(grid)
    full = _format_verdict_lines(runs)
    blocks = (
        Table(columns, impacts[:MOST_IMPACT_ROWS], note=note, only=media),
        Lines(full if len(methods) == 1 else _format_short_verdict_lines(runs), Media.TERMINAL),
        Lines(full, Media.DETAIL),
    )
    return Section("Impacts by method", tuple(block for block in blocks if block.items), level=3)


def _format_verdict_lines(runs: Sequence[GridCell]) -> tuple[str, ...]:
    """For each scored run that is not exact, return one line with its verdicts, in the order of the runs."""
    has_several_steps = len({cell.line.dt_s for cell in runs}) > 1
    lines: dict[tuple[str, str], str] = {}
    for cell in runs:
        if cell.mark not in _COUNTED["exact"]:
            step = f" at {formatting.format_step(cell.line.dt_s)}" if has_several_steps else ""
            # equal lines at several steps are shown once
            lines.setdefault((cell.method.title, "; ".join(cell.reasons)), step)
    return tuple(f"{name}{step}: {found}" for (name, found), step in lines.items())


def _format_short_verdict_lines(runs: Sequence[GridCell]) -> tuple[str, ...]:
    """For the largest step size, return the verdicts of each scored run that is not exact.

    Numbers are left out of the verdicts. Methods with the same verdicts share a line.
    """
    coarsest = max((cell.line.dt_s for cell in runs), default=0.0)
    names = formatting.group_by(
        ("; ".join(reason.partition(" (")[0] for reason in cell.reasons), cell.method.title)
        for cell in runs
        if cell.line.dt_s == coarsest and cell.mark not in _COUNTED["exact"]
    )
    has_finer_steps = any(cell.line.dt_s < coarsest for cell in runs)
    step = f" at {formatting.format_step(coarsest)}" if has_finer_steps else ""
    return tuple(f"{formatting.join_words(methods)}{step}: {found}" for found, methods in names.items())


class _Impact(NamedTuple):
    """An impact of the reference, or an invented impact of a run, with the result of each method."""

    bodies: str
    time_s: float | None
    outcomes: dict[Method, str]

    @property
    def time_text(self) -> str:
        """The time in seconds; empty if it is unknown."""
        return "" if self.time_s is None else formatting.format_number(self.time_s, 6)


def _find_impacts(grid: Grid, methods: Sequence[Method]) -> list[_Impact]:
    """Find the impacts of the reference, and invented impacts of all runs, in order of time."""
    found: dict[tuple[str, float | None], dict[Method, str]] = {}
    for cell in grid.rows[0].cells if len(grid.rows) == 1 else ():
        if cell.method in methods and cell.compared_run:
            for impact in build_impact_rows(grid.results.references[cell.scene], *cell.compared_run):
                time_s = impact.get("true", impact.get("reported"))
                found.setdefault((impact["pair"], time_s), {})[cell.method] = impact["became"]
    return sorted((_Impact(*key, became) for key, became in found.items()), key=lambda one: one.time_s or 0.0)


def _format_impact_result(method: Method, impact: _Impact) -> str:
    return impact.outcomes.get(method, "")
