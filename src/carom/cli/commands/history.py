"""`carom history`: compare releases of an engine."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from carom.cli import common
from carom.cli.command_line import command_line
from carom.cli.options import asking
from carom.studies.history.options import HistoryOptions

if TYPE_CHECKING:
    from carom.studies.history.release_cache import ReleaseCache

#: Default groups of scenes: short scenes of all kinds with known answers.
SCENES = ("paper", "classics", "engines")


@asking(HistoryOptions)
def history(
    options: HistoryOptions,
    engine: Annotated[
        str, typer.Argument(help="Engine name, or path of an engine.toml. Its releases must be on pip or npm.")
    ],
    scenes: Annotated[list[str] | None, common.scenes_argument("paper, classics, engines")] = None,
    listed: Annotated[bool, typer.Option("--list", help="List the available releases and exit.")] = False,
    bisect: Annotated[
        str | None,
        typer.Option(
            "--bisect",
            metavar="SCENE:PROFILE:STEP",
            help="Find the release that changed one run, such as classics/box:default:1/60, and exit.",
        ),
    ] = None,
    out: Annotated[Path | None, common.out_option("Output folder for history.md, history.svg and the journal.")] = None,
    resume: common.Resume = False,
    retry: common.Retry = False,
    verbose: common.Verbose = False,
) -> None:
    """List changes between releases of an engine, with the present adapter and scenes.

    Each release is installed into its own folder, by pip from wheels or by npm without scripts. Your installation does
    not change. Exit code 1 if the newest release is worse than the previous one.

    Examples: `carom history pymunk`, `carom history rapier2d --versions '>=0.18' --out history`,
    `carom history rapier2d --bisect classics/cradle-gaps:default:1/60`.
    """
    from carom.studies.history.release_cache import open_release_cache

    (name,) = common.engines_named([engine]) or [engine]
    with open_release_cache(options.kept_mb * 1e6) as kept:
        if listed:
            _list(name, options, kept)
        elif bisect is not None:
            _bisect(name, bisect, options, kept)
        else:
            _run(name, scenes or list(SCENES), options, kept, out, resume=resume, retry=retry, verbose=verbose)


def _list(engine: str, options: HistoryOptions, kept: ReleaseCache) -> None:
    from carom.studies.history.document import describe_listing
    from carom.studies.history.run import list_releases

    common.say_lines(describe_listing(*list_releases(engine, options, kept)))


def _bisect(engine: str, asked: str, options: HistoryOptions, kept: ReleaseCache) -> None:
    from carom.errors import InputError
    from carom.studies.history.document import describe_bisection
    from carom.studies.history.run import bisect_change

    match asked.split(":"):
        case [scene, profile, step]:
            (found,) = common.plain_scenes_named([scene])
        case _:
            raise InputError(f"--bisect must be SCENE:PROFILE:STEP, such as classics/box:default:1/60, got {asked!r}")
    with common.progress_bar() as progress:
        one = bisect_change(engine, found, profile, common.seconds(step), kept, options, progress=progress)
    for line in describe_bisection(one):
        common.say(line)


def _run(
    engine: str,
    scenes: list[str],
    options: HistoryOptions,
    kept: ReleaseCache,
    out: Path | None,
    *,
    resume: bool,
    retry: bool,
    verbose: bool,
) -> None:
    from carom.errors import InputError
    from carom.report.files import require_report_extra
    from carom.studies.history import run
    from carom.studies.history.compare_cells import history_journal
    from carom.studies.history.document import history_document, write_history

    named = common.plain_scenes_named(scenes)
    if out is None and (resume or retry):
        raise InputError("--resume and --retry need the output folder: give --out")
    command, page = command_line(), None
    if out is None:
        with common.progress_bar() as progress:
            found = run.history(engine, named, kept, options, progress=progress, command=command)
    else:
        require_report_extra()
        path = out / run.JOURNAL
        with (
            common.studied(out, run.PURPOSE, path) as progress,
            history_journal(path, resume=resume, retry=retry) as journal,
        ):
            found = run.history(engine, named, kept, options, notes=journal, progress=progress, command=command)
        page = write_history(found, out)
    common.print_document(history_document(found), full=verbose, report=page)
    if not found.ran:
        raise typer.Exit(common.EXIT_UNAVAILABLE)
    if found.worse_now:
        raise typer.Exit(common.EXIT_VIOLATION)
