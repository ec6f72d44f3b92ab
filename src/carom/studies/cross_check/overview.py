"""First section of a report: the ranked methods, one row each, and for one scene its impacts by method."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

from carom.execution.results import Results
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
    Figure,
    Figures,
    Lines,
    Media,
    Section,
    Share,
    Table,
    Text,
)
from carom.report.grid import GRADED, Grid, GridCell, GridColumn, GridRow, Mark
from carom.report.replay import impact_rows, replay_link
from carom.studies.cross_check.headline import has_miss
from carom.studies.cross_check.ranking import RANKING_NOTE, RIGHT, rank_methods
from carom.studies.cross_check.sampling_cost import PRICE_CAPTION, PRICE_TITLE, EngineCost, draw_sampling_costs
from carom.studies.cross_check.stepwise import steps_section
from carom.studies.cross_check.tables import legend, mark_cell
from carom.studies.cross_check.terminal_summary import counts_table, run_tables, verdict_lines

#: From best to worst.
_GRADED = tuple(mark for mark in Mark if mark in GRADED and mark is not Mark.UNGRADED)
#: Largest number of impacts that are listed, largest number that are columns of the table of methods, and largest
#: number of methods next to which a terminal has room for impacts.
MOST_IMPACTS, MOST_BESIDE, MOST_ACROSS = 40, 4, 3

GROUP_NOTE = (
    "Of a group of scenes stands how many are exact or close of those graded, coloured by the share of each grade; "
    f"{Mark.WRONG.symbol} in the corner: a run misses an impact in at least one of them; of a run that has parted from "
    "the reference no single impact is said to be missed. "
    "Each plays the worst of its scenes."
)
METHOD_NOTE = (
    "Missed and invented impacts are counted over all scenes. The error is the largest velocity or spin error over "
    "PIT's at worst over the phases of the same step, median over scenes that have a unique answer: 1 pays the price "
    "of checking once per step, 0 none of it."
)
METHOD_SHORT = "impacts: - missed, + invented; error: of velocity or spin, {median}over PIT's at worst"


def overview(results: Results, grid: Grid, found: tuple[EngineCost, ...]) -> Iterator[Section]:
    """Yield the first sections: all methods, the best first, with their groups of scenes; for one scene its impacts."""
    methods = [column for column in grid.columns.values() if any(cell.has_replay for cell in grid.cells(column))]
    if not methods:
        return
    others = [method for method in methods if method.engine != "pic"] or methods  # known answers show PIC's accuracy
    alone = grid.rows[0] if len(grid.rows) == 1 else None
    every = f"{alone.scene.name}: every" if alone else "Every"
    impacts = _find_impacts(results, alone) if alone else ()
    beside = impacts if len(impacts) <= MOST_BESIDE else ()
    signs = {} if alone else {mark.symbol: mark.css.replace("-", " ") for mark in grid.marks}
    chart = Figure(partial(draw_sampling_costs, found, PRICE_TITLE), PRICE_CAPTION, PRICE_TITLE)
    blocks: tuple[Block, ...] = (
        *(run_tables(results, grid, alone.scene.name) if alone else (counts_table(grid, others),)),
        _method_table(grid, others, beside),
        legend(grid, PAGE),
        *(() if alone else (Text(GROUP_NOTE, PAGE), Text(RANKING_NOTE, ON_PAPER))),
        *((Figures((chart,), large=True),) if any(price.own for price in found) else ()),
        *((Text("  ".join(f"{symbol} {word}" for symbol, word in signs.items()), DETAIL),) if signs else ()),
        Text(METHOD_SHORT.format(median="" if alone else "median, "), DETAIL),
        Text(METHOD_NOTE, ON_PAPER),
    )
    phrase = grid.step_phrase
    yield Section(f"{every} method against PIC, at {phrase}", blocks, short="Every method")
    if alone:
        yield steps_section(results, grid)
        verdicts = verdict_lines(results, grid, alone.scene.name, full=len(others) == 1)
        # Next to the methods paper has these impacts already; a terminal has room for few methods' times.
        media = (DETAIL if beside else IN_FULL) | (TERMINAL if len(others) <= MOST_ACROSS else DETAIL)
        shown = (
            *((_impact_table(alone, impacts, media),) if impacts else ()),
            *((Lines(verdicts, TERMINAL),) if verdicts else ()),
            Lines(verdict_lines(results, grid, alone.scene.name, full=True), DETAIL),
        )
        yield Section("Its impacts, every method next to the others", shown, level=3)


def _shares(cells: tuple[GridCell, ...]) -> tuple[Share, ...]:
    found = [cell.mark for cell in cells]
    return tuple(Share(m.css, found.count(m), m.symbol, m.style) for m in Mark if m in found)


def _find_worst(cells: tuple[GridCell, ...]) -> GridCell | None:
    """Find the cell with the worst grade and, among those, the largest error over PIT's; None if none is graded."""

    def badness(cell: GridCell) -> tuple[int, int, float]:
        score = cell.row.score if cell.row else None
        if score is None:
            return (-1, 0, 0.0)
        cost = 0.0 if math.isnan(score.price_paid) else score.price_paid
        return (_GRADED.index(cell.mark), len(score.missed) + len(score.spurious), cost)

    return max((cell for cell in cells if cell.mark in _GRADED), key=badness, default=None)


