"""Functions that several commands use: exit codes, common options, error messages, scene loading and printing."""

from __future__ import annotations

import functools
import io
import os
import signal
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ParamSpec, TextIO

import typer

from carom.cli.ascii import ERRORS
from carom.errors import AdapterError, CaromError, InputError
from carom.support.escaping import escape_controls
from carom.support.options import build_step_kind

if TYPE_CHECKING:
    from rich.console import Console

    from carom.catalogue import CatalogueScene
    from carom.execution.job import Progress
    from carom.model.scene import Scene
    from carom.report.document import Document

EXIT_VIOLATION = 1
EXIT_BAD_INPUT = 2
EXIT_UNAVAILABLE = 3
EXIT_CRASHED = 4
EXIT_SIGNAL = 128  # the signal's number is added, as in shells
EXIT_INTERRUPTED = EXIT_SIGNAL + signal.SIGINT

Parameters = ParamSpec("Parameters")


def declare_out_option(text: str) -> Any:
    """Return the option for the output folder. `text` describes the option, and its default if there is one."""
    return typer.Option("--out", "-o", show_default=False, help=text)


def declare_scenes_argument(default: str) -> Any:
    """Return the argument for scenes. `default` describes the scenes that are used without this argument."""
    return typer.Argument(help=f"Scene files, or names, groups or patterns of catalogue scenes (default: {default}).")


SCENE_NAMES = typer.Argument(help="Scene files (.toml, .json), or names, groups or patterns of catalogue scenes.")


def parse_engine(word: str) -> str:
    """Return an engine's name for a name or manifest on the command line. Register the engine of a manifest."""
    from carom.engines import registry

    try:
        return registry.resolve_engine(word)
    except AdapterError as error:
        raise typer.BadParameter(str(error)) from None


Resume = Annotated[
    bool, typer.Option("--resume", help="Continue an interrupted run from the journal in the output folder.")
]

Retry = Annotated[
    bool,
    typer.Option("--retry", help="Like --resume, but also repeat runs that crashed, timed out or raised an error."),
]

Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Print all tables, not only the summary.")]


def handle_errors(command: Callable[Parameters, None]) -> Callable[Parameters, None]:
    """Decorator for a command: if it ends by an error or a signal, print a message and exit with the right code."""

    @functools.wraps(command)
    def run_guarded(*args: Parameters.args, **kwargs: Parameters.kwargs) -> None:
        try:
            command(*args, **kwargs)
        except CaromError as error:
            from carom.execution.job import UnavailableError

            say_error(error)
            raise typer.Exit(EXIT_UNAVAILABLE if isinstance(error, UnavailableError) else EXIT_BAD_INPUT) from None
        except KeyboardInterrupt as error:
            word, code = _describe_signal(error)
            say(f"carom: {word}; no report was written", apart=True)
            raise typer.Exit(code) from None
        except BrokenPipeError:  # the program that reads the output, such as `head`, has closed the pipe
            drop_unwritten(sys.stdout, sys.stderr)
            raise typer.Exit from None
        except OSError as error:  # for example, the disk is full or a file is not writable
            say(f"carom: {error.filename or 'output'}: {error.strerror or error}", apart=True)
            raise typer.Exit(EXIT_BAD_INPUT) from None
        except MemoryError:
            say("carom: not enough memory", apart=True)
            raise typer.Exit(EXIT_BAD_INPUT) from None

    return run_guarded


def drop_unwritten(*streams: TextIO) -> None:
    """Discard buffered output that can't be written.

    Otherwise the interpreter would try to write the output at exit, and fail.
    """
    for stream in streams:
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def say(text: str, *, apart: bool = False) -> None:
    """Print text with control characters escaped.

    If `apart` is true, the text is not part of the results, and is printed to standard error.
    """
    replace_missing_characters()
    typer.echo(escape_controls(text), err=apart)


def say_error(error: CaromError) -> None:
    """Print an error to standard error, followed by each hint on a line of its own."""
    say("\n".join((f"carom: {error.message}", *(f"hint: {hint}" for hint in error.hints))), apart=True)


