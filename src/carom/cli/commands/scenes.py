"""`carom scenes`: list the catalogue, or write scenes as files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from carom.cli.arguments import declare_out_option
from carom.cli.output import print_lines, print_text


def scenes(
    names: Annotated[
        list[str] | None, typer.Argument(help="Groups to list, or names or patterns of scenes to print as TOML.")
    ] = None,
    out: Annotated[
        Path | None, declare_out_option("Folder to write the named scenes into, as TOML files to edit.")
    ] = None,
    save: Annotated[Path | None, typer.Option("--save", hidden=True)] = None,
    whole: Annotated[bool, typer.Option("--all", help="List every scene of every group.")] = False,
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON Schema of a scene file.")] = False,
) -> None:
    """List the groups of the catalogue or the scenes of a group, or print scenes as files.

    Examples: `carom scenes`, `carom scenes classics`, `carom scenes classics/box`, `carom scenes paper --out mine`.
    """
    if schema:
        import json

        from carom.model.scene_file import build_scene_schema

        typer.echo(json.dumps(build_scene_schema(), indent=2))
        return
    from carom.catalogue import all_scenes, find_scenes
    from carom.errors import InputError
    from carom.model.scene_file import save_scene
    from carom.report.certified import format_scene_file
    from carom.report.engine_and_scene_lists import format_group_lines, format_scene_lines
    from carom.support.folders import build_file_name

    out = out or save
    everything = list(all_scenes().values())
    groups = {entry.group for entry in everything}
    if not names and not whole and out is None:
        print_lines(format_group_lines(everything))
        return
    found = find_scenes(names) if names and not whole else everything
    if out is None and (whole or groups.issuperset(names or ())):
        print_lines(format_scene_lines(found))
        return
    for entry in found:
        if out is None:
            print_text(format_scene_file(entry))
            continue
        path = out / f"{build_file_name(entry.name)}.toml"
        if path.exists() or path.is_symlink():
            raise InputError(f"{path} already exists: name another folder with --out")
        out.mkdir(parents=True, exist_ok=True)
        save_scene(entry.scene, path)
        print_text(str(path))
