"""Command line of Carom.

Each command is a module of `carom.cli.commands`. Only the module of the requested command is loaded.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from carom.cli import address_space, commands
from carom.cli.command_line import Command
from carom.cli.exit_codes import ExitCode
from carom.cli.output import drop_unwritten, print_error, print_text
from carom.errors import CaromError

__all__ = ["app", "build_app", "run_command_line"]

#: Commands by purpose, in the order of `carom --help`.
GROUPS = {
    "Check": ("run", "bench", "stress", "certify"),
    "Choose": ("advise", "tune", "engines"),
    "Compare": ("diff", "history", "report"),
    "See": ("play", "demo", "scenes", "explain"),
    "Connect": ("import", "serve"),
}
_FIRST = tuple(name for names in GROUPS.values() for name in names)

#: Module and function of each command whose name is a Python keyword. A keyword can't be the name of a module.
_SPELT = {"import": ("importing", "import_file")}

_MODULES = {path.stem for path in Path(commands.__path__[0]).glob("[!_]*.py")} - {"importing"}
COMMANDS = (*_FIRST, *sorted(_MODULES - {*_FIRST}))


class CommandGroup(TyperGroup):
    """The top-level command `carom`. ``carom --help`` lists the commands under headings."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write one section per group. A command without a group is listed under *Other*."""
        rows = {name: self.commands[name].get_short_help_str(1000) for name in self.list_commands(ctx)}
        width = max(map(len, rows), default=0)
        for title, names in {**GROUPS, "Other": [name for name in rows if name not in _FIRST]}.items():
            if listed := [(name.ljust(width), rows[name]) for name in names if name in rows]:
                with formatter.section(title):
                    formatter.write_dl(listed)


def build_app(names: Sequence[str]) -> typer.Typer:
    """Return the command line with the given commands.

    A command line with fewer commands starts faster, because Typer reads the options of each command.
    """
    app = typer.Typer(
        cls=CommandGroup,
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,  # drawing boxes around help texts is slow
        context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 120},
        help="Check how accurately physics engines compute disc collisions: "
        "impact times and velocities, compared with the exact solution.",
        epilog="Exit codes: 0 no violation, 1 violation found, 2 wrong usage or invalid scene, "
        "3 a requested engine is not available or nothing could be run, 4 an adapter crashed, failed or timed out.",
    )
    for name in names:
        module, function = _SPELT.get(name, (name, name))
        command = getattr(importlib.import_module(f"carom.cli.commands.{module}"), function)
        # Without `short_help`, the list of commands would cut first sentences at 45 characters.
        app.command(name, cls=Command, short_help=(command.__doc__ or "").partition("\n\n")[0])(command)
    app.callback()(_options)
    return app


def __getattr__(name: str) -> Any:
    if name == "app":  # `carom.cli.app` contains all commands
        globals()["app"] = app = build_app(COMMANDS)
        return app
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def _print_version(is_requested: bool) -> None:
    if is_requested:
        from importlib.metadata import version

        typer.echo(f"carom {version('carom')}")
        raise typer.Exit


def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    del version  # the option's callback has already printed the version


def run_command_line() -> str | int | None:
    """Run the command and return its exit code, even if the output can't be written.

    Raises:
        KeyboardInterrupt: A signal arrived before the command began or after it ended.
    """
    output = sys.stdout
    try:
        try:
            if not {"-h", "--help", "--version"} & {*sys.argv}:  # other arguments need NumPy
                address_space.require_address_space()
            first_argument = sys.argv[1:2]
            build_app(first_argument if first_argument and first_argument[0] in COMMANDS else COMMANDS)()
            code: str | int | None = 0
        except SystemExit as end:
            if isinstance(signal := getattr(end.__context__, "__cause__", None), KeyboardInterrupt):
                raise signal from None  # raise the original signal again, since Typer reports every signal as Ctrl-C
            code = end.code if sys.stdout is output else 0  # if the pipe is closed, Typer replaces `stdout`
        except (CaromError, ImportError, MemoryError, RuntimeError) as error:
            if not isinstance(error, CaromError):
                if not (limit_mb := address_space.read_limit_mb()):
                    raise
                limit = f"address space is limited to {limit_mb:.0f} MB (ulimit -v)"
                error = CaromError(f"{type(error).__name__}: {error}; {limit}", hints=["raise the limit"])
            print_error(error)
            code = ExitCode.BAD_INPUT
        output.flush()  # write now, because an error at exit could not be reported
    except BrokenPipeError:  # a reader such as `head` has closed the pipe
        code = 0
    except OSError as error:  # for example a full disk
        with suppress(OSError):
            print_text(f"carom: output: {error.strerror or error}", to_stderr=True)
        code = ExitCode.BAD_INPUT
    drop_unwritten(output, sys.stderr)
    return code
