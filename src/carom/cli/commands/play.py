"""`carom play`: open an interactive page that compares frame-sampled detection with exact collision times."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from carom.cli import arguments, output
from carom.cli.output import print_text
from carom.errors import InputError


def play(
    scene: Annotated[
        str | None, typer.Argument(help="Scene file, or name of a catalogue scene, with at most ten discs.")
    ] = None,
    engine: Annotated[
        list[str] | None,
        typer.Option(
            "--engine",
            "-e",
            help="Installed engine to run in the page: matter, planck, cannon, p2, rapier2d, box2d3, jolt or none; "
            "repeatable (default: matter, planck).",
        ),
    ] = None,
    out: Annotated[Path | None, arguments.declare_out_option("HTML file to write (default: a temporary file).")] = None,
    opened: Annotated[
        bool, typer.Option("--open/--no-open", show_default=False, help="Open the page in a browser (default: --open).")
    ] = True,
) -> None:
    """Throw discs on an interactive page: frame-sampled detection vs. exact collision times.

    The page is one HTML file and works offline.

    Examples: `carom play`, `carom play my-scene.toml`, `carom play paper/late -e rapier2d --out late.html --no-open`.
    """
    from carom.support.folders import build_temporary_path, write_file
    from carom.web.installed_engines import DEFAULT_ENGINES, load_page_engines
    from carom.web.open_page import open_page
    from carom.web.page import add_gallery, render_page

    if out is not None and out.suffix != ".html":
        raise InputError(f"--out must end in .html, got {str(out)!r}")
    own_scenes = [] if scene is None else [arguments.load_one_scene(scene, "SCENE")]
    engine_names = [] if engine == ["none"] else engine
    installed = load_page_engines(
        DEFAULT_ENGINES if engine_names is None else engine_names, required=engine_names is not None
    )
    html = render_page(add_gallery(*own_scenes), installed)
    page = write_file(build_temporary_path("play.html") if out is None else out, html)
    print_text(f"Methods: PIC, PIT{''.join(f', {one.label}' for one in installed)}.")
    output.print_path("page", page)
    if opened and not open_page(page.resolve()):
        print_text("No browser was found. Open the page yourself.")
