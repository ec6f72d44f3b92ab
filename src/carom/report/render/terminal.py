"""A document on a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich import box
from rich.cells import cell_len
from rich.console import JustifyMethod
from rich.table import Table as RichTable
from rich.text import Text as RichText

from carom.report import document as blocks
from carom.report.document import Cell, Column, Document, Medium, Share, Table
from carom.text import visible

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
        below = list[str]()  # what the signs of a table mean stands below it
        for block in section.shown(medium):
            match block:
                case Table():
                    yield visible(block.title or section.heading)
                    yield from _parts(block, medium, width)
                    yield from map(visible, filter(None, (block.note, *below)))
                    below.clear()
                case blocks.Legend():
                    below += [f"{mark.symbol} {mark.text}: {meaning}" for mark, meaning in block.items]
                case blocks.Lines():
                    yield from map(visible, block.items)
                case blocks.Text() | blocks.Code():
                    yield visible(block.text)
                case blocks.Facts():
                    yield from (visible(f"{name}: {value}") for name, value in block.items)
                case blocks.Figures() | blocks.Pairs() | blocks.Replays():  # a page's alone
                    pass
    yield from map(visible, document.lead)


def _parts(table: Table, medium: Medium, width: int) -> Iterator[RichTable]:
    """Yield the table, in as many parts as the width asks for; each part has the first column, which heads the rows."""
    columns, rows = table.shown(medium)
    begin = 1
    while begin < max(2, len(columns)):
        end = len(columns)
        while end > begin + 1 and _needs(_part(columns, rows, [0, *range(begin, end)])) > width:
            end -= 1
        yield _part(columns, rows, [0, *range(begin, end)])
        begin = end


def _needs(table: RichTable) -> int:
    """Return the least width at which no word of the table is cut: between two columns are three signs."""
    return sum(column.min_width or 0 for column in table.columns) + 3 * (len(table.columns) - 1)


def _part(columns: Sequence[Column], rows: Sequence[Sequence[Cell]], kept: Sequence[int]) -> RichTable:
    shown = RichTable(pad_edge=False, show_edge=False, box=box.SIMPLE_HEAD)
    for k in kept:
        heading = RichText(visible("\n".join(filter(None, (columns[k].head, columns[k].under)))))
        cells = [_cell(row[k]) for row in rows if k < len(row)]
        whole = k == 0 or any(row[k].shares for row in rows if k < len(row))  # a name, or a bar
        texts = [cell.plain for cell in cells] + [heading.plain]
        least = max(cell_len(word) for text in texts for word in (text.splitlines() if whole else text.split()) or [""])
        justify: JustifyMethod = "right" if columns[k].number else "left"
        shown.add_column(heading, justify=justify, no_wrap=whole, min_width=least)
    for row in rows:
        shown.add_row(*(_cell(row[k]) for k in kept if k < len(row)))
    return shown


def _cell(cell: Cell) -> RichText:
    if cell.shares:
        return _bar(cell.shares)
    head = " ".join(filter(None, (cell.symbol, cell.short or cell.text)))
    return RichText(visible(head if cell.short or not cell.note else f"{head}\n  {cell.note}"), cell.style)


def _bar(shares: Sequence[Share]) -> RichText:
    """Return a bar made of the shares' own signs, so that it can be read without colours; no share is left out."""
    spare, bar = _BAR - len(shares), RichText()
    done, total = 0, sum(share.size for share in shares)
    for share in shares:
        begin, done = spare * done // total, done + share.size
        bar.append(share.symbol * (1 + spare * done // total - begin), share.style)
    return bar
