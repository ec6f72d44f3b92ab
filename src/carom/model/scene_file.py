"""Loads and saves scenes as TOML or JSON files, and builds the JSON Schema of these files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from carom.errors import InputError, Problem, SceneError
from carom.model.file_shorthand import add_shorthand, expand_shorthand
from carom.model.scene import Disc, Scene
from carom.model.walls import count_edges, kind_of_wall
from carom.support.checks import check_instance
from carom.support.fields import Model
from carom.support.limits import MOST_BYTES, MOST_DISCS, MOST_WALLS

#: Largest number of discs and walls in a scene file. A scene made in Python may have more.
MOST_BODIES = {"discs": MOST_DISCS, "walls": MOST_WALLS}


def build_scene_schema() -> dict[str, Any]:
    """Return the JSON Schema of scene files. The package contains this schema as ``carom/scene.schema.json``."""
    schema = Scene.model_json_schema()
    for name, limit in MOST_BODIES.items():
        schema["properties"][name]["maxItems"] = limit
    for part in (schema, *schema["$defs"].values()):  # remove examples from the docstrings
        if "description" in part:
            part["description"] = part["description"].partition("\n\nExamples:")[0]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **add_shorthand(schema)}


def load_scene(path: str | Path) -> Scene:
    """Load and validate the scene in a ``.toml`` or ``.json`` file.

    A file may give lengths in pixels, and a disc's shape instead of its moment of inertia. See
    `carom.model.file_shorthand`.

    Raises:
        SceneError: The file can't be read, is neither TOML nor JSON, is too large, or contains no valid scene. The
            message contains the file's name, the field, the field's index and the value.

    Examples:
        >>> carom.save_scene(carom.scene("paper/late"), "late.toml")
        >>> carom.load_scene("late.toml").name
        'paper/late'
    """
    path = Path(path)
    try:
        return Scene(**_limit_problems(expand_shorthand(_parse_file(path))))
    except SceneError as error:
        has_more = error.more or len(error.problems) > SceneError.SHOWN  # perhaps not all problems were found
        raise SceneError(error.problems, source=str(path), more=has_more) from None


def _parse_file(path: Path) -> dict[str, Any]:
    if path.suffix not in MOST_BYTES:
        raise SceneError([_build_ending_problem(path)])
    try:
        from carom.support.data_files import read_data  # scenes made in Python don't need the parsers

        content = read_data(path, path.suffix)
    except InputError as error:
        raise SceneError([Problem((), str(error))]) from None
    for name, limit in MOST_BODIES.items():
        bodies = content.get(name)
        if not isinstance(bodies, list):
            continue
        if (total := sum(map(count_edges, bodies))) > limit:
            noun = "edges of walls" if total > len(bodies) else name
            raise SceneError([Problem((name,), f"a scene file can have at most {limit} {noun}, got {total}")])
    return content


def _build_ending_problem(path: Path) -> Problem:
    ending = repr(path.suffix) if path.suffix else "no suffix"
    return Problem((), f"a scene file must end in .toml or .json, got {ending}")


def _limit_problems(content: dict[str, Any]) -> dict[str, Any]:
    """Shorten the content of a file that has many problems, so that validation finds only some of them.

    Each problem takes a kilobyte of memory, and a file can have millions of problems.
    """
    content = _limit_unknown_fields(content, Scene)
    if isinstance(walls := content.get("walls"), list):
        content["walls"] = [
            _limit_unknown_fields(wall, kind_of_wall(wall)) if isinstance(wall, dict) else wall for wall in walls
        ]
    if isinstance(discs := content.get("discs"), list):
        good: list[Any] = []
        for k, disc in enumerate(discs):
            try:
                good.append(Disc(**_limit_unknown_fields(disc, Disc)))
            except (SceneError, TypeError):
                good += [_limit_unknown_fields(one, Disc) for one in discs[k : k + SceneError.SHOWN]]
                break
        content["discs"] = good
    return content


def _limit_unknown_fields(fields: Any, model: type[Model]) -> Any:
    if not isinstance(fields, dict) or len(fields) <= len(model.model_fields):
        return fields
    unknown = [name for name in fields if name not in model.model_fields]
    return {name: fields[name] for name in (*model.model_fields, *unknown[: SceneError.SHOWN]) if name in fields}


def save_scene(scene: Scene, path: str | Path) -> None:
    """Write a scene to a file whose name ends in ``.toml`` or ``.json``. Loading the file returns an equal scene.

    Raises:
        SceneError: The name ends in neither ``.toml`` nor ``.json``.
        InputError: `scene` is not a scene.
        OSError: The file can't be written.

    Examples:
        >>> scene = carom.scene("paper/late")
        >>> carom.save_scene(scene, "late.json")
        >>> carom.load_scene("late.json") == scene
        True
    """
    check_instance("scene", scene, Scene)
    path = Path(path)
    if path.suffix == ".toml":
        import tomli_w

        text = tomli_w.dumps(scene.model_dump(mode="python"))
    elif path.suffix == ".json":
        text = scene.model_dump_json(indent=2) + "\n"
    else:
        raise SceneError([_build_ending_problem(path)], source=str(path))
    path.write_text(text, encoding="utf-8")
