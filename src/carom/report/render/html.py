"""Renderer of documents as one HTML file.

The HTML file loads no other files, and every name in the file is escaped. The content security policy of the page only
allows the report's own script, which is identified by a hash.
"""

from __future__ import annotations

import base64
import hashlib
import re
from importlib import resources
from typing import TYPE_CHECKING, Any

from carom.report.document import QUESTION, Cell, Document, Figures, Media, Replays, Table
from carom.report.files import pack_data, require_report_extra
from carom.support.escaping import escape_controls

if TYPE_CHECKING:
    from collections.abc import Sequence

_REPLAY = ("drawing.js", "sampler.js", "replay.js")
#: Scripts that a page needs, by the kind of block that it contains.
_SCRIPTS = {Replays: (*_REPLAY, "table.js"), Figures: ("chart.js",), Table: ("rows.js",)}

#: Number of table columns that fit on a phone.
_MOST_ACROSS = 3

#: Export keywords of modules, which are removed because a page joins all scripts into one.
_EXPORT = re.compile(r"^export (?:\{[^}]*\};\n)?", re.MULTILINE)
#: Imports, comment lines and indentation of modules, which are removed from pages. No string of a module spans several
#: lines, so the removal does not change strings.
_IMPORT = re.compile(r'^import \{[^}]*\} from "\./\w+\.js";\n|^ *//[^\n]*\n|^ +', re.MULTILINE)


def render_html(document: Document) -> str:
    """Return a document as an HTML page.

    Raises:
        MissingExtraError: jinja2 or matplotlib is not installed.
    """
    sections = list(document.select_for(Media.PAGE))
    blocks = [block for section in sections for block in section.select_for(Media.PAGE)]
    kinds = {type(block) for block in blocks if not isinstance(block, Table) or block.packed}
    script = build_page_script(*(name for kind, names in _SCRIPTS.items() if kind in kinds for name in names))
    return _render_template(
        "page.html.j2",
        script,
        document=document,
        sections=sections,
        page=Media.PAGE,
        anchor=lambda section: re.sub(r"[^a-z0-9]+", "-", section.heading.lower()).strip("-"),
        kind=lambda block: type(block).__name__.lower(),
        question=QUESTION,
        most_across=_MOST_ACROSS,
        packed_rows=_pack_rows,
    )


def render_replay_page(
    title: str, data: str, sentences: Sequence[str] = (), stills: Sequence[tuple[str, str]] = ()
) -> str:
    """Return a page with one replay.

    Args:
        title: Title of the page.
        data: Packed data of the replay.
        sentences: Sentences for browsers without JavaScript.
        stills: Captions and SVG pictures for browsers without JavaScript.

    Raises:
        MissingExtraError: jinja2 or matplotlib is not installed.
    """
    script = build_page_script(*_REPLAY)
    return _render_template("replay.html.j2", script, title=title, data=data, said=sentences, stills=stills)


def _render_template(name: str, script: str, **values: Any) -> str:
    require_report_extra()
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("carom.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(name).render(script=script, policy=build_content_policy(script), **values)


def build_page_script(*names: str) -> str:
    """Join several scripts into one, and add the code that unpacks their data."""
    templates = resources.files("carom.report") / "templates"
    shared = resources.files("carom") / "web"  # folder of drawing.js, which the play page also uses
    file_names = ("unpack.js", *names) if names else ()
    texts = (
        ((shared if name == "drawing.js" else templates) / name).read_text(encoding="utf-8") for name in file_names
    )
    return "".join(_EXPORT.sub("", _IMPORT.sub("", text)) for text in texts)


def build_content_policy(script: str) -> str:
    """Return the content security policy of a page, which only allows this script and no external content."""
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    allowed = f"'sha256-{digest}'" if script else "'none'"
    # Inline styles must be allowed, because drawings have style attributes.
    return f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"


def _pack_rows(table: Table) -> str:
    """Return a table's packed data for `rows.js`. A cell becomes a text, or an object if it has more fields."""
    columns, rows = table.select_for(Media.PAGE)
    heads = [[column.line, column.number] for column in columns]
    return pack_data({"columns": heads, "rows": [[_pack_cell(cell) for cell in row] for row in rows]})


def _pack_cell(cell: Cell) -> str | dict[str, str]:
    """Return the data of a cell for `rows.js`, which can show words and symbols, but no bars or links."""
    # Control characters are escaped here, because the code that writes the page's file can't escape packed data.
    attributes = {
        name: escape_controls(getattr(cell, name)) for name in ("css", "symbol", "note", "title") if getattr(cell, name)
    }
    if cell.link or cell.shares or cell.anchor or cell.part is not None:
        raise ValueError(f"a cell of a packed table can't have a link, bar, meter or anchor: {cell!r}")
    text = escape_controls(cell.text)
    return {"text": text, **attributes} if attributes else text
