"""`carom import`: a file of an engine as a scene."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from carom.cli.common import guarded, say


@guarded
def import_file(
    file: Annotated[
        Path,
        typer.Argument(
            help="A pymunk.Space (.pkl, .pickle), an MJCF model (.xml), or what Planck's Serializer made (.json)."
        ),
    ],
    to: Annotated[
        Path | None, typer.Argument(help="The scene to write, .toml or .json; printed as TOML by default.")
    ] = None,
    duration: Annotated[float, typer.Option("--duration", help="How long the scene is to be, seconds.")] = 10.0,
    pixels_per_metre: Annotated[
        float, typer.Option("--pixels-per-metre", help="How many of the file's units of length a metre is.")
    ] = 1.0,
) -> None:
    """Make a scene of a pymunk space, an MJCF model or a dump of Planck's; what a scene has no place for is named."""
    from carom.errors import InputError
    from carom.execution.scene_import import import_scene
    from carom.model.scene import save_scene

    if to is not None and (to.exists() or to.is_symlink()):
        raise InputError(f"{to} exists already, and may have been edited: name another file")
    found = import_scene(file, duration_s=duration, pixels_per_metre=pixels_per_metre)
    for what in found.dropped:
        say(f"dropped: {what}", apart=True)
    if to is None:
        import tomli_w

        say(tomli_w.dumps(found.scene.model_dump(mode="python")).rstrip("\n"))
        return
    save_scene(found.scene, to)
    say(str(to))
