"""The answer first: a line a method, scene groups by method, and one scene's impacts with all methods side by side."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterator
from urllib.parse import quote

from carom.report import wording
from carom.report.document import Cell, Column, Share, Table
from carom.report.grid import Column as Method
from carom.report.grid import Grid, GridCell, GridRow
from carom.report.marks import Mark
from carom.report.replay import impact_rows
from carom.runs.results import Results

__all__ = ["group_table", "impacts_side_by_side", "method_table", "replay_link"]

#: From best to worst: the order in which bars are drawn and cells are compared.
_ORDER = tuple(Mark)
_GRADED = (Mark.EXACT, Mark.EXACT_32, Mark.EXACT_16, Mark.CLOSE, Mark.SAMPLED, Mark.INACCURATE, Mark.WRONG)
#: With more impacts, a terminal's screen is no place to read them one by one.
MOST_IMPACTS = 40


def replay_link(cell: GridCell) -> str:
    """Return where a page plays a cell; empty where there is nothing to play."""
    row = cell.row
    return f"#{quote(f'{row.job.scene.name}/{row.job.engine}/{row.job.profile}')}" if row and cell.plays else ""


def _shares(cells: tuple[GridCell, ...]) -> tuple[Share, ...]:
    found = [cell.mark for cell in cells]
    return tuple(Share(m.css, found.count(m), m.symbol, m.style) for m in _ORDER if m in found)


def _worst(cells: tuple[GridCell, ...]) -> GridCell | None:
    """Return the graded cell with the worst grade, and of those the one that pays most."""

    def badness(cell: GridCell) -> tuple[int, int, float]:
        score = cell.row.score if cell.row else None
        if score is None:
            return (-1, 0, 0.0)
        paid = 0.0 if math.isnan(score.price_paid) else score.price_paid
        return (_GRADED.index(cell.mark), len(score.missed) + len(score.spurious), paid)

    graded = [cell for cell in cells if cell.mark in _GRADED]
    return max(graded, key=badness, default=None)


def _scene_of(cell: GridCell) -> str:
    return cell.row.job.scene.name if cell.row else ""


def _counted(grid: Grid, method: Method) -> Cell:
    """Say how many impacts a method missed and invented; nothing where it did neither."""
    scores = [cell.row.score for cell in grid.cells(method) if cell.row and cell.row.score]
    missed, invented = (sum(map(len, found)) for found in zip(*((s.missed, s.spurious) for s in scores), strict=True))
    return Cell(" ".join([f"-{missed}"] * bool(missed) + [f"+{invented}"] * bool(invented)))


def _paid(grid: Grid, method: Method) -> str:
    scores = [cell.row.score for cell in grid.cells(method) if cell.row and cell.row.score]
    known = [score.price_paid for score in scores if not math.isnan(score.price_paid)]
    return wording.number(statistics.median(known)) if known else wording.ABSENT


def _worst_scene(cells: tuple[GridCell, ...]) -> Cell:
    cell = _worst(cells)
    if cell is None or cell.mark in (Mark.EXACT, Mark.EXACT_32, Mark.EXACT_16):
        return Cell("")
    return Cell(_scene_of(cell), title="; ".join(cell.reasons), link=replay_link(cell))


def method_table(grid: Grid) -> Table:
    """Return a row a method: its grades, impacts missed and invented, the price it pays, and where it does worst."""
    methods = [method for method in grid.columns if any(cell.plays for cell in grid.cells(method))]
    return Table.made(
        (
            ("method", lambda method: method.name),
            ("scenes by grade", lambda method: Cell(_tally(grid, method), shares=_shares(grid.cells(method)))),
            (Column("impacts", "- +", number=True), lambda method: _counted(grid, method)),
            (Column("error", "by PIT's", number=True), lambda method: _paid(grid, method)),
            ("worst scene", lambda method: _worst_scene(grid.cells(method))),
        ),
        methods,
        css="methods",
    )


def _tally(grid: Grid, method: Method) -> str:
    return " ".join(f"{count}{mark.symbol}" for mark, count in grid.tally(method))


def group_table(grid: Grid) -> Table:
    """Return scene groups down and methods across: how many scenes have the worst grade, and a way to the worst one."""
    methods = [method for method in grid.columns if any(cell.plays for cell in grid.cells(method))]
    places = [grid.columns.index(method) for method in methods]

    def row(name: str, rows: tuple[GridRow, ...]) -> tuple[Cell, ...]:
        return (
            Cell(name or "scenes", wording.count(len(rows), "scene")),
            *(_group_cell(tuple(row.cells[k] for row in rows)) for k in places),
        )

    heads = (Column("group"), *(Column(method.label, method.profile) for method in methods))
    rows = tuple(row(name, rows) for name, rows in grid.groups)
    return Table(heads, rows if len(rows) < 2 else (*rows, row("all", grid.rows)), css="heat")


def _group_cell(cells: tuple[GridCell, ...]) -> Cell:
    worst = _worst(cells)
    if worst is None:
        return Cell("", shares=_shares(cells))
    same = sum(cell.mark is worst.mark for cell in cells)
    return Cell(
        f"{same} of {len(cells)}",
        title=f"worst: {_scene_of(worst)}, {worst.mark.word}: {'; '.join(worst.reasons)}",
        css=worst.mark.css,
        symbol=worst.mark.symbol,
        style=worst.mark.style,
        link=replay_link(worst),
        shares=_shares(cells),
    )


def impacts_side_by_side(results: Results, grid: Grid) -> Iterator[Table]:
    """Yield the impacts of the one scene that was run, a column a method; nothing where there are several scenes."""
    if len(grid.rows) != 1 or grid.rows[0].scene.name not in results.references:
        return
    row = grid.rows[0]
    reference = results.references[row.scene.name]
    cells = [cell for cell in row.cells if cell.plays and cell.column.engine != "pic"]
    found: dict[tuple[str, float | None], dict[str, str]] = {}
    for cell in cells:
        if cell.row is not None and cell.row.trace is not None and cell.row.score is not None:
            for impact in impact_rows(reference, cell.row.trace, cell.row.score):
                when = impact.get("true", impact.get("reported"))
                found.setdefault((impact["pair"], when), {})[cell.column.name] = impact["became"]
    rows = tuple(
        (pair, "" if when is None else f"{when:.6g}", *(became.get(cell.column.name, "") for cell in cells))
        for (pair, when), became in sorted(found.items(), key=lambda item: item[0][1] or 0.0)
    )
    heads = (
        Column("bodies"),
        Column("time, s", number=True),
        *(Column(c.column.label, c.column.profile) for c in cells),
    )
    left_out = len(rows) - MOST_IMPACTS
    note = f"{left_out} more impacts are not shown" if left_out > 0 else ""
    if rows:
        yield Table(heads, rows[:MOST_IMPACTS], note=note)
