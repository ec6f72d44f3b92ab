"""Scenes as files: what is loaded, what is refused, and that saving loses nothing."""

import json
import math
import os
import tempfile
from importlib import resources
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.cases import each
from tests.random_scenes import TABLES, draw_scene, draw_table

from carom.errors import SceneError
from carom.model.scene import Disc, Scene, Wall
from carom.model.scene_file import build_scene_schema, load_scene, save_scene
from carom.support.limits import MOST_BYTES

SAMPLE = Scene(
    name="sample",
    description='Quotes ", backslashes \\, lines\nand the letter ü.',
    duration_s=1.5,
    discs=[
        Disc(position_m=(0.1, 0.2), velocity_m_s=(1e-300, -1e22), radius_m=0.1, mass_kg=0.3),
        Disc(position_m=(5, 0), radius_m=1, mass_kg=math.inf),
    ],
    walls=[Wall(point_m=(0, -7), normal=(1, 3))],
    restitution=0.9,
)

#: One with friction and spin.
ROUGH = Scene(
    name="rough",
    duration_s=1.5,
    discs=[
        Disc(position_m=(0, 0), radius_m=1, spin_rad_s=-0.1, inertia_factor=0.4),
        Disc(position_m=(5, 0), radius_m=1, inertia_factor=math.inf),
    ],
    friction=0.1,
    wall_friction=1e19,
    tangential_restitution=-0.5,
    wall_tangential_restitution=1.0,
)


def catch_refusal(path: Path) -> str:
    """Return the message with which a file is refused; it must name the file on every line."""
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    text = str(caught.value)
    assert all(line.startswith((f"{path}: ", "and ")) for line in text.splitlines())
    return text.replace(f"{path}: ", "")


def write_data(path: Path, data: str | bytes) -> Path:
    """Write the data and return the path."""
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return path


def format_scene(duration_s: str) -> str:
    """Return a scene as JSON, with these letters for its duration."""
    return f'{{"name": "x", "duration_s": {duration_s}, "discs": [{{"position_m": [0, 0], "radius_m": -1}}]}}'


MANY_EDGES = {"walls": [{"points_m": [[k, 5.0] for k in range(600)]}] * 2}

# Files that hold no scene ---------------------------------------------------------------------------------------------


#: By what is wrong: the file's ending, what is in it, and what must be said, from the beginning on.
NO_SCENES: dict[str, tuple[str, str | bytes, str]] = {
    "no TOML": ("toml", "name = \n", "is not TOML: Invalid value (at line 1"),
    "no JSON": ("json", '{"name": }', "is not JSON: Expecting value: line 1 column 10"),
    "another encoding": ("toml", b"# caf\xe9", "is not TOML: byte 5 is not UTF-8 text"),
    "nested": ("json", "[" * 100_000, "is nested too deeply"),
    "nested in TOML": ("toml", "name = " + "[" * 100_000, "is nested too deeply"),
    "a list": ("json", "[1, 2]", "must be an object with named fields, got [1, 2]"),
    "null": ("json", "null", "must be an object with named fields, got None"),
    "digits": ("json", format_scene("1" * 5000), "is not JSON: "),
    "digits in TOML": ("toml", f"duration_s = {'1' * 5000}", "is not TOML: "),
    "hexadecimal digits": ("toml", f"duration_s = 0x{'1' * 5000}", "duration_s: must be a valid number"),
    **{
        number: ("json", format_scene(number), "duration_s: must be a finite number, got ")
        for number in ("NaN", "Infinity", "1e999")
    },
    "a bad value": ("json", format_scene("1"), "discs[0].radius_m: must be greater than 0, got -1"),
    "many values": ("json", '{"a": [' + "[],[]," * 600_000 + "0]}", "has more than 2097152 values, the limit for JSON"),
    "many tables": ("toml", "\n".join(f"[t{k}]" for k in range(263_000)), "the limit for TOML; JSON files"),
    "many walls": ("json", '{"walls": [' + "{}," * 1000 + "{}]}", "walls: a scene file can have at most 1000"),
    "many edges": ("json", json.dumps(MANY_EDGES), "can have at most 1000 edges of walls, got 1200"),
    "many discs": ("json", '{"discs": [' + "0," * 100_000 + "0]}", "can have at most 100000 discs, got 10"),
    "a key twice": ("json", '{"name": "a", "name": "b"}', "is ambiguous: one object has the key 'name' twice"),
    "a long key": ("toml", f"{'a' * 10_000} = 1", f"{'a' * 57}...: is not a field of a scene"),
    "controls": ("toml", '"\\u001b[31m\u202e" = 1', "\\u001b[31m\\u202e: is not a field of a scene"),
}


@each("what", NO_SCENES)
def test_invalid_scene_file_is_refused_with_the_reason(what: str, tmp_path: Path) -> None:
    """Syntax errors are refused with their place, fields with their value, and sizes with the limit."""
    ending, data, says = NO_SCENES[what]
    text = catch_refusal(write_data(tmp_path / f"x.{ending}", data))
    assert says in text
    assert len(text) < 2000


def test_missing_file_and_folder_are_refused(tmp_path: Path) -> None:
    """A missing file is refused with the system's message, and a folder as unreadable."""
    for name in ("x.toml", "x.json"):
        assert catch_refusal(tmp_path / name) == f"can't be read: {os.strerror(2)}"
        (tmp_path / name).mkdir()
        assert catch_refusal(tmp_path / name).startswith("can't be read: ")