def _scene_of(cell: GridCell) -> str:
    return cell.row.job.scene.name if cell.row else ""


def first_replay(grid: Grid) -> Cell | None:
    """Return a link to the replay of the engines' worst cell, and among those the one with fewest impacts."""
    cells = [cell for column in grid.columns.values() for cell in grid.cells(column)]
    graded = [cell for cell in cells if cell.mark in _GRADED and cell.mark.css != Mark.EXACT.css]
    engines = [cell for cell in graded if not cell.column.own] or graded
    if not engines:
        return None

    def order(cell: GridCell) -> tuple[int, bool, int]:
        score = cell.row.score if cell.row else None
        return (-_GRADED.index(cell.mark), not (score and score.missed), score.expected if score else 0)

    cell = min(engines, key=order)
    missed = cell.row is not None and cell.row.score is not None and cell.row.score.missed
    does = "miss an impact" if missed else f"at {_scene_of(cell)}"
    return Cell(f"Watch {cell.column.name} {does}", link=replay_link(cell))


def _method_table(grid: Grid, methods: list[GridColumn], impacts: Sequence[_Impact]) -> Table:
    """Return one row per method, the best first: grades, missed and invented impacts, error over PIT's, and groups.

    For a single scene, the given impacts are further columns.
    """
    alone = len(grid.rows) == 1
    groups = {} if alone else _group_rows(grid)
    columns = (
        Column("method", lambda method: Cell(method.label, method.profile, short=method.name)),
        Column("grade", partial(_grade, grid)) if alone else Column("scenes by grade", partial(_grade_bar, grid)),
        Column("impacts", partial(_format_impacts, grid), "- +", number=True),
        Column("error", partial(_format_cost, grid), "/ PIT's", number=True),
        *(Column(impact.bodies, partial(_became, impact=impact), f"{impact.when} s") for impact in impacts),
        *(
            Column(name, partial(_group_cell, rows), formatting.count(len(rows), "scene"), only=PAGE)
            for name, rows in groups.items()
        ),
        *(() if alone else (Column("worst scene", partial(_worst_scene, grid)),)),
    )
    return Table(columns, rank_methods(grid, methods), css="methods", only=IN_FULL, cards=True)


def _grade(grid: Grid, method: GridColumn) -> Cell:
    (cell,) = grid.cells(method)
    return replace(mark_cell(cell.mark), title="; ".join(cell.reasons), link=replay_link(cell))


def _grade_bar(grid: Grid, method: GridColumn) -> Cell:
    tally = " ".join(f"{count}{mark.symbol}" for mark, count in grid.tally(method))
    return Cell(tally, shares=_shares(grid.cells(method)))


def _format_impacts(grid: Grid, method: GridColumn) -> str:
    """Format the numbers of impacts that a method missed and invented; empty if there are none."""
    scores = [cell.row.score for cell in grid.cells(method) if cell.row and cell.row.score]
    return formatting.lost(sum(len(s.missed) for s in scores), sum(len(s.spurious) for s in scores))


