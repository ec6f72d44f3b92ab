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
    scene: Annotated[str, typer.Argument(help="A scene file (.toml, .json), or one scene of the catalogue by name.")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for a page with the error drawn against the step.")
    ] = None,
    verbose: common.Verbose = False,
) -> None:
    """Say from which step on each engine misses no impact of a scene, and meets a demand, and which impact asks for it.

    Every step of a grid is tried, from the whole run in one step down, at starts spread over it and at unlucky ones. An
    answer is a range: every step tried in it passes, and the next larger one that was run fails.

    Examples: `carom advise my-scene.toml --out advice`, `carom advise paper/missed --direction-error 5deg
    --miss-probability 0.1`.
    """
    from carom.report.files import require_report_extra
    from carom.studies.advise.document import PURPOSE, advice_document, write_advice
    from carom.studies.advise.run import advise as find
    from carom.support.folders import claimed

    found = common.plain_scenes_named([scene])
    if len(found) != 1:
        raise InputError(f"{scene!r} names {len(found)} scenes, and advice is for one")
    page = None
    with claimed(out, PURPOSE, "--out") if out is not None else nullcontext():
        if out is not None:  # before minutes are spent
            require_report_extra()
        with options.pool() as pool, common.progress_bar() as progress:
            advice = find(found[0], options, pool, progress=progress, command=command_line())
        if out is not None:
            page = write_advice(advice, out, scene)
    common.print_document(advice_document(advice, scene), full=verbose, page=page)
