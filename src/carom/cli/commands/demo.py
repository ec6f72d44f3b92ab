"""`carom demo`: show an engine that misses an impact, and open a page to try the scene."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from carom.cli.output import print_text


def demo(
    page: Annotated[Path | None, typer.Argument(help="HTML file to write (default: a temporary file).")] = None,
) -> None:
    """Show an engine that misses an impact, and open an interactive page of the same scene."""
    from carom.studies.cross_check.demo import demo as shown

    found = shown(page)
    print_text(repr(found))
    if not found.opened:
        print_text("No browser was found. Open the page yourself.")
    trace = found.replay.observed
    command = f"carom run {trace.scene.name} -e {trace.method} -p {trace.profile} --dt 1/{1 / trace.dt_s:g} -v"
    print_text(f"For the numbers, run: {command}")
    print_text("For another scene, run: carom play SCENE")
