"""`carom report`: rebuild the report of a cross-check from its records."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from carom.cli import arguments, output
from carom.errors import InputError


def report(
    folder: Annotated[Path, typer.Argument(help="Folder of the report, or its results.jsonl.")],
    page: Annotated[Path | None, typer.Option("--page", help="Write the report to a new HTML file.")] = None,
    markdown: Annotated[
        Path | None,
        typer.Option("--markdown", help="Write the report to a new Markdown file. With -, print only the Markdown."),
    ] = None,
    verbose: arguments.Verbose = False,
) -> None:
    """Rebuild the report from results.jsonl without running engines.

    The rebuilt report has no replays or pictures. Examples: `carom report reports/latest`, `carom report before -v`.
    """
    from carom.report.results_file.results_jsonl import read_records
    from carom.studies.cross_check.document import rebuild_document

    for option, path in (("--page", page), ("--markdown", markdown)):
        if path is not None and path.is_file():
            raise InputError(f"{option}: {path} already exists: name another file")
    document = rebuild_document(*read_records(folder / "results.jsonl" if folder.is_dir() else folder))
    output.write_report(document, page, markdown, full=verbose)
