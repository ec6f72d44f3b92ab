"""Renderer of documents as Markdown."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from carom.report import document as blocks
from carom.report.document import Block, Document, Media, Table


def markdown(document: Document) -> str:
    """Return a document as Markdown. Names in the document are escaped, so that they are never markup."""
    return "\n".join(_lines(document)) + "\n"


def _lines(document: Document) -> Iterator[str]:
    yield f"# {_text(document.title)}"
    for sentence in (*filter(None, (document.about,)), *document.lead):
        yield from ("", _text(sentence))
    for section in document.shown(Media.MARKDOWN):
        yield from ("", f"{'#' * section.level} {_text(section.heading)}")
        for block in section.shown(Media.MARKDOWN):
            yield ""
            yield from _block(block)


def _block(block: Block) -> Iterator[str]:
    match block:
        case Table():
            yield from _table(block)
        case blocks.Text():
            yield f"*{blocks.QUESTION}* {_text(block.text)}" if block.folded else _text(block.text)
        case blocks.Lines():
            yield from (f"- {_text(line)}" for line in block.items)
        case blocks.Facts():
            yield from _rows(("", ""), block.items)
        case blocks.Legend():
            yield from (f"- {mark.symbol} **{mark.text}**: {_text(meaning)}" for mark, meaning in block.items)
        case blocks.Code():
            yield from (f"    {line}" for line in block.text.splitlines())
        case blocks.Pairs():
            for pair in block.items:
                sides = ", ".join(pair.sides)
                yield f"- **{_text(pair.heading)}** ({_text(sides)}). {_text(' '.join(pair.caption))}"
        case blocks.Figures() | blocks.Replays():  # drawings are for pages only; tables have the same numbers
            pass


def _table(table: Table) -> Iterator[str]:
    columns, rows = table.shown(Media.MARKDOWN)
    if table.title:
        yield from (f"**{_text(table.title)}**", "")
    yield from _rows([column.line for column in columns], [[cell.line for cell in row] for row in rows])
    if table.note:
        yield from ("", _text(table.note))


def _rows(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    yield _row([_text(cell) for cell in head])
    yield _row(["---"] * len(head))
    yield from (_row([_text(cell) for cell in row]) for row in rows)


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _text(text: str) -> str:
    """Escape text for Markdown: one line, without markup, table borders or HTML."""
    return re.sub(r"([\\`*_\[\]<>|])", r"\\\1", re.sub(r"\s+", " ", text)).replace("&", "&amp;")
