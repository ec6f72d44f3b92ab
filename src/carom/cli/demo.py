"""`carom demo`: a page that shows an engine missing an impact, within seconds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from carom.cli.shared import guarded, say

__all__ = ["demo"]


@guarded
def demo(
    page: Annotated[
        Path | None, typer.Argument(help="The page to write, .html. In a folder for temporary files by default.")
    ] = None,
) -> None:
    """Show an engine that misses an impact beside the exact run: opens a page, or prints where it lies."""
    from carom.studies.cross_check.demo import demo as shown

    found = shown(page)
    say(repr(found))
    if not found.opened:
        say("No browser could be opened here: open the page in one.")
    trace = found.replay.observed
    say(f"The numbers: carom run {trace.scene.name} -e {trace.method} -p {trace.profile} --dt 1/{1 / trace.dt_s:g} -v")
    say("Throw the discs yourself: carom play")
