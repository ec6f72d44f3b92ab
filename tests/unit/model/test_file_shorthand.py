"""What a scene file may say for short is written out when it is read."""

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from tests.cases import each

from carom import Chain, Ring, Wall
from carom.errors import SceneError
from carom.model.scene_file import build_scene_schema, load_scene, save_scene

PIXELS: dict[str, Any] = {
    "name": "px",
    "length_unit": "px",
    "pixels_per_metre": 64,
    "duration_s": 1.0,
    "gravity_m_s2": [0, 640],
    "walls": [
        {"point_m": [0, 192], "normal": [0, -3]},
        {"points_m": [[640, 0], [640, 64], [704, 0]], "half_width_m": 6.4},
        {"centre_m": [0, 0], "radius_m": 960},
    ],
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
    """Lengths, velocities and gravity are divided; normals, masses and times are not. Saved files have no shorthand."""
    VALIDATOR.validate(PIXELS)
    scene = load_content(tmp_path, PIXELS)
    first, second = scene.discs
    assert (first.position_m, first.velocity_m_s, first.radius_m) == ((0.5, 1.0), (-0.25, 0.125), 0.25)
    assert (second.position_m, second.velocity_m_s, second.radius_m, second.mass_kg) == ((2, 1), (0, 0), 0.125, 2.0)
    assert (first.inertia_factor, second.inertia_factor) == (2 / 5, 1 / 2)  # of a sphere, and of a disc
    assert scene.walls == (
        Wall(point_m=(0, 3), normal=(0, -1)),
        Chain(points_m=[(10, 0), (10, 1), (11, 0)], half_width_m=0.1),
        Ring(centre_m=(0, 0), radius_m=15),
    )
    assert (scene.gravity_m_s2, scene.duration_s) == ((0.0, 10.0), 1.0)
    save_scene(scene, path := tmp_path / "saved.toml")
    assert "pixels" not in path.read_text(encoding="utf-8")
    assert load_scene(path) == scene


def list_discs(**fields: Any) -> dict[str, Any]:
    """Return a change to `PIXELS`: one disc with these fields."""
    return {"discs": [{"position_m": [0, 0], "radius_m": 1, **fields}]}


@each(
    "change, says",
    [
        ({"length_unit": "ft"}, 'length_unit: must be "m" or "px", got'),
        ({"pixels_per_metre": None}, "pixels_per_metre: is required with length_unit px, but missing"),
        ({"length_unit": "m"}, 'pixels_per_metre: needs length_unit = "px"'),
        ({"pixels_per_metre": 0}, "pixels_per_metre must be a positive number, got 0"),
        ({"pixels_per_metre": "64"}, "pixels_per_metre must be a positive number, got '64'"),
        ({"shape": "sphere"}, "shape: is not a field of a scene; set it in each entry of [[discs]]"),
        (list_discs(shape="box"), 'discs[0].shape: must be "disc" or "sphere"'),
        (list_discs(shape=[]), 'discs[0].shape: must be "disc" or "sphere"'),
        (list_discs(shape="sphere", inertia_factor=0.4), "discs[0].shape: conflicts with inertia_factor: give"),
        *(
            (list_discs(position_m=value), "discs[0].position_m")
            for value in ("12", None, [1, 2, 3], {"x": 1}, True, [[1], 2])
        ),
        (list_discs(position_m=10**400), "discs[0].position_m"),
    ],
)
def test_wrong_shorthand_is_refused_with_its_field(tmp_path: Path, change: dict[str, Any], says: str) -> None:
    """Wrong, missing or conflicting fields of a file in pixels are refused by name, and by the published schema."""
    content = {name: value for name, value in (PIXELS | change).items() if value is not None}
    with pytest.raises(SceneError) as caught:
        load_content(tmp_path, content)
    assert says in str(caught.value)
    with pytest.raises(jsonschema.ValidationError):
        VALIDATOR.validate(content)
