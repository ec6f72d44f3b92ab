"""`carom history`: compare releases of an engine."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from carom.cli import arguments, error_handling, output
from carom.cli.command_line import get_command_line
from carom.cli.exit_codes import ExitCode
from carom.cli.options import add_options
from carom.errors import InputError
from carom.studies.history.options import HistoryOptions

if TYPE_CHECKING:
    from carom.studies.history.release_cache import ReleaseCache

#: Default groups of scenes: short scenes of all kinds with known answers.
SCENES = ("paper", "classics", "engines")


@add_options(HistoryOptions)
def history(
    options: HistoryOptions,
    engine: Annotated[
        str,
        typer.Argument(
            help="Engine name, or path of an engine.toml. Its releases must be installable with pip or npm."
        ),
    ],
    scenes: Annotated[list[str] | None, arguments.declare_scenes_argument("paper, classics, engines")] = None,
    listed: Annotated[bool, typer.Option("--list", help="List the available releases and exit.")] = False,
    bisect: Annotated[
        str | None,
        typer.Option(
            "--bisect",
            metavar="SCENE:PROFILE:STEP",
            help="Find the release that changed one run, such as classics/box:default:1/60, and exit.",
        ),
    ] = None,
    out: Annotated[
        Path | None, arguments.declare_out_option("Output folder for history.md, history.svg and the journal.")
    ] = None,
    resume: arguments.Resume = False,
    retry: arguments.Retry = False,
    verbose: arguments.Verbose = False,
) -> None:
    """Run the releases of an engine with the present adapter and scenes, and list how results changed.

    Each release is installed into a folder of its own, so your installation does not change. Pip installs only wheels,
    and npm runs no scripts. The exit code is 1 if the newest release is worse than the previous one.

    Examples: `carom history pymunk`, `carom history rapier2d --versions '>=0.18' --out history`,
    `carom history rapier2d --bisect classics/cradle-gaps:default:1/60`.
    """
    from carom.report.files import require_report_extra
    from carom.studies.history import run
    from carom.studies.history.compare_cells import history_journal
    from carom.studies.history.document import build_history_document, describe_listing, write_history
    from carom.studies.history.release_cache import open_release_cache

    name = arguments.parse_engine(engine)
    with open_release_cache(options.kept_mb * 1e6) as cache, ExitStack() as stack:
        if listed:
            pool = stack.enter_context(options.open_local_pool(1))
            output.print_lines(describe_listing(*run.list_releases(name, options, cache, pool)))
            return
        if bisect is not None:
            _bisect_change(name, bisect, options, cache)
            return
        loaded_scenes = arguments.load_plain_scenes(scenes or list(SCENES))
        if out is None and (resume or retry):
            raise InputError("--resume and --retry need the output folder: give --out")
        journal = None
        if out is None:
            progress = stack.enter_context(output.show_progress_bar())
        else:
            require_report_extra()
            path = out / run.JOURNAL
            progress = stack.enter_context(error_handling.run_study(out, run.PURPOSE, path))
            journal = stack.enter_context(history_journal(path, resume=resume, retry=retry))
        result = run.run_history(
            name, loaded_scenes, cache, options, notes=journal, progress=progress, command=get_command_line()
        )
    document = build_history_document(result)
    page = None if out is None else write_history(result, document, out)
    output.print_document(document, full=verbose, report=page)
    if not result.completed:
        raise typer.Exit(ExitCode.UNAVAILABLE)
    if result.is_worse:
        raise typer.Exit(ExitCode.VIOLATION)


def _bisect_change(engine: str, cell: str, options: HistoryOptions, cache: ReleaseCache) -> None:
    from carom.studies.history.document import describe_bisection
    from carom.studies.history.run import bisect_change

    match cell.split(":"):
        case [scene, profile, step]:
            found = arguments.load_one_scene(scene, "--bisect")
        case _:
            raise InputError(f"--bisect must be SCENE:PROFILE:STEP, such as classics/box:default:1/60, got {cell!r}")
    with output.show_progress_bar() as progress:
        one = bisect_change(engine, found, profile, arguments.parse_step(step), cache, options, progress=progress)
    for line in describe_bisection(one):
        output.print_text(line)