@each("data", ["name.{} = 1", "[name.{}]\nx = 1"])
def test_toml_key_of_many_parts_is_refused(tmp_path: Path, data: str) -> None:
    """A dotted TOML key of 3000 parts is refused, since the time to read it grows with the square of the parts."""
    for separator in (".", " . ", '."b".', ".'b'\t."):
        text = catch_refusal(write_data(tmp_path / "x.toml", data.format(separator.join("a" * 3000))))
        assert text == "has a key of more than 4 dotted parts"


@each("depth", range(940, 1000, 4))
def test_nesting_near_the_parsers_limit_is_refused(tmp_path: Path, depth: int) -> None:
    """JSON that is nested 940 to 996 levels deep is refused with a SceneError at every depth."""
    assert catch_refusal(write_data(tmp_path / "x.json", '{"name":' + "[" * depth + "]" * depth + "}"))


@each("name, shown", [("x.yaml", "'.yaml'"), ("x", "no suffix"), ("x.TOML", "'.TOML'")])
def test_unknown_suffix_is_refused_on_loading_and_saving(tmp_path: Path, name: str, shown: str) -> None:
    """Only .toml and .json are accepted; for another suffix no file is read or written."""
    says = f"a scene file must end in .toml or .json, got {shown}"
    assert catch_refusal(tmp_path / name) == says
    with pytest.raises(SceneError, match="a scene file must end in"):
        save_scene(SAMPLE, tmp_path / name)
    assert not (tmp_path / name).exists()


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="there is no /dev/zero here")
def test_endless_device_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A device that reports no size and has no end is read up to the limit and then refused."""
    monkeypatch.setitem(MOST_BYTES, ".toml", 2**20)
    path = tmp_path / "x.toml"
    path.symlink_to("/dev/zero")
    assert catch_refusal(path) == "is larger than 1 MiB, the limit for TOML"


def test_file_of_exactly_the_limit_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file of the largest allowed size is loaded, and one that is a byte larger is refused."""
    save_scene(SAMPLE, tmp_path / "x.toml")
    size = (tmp_path / "x.toml").stat().st_size
    monkeypatch.setitem(MOST_BYTES, ".toml", size)
    assert load_scene(tmp_path / "x.toml") == SAMPLE
    monkeypatch.setitem(MOST_BYTES, ".toml", size - 1)
    assert "is larger than" in catch_refusal(tmp_path / "x.toml")


# Round trip -----------------------------------------------------------------------------------------------------------

TEXT = st.text(st.characters(codec="utf-8", exclude_categories=["Cc"]), min_size=1, max_size=20)


def save_and_load(scene: Scene, folder: Path) -> list[Scene]:
    """Return the scene as it is loaded from TOML and from JSON."""
    for suffix in (".toml", ".json"):
        save_scene(scene, folder / f"scene{suffix}")
    return [load_scene(folder / f"scene{suffix}") for suffix in (".toml", ".json")]


@given(st.integers(0, 10**6), st.sampled_from(["anywhere", *TABLES]), TEXT, st.text(max_size=50))
def test_saved_scene_loads_equal(number: int, kind: str, name: str, description: str) -> None:
    """Any scene with discs, walls and drives that is saved as TOML or JSON loads as the same scene, to the bit."""
    drawn = (draw_table if kind in TABLES else draw_scene)(kind, number)
    scene = drawn.model_copy(update={"name": name, "description": description})
    with tempfile.TemporaryDirectory() as folder:
        assert save_and_load(scene, Path(folder)) == [scene, scene]


@each("scene", [SAMPLE, ROUGH])
def test_saved_scene_of_odd_numbers_loads_equal(scene: Scene, tmp_path: Path) -> None:
    """Infinite masses and inertias, friction, and numbers from 1e-300 to 1e22 are loaded as they were saved."""
    assert save_and_load(scene, tmp_path) == [scene, scene]


# JSON Schema ----------------------------------------------------------------------------------------------------------


def to_json(scene: Scene) -> Any:
    """Return the scene as a JSON file of it reads."""
    return json.loads(scene.model_dump_json())


def test_published_schema_is_current_and_accepts_saved_scenes() -> None:
    """The published schema is valid, equals the generated one, and accepts scenes with friction or infinite mass."""
    jsonschema.Draft202012Validator.check_schema(build_scene_schema())
    for saved in (SAMPLE, ROUGH):
        VALIDATOR.validate(to_json(saved))
    published = resources.files("carom").joinpath("scene.schema.json").read_text(encoding="utf-8")
    assert published == json.dumps(build_scene_schema(), indent=2, sort_keys=True) + "\n"


VALIDATOR = jsonschema.Draft202012Validator(build_scene_schema())


def test_at_most_ten_problems_of_a_file_are_listed(tmp_path: Path) -> None:
    """Ten of a hundred thousand problems in a file are listed, and a last line states that there are others."""
    disc = ",".join(f'"k{k}":1' for k in range(100))
    lines = catch_refusal(write_data(tmp_path / "x.json", '{"discs": [' + f"{{{disc}}}," * 1000 + "0]}")).splitlines()
    assert len(lines) == 11
    assert lines[-1].startswith("and at least")
