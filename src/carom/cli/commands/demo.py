"""`carom demo`: an engine that misses an impact, and a page to miss it by hand, within seconds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from carom.cli.common import guarded, say


@guarded
def demo(
    page: Annotated[
        Path | None, typer.Argument(help="The page to write, .html. In a folder for temporary files by default.")
    ] = None,
) -> None:
    """Run an engine that misses an impact, and open a page to throw the discs of its scene, or print where it lies."""
    from carom.studies.cross_check.demo import demo as shown

    found = shown(page)
    say(repr(found))
    if not found.opened:
        say("No browser could be opened here: open the page in one.")
    trace = found.replay.observed
    say(f"The numbers: carom run {trace.scene.name} -e {trace.method} -p {trace.profile} --dt 1/{1 / trace.dt_s:g} -v")
    say("Another scene, or one of yours: carom play SCENE")
