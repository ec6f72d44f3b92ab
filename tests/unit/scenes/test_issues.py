from __future__ import annotations

import re
from pathlib import Path

import pytest

from carom import load_scene, save_scene, solve_pic
from carom.errors import UnknownNameError
from carom.scenes import Complaint, all_scenes, catalogue, deviation, find_scenes

COMPLAINTS = [entry for entry in all_scenes().values() if isinstance(entry, Complaint)]


def test_there_are_twenty_and_more_each_with_its_thread() -> None:
    """At least twenty complaints, each with the address of its thread and with what was reported, ours and theirs."""
    assert len(COMPLAINTS) >= 20
    for entry in COMPLAINTS:
        assert re.fullmatch(r"https://github\.com/[\w.-]+/[\w.-]+/(issues|pull)/\d+", entry.thread)
        number = entry.thread.rpartition("/")[2]
        assert number in entry.name
        assert entry.reported.endswith(".")
        assert entry.made.endswith(".")
        assert entry.about


def test_pic_reproduces_the_known_answer_of_a_complaint_that_survives_its_file(tmp_path: Path) -> None:
    """Saved and loaded again each scene is the same to the bit, and PIC meets its known answer."""
    for entry in COMPLAINTS:
        save_scene(entry.scene, tmp_path / "scene.toml")
        scene = load_scene(tmp_path / "scene.toml")
        assert scene == entry.scene
        assert deviation(solve_pic(scene), entry.known, scene) <= 1e-12, entry.name


def test_complaints_run_only_when_they_are_named() -> None:
    """The suite is without them; a name or a pattern that begins with their group finds them, and nothing else does."""
    assert not any(name.startswith("issues/") for name in catalogue())
    assert len(find_scenes(["issues"])) == len(COMPLAINTS) == len(find_scenes(["issues/*"]))
    assert [entry.name for entry in find_scenes(["issues/jolt-1403"])] == ["issues/jolt-1403"]
    assert not any(entry.name.startswith("issues/") for entry in find_scenes(["*", "tag:walls"]))
    with pytest.raises(UnknownNameError, match="issues/jolt-1403"):
        find_scenes(["issues/jolt-1404"])
