"""`carom play`: a page on which one throws the discs, exact next to a method that checks for overlap once per frame."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from carom.cli import common
from carom.cli.common import guarded, say
from carom.errors import InputError


@guarded
def play(
    scene: Annotated[
        str | None, typer.Argument(help="A scene file or a scene of the catalogue, of ten discs at most.")
    ] = None,
    engine: Annotated[
        list[str] | None,
        typer.Option(
            "--engine",
            "-e",
            help="An engine to run in the page, where it is installed: matter, planck, cannon, p2, rapier2d, box2d3 or "
            "jolt; `none` for none. By default matter and planck, where they are.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="The page to write, .html. In a temporary folder by default.")
    ] = None,
    opened: Annotated[bool, typer.Option("--open/--no-open", help="Open the page in a browser.")] = True,
) -> None:
    """Throw the discs yourself: one page, exact next to checking once per frame, that fetches nothing.

    Examples: `carom play`, `carom play my-scene.toml`, `carom play paper/late -e rapier2d --out late.html --no-open`.
    """
    from carom.support.folders import temporary, write_file
    from carom.web.installed import DEFAULT_ENGINES, page_engines
    from carom.web.opened import open_page
    from carom.web.page import page_html, with_gallery

    if out is not None and out.suffix != ".html":
        raise InputError(f"the page ends in .html, got {str(out)!r}")
    own = common.plain_scenes_named([scene]) if scene is not None else []
    if len(own) > 1:
        raise InputError(f"{scene} are {len(own)} scenes: name one")
    asked = [] if engine == ["none"] else engine
    installed = page_engines(DEFAULT_ENGINES if asked is None else asked, required=asked is not None)
    html = page_html(with_gallery(*own), installed)
    page = write_file(temporary("play.html") if out is None else out, html)
    say(f"Methods: PIC, PIT{''.join(f', {one.label}' for one in installed)}.")
    common.say_place("page", page)
    if opened and not open_page(page.resolve()):
        say("No browser could be opened here: open the page in one.")
