"""`carom advise`: the largest step that is good enough for a scene."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Annotated

import typer

from carom.cli import common
from carom.cli.command_line import command_line
from carom.cli.options import asking
from carom.errors import InputError
from carom.studies.advise.options import AdviceOptions


@asking(AdviceOptions)
def advise(
    options: AdviceOptions,
    scene: Annotated[str, typer.Argument(help="Scene file (.toml, .json), or name of a catalogue scene.")],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="Output folder for a page that plots the error against the time step."),
    ] = None,
    verbose: common.Verbose = False,
) -> None:
    """Find the largest time step at which each engine misses no impact and meets an accuracy target.

    Tests every step of a grid, from the whole run in one step down, at start positions spread over a step and at
    unfavourable ones. Every tested step at or below the result passes; the next larger one fails.

    Examples: `carom advise my-scene.toml --out advice`, `carom advise paper/missed --direction-error 5deg
    --miss-probability 0.1`.
    """
    from carom.report.files import require_report_extra
    from carom.studies.advise.document import PURPOSE, advice_document, write_advice
    from carom.studies.advise.run import advise as find
    from carom.support.folders import claimed

    found = common.plain_scenes_named([scene])
    if len(found) != 1:
        raise InputError(f"{scene!r} matches {len(found)} scenes; carom advise takes one")
    page = None
    with claimed(out, PURPOSE, "--out") if out is not None else nullcontext():
        if out is not None:  # before minutes are spent
            require_report_extra()
        with options.pool() as pool, common.progress_bar() as progress:
            advice = find(found[0], options, pool, progress=progress, command=command_line())
        if out is not None:
            page = write_advice(advice, out, scene)
    common.print_document(advice_document(advice, scene), full=verbose, page=page)
