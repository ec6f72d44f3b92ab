"""A document on a terminal."""

from __future__ import annotations

from collections.abc import Iterator

from rich import box
from rich.table import Table as RichTable
from rich.text import Text as RichText

from carom.report.document import (
    Cell,
    Code,
    Document,
    Facts,
    Figures,
    Legend,
    Lines,
    Medium,
    Pairs,
    Replays,
    Table,
    Text,
)

__all__ = ["terminal"]

#: A table of few columns is narrower than its own title and legend, which are wrapped to the table's width.
_MIN_WIDTH = 78


def terminal(document: Document) -> Iterator[RichTable | str]:
    """Yield what is printed, in order: the sections, and last, where it stays in sight, what matters most."""
    for section in document.shown(Medium.TERMINAL):
        heading, caption = section.heading, ""
        for block in section.shown(Medium.TERMINAL):
            match block:
                case Table():
                    yield _table(block, block.title or heading, "\n".join(filter(None, (block.note, caption))))
                    caption = ""
                case Legend():
                    caption = "\n".join(f"{mark.symbol} {mark.text}: {meaning}" for mark, meaning in block.items)
                case Lines():
                    yield from block.items
                case Text() | Code():
                    yield block.text
                case Facts():
                    yield from (f"{name}: {value}" for name, value in block.items)
                case Figures() | Pairs() | Replays():  # a page's alone
                    pass
    yield from document.lead


def _table(table: Table, title: str, caption: str) -> RichTable:
    shown = RichTable(
        title=RichText(title, style="italic"),
        caption=RichText(caption) if caption else None,
        title_justify="left",
        caption_justify="left",
        pad_edge=False,
        box=box.SIMPLE_HEAD,
        min_width=_MIN_WIDTH,
    )
    columns, rows = table.shown(Medium.TERMINAL)
    for k, column in enumerate(columns):
        heading = RichText("\n".join(filter(None, (column.head, column.under))))
        shown.add_column(heading, justify="right" if column.number else "left", no_wrap=k == 0)
    for row in rows:
        shown.add_row(*map(_cell, row))
    return shown


def _cell(cell: Cell) -> RichText:
    head = " ".join(filter(None, (cell.symbol, cell.short or cell.text)))
    return RichText(head if cell.short or not cell.note else f"{head}\n  {cell.note}", cell.style)
