"""Renderer of documents as Markdown."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from carom.report import document as blocks
from carom.report.document import Block, Document, Media, Table


def render_markdown(document: Document) -> str:
    """Return a document as Markdown.

    Names in the document are escaped, so that they are never interpreted as markup.
    """
    return "\n".join(_render_lines(document)) + "\n"


def _render_lines(document: Document) -> Iterator[str]:
    yield f"# {_escape_text(document.title)}"
    for sentence in (*filter(None, (document.about,)), *document.lead):
        yield from ("", _escape_text(sentence))
    for section in document.select_for(Media.MARKDOWN):
        yield from ("", f"{'#' * section.level} {_escape_text(section.heading)}")
        for block in section.select_for(Media.MARKDOWN):
            yield ""
            yield from _render_block(block)


def _render_block(block: Block) -> Iterator[str]:
    match block:
        case Table():
            yield from _render_table(block)
        case blocks.Text():
            yield f"*{blocks.QUESTION}* {_escape_text(block.text)}" if block.folded else _escape_text(block.text)
        case blocks.Lines():
            yield from (f"- {_escape_text(line)}" for line in block.items)
        case blocks.Facts():
            yield from _render_rows(("", ""), block.items)
        case blocks.Legend():
            yield from (f"- {mark.symbol} **{mark.text}**: {_escape_text(meaning)}" for mark, meaning in block.items)
        case blocks.Code():
            yield from (f"    {line}" for line in block.text.splitlines())
        case blocks.Pairs():
            for pair in block.items:
                parts = pair.heading, ", ".join(pair.sides), " ".join(pair.caption)
                heading, sides, caption = map(_escape_text, parts)
                yield f"- **{heading}** ({sides}). {caption}"
        # Only pages show figures and replays; tables show the same numbers.


def _render_table(table: Table) -> Iterator[str]:
    columns, rows = table.select_for(Media.MARKDOWN)
    if table.title:
        yield from (f"**{_escape_text(table.title)}**", "")
    yield from _render_rows([column.line for column in columns], [[cell.line for cell in row] for row in rows])
    if table.note:
        yield from ("", _escape_text(table.note))


def _render_rows(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    yield _render_row([_escape_text(cell) for cell in head])
    yield _render_row(["---"] * len(head))
    yield from (_render_row([_escape_text(cell) for cell in row]) for row in rows)


def _render_row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _escape_text(text: str) -> str:
    """Escape text for Markdown: one line, without markup, table borders or HTML."""
    return re.sub(r"([\\`*_\[\]<>|])", r"\\\1", re.sub(r"\s+", " ", text)).replace("&", "&amp;")
