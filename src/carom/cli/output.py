"""What commands print: results, messages, errors, progress and documents."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import typer

from carom.cli.ascii import ERRORS
from carom.errors import CaromError
from carom.support.escaping import escape_controls

if TYPE_CHECKING:
    from rich.console import Console

    from carom.execution.job import Progress
    from carom.report.document import Document


def print_text(text: str, *, to_stderr: bool = False) -> None:
    """Print text with control characters escaped.

    If `to_stderr` is true, print to standard error, because the text is not part of the results.
    """
    replace_missing_characters()
    typer.echo(escape_controls(text), err=to_stderr)


def print_error(error: CaromError) -> None:
    """Print an error to standard error, followed by each hint on a line of its own."""
    print_text("\n".join((f"carom: {error.message}", *(f"hint: {hint}" for hint in error.hints))), to_stderr=True)


def print_lines(lines: Iterable[str]) -> None:
    """Print lines without wrapping. On a terminal, long lines are cut at the right edge."""
    console = build_console()
    for line in map(escape_controls, lines):
        typer.echo(
            f"{line[: console.width - 3].rstrip()}..." if console.is_terminal and len(line) > console.width else line
        )


@contextmanager
def show_progress_bar() -> Iterator[Progress]:
    """Show the progress of a long command on a terminal, with an estimate of the remaining time."""
    if not sys.stderr.isatty():
        yield lambda _done, _total, _what: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), TextColumn("{task.description}", markup=False))
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None)

        def show(done: int, total: int, description: str) -> None:
            bar.update(task, completed=done, total=total, description=escape_controls(description))

        yield show


def build_console() -> Console:
    """Return the console for results."""
    from rich.console import Console

    class Out(Console):
        def on_broken_pipe(self) -> None:
            raise  # noqa: PLE0704 - called while the error is handled; Rich would exit with code 1

    replace_missing_characters()
    # Markup is disabled, because names and messages of engines may contain brackets and colons. If the output is a
    # pipe, the environment variable COLUMNS sets the width.
    return Out(highlight=False, markup=False, emoji=False)


def replace_missing_characters() -> None:
    """Configure standard output and standard error to replace characters that their encodings do not have."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=ERRORS)


def drop_unwritten(*streams: TextIO) -> None:
    """Discard buffered output that can't be written.

    Without this function, the interpreter would try to write this output at exit, and fail.
    """
    for stream in streams:
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def print_path(label: str, path: Path) -> None:
    """Print the path of a written file on one line, without control characters."""
    build_console().print(f"{label}: {escape_controls(str(path))}", soft_wrap=True)


def print_document(document: Document, *, full: bool = False, **places: Path | None) -> None:
    """Print a document's summary or, with `full`, the whole document. Then print the paths of written files."""
    from carom.report.render.terminal import render_terminal

    console = build_console()
    for item in render_terminal(document, console.width, full=full):
        console.print(item)
    for label, path in places.items():
        if path is not None:
            print_path(label, path)


def write_report(document: Document, page: Path | None, markdown: Path | None, *, full: bool) -> None:
    """Write a document to the HTML and Markdown files that are given, and print it.

    If `markdown` is ``-``, print only the Markdown.
    """
    from carom.report.render.html import render_html
    from carom.report.render.markdown import render_markdown as markdown_of
    from carom.support.folders import write_file

    if page is not None:
        write_file(page, render_html(document))
    if markdown == Path("-"):
        print_text(markdown_of(document).removesuffix("\n"))
        return
    if markdown is not None:
        write_file(markdown, markdown_of(document))
    print_document(document, full=full)
