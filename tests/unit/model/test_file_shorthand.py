"""What a scene file may say for short is written out when it is read."""

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from tests.cases import each

from carom.errors import SceneError
from carom.model.file_shorthand import SHAPES, expand_shorthand
from carom.model.scene_file import build_scene_schema, load_scene, save_scene

PIXELS: dict[str, Any] = {
    "name": "px",
    "length_unit": "px",
    "pixels_per_metre": 64,
    "duration_s": 1.0,
    "gravity_m_s2": [0, 640],
    "walls": [{"point_m": [0, 192], "normal": [0, -3]}],
    "discs": [
        {"position_m": [32, 64.0], "velocity_m_s": [-16, 8], "radius_m": 16, "shape": "sphere"},
        {"position_m": [128, 64], "radius_m": 8, "mass_kg": 2.0, "shape": "disc"},
    ],
}
VALIDATOR = jsonschema.Draft202012Validator(build_scene_schema())


def load_content(tmp_path: Path, content: dict[str, Any]) -> Any:
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    return load_scene(path)


def test_lengths_in_pixels_are_converted_to_metres(tmp_path: Path) -> None:
    """Positions, velocities, radii, wall points and gravity are divided; normals, masses and times are not."""
    scene = load_content(tmp_path, PIXELS)
    first, second = scene.discs
    assert (first.position_m, first.velocity_m_s, first.radius_m) == ((0.5, 1.0), (-0.25, 0.125), 0.25)
    assert (second.position_m, second.velocity_m_s, second.radius_m, second.mass_kg) == ((2, 1), (0, 0), 0.125, 2.0)
    assert (scene.walls[0].point_m, scene.walls[0].normal) == ((0.0, 3.0), (0.0, -1.0))
    assert (scene.gravity_m_s2, scene.duration_s) == ((0.0, 10.0), 1.0)


def test_shape_sets_the_moment_of_inertia(tmp_path: Path) -> None:
    """The moment of inertia over mass and radius squared is 2/5 for a sphere and 1/2 for a disc."""
    assert [disc.inertia_factor for disc in load_content(tmp_path, PIXELS).discs] == [2 / 5, 1 / 2]


def test_saved_file_has_no_shorthand(tmp_path: Path) -> None:
    """A scene from a file in pixels is saved without pixels and loads as the same scene."""
    scene = load_content(tmp_path, PIXELS)
    path = tmp_path / "saved.toml"
    save_scene(scene, path)
    assert "px" not in path.read_text(encoding="utf-8").replace('name = "px"', "")
    assert load_scene(path) == scene


@each(
    "change, says",
    [
        ({"length_unit": "ft"}, 'length_unit: must be "m" or "px", got'),
        ({"pixels_per_metre": None}, "pixels_per_metre: is required with length_unit px, but missing"),
        ({"length_unit": "m"}, 'pixels_per_metre: needs length_unit = "px"'),
        ({"pixels_per_metre": 0}, "pixels_per_metre must be a positive number, got 0"),
        ({"pixels_per_metre": "64"}, "pixels_per_metre must be a positive number, got '64'"),
        (
            {"discs": [{"position_m": [0, 0], "radius_m": 1, "shape": "box"}]},
            'discs[0].shape: must be "disc" or "sphere"',
        ),
        ({"discs": [{"position_m": [0, 0], "radius_m": 1, "shape": []}]}, 'discs[0].shape: must be "disc" or "sphere"'),
        (
            {"discs": [{"position_m": [0, 0], "radius_m": 1, "shape": "sphere", "inertia_factor": 0.4}]},
            "discs[0].shape: conflicts with inertia_factor: give only one of them",
        ),
    ],
)
def test_wrong_shorthand_is_refused_with_its_field(tmp_path: Path, change: dict[str, Any], says: str) -> None:
    """Wrong, missing or conflicting shorthand fields are refused by name, and by the published schema, too."""
    content = {name: value for name, value in (PIXELS | change).items() if value is not None}
    with pytest.raises(SceneError) as caught:
        load_content(tmp_path, content)
    assert says in str(caught.value)
    with pytest.raises(jsonschema.ValidationError):
        VALIDATOR.validate(content)


def test_published_schema_accepts_shorthand() -> None:
    """A file in pixels with shapes is valid, and the schema has exactly the shapes that Carom supports."""
    VALIDATOR.validate(PIXELS)
    assert set(build_scene_schema()["$defs"]["Disc"]["properties"]["shape"]["enum"]) == set(SHAPES)


@each("value", ["12", None, [1, 2, 3], {"x": 1}, True, 10**400, [[1], 2]])
def test_malformed_position_in_pixels_is_refused(tmp_path: Path, value: object) -> None:
    """A malformed position in a file in pixels is refused with the name of the field, as in a file in metres."""
    content = PIXELS | {"discs": [{"position_m": value, "radius_m": 1}]}
    with pytest.raises(SceneError, match=r"discs\[0\]\.position_m"):
        load_content(tmp_path, content)


def test_shape_of_a_scene_is_refused_with_a_hint() -> None:
    """A scene has no field `shape`, and the message explains that each disc has one."""
    with pytest.raises(SceneError) as caught:
        expand_shorthand({"shape": "sphere", "discs": []})
    assert str(caught.value) == "shape: is not a field of a scene; set it in each entry of [[discs]]"