def _format_cost(grid: Grid, method: GridColumn) -> str:
    scores = [cell.row.score for cell in grid.cells(method) if cell.row and cell.row.score]
    known = [score.price_paid for score in scores if not math.isnan(score.price_paid)]
    return formatting.number(statistics.median(known)) if known else formatting.ABSENT


def _worst_scene(grid: Grid, method: GridColumn) -> Cell:
    cell = _find_worst(grid.cells(method))
    if cell is None or _GRADED.index(cell.mark) < _GRADED.index(Mark.CLOSE):
        return Cell("")
    return Cell(_scene_of(cell), title="; ".join(cell.reasons), link=replay_link(cell))


def _group_rows(grid: Grid) -> dict[str, list[GridRow]]:
    """Group the scenes, in order of their first scenes; scenes without a group form one."""
    named = ((row.scene.name.partition("/"), row) for row in grid.rows)
    return formatting.together((first if slash else "others", row) for (first, slash, _), row in named)


def _group_cell(rows: list[GridRow], method: GridColumn) -> Cell:
    """Return in how many of a group's graded scenes a method is right, with a link to the worst."""
    cells = tuple(cell for row in rows for cell in row.cells if cell.column == method)
    worst = _find_worst(cells)
    if worst is None:
        return Cell("", shares=_shares(cells))
    graded = [cell for cell in cells if cell.mark in _GRADED]
    missed = sum(map(has_miss, graded))
    says = f"worst: {_scene_of(worst)}, {worst.mark.word}: {'; '.join(worst.reasons)}"
    return Cell(
        f"{sum(cell.mark in RIGHT for cell in graded)} of {len(graded)}",
        title=f"an impact is missed in {formatting.count(missed, 'scene')}; {says}" if missed else says,
        css="share",
        link=replay_link(worst),
        shares=_shares(cells),
        corner=Mark.WRONG.symbol if missed else "",
    )


class _Impact(NamedTuple):
    """An impact of the reference or a spurious one, with its outcome by method."""

    bodies: str
    time_s: float | None
    became: dict[GridColumn, str]

    @property
    def when(self) -> str:
        """The time in seconds; empty where it is not known."""
        return "" if self.time_s is None else formatting.number(self.time_s, 6)


def _compared_cells(row: GridRow) -> list[GridCell]:
    """Return the cells that are compared with PIC; PIC itself where nothing else ran."""
    ran = [cell for cell in row.cells if cell.has_replay]
    return [cell for cell in ran if cell.column.engine != "pic"] or ran


def _find_impacts(results: Results, row: GridRow) -> tuple[_Impact, ...]:
    """Find the impacts of a scene in order of time, including spurious ones."""
    found: dict[tuple[str, float | None], dict[GridColumn, str]] = {}
    for cell in _compared_cells(row):
        if cell.row is not None and cell.row.trace is not None and cell.row.score is not None:
            for impact in impact_rows(results.references[row.scene.name], cell.row.trace, cell.row.score):
                when = impact.get("true", impact.get("reported"))
                found.setdefault((impact["pair"], when), {})[cell.column] = impact["became"]
    impacts = (_Impact(*key, became) for key, became in found.items())
    return tuple(sorted(impacts, key=lambda one: one.time_s or 0.0))


def _impact_table(row: GridRow, impacts: Sequence[_Impact], only: Media) -> Table:
    """Return the impacts of the single scene, one column per method."""
    columns = [
        Column("bodies", lambda impact: impact.bodies),
        Column("time, s", lambda impact: impact.when, number=True),
    ]
    columns += [
        Column(cell.column.label, partial(_became, cell.column), cell.column.profile) for cell in _compared_cells(row)
    ]
    left_out = len(impacts) - MOST_IMPACTS
    note = f"{left_out} more impacts are not shown" if left_out > 0 else ""
    return Table(columns, impacts[:MOST_IMPACTS], note=note, only=only)


def _became(method: GridColumn, impact: _Impact) -> str:
    return impact.became.get(method, "")
