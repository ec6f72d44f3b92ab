"""`carom advise`: find the largest step size that is accurate enough for a scene."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Annotated

import typer

from carom.cli import arguments, output
from carom.cli.command_line import get_command_line
from carom.cli.options import add_options
from carom.studies.advise.options import AdviceOptions


@add_options(AdviceOptions)
def advise(
    options: AdviceOptions,
    scene: Annotated[str, typer.Argument(help="Scene file (.toml, .json), or name of a catalogue scene.")],
    out: Annotated[
        Path | None,
        arguments.declare_out_option("Output folder for a page that plots the error against the step size."),
    ] = None,
    verbose: arguments.Verbose = False,
) -> None:
    """Find the largest step size at which each engine misses no impact and meets an accuracy target.

    A series of step sizes is tested, beginning with the whole run in one step. Each step size is tested several times,
    with the scene shifted in time by fractions of a step. Some of these shifts make impacts easy to miss. The
    recommended step size and all smaller tested ones pass, but the next larger one fails.

    Examples: `carom advise my-scene.toml --out advice`, `carom advise paper/missed --direction-error 5deg
    --miss-probability 0.1`.
    """
    from carom.report.files import require_report_extra
    from carom.report.render.html import render_html
    from carom.studies.advise.document import PURPOSE, build_advice_document
    from carom.studies.advise.run import advise as find
    from carom.support.folders import claim_while_writing, write_files

    loaded_scene = arguments.load_one_scene(scene, "SCENE")
    page = None
    with claim_while_writing(out, PURPOSE, "--out") if out is not None else nullcontext():
        if out is not None:  # check the folder before the search, which takes minutes
            require_report_extra()
        with options.open_pool() as pool, output.show_progress_bar() as progress:
            advice = find(loaded_scene, options, pool, progress=progress, command=get_command_line())
        document = build_advice_document(advice, scene)
        if out is not None:
            page = write_files(out, PURPOSE, {"index.html": render_html(document)})
    output.print_document(document, full=verbose, page=page)
