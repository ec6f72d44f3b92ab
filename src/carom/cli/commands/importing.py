"""`carom import`: convert a file of an engine to a scene."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from carom.cli.output import print_text


def import_file(
    file: Annotated[
        Path,
        typer.Argument(
            help="pymunk.Space (.pkl, .pickle), MJCF model (.xml) or output of Planck's Serializer (.json)."
        ),
    ],
    to: Annotated[
        Path | None, typer.Argument(help="Scene file to write, .toml or .json (default: print TOML).")
    ] = None,
    duration: Annotated[
        float, typer.Option("--duration", show_default=False, help="Duration of the scene in seconds (default: 10).")
    ] = 10.0,
    pixels_per_metre: Annotated[
        float,
        typer.Option("--pixels-per-metre", show_default=False, help="Length units of the file per metre (default: 1)."),
    ] = 1.0,
) -> None:
    """Convert a pymunk space, an MJCF model or a Planck dump to a scene, and list the parts that are left out."""
    from carom.errors import InputError
    from carom.execution.scene_import import import_scene
    from carom.model.scene_file import save_scene

    if to is not None and (to.exists() or to.is_symlink()):
        raise InputError(f"{to} already exists: name another file")
    found = import_scene(file, duration_s=duration, pixels_per_metre=pixels_per_metre)
    for dropped in found.dropped:
        print_text(f"dropped: {dropped}", to_stderr=True)
    if to is None:
        import tomli_w

        print_text(tomli_w.dumps(found.scene.model_dump(mode="python")).rstrip("\n"))
        return
    save_scene(found.scene, to)
    print_text(str(to))
