"""The command line: parse, call, print. What it imports at the top is all that `carom --help` needs."""

from __future__ import annotations

import functools
import shlex
import sys
from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ParamSpec

import typer

from carom.errors import CaromError, InputError

if TYPE_CHECKING:
    from rich.console import Console

    from carom.runner import Results
    from carom.scene import Scene
    from carom.scenes import CatalogueScene

__all__ = ["app", "main"]

EXIT_VIOLATION = 1
EXIT_BAD_INPUT = 2
EXIT_UNAVAILABLE = 3
EXIT_CRASHED = 4
EXIT_INTERRUPTED = 130  # what a shell reports for a command that Ctrl-C ended

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Cross-check disc collisions: collision times and post-impact velocities of physics engines, "
    "scored against the analytic result.",
    epilog="Exit codes: 0 conforms, 1 a violation, 2 bad usage or bad scene, 3 a requested engine is unavailable "
    "or nothing could be run, 4 an adapter crashed or gave no answer in time.",
)

Parameters = ParamSpec("Parameters")


class FailOn(StrEnum):
    """The best grade that counts as a violation."""

    SAMPLED = "sampled"
    INACCURATE = "inaccurate"
    WRONG = "wrong"
    NEVER = "never"


def _guarded(command: Callable[Parameters, None]) -> Callable[Parameters, None]:
    """Turn Carom's own errors and Ctrl-C into a sentence and an exit code."""

    @functools.wraps(command)
    def guarded(*args: Parameters.args, **kwargs: Parameters.kwargs) -> None:
        try:
            command(*args, **kwargs)
        except CaromError as error:
            typer.echo(f"carom: {error}", err=True)
            raise typer.Exit(EXIT_BAD_INPUT) from None
        except KeyboardInterrupt:
            typer.echo("carom: interrupted; no report was written", err=True)
            raise typer.Exit(EXIT_INTERRUPTED) from None
        except BrokenPipeError:  # the reader, `head` say, has seen enough
            sys.stderr.close()
            raise typer.Exit from None
        except OSError as error:  # a disc that is full, a file that may not be written
            typer.echo(f"carom: {error.filename or 'output'}: {error.strerror or error}", err=True)
            raise typer.Exit(EXIT_BAD_INPUT) from None

    return guarded


def _console() -> Console:
    from rich.console import Console

    # A pipe or a log has no width of its own; 160 columns keep a row of the widest table on one line.
    # Names and an engine's own words may hold brackets and colons that are no markup.
    return Console(width=None if sys.stdout.isatty() else 160, highlight=False, markup=False, emoji=False)


def _seconds(text: str) -> float:
    """Read a step such as ``1/240`` or ``0.004``."""
    from fractions import Fraction

    try:
        value = float(Fraction(text))
    except (ValueError, ZeroDivisionError, OverflowError):
        raise InputError(f"--dt must be a number of seconds such as 1/240 or 0.004, got {text!r}") from None
    if not value > 0:
        raise InputError(f"--dt must be above 0, got {text!r}")
    return value


def _scenes(names: list[str]) -> list[Scene | CatalogueScene]:
    """Load files, and find scenes of the catalogue by name; all of the catalogue where no name is given."""
    from carom.scene import load_scene
    from carom.scenes import catalogue, find_scenes

    if not names:
        return list(catalogue().values())
    found: list[Scene | CatalogueScene] = []
    for name in names:
        is_file = Path(name).suffix in {".toml", ".json"} or Path(name).is_file()
        found += [load_scene(name)] if is_file else find_scenes([name])
    return found


