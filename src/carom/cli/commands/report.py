"""`carom report`: the report of a cross-check again, from its records."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from carom.cli import common
from carom.errors import InputError


@common.guarded
def report(
    folder: Annotated[Path, typer.Argument(help="A report's folder, or its results.jsonl.")],
    page: Annotated[Path | None, typer.Option("--page", help="Write it as one HTML file, a new one.")] = None,
    markdown: Annotated[
        Path | None, typer.Option("--markdown", help="Write it as Markdown, a new file; - prints that alone.")
    ] = None,
    detail: Annotated[bool, typer.Option("--verbose", "-v", help="Print every scene on every engine too.")] = False,
) -> None:
    """Draw the report of a cross-check again from its results.jsonl, without running anything.

    Replays and pictures are not in the records. Examples: `carom report reports/latest`, `carom report before -v`.
    """
    from carom.report.records import read_records
    from carom.studies.cross_check.rebuild import rebuild_document

    for option, path in (("--page", page), ("--markdown", markdown)):
        if path is not None and path.is_file():
            raise InputError(f"{option}: {path} is there already, and is not replaced: name another file")
    document = rebuild_document(*read_records(folder / "results.jsonl" if folder.is_dir() else folder))
    common.hand_over(document, page, markdown, full=detail)
