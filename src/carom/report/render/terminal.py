"""A document on a terminal."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence

from rich import box
from rich.console import Console, JustifyMethod
from rich.measure import Measurement
from rich.table import Table as RichTable
from rich.text import Text as RichText

from carom.report import document as blocks
from carom.report.document import Cell, Column, Document, Medium, Share, Table

__all__ = ["terminal"]

#: So many signs make a bar.
_BAR = 14


def terminal(document: Document, width: int, *, full: bool = False) -> Iterator[RichTable | str]:
    """Yield what is printed, in order: the sections, and last, where it stays in sight, what matters most.

    Args:
        document: What is shown.
        width: How many columns there are; a table that is wider is shown in parts.
        full: Whether to show the evidence as well as the answer.
    """
    medium = Medium.DETAIL if full else Medium.TERMINAL
    for section in document.shown(medium):
        heading, caption = section.heading, ""
        for block in section.shown(medium):
            match block:
                case Table():
                    note = "\n".join(filter(None, (block.note, caption)))
                    yield from _tables(block, medium, block.title or heading, note, width)
                    caption = ""
                case blocks.Legend():
                    caption = "\n".join(f"{mark.symbol} {mark.text}: {meaning}" for mark, meaning in block.items)
                case blocks.Lines():
                    yield from block.items
                case blocks.Text() | blocks.Code():
                    yield block.text
                case blocks.Facts():
                    yield from (f"{name}: {value}" for name, value in block.items)
                case blocks.Figures() | blocks.Pairs() | blocks.Replays():  # a page's alone
                    pass
    yield from document.lead


def _tables(table: Table, medium: Medium, title: str, caption: str, width: int) -> Iterator[RichTable]:
    """Yield the table, in as many parts as the width asks for; each part has the first column, which heads the rows."""
    columns, rows = table.shown(medium)
    begin = 1
    while True:
        end = len(columns)
        shown = _part(columns, rows, [0, *range(begin, end)], title, caption)
        while end > begin + 1 and _needs(shown) > width:
            end -= 1
            shown = _part(columns, rows, [0, *range(begin, end)], title, caption if end == len(columns) else "")
        yield shown
        begin = end
        if begin >= len(columns):
            return


def _needs(table: RichTable) -> int:
    """Return the least width at which no word of the table is cut."""
    wide = Console(width=10_000, file=io.StringIO())
    return Measurement.get(wide, wide.options, table).minimum


def _part(
    columns: Sequence[Column], rows: Sequence[Sequence[Cell]], kept: Sequence[int], title: str, caption: str
) -> RichTable:
    shown = RichTable(
        title=RichText(title, style="italic"),
        caption=RichText(caption) if caption else None,
        title_justify="left",
        caption_justify="left",
        pad_edge=False,
        box=box.SIMPLE_HEAD,
    )
    for k in kept:
        heading = RichText("\n".join(filter(None, (columns[k].head, columns[k].under))))
        bars = any(row[k].shares for row in rows if k < len(row))
        justify: JustifyMethod = "right" if columns[k].number else "left"
        shown.add_column(heading, justify=justify, no_wrap=k == 0 or bars, min_width=_BAR if bars else None)
    for row in rows:
        shown.add_row(*(_cell(row[k]) for k in kept if k < len(row)))
    return shown


def _cell(cell: Cell) -> RichText:
    if cell.shares:
        return _bar(cell.shares)
    head = " ".join(filter(None, (cell.symbol, cell.short or cell.text)))
    return RichText(head if cell.short or not cell.note else f"{head}\n  {cell.note}", cell.style)


def _bar(shares: Sequence[Share]) -> RichText:
    """Return a bar made of the shares' own signs, so that it can be read without colours; no share is left out."""
    spare, bar = _BAR - len(shares), RichText()
    done, total = 0, sum(share.size for share in shares)
    for share in shares:
        begin, done = spare * done // total, done + share.size
        bar.append(share.symbol * (1 + spare * done // total - begin), share.style)
    return bar
