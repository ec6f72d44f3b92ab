"""Shorthand of scene files: lengths in pixels, and the shape of a disc instead of its moment of inertia.

The shorthand is replaced when a file is read.
"""

from __future__ import annotations

from typing import Any

from carom.errors import InputError, Problem, SceneError
from carom.model.units import convert_units
from carom.support.checks import check_number
from carom.support.escaping import format_value

#: Moment of inertia divided by mass times radius squared, for bodies of uniform density.
SHAPES = {"disc": 0.5, "sphere": 0.4}

UNITS = ("m", "px")


def expand_shorthand(content: dict[str, Any]) -> dict[str, Any]:
    """Return the content of a file with its shorthand replaced by the fields of a scene.

    Values of wrong types are not changed here, since the scene refuses them later.

    Raises:
        SceneError: `length_unit`, `pixels_per_metre` or a `shape` is unknown, or conflicts with another field.
    """
    content = dict(content)
    unit, pixels = content.pop("length_unit", "m"), content.pop("pixels_per_metre", None)
    if unit not in UNITS:
        raise SceneError([Problem(("length_unit",), f'must be "m" or "px", got {format_value(unit)}')])
    if (unit == "px") != (pixels is not None):
        problem = "is required with length_unit px, but missing" if pixels is None else 'needs length_unit = "px"'
        raise SceneError([Problem(("pixels_per_metre",), problem)])
    if unit == "px":
        try:
            content = convert_units(content, check_number("pixels_per_metre", pixels, positive=True))
        except InputError as error:
            raise SceneError([Problem((), str(error))]) from None
        except RecursionError:
            raise SceneError([Problem((), "its lists are nested too deeply")]) from None
    if "shape" in content:
        raise SceneError([Problem(("shape",), "is not a field of a scene", ("set it in each entry of [[discs]]",))])
    discs = content.get("discs")
    if isinstance(discs, list):
        content["discs"] = [_add_inertia(disc, k) for k, disc in enumerate(discs)]
    return content


def _add_inertia(disc: Any, k: int) -> Any:
    if not isinstance(disc, dict) or "shape" not in disc:
        return disc
    if "inertia_factor" in disc:
        raise SceneError([Problem(("discs", k, "shape"), "conflicts with inertia_factor: give only one of them")])
    shape = disc["shape"]
    if not isinstance(shape, str) or shape not in SHAPES:
        known = " or ".join(f'"{name}"' for name in SHAPES)
        raise SceneError([Problem(("discs", k, "shape"), f"must be {known}, got {format_value(shape)}")])
    return {name: value for name, value in disc.items() if name != "shape"} | {"inertia_factor": SHAPES[shape]}


def add_shorthand(schema: dict[str, Any]) -> dict[str, Any]:
    """Return the JSON Schema of scene files: the schema of a scene with the additional fields of the shorthand."""
    unit = {
        "default": "m",
        "description": "Unit of the lengths in this file: m, or px for pixels (then pixels_per_metre is required).",
        "enum": list(UNITS),
        "title": "Length Unit",
    }
    pixels = {
        "description": "Number of pixels in a metre; required with length_unit px.",
        "exclusiveMinimum": 0,
        "title": "Pixels Per Metre",
        "type": "number",
    }
    factors = ", ".join(f"{name} {factor}" for name, factor in SHAPES.items())
    shape = {"description": f"Instead of inertia_factor: {factors}.", "enum": list(SHAPES), "title": "Shape"}
    schema["properties"] |= {"length_unit": unit, "pixels_per_metre": pixels}
    schema |= {
        "if": {"properties": {"length_unit": {"const": "px"}}, "required": ["length_unit"]},
        "then": {"required": ["pixels_per_metre"]},
        "else": {"not": {"required": ["pixels_per_metre"]}},
    }
    disc = schema["$defs"]["Disc"]
    disc["properties"]["shape"] = shape
    disc["not"] = {"required": ["shape", "inertia_factor"]}
    return schema
