"""`carom tune` as a user types it: what it finds, what it leaves to paste, and how it goes on."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest
from tests.command import carom_command

from carom import Disc, Scene, save_scene
from carom.adapter import Profile
from carom.studies.tune.search import KnobSearch


@pytest.fixture
def slow(tmp_path: Path) -> Path:
    """Two discs that meet head-on at 0.4 m/s; Box2D as it is shipped makes impacts of up to 1 m/s inelastic."""
    discs = [
        Disc(position_m=(0, 0), velocity_m_s=(0.4, 0), radius_m=0.5),
        Disc(position_m=(1.23, 0), velocity_m_s=(0, 0), radius_m=0.5),
    ]
    path = tmp_path / "slow.toml"
    save_scene(Scene(name="slow", discs=discs, duration_s=1.5, frame_rate_hz=60.0), path)
    return path


def blocks(text: str, heading: str) -> str:
    """Return the code below a heading of a report in Markdown."""
    below = text.partition(f"## {heading}\n")[2].partition("\n#")[0]
    return "".join(f"{line[4:]}\n" for line in below.splitlines() if line.startswith("    "))


@pytest.mark.long
def test_what_lifts_a_threshold_is_found_and_can_be_pasted(slow: Path, tmp_path: Path) -> None:
    """Of Box2D's knobs the scaling of velocities alone mends a slow impact; the profiles to paste hold it, and run."""
    out = tmp_path / "out"
    done = carom_command("tune", "box2d", slow, "--trials", 12, "--out", out, "-j", 1)
    assert done.exit_code == 0, done.output
    text = (out / "tune.md").read_text()
    profile = eval(f"{{{blocks(text, 'To paste, in Python')}}}", {"Profile": Profile})["found"]  # noqa: S307 - our own
    settings = profile.settings(1 / 60)
    assert settings["velocity_scale"] > 1.0 / 0.4
    assert settings["positionIterations"] == 3  # as in `default`, since nothing is gained by another
    pasted = tomllib.loads(blocks(text, "To paste, in engine.toml"))["profiles"]["found"]
    assert {**pasted["settings"], "dt_s": 1 / 60} == settings
    command = blocks(text, "To run it").split()
    assert command[:2] == ["carom", "run"]
    assert f"velocity_scale={settings['velocity_scale']}" in command
    ran = carom_command(*command[1:], "--dt", "1/60", "--no-timing")
    assert ran.exit_code == 0, ran.output


@pytest.mark.long
def test_a_search_that_is_interrupted_says_what_it_has_and_goes_on(
    slow: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C leaves the best so far and the way on; taken up, the search ends where it would have ended whole."""
    one, other = tmp_path / "one", tmp_path / "other"
    assert carom_command("tune", "box2d", slow, "--trials", 12, "--out", other, "-j", 1).exit_code == 0
    tried = KnobSearch.tried

    def interrupted(self: KnobSearch, point: dict[str, int]) -> Any:
        if self.best is not self.begun:
            raise KeyboardInterrupt
        return tried(self, point)

    with monkeypatch.context() as patched:
        patched.setattr(KnobSearch, "tried", interrupted)
        done = carom_command("tune", "box2d", slow, "--trials", 12, "--out", one, "-j", 1)
    assert done.exit_code == 130
    assert "best so far, in trial" in done.output
    assert "--set velocity_scale=" in done.output
    assert "--resume goes on from there" in done.output
    refused = carom_command("tune", "box2d", slow, "--trials", 12, "--out", one)
    assert refused.exit_code == 2
    assert "continue from them by --resume" in refused.output
    assert carom_command("tune", "box2d", slow, "--trials", 12, "--out", one, "-j", 1, "--resume").exit_code == 0
    whole, resumed = ((folder / "tune.md").read_text() for folder in (other, one))
    assert blocks(resumed, "To paste, in Python") == blocks(whole, "To paste, in Python")
