"""`carom diff`: compare two cross-checks."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from carom.cli import arguments, output
from carom.cli.exit_codes import ExitCode
from carom.cli.options import add_options
from carom.errors import InputError
from carom.execution.shared_options import FailOn
from carom.studies.diff.options import DiffOptions

#: A file is an earlier comparison if its first `MOST_HEAD` bytes contain this title.
TITLE, MOST_HEAD = "Carom diff", 4096


@add_options(DiffOptions)
def diff(
    options: DiffOptions,
    old: Annotated[Path | None, typer.Argument(help="Folder of the old report, or its results.jsonl.")] = None,
    new: Annotated[Path | None, typer.Argument(help="Folder of the new report, or its results.jsonl.")] = None,
    markdown: Annotated[
        Path | None,
        typer.Option("--markdown", help="Write the comparison to a Markdown file. With -, print only the Markdown."),
    ] = None,
    page: Annotated[Path | None, typer.Option("--page", help="Write the comparison to an HTML file.")] = None,
    verbose: arguments.Verbose = False,
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON Schema of a line of results.jsonl.")] = False,
) -> None:
    """List what became better or worse between an old and a new report, and why.

    Examples: `carom diff reports/before reports/after`, `carom diff old new --markdown - --fail-on close`.
    """
    if schema:
        import json

        from carom.report.results_file.line_codec import build_records_schema

        typer.echo(json.dumps(build_records_schema(), indent=2, sort_keys=True, allow_nan=False))
        return
    if old is None or new is None:
        raise InputError("two reports are needed: carom diff OLD NEW")
    from carom.comparator import Grade
    from carom.studies.diff.compare_records import compare_records as compared
    from carom.studies.diff.document import build_diff_document

    for option, path in (("--page", page), ("--markdown", markdown)):
        if path is not None:
            _require_own(option, path)
    found = compared(old, new, options.match)
    output.write_report(build_diff_document(found, str(old), str(new)), page, markdown, full=verbose)
    worst_grade = None if options.fail_on is FailOn.NEVER else Grade[options.fail_on.name]
    if worst_grade is not None and any(change.is_regression_to(worst_grade) for change in found.changes):
        raise typer.Exit(ExitCode.VIOLATION)


def _require_own(option: str, path: Path) -> None:
    """Raise an error if the file exists and is not an earlier comparison."""
    from carom.support.escaping import format_value

    if path.is_file() and (begin := path.read_bytes()[:MOST_HEAD]) and TITLE.encode() not in begin:
        raise InputError(
            f"{option}: {format_value(str(path))} exists and is not an earlier comparison: name another file"
        )