@app.command()
@_guarded
def run(
    scenes: Annotated[
        list[str] | None,
        typer.Argument(
            help="Scene files (.toml, .json), or scenes of the catalogue by name, group or pattern. "
            "All of the catalogue by default."
        ),
    ] = None,
    engine: Annotated[
        list[str] | None, typer.Option("--engine", "-e", help="Engine to run, repeatable. All by default.")
    ] = None,
    dt: Annotated[
        list[str] | None,
        typer.Option(
            "--dt",
            help="Step in seconds, such as 1/240; repeatable. "
            "By default each scene's own frame, a quarter and a sixteenth of it.",
        ),
    ] = None,
    profile: Annotated[
        list[str] | None,
        typer.Option("--profile", "-p", help="Settings profile, repeatable. By default 'default' and 'tuned'."),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(
            "--report", help="Folder to write the report into: index.html, report.md, results.jsonl, junit.xml."
        ),
    ] = None,
    jobs: Annotated[
        int | None, typer.Option("--jobs", "-j", min=1, help="Runs at a time. As many as there are cores by default.")
    ] = None,
    time_limit: Annotated[
        float, typer.Option("--time-limit", help="Seconds after which an engine that gives no answer is ended.")
    ] = 60.0,
    timing: Annotated[
        bool, typer.Option("--timing/--no-timing", help="Whether to time each scene at its coarsest step too.")
    ] = True,
    fail_on: Annotated[
        FailOn, typer.Option("--fail-on", help="The best grade that counts as a violation (exit code 1).")
    ] = FailOn.INACCURATE,
) -> None:
    """Run scenes through engines, score each against PIC, and print a verdict table.

    Examples: `carom run`, `carom run paper classics/galperin-100 -e pymunk -e mujoco`,
    `carom run my-scene.toml --engine mujoco --dt 1/240 --report reports/mine`.
    """
    from carom.report import require_writable, verdict_line, verdict_table, write_report
    from carom.report.impact_table import impact_tables

    found = _scenes(scenes or [])
    if report is not None:
        require_writable(report)
    results = _cross_check(found, engine, dt, profile, jobs, time_limit, timing)
    paths = None if report is None else write_report(results, report)
    console = _console()
    console.print(verdict_table(results))
    for table in impact_tables(results):
        console.print(table)
    console.print(verdict_line(results), soft_wrap=True)
    if paths is not None:
        console.print(f"report: {paths.html}", soft_wrap=True)
    code = _exit_code(results, set(engine or ()), fail_on)
    if code:
        raise typer.Exit(code)


def _cross_check(
    scenes: list[Scene | CatalogueScene],
    engine: list[str] | None,
    dt: list[str] | None,
    profile: list[str] | None,
    jobs: int | None,
    time_limit: float,
    timing: bool,
) -> Results:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from carom.runner import cross_check
    from carom.runner.cross_check import DEFAULT_PROFILES

    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty()) as bar:
        task = bar.add_task("", total=None)

        def progress(done: int, total: int, what: str) -> None:
            bar.update(task, completed=done, total=total, description=what)

        return cross_check(
            scenes,
            engine,
            dts=[_seconds(text) for text in dt] if dt else None,
            profiles=tuple(profile or DEFAULT_PROFILES),
            jobs=jobs,
            time_limit_s=time_limit,
            timing=timing,
            progress=progress,
            command=shlex.join(["carom", *sys.argv[1:]]),
        )


def _exit_code(results: Results, requested: set[str], fail_on: FailOn) -> int:
    from carom.comparator import Grade
    from carom.runner import Status, violates

    broken = {Status.CRASHED, Status.TIMED_OUT, Status.FAILED}
    if any(row.status in broken for row in results.rows):
        return EXIT_CRASHED
    if any(row.status is Status.UNAVAILABLE and row.cell.engine in requested for row in results.rows):
        return EXIT_UNAVAILABLE
    if all(row.score is None for row in results.rows):  # what was not run does not conform
        return EXIT_UNAVAILABLE
    if fail_on is not FailOn.NEVER and any(violates(row, Grade[fail_on.name]) for row in results.rows):
        return EXIT_VIOLATION
    return 0


@app.command()
@_guarded
def scenes(
    names: Annotated[
        list[str] | None, typer.Argument(help="Scenes to show in full, by name, group or pattern.")
    ] = None,
    save: Annotated[
        Path | None,
        typer.Option("--save", help="Write the scenes named into this folder, as TOML files of your own to edit."),
    ] = None,
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON Schema of a scene file.")] = False,
) -> None:
    """List the catalogue, or show scenes of it in full, as the files they could be loaded from."""
    if schema:
        import json

        from carom.scene import scene_schema

        typer.echo(json.dumps(scene_schema(), indent=2))
        return
    from carom.report.scene_table import scene_table, scene_text
    from carom.scene import save_scene
    from carom.scenes import catalogue, find_scenes

    if not names and save is None:
        _console().print(scene_table(list(catalogue().values())))
        return
    found = find_scenes(names) if names else list(catalogue().values())
    for entry in found:
        if save is None:
            typer.echo(scene_text(entry))
            continue
        path = save / f"{entry.name.replace('/', '-')}.toml"
        path.parent.mkdir(parents=True, exist_ok=True)
        save_scene(entry.scene, path)
        typer.echo(path)


@app.command()
@_guarded
def engines() -> None:
    """List the engines: version, profiles and capabilities, or why one is unavailable."""
    from carom.registry import engines as known_engines
    from carom.report.engine_table import engine_table

    _console().print(engine_table(known_engines()))


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"carom {version('carom')}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and leave.")
    ] = False,
) -> None:
    del version  # its callback has done all there is to do


def main() -> None:
    """Entry point of the `carom` command."""
    app()
