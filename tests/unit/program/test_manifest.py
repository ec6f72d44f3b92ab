"""A manifest says what an engine is; what is wrong in one is named with its field and value, and nothing is started."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from carom.adapter import ContactTimes, Stamp
from carom.errors import AdapterError
from carom.program.manifest import load_manifest

WHOLE = """
name = "toy"
engine = "Toy engine"
version = "1.2"
command = ["./toy", "--quiet", "../shared.js"]
install = "make toy"
[capabilities]
walls = false
restitution = [0.0, 1.0]
contact_times = "solved"
stamp = "instant"
max_speed_m_s = 400.0
[profiles.default]
description = "As shipped."
settings = { iterations = 4, solver = "pgs", warm = true, slop = 0.005 }
accuracy = { late_steps = 1.0 }
changed = { friction = "the scene's" }
[profiles.tuned]
description = "The best."
located = true
[profiles.tuned.capabilities]
walls = true
"""


def written(folder: Path, text: str) -> Path:
    """Write a manifest."""
    path = folder / "engine.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_every_field_is_taken_over(tmp_path: Path) -> None:
    """Capabilities, accuracy and settings arrive as what an adapter in Python declares, enumerations by their names."""
    found = load_manifest(written(tmp_path, WHOLE))
    assert (found.name, found.engine, found.version) == ("toy", "Toy engine", "1.2")
    assert found.capabilities.contact_times is ContactTimes.SOLVED
    assert found.capabilities.stamp is Stamp.INSTANT
    assert found.capabilities.restitution == (0.0, 1.0)
    assert not found.capabilities.walls
    default, tuned = found.profiles["default"], found.profiles["tuned"]
    assert default.settings == {"iterations": 4, "solver": "pgs", "warm": True, "slop": 0.005}
    assert default.accuracy.late_steps == 1.0
    assert default.changed == {"friction": "the scene's"}
    assert found.profiles["tuned"].changed == {}
    assert tuned.located
    assert tuned.capabilities is not None
    assert tuned.capabilities.walls
    assert tuned.capabilities.max_speed_m_s == 400.0  # what it leaves out is the engine's


def test_files_beside_the_manifest_are_found_from_anywhere(tmp_path: Path) -> None:
    """A word of the command that begins with a dot and a slash is a file beside the manifest, any other is as it is."""
    command = load_manifest(written(tmp_path, WHOLE)).command_from(tmp_path)
    assert command == (str(tmp_path / "toy"), "--quiet", str(tmp_path.parent / "shared.js"))


def test_a_program_that_is_not_there_is_a_reason(tmp_path: Path) -> None:
    """What is missing is named, with the command that installs it."""
    found = load_manifest(written(tmp_path, WHOLE))
    assert found.missing(tmp_path) == f"there is no program {tmp_path / 'toy'}; make toy"
    other = load_manifest(written(tmp_path, WHOLE.replace('"./toy"', '"no-such-program-of-carom"')))
    assert other.missing(tmp_path) == "no-such-program-of-carom is not on the PATH; make toy"


def test_an_npm_package_that_is_not_there_is_a_reason_and_one_that_is_tells_its_version(tmp_path: Path) -> None:
    """Without its package an engine is unavailable, with the command that brings it; the package has the version."""
    whole = WHOLE.replace('version = "1.2"', 'package = "../packages/toys/package.json"')
    whole = whole.replace('"./toy"', f'"{Path(sys.executable).as_posix()}"').replace(
        '"make toy"', '"npm --prefix ../p"'
    )
    found = load_manifest(written(tmp_path, whole))
    assert found.missing(tmp_path) == f"toys is not installed; npm --prefix {tmp_path.parent / 'p'}"
    assert found.version_from(tmp_path) == ""
    package = tmp_path.parent / "packages/toys/package.json"
    package.parent.mkdir(parents=True)
    package.write_text('{"name": "toys", "version": "3.4.5"}')
    assert found.missing(tmp_path) == ""
    assert found.version_from(tmp_path) == "3.4.5"
    package.write_text("{")
    assert found.version_from(tmp_path) == ""


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('name = "toy"', "", "name: is required"),
        ('version = "1.2"', "version = 1.2", "version: must be a valid string, got 1.2;"),
        ("restitution = [0.0, 1.0]", "restitution = 1", "capabilities.restitution: must be a list, got 1;"),
        ('"instant"', '"middle"', "capabilities: stamp must be one of start, end, instant, got 'middle';"),
        ('name = "toy"', 'name = "../toy"', "name"),
        ('name = "toy"', 'name = "toy"\nprotocol = 2', "protocol"),
        ('command = ["./toy", "--quiet", "../shared.js"]', "command = []", "command"),
        ("walls = false", "wals = false", "'wals'"),
        ('"solved"', '"sometimes"', "contact_times"),
        ("late_steps = 1.0", 'late_steps = "one"', "late_steps"),
        ('description = "As shipped."', "", "profiles.default.description"),
        ("slop = 0.005", "slop = [1]", "settings.slop: must be a number, true, false or a text, got [1]"),
        ("slop = 0.005", "slop = inf", "settings.slop: must be finite, as JSON's numbers are, got inf"),
        ("name = ", "nam = ", "nam"),
    ],
)
def test_what_is_wrong_is_named(old: str, new: str, told: str, tmp_path: Path) -> None:
    """A manifest with a slip is refused with the file, the field or its value, and where to read on."""
    path = written(tmp_path, WHOLE.replace(old, new, 1))
    with pytest.raises(AdapterError) as caught:
        load_manifest(path)
    assert str(path) in str(caught.value)
    assert told in str(caught.value)
    assert "see docs/engine-protocol.md#the-manifest" in str(caught.value)


def test_a_manifest_that_is_not_there_or_no_text_is_refused(tmp_path: Path) -> None:
    """A missing file, a folder, bytes that are no UTF-8, and a file of megabytes are each a sentence."""
    for data in (None, b"\xff\xfe", b"[capabilities", b"#" * 2**21):
        path = tmp_path / "other.toml"
        if data is not None:
            path.write_bytes(data)
        with pytest.raises(AdapterError, match=r"other\.toml"):
            load_manifest(path)
    with pytest.raises(AdapterError):
        load_manifest(tmp_path)
