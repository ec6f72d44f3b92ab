"""Arguments and options that several commands share, and functions that read scenes, engines and step sizes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from carom.errors import InputError
from carom.support.options import build_step_kind

if TYPE_CHECKING:
    from carom.catalogue import CatalogueScene
    from carom.model.scene import Scene


def declare_out_option(text: str) -> Any:
    """Return the option for the output folder. `text` describes the option, and its default if there is one."""
    return typer.Option("--out", "-o", show_default=False, help=text)


def declare_scenes_argument(default: str) -> Any:
    """Return the argument for scenes. `default` describes the scenes that are used without this argument."""
    return typer.Argument(help=f"Scene files, or names, groups or patterns of catalogue scenes (default: {default}).")


SCENE_NAMES = typer.Argument(help="Scene files (.toml, .json), or names, groups or patterns of catalogue scenes.")


def parse_engine(name: str) -> str:
    """Return the name of an engine. If `name` is the path of a manifest (engine.toml), register its engine."""
    from carom.engines import registry

    return registry.resolve_engine(name)


Resume = Annotated[
    bool, typer.Option("--resume", help="Continue an interrupted run from the journal in the output folder.")
]

Retry = Annotated[
    bool,
    typer.Option("--retry", help="Like --resume, but also repeat runs that crashed, timed out or raised an error."),
]

Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Print all tables, not only the summary.")]


def parse_step(text: str) -> float:
    """Parse a step size such as ``1/240`` or ``0.004``."""
    kind = build_step_kind()
    try:
        found: float = kind.convert(kind.parse(text))
    except (ValueError, OverflowError):
        raise kind.build_error("--dt", text) from None
    return found


def load_scenes(names: list[str]) -> list[Scene | CatalogueScene]:
    """Load scene files, and find catalogue scenes by name. Without names, return the whole catalogue."""
    from carom.catalogue import catalogue, find_scenes

    if not names:
        return list(catalogue().values())
    found: list[Scene | CatalogueScene] = []
    for name in names:
        if Path(name).suffix in {".toml", ".json"} or Path(name).is_file():
            from carom.model.scene_file import load_scene

            found.append(load_scene(name))
        else:
            found += find_scenes([name])
    return found


def load_plain_scenes(names: list[str]) -> list[Scene]:
    """Load scenes like `load_scenes`, but without the known answers of catalogue scenes."""
    from carom.model.scene import Scene

    return [entry if isinstance(entry, Scene) else entry.scene for entry in load_scenes(names)]


def load_one_scene(name: str, argument: str) -> Scene:
    """Return the scene of a scene file, or the catalogue scene with this name.

    Raises:
        InputError: The name matches several scenes. `argument` is the argument's name in the message.
    """
    found = load_plain_scenes([name])
    if len(found) != 1:
        raise InputError(f"{argument} must name one scene, but {name!r} matches {len(found)} scenes")
    return found[0]
