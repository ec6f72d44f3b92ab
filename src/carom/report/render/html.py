"""A document as one HTML file: no script, nothing fetched, every name escaped."""

from __future__ import annotations

import re

from carom.report.document import Block, Document, Medium, Section
from carom.report.files import require_report_extra

__all__ = ["html"]


def html(document: Document) -> str:
    """Return the page.

    Raises:
        MissingExtraError: jinja2 or matplotlib is not installed.
    """
    require_report_extra()
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("carom.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    sections = list(document.shown(Medium.PAGE))
    page = environment.get_template("page.html.j2")
    return page.render(document=document, sections=sections, page=Medium.PAGE, anchor=_anchor, kind=_kind)


def _anchor(section: Section) -> str:
    return re.sub(r"[^a-z0-9]+", "-", section.heading.lower()).strip("-")


def _kind(block: Block) -> str:
    """Return the name of the macro that shows a block."""
    return type(block).__name__.lower()
