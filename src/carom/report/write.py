"""Writing a report: all four files or none."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from carom.errors import InputError
from carom.report.cross_check import cross_check_document
from carom.report.document import Document
from carom.report.extra import require_report_extra
from carom.report.junit import junit
from carom.report.records import records
from carom.report.render import html, markdown
from carom.runs.results import Results

__all__ = ["ReportPaths", "replace_all", "require_writable", "write_report"]


class ReportPaths(NamedTuple):
    """The files of a report."""

    html: Path
    markdown: Path
    jsonl: Path
    junit: Path


def write_report(results: Results, folder: Path, document: Document | None = None) -> ReportPaths:
    """Write `index.html`, `report.md`, `results.jsonl` and `junit.xml` into a folder, in place of older ones.

    Everything is derived before the first file is touched, and each file is renamed into place when it is whole.

    Args:
        results: What is reported.
        folder: Where to; it is made where it does not exist.
        document: Its document, where that was made already.

    Raises:
        MissingExtraError: jinja2 or matplotlib, the extra `report`, is not installed.
        OSError: The folder can't be written to.
    """
    document = document or cross_check_document(results)
    folder = Path(folder)
    paths = ReportPaths(*(folder / name for name in ("index.html", "report.md", "results.jsonl", "junit.xml")))
    texts = (html(document), markdown(document), records(results), junit(results))
    folder.mkdir(parents=True, exist_ok=True)
    replace_all(dict(zip(paths, texts, strict=True)))
    return paths


def require_writable(folder: Path) -> None:
    """See to it, before minutes of work, that a report can be written there; nothing is made yet.

    Raises:
        MissingExtraError: jinja2 or matplotlib, the extra `report`, is not installed.
        InputError: The folder, or the nearest one above it that exists, is no folder or can't be written to.
    """
    require_report_extra()
    existing = next(place for place in (folder.absolute(), *folder.absolute().parents) if place.exists())
    if not existing.is_dir():
        raise InputError(f"the report can't be written into {folder}: {existing} is not a folder")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise InputError(f"the report can't be written into {folder}: no permission to write in {existing}")


def replace_all(contents: Mapping[Path, str | bytes]) -> None:
    """Write each text beside its place first; only when all are on the disk are they renamed."""
    whole: list[tuple[Path, Path]] = []
    try:
        for path, text in contents.items():
            part = path.with_name(f".{path.name}.{os.getpid()}.part")
            whole.append((part, path))
            if isinstance(text, str):
                part.write_text(text, encoding="utf-8", newline="\n")
            else:
                part.write_bytes(text)
        for part, path in whole:
            part.replace(path)
    finally:
        for part, _ in whole:
            part.unlink(missing_ok=True)