def say_lines(lines: Iterable[str]) -> None:
    """Print lines without wrapping. On a terminal, long lines are cut at its right edge."""
    console = build_console()
    for line in map(escape_controls, lines):
        typer.echo(
            f"{line[: console.width - 3].rstrip()}..." if console.is_terminal and len(line) > console.width else line
        )


def _describe_signal(error: KeyboardInterrupt) -> tuple[str, int]:
    """Return message and exit code for the signal that ended a command. An error without a number means Ctrl-C."""
    if hasattr(signal, "setitimer"):  # stop the timer of `carom.__main__` that raises the signal again
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    number = signal.Signals(error.args[0]) if error.args else signal.SIGINT
    return "interrupted" if number is signal.SIGINT else f"ended by {number.name}", EXIT_SIGNAL + number


@contextmanager
def guard_journals(journal: Path, *other_journals: Path) -> Iterator[None]:
    """Context for a block that writes journals: after a signal, print how to resume, and remove empty journals."""
    from carom.execution.journal import remove_unused

    new = [path for path in (journal, *other_journals) if not path.exists()]
    try:
        yield
    except KeyboardInterrupt as error:
        for path in new:  # a signal can interrupt the journal before it removes an empty file
            remove_unused(path)
        if not journal.exists():  # there is no finished result
            raise
        word, code = _describe_signal(error)
        say(f"carom: {word}; finished results are in {journal}, and --resume continues from them", apart=True)
        raise typer.Exit(code) from None


@contextmanager
def run_study(out: Path, purpose: str, journal: Path, *other_journals: Path) -> Iterator[Progress]:
    """Context for a study: mark its output folder, handle signals as `guard_journals` does, and show progress."""
    from carom.support.folders import claim_while_writing

    with (
        claim_while_writing(out, purpose, "--out"),
        guard_journals(journal, *other_journals),
        show_progress_bar() as progress,
    ):
        yield progress


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


def say_path(label: str, path: Path) -> None:
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
            say_path(label, path)


def write_report(document: Document, page: Path | None, markdown: Path | None, *, full: bool) -> None:
    """Write a document to the HTML and Markdown files that are given, and print it.

    If a file is ``-``, print only the Markdown.
    """
    from carom.report.render.html import render_html
    from carom.report.render.markdown import render_markdown as markdown_of
    from carom.support.folders import write_file

    if page is not None:
        write_file(page, render_html(document))
    if markdown == Path("-"):
        say(markdown_of(document).removesuffix("\n"))
        return
    if markdown is not None:
        write_file(markdown, markdown_of(document))
    print_document(document, full=full)


def parse_step(text: str) -> float:
    """Parse a step size such as ``1/240`` or ``0.004``."""
    kind = build_step_kind()
    try:
        found: float = kind.take(kind.read(text))
    except (ValueError, OverflowError):
        raise kind.build_error("--dt", text) from None
    return found


def load_scenes(names: list[str]) -> list[Scene | CatalogueScene]:
    """Load scene files, and find catalogue scenes by name. Without names, return the whole catalogue."""
    from carom.catalogue import catalogue, find_scenes
    from carom.model.scene_file import load_scene

    if not names:
        return list(catalogue().values())
    found: list[Scene | CatalogueScene] = []
    for name in names:
        is_file = Path(name).suffix in {".toml", ".json"} or Path(name).is_file()
        found += [load_scene(name)] if is_file else find_scenes([name])
    return found


def load_plain_scenes(names: list[str]) -> list[Scene]:
    """Return the scenes that `load_scenes` returns, without known answers."""
    from carom.model.scene import Scene

    return [entry if isinstance(entry, Scene) else entry.scene for entry in load_scenes(names)]


def load_one_scene(name: str, argument: str) -> Scene:
    """Return the scene of a scene file, or the catalogue scene with a name.

    Raises:
        InputError: The name matches several scenes. In the message, the name is called `argument`.
    """
    found = load_plain_scenes([name])
    if len(found) != 1:
        raise InputError(f"{argument} must name one scene, but {name!r} matches {len(found)} scenes")
    return found[0]
