"""The command line: parse, call, print; a module a command. What is imported here is all that `carom --help` needs."""

from __future__ import annotations

from typing import Annotated

import typer

from carom.cli import advise, bench, certify, diff, engines, run, scenes, stress

__all__ = ["app"]

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # boxes around a help text would cost more processor time than all else of `carom --help`
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 120},
    help="Cross-check disc collisions: collision times and post-impact velocities of physics engines, "
    "scored against the analytic result.",
    epilog="Exit codes: 0 conforms, 1 a violation, 2 bad usage or bad scene, 3 a requested engine is unavailable "
    "or nothing could be run, 4 an adapter crashed or gave no answer in time.",
)

for command in (
    run.run,
    diff.diff,
    bench.bench,
    advise.advise,
    certify.certify,
    stress.stress,
    scenes.scenes,
    engines.engines,
):
    # Its first sentence whole: by default the list of commands cuts it at 45 characters.
    app.command(short_help=(command.__doc__ or "").partition("\n\n")[0])(command)


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
