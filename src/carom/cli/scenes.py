"""`carom scenes`: list the catalogue, or show scenes of it in full."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from carom.cli.shared import guarded, say, say_lines

__all__ = ["scenes"]


@guarded
def scenes(
    names: Annotated[
        list[str] | None, typer.Argument(help="Scenes to show in full, by name, group or pattern.")
    ] = None,
    save: Annotated[
        Path | None,
        typer.Option("--save", help="Write the scenes named into this folder, as TOML files of your own to edit."),
    ] = None,
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON Schema of a scene file.")] = False,
) -> None:
    """List the catalogue, a line each, or show scenes of it in full, as the files they could be loaded from."""
    if schema:
        import json

        from carom.scene import scene_schema

        typer.echo(json.dumps(scene_schema(), indent=2))
        return
    from carom.errors import InputError
    from carom.folders import file_name
    from carom.report.lists import scene_lines
    from carom.report.small import scene_text
    from carom.scene import save_scene
    from carom.scenes import all_scenes, find_scenes

    if not names and save is None:
        say_lines(scene_lines(list(all_scenes().values())))
        return
    found = find_scenes(names) if names else list(all_scenes().values())
    for entry in found:
        if save is None:
            say(scene_text(entry))
            continue
        path = save / f"{file_name(entry.name)}.toml"
        if path.exists() or path.is_symlink():
            raise InputError(f"{path} exists already, and may have been edited: name another folder by --save")
        save.mkdir(parents=True, exist_ok=True)
        save_scene(entry.scene, path)
        say(str(path))
