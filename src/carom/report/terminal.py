"""The verdict on a terminal: the grid as a table, and the sentences above it."""

from __future__ import annotations

from rich import box
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from carom.report.certified_reach import certified_lines
from carom.report.grid import GridCell, build_grid
from carom.report.phrases import unrun_lines
from carom.report.price import price_lines, prices
from carom.report.sampling import agreements
from carom.report.summary import summarise
from carom.runner import Results

__all__ = ["verdict_line", "verdict_table"]


#: A table of one engine is narrower than its own title and legend, which are wrapped to the table's width.
_MIN_WIDTH = 78


def verdict_line(results: Results) -> str:
    """Return the verdict of a cross-check in a few plain sentences.

    A line for each engine says how much of its error is the price of sampling, one for each reason why it did not run.
    """
    grid = build_grid(results)
    sentences = summarise(results, grid, agreements(results, grid)).sentences
    return "\n".join([" ".join(sentences), *price_lines(prices(grid)), *unrun_lines(grid)])


def verdict_table(results: Results) -> Table:
    """Return the grid of scenes and engines at each scene's coarsest step, with its legend as the caption."""
    grid = build_grid(results)
    table = Table(
        title=f"Against PIC at {grid.step_phrase}",
        caption=_legend(tuple((mark.symbol, mark.word, mark.meaning) for mark in grid.marks)),
        caption_justify="left",
        title_justify="left",
        pad_edge=False,
        min_width=_MIN_WIDTH,
        box=box.SIMPLE_HEAD,
    )
    table.add_column("scene", no_wrap=True)
    for column in grid.columns:
        table.add_column(Text(f"{column.label}\n{column.profile}"), justify="left")
    notes = {line.scene: f"  {line.short}" for line in certified_lines(results)}
    for _, rows in grid.groups:
        for row in rows:
            last = row is rows[-1]
            table.add_row(
                Text("\n".join(filter(None, (row.scene.name, notes.get(row.scene.name))))),
                *(_cell(cell) for cell in row.cells),
                end_section=last,
            )
    return table


def _cell(cell: GridCell) -> Text:
    return Text(
        f"{cell.mark.symbol} {cell.compact or (cell.mark.word if not cell.mark.ran else '')}".rstrip(), cell.mark.style
    )


def _legend(marks: tuple[tuple[str, str, str], ...]) -> str:
    lines = [f"{symbol} {word}: {meaning}" for symbol, word, meaning in marks]
    lines += [
        "0.075: largest velocity error, over the scene's greatest speed",
        "-1 +2: impacts missed and invented",
        "0.4 dt: velocities right to rounding, found so many steps late or early",
    ]
    return escape("\n".join(lines))
