"""Messages and exit codes of commands that end by an error or a signal."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from carom.cli.exit_codes import ExitCode
from carom.cli.output import drop_unwritten, print_error, print_text, show_progress_bar
from carom.errors import CaromError

if TYPE_CHECKING:
    from carom.execution.job import Progress


@contextmanager
def handle_errors() -> Iterator[None]:
    """Context of a command: if an error or a signal ends the command, print a message and exit with an exit code."""
    try:
        yield
    except CaromError as error:
        from carom.execution.job import UnavailableError

        print_error(error)
        raise typer.Exit(ExitCode.UNAVAILABLE if isinstance(error, UnavailableError) else ExitCode.BAD_INPUT) from None
    except KeyboardInterrupt as error:
        word, signal_code = _describe_signal(error)
        print_text(f"carom: {word}; no report was written", to_stderr=True)
        raise typer.Exit(signal_code) from None
    except BrokenPipeError:  # the program that reads the output, such as `head`, has closed the pipe
        drop_unwritten(sys.stdout, sys.stderr)
        raise typer.Exit from None
    except OSError as error:  # for example, the disk is full or a file is not writable
        print_text(f"carom: {error.filename or 'output'}: {error.strerror or error}", to_stderr=True)
        raise typer.Exit(ExitCode.BAD_INPUT) from None
    except MemoryError:
        print_text("carom: not enough memory", to_stderr=True)
        raise typer.Exit(ExitCode.BAD_INPUT) from None


def _describe_signal(error: KeyboardInterrupt) -> tuple[str, int]:
    """Return message and exit code for the signal that ended a command.

    A `KeyboardInterrupt` without a number means Ctrl-C.
    """
    if hasattr(signal, "setitimer"):  # stop the timer of `carom.__main__` that raises the signal again
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    number = signal.Signals(error.args[0]) if error.args else signal.SIGINT
    return "interrupted" if number is signal.SIGINT else f"ended by {number.name}", ExitCode.SIGNAL + number


@contextmanager
def guard_journals(journal: Path, *other_journals: Path) -> Iterator[None]:
    """Context for a block that writes journals: after a signal, print how to resume, and remove empty journals."""
    from carom.execution.journal import remove_unused

    new = [path for path in (journal, *other_journals) if not path.exists()]
    try:
        yield
    except KeyboardInterrupt as error:
        for path in new:  # a signal can arrive before the journal removes an empty file
            remove_unused(path)
        if not journal.exists():  # there is no finished result
            raise
        word, code = _describe_signal(error)
        message = f"carom: {word}; finished results are in {journal}, and --resume continues from them"
        print_text(message, to_stderr=True)
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
