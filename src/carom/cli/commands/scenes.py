"""`carom scenes`: list the catalogue, or show scenes of it in full."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from carom.cli.common import guarded, say, say_lines


@guarded
def scenes(
    names: Annotated[
        list[str] | None, typer.Argument(help="Scenes to show in full, by name, group or pattern.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="Write the scenes named into this folder, as TOML files of your own to edit."),
    ] = None,
    save: Annotated[Path | None, typer.Option("--save", hidden=True)] = None,
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON Schema of a scene file.")] = False,
) -> None:
    """List the catalogue, a line each, or show scenes of it in full, as the files they could be loaded from."""
    if schema:
        import json

        from carom.model.scene import scene_schema

        typer.echo(json.dumps(scene_schema(), indent=2))
        return
    from carom.catalogue import all_scenes, find_scenes
    from carom.errors import InputError
    from carom.model.scene import save_scene
    from carom.report.lists import scene_lines
    from carom.report.small import scene_text
    from carom.support.folders import file_name

    out = out or save
    if not names and out is None:
        say_lines(scene_lines(list(all_scenes().values())))
        return
    found = find_scenes(names) if names else list(all_scenes().values())
    for entry in found:
        if out is None:
            say(scene_text(entry))
            continue
        path = out / f"{file_name(entry.name)}.toml"
        if path.exists() or path.is_symlink():
            raise InputError(f"{path} exists already, and may have been edited: name another folder by --out")
        out.mkdir(parents=True, exist_ok=True)
        save_scene(entry.scene, path)
        say(str(path))
