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


def loaded(tmp_path: Path, content: dict[str, Any]) -> Any:
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    return load_scene(path)


def test_lengths_in_pixels_are_metres_of_the_scene(tmp_path: Path) -> None:
    """Places, velocities, radii, points of walls and gravity are divided, normals, masses and seconds are not."""
    scene = loaded(tmp_path, PIXELS)
    first, second = scene.discs
    assert (first.position_m, first.velocity_m_s, first.radius_m) == ((0.5, 1.0), (-0.25, 0.125), 0.25)
    assert (second.position_m, second.velocity_m_s, second.radius_m, second.mass_kg) == ((2, 1), (0, 0), 0.125, 2.0)
    assert (scene.walls[0].point_m, scene.walls[0].normal) == ((0.0, 3.0), (0.0, -1.0))
    assert (scene.gravity_m_s2, scene.duration_s) == ((0.0, 10.0), 1.0)


def test_a_shape_is_its_moment_of_inertia(tmp_path: Path) -> None:
    """2/5 of a sphere and 1/2 of a disc of even density, times mass and radius squared."""
    assert [disc.inertia_factor for disc in loaded(tmp_path, PIXELS).discs] == [2 / 5, 1 / 2]


def test_a_file_that_is_saved_says_nothing_for_short(tmp_path: Path) -> None:
    """It holds metres and the moment of inertia, and loads as the same scene."""
    scene = loaded(tmp_path, PIXELS)
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
def test_what_is_said_twice_or_wrongly_is_refused_by_name(tmp_path: Path, change: dict[str, Any], says: str) -> None:
    """The message names the field, and the published schema refuses the file too."""
    content = {name: value for name, value in (PIXELS | change).items() if value is not None}
    with pytest.raises(SceneError) as caught:
        loaded(tmp_path, content)
    assert says in str(caught.value)
    with pytest.raises(jsonschema.ValidationError):
        VALIDATOR.validate(content)


def test_the_published_schema_takes_what_is_said_for_short() -> None:
    """A file in pixels, with shapes, is one."""
    VALIDATOR.validate(PIXELS)
    assert set(build_scene_schema()["$defs"]["Disc"]["properties"]["shape"]["enum"]) == set(SHAPES)


@each("value", ["12", None, [1, 2, 3], {"x": 1}, True, 10**400, [[1], 2]])
def test_what_is_no_length_is_refused_as_it_stands(tmp_path: Path, value: object) -> None:
    """The error of a malformed field in a file in pixels names it, as in a file in metres."""
    content = PIXELS | {"discs": [{"position_m": value, "radius_m": 1}]}
    with pytest.raises(SceneError, match=r"discs\[0\]\.position_m"):
        loaded(tmp_path, content)


def test_a_shape_of_the_whole_scene_is_refused_with_where_it_belongs() -> None:
    """A scene has no shape; the hint says that each disc has one."""
    with pytest.raises(SceneError) as caught:
        expand_shorthand({"shape": "sphere", "discs": []})
    assert str(caught.value) == "shape: is not a field of a scene; give it for each of [[discs]]"
