"""Renderer of documents for a terminal."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from rich import box
from rich.cells import cell_len
from rich.console import Console, JustifyMethod
from rich.table import Table as RichTable
from rich.text import Text as RichText

from carom.report import document as blocks
from carom.report.document import Cell, Column, Document, Media, Share, Table
from carom.support.escaping import escape_controls

#: Number of characters in a bar.
_BAR = 14


def render_terminal(document: Document, width: int, *, full: bool = False) -> Iterator[RichTable | str]:
    """Yield the printed parts in order: the main result, the sections, and further sentences of the headline.

    Args:
        document: The document.
        width: Number of text columns. A table that is wider than this is shown in parts.
        full: Whether to show the whole document instead of a summary.
    """
    medium = Media.DETAIL if full else Media.TERMINAL
    yield from map(escape_controls, document.lead[:1])
    for section in document.select_for(medium):
        below = list[str]()  # legend of the table, printed below it
        for block in section.select_for(medium):
            match block:
                case Table():
                    yield escape_controls(block.title or section.heading)
                    yield from _split_table(block, medium, width)
                    yield from map(escape_controls, filter(None, (block.note, *below)))
                    below.clear()
                case blocks.Legend():
                    below += [f"{mark.symbol} {mark.text}: {meaning}" for mark, meaning in block.items]
                case blocks.Lines():
                    yield from map(escape_controls, block.items)
                case blocks.Text() | blocks.Code():
                    yield escape_controls(block.text)
                case blocks.Facts():
                    yield from (escape_controls(f"{name}: {value}") for name, value in block.items)
                # Only pages show figures, pairs and replays.
    yield from map(escape_controls, document.lead[1:])


def render_plain_text(document: Document, width: int = 80) -> str:
    """Return a document as the text that a terminal shows, without colours."""
    buffer = io.StringIO()
    console = Console(file=buffer, width=width, highlight=False, markup=False)
    for item in render_terminal(document, width):
        console.print(item)
    return buffer.getvalue().rstrip()


#: Width between two columns: padding and border.
_GAP = 2


def _split_table(table: Table, medium: Media, width: int) -> Iterator[RichTable]:
    """Split a table into as many parts as the width requires. Each part repeats the first column."""
    columns, rows = table.select_for(medium)
    fitted = [_fit_column(column, [row[k] for row in rows], first=not k) for k, column in enumerate(columns)]
    begin = 1
    while begin < max(2, len(fitted)):
        end = len(fitted)
        while end > begin + 1 and sum(one.least + _GAP for one in (fitted[0], *fitted[begin:end])) - _GAP > width:
            end -= 1
        yield _build_part([fitted[0], *fitted[begin:end]], width)
        begin = end


class _Fitted(NamedTuple):
    """A column to print. `least` is the width of its longest word, and `most` the width of its longest line."""

    head: RichText
    cells: list[RichText]
    number: bool
    whole: bool
    least: int
    most: int


def _fit_column(column: Column, cells: Sequence[Cell], *, first: bool) -> _Fitted:
    heading = RichText(escape_controls("\n".join(filter(None, (column.head, column.subheading)))))
    rendered = [_render_cell(cell) for cell in cells]
    is_unbroken = first or any(cell.shares for cell in cells)  # names and bars are kept on one line
    heads, rows = heading.plain.splitlines(), [line for text in rendered for line in text.plain.splitlines()]
    words = heads if is_unbroken else _list_words(heads)
    words += rows if is_unbroken or column.number else _list_words(rows)  # do not separate a number from its unit
    min_width, max_width = (max(map(cell_len, parts), default=0) for parts in (words, heads + rows))
    return _Fitted(heading, rendered, column.number, is_unbroken, min_width, max_width)


def _list_words(lines: list[str]) -> list[str]:
    """Split lines into words. The first word of an indented line keeps its indentation."""
    return [word for line in lines for word in re.findall(r"^\s*\S+|\S+", line)]


def _build_part(columns: Sequence[_Fitted], width: int) -> RichTable:
    widths = [column.most for column in columns]
    while sum(widths) + _GAP * (len(widths) - 1) > width:  # narrow the widest column first, without cutting words
        narrowable = [k for k, column in enumerate(columns) if widths[k] > column.least]
        if not narrowable:
            break
        widths[max(narrowable, key=widths.__getitem__)] -= 1
    table = RichTable(pad_edge=False, show_edge=False, collapse_padding=True, box=box.SIMPLE_HEAD)
    for column, wide in zip(columns, widths, strict=True):
        justify: JustifyMethod = "right" if column.number else "left"
        table.add_column(column.head, justify=justify, no_wrap=column.whole, width=wide)
    for row in zip(*(column.cells for column in columns), strict=True):
        table.add_row(*row)
    return table


def _render_cell(cell: Cell) -> RichText:
    if cell.shares:
        return _render_bar(cell.shares)
    head = " ".join(filter(None, (cell.symbol, cell.short or cell.text)))
    return RichText(escape_controls(head if cell.short or not cell.note else f"{head}\n  {cell.note}"), cell.style)


def _render_bar(shares: Sequence[Share]) -> RichText:
    """Return a bar made of the symbols of its parts, which is readable without colours.

    Every part has at least one symbol.
    """
    spare, bar = _BAR - len(shares), RichText()
    done, total = 0, sum(share.size for share in shares)
    for share in shares:
        begin, done = spare * done // total, done + share.size
        bar.append(share.symbol * (1 + spare * done // total - begin), share.style)
    return bar
