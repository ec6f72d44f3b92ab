"""What the README shows is what happens."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from docs.figures import readme

README = (Path(__file__).resolve().parents[2] / "README.md").read_text()


def block(language: str) -> str:
    found = re.search(rf"```{language}\n(.*?)```", README, re.DOTALL)
    assert found
    return found.group(1)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder that holds the README's scene as my-scene.toml."""
    (tmp_path / "my-scene.toml").write_text(block("toml"))
    return tmp_path


def test_the_scene_and_the_python_lines_run_as_printed(folder: Path) -> None:
    """The README's scene, run by the README's Python lines as a plain script, ends with a grade."""
    (folder / "script.py").write_text(block("python"))
    done = subprocess.run([sys.executable, "script.py"], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "no worse than PIT at the same step" in done.stdout


@pytest.mark.long
def test_the_command_on_a_file_of_ones_own_runs_as_printed(folder: Path) -> None:
    """The README's command on that file runs; MuJoCo as it comes is inaccurate there, which is exit code 1."""
    command = re.search(r"^    (carom run my-scene\.toml .*)$", README, re.MULTILINE)
    assert command
    arguments = command.group(1).split()[1:]
    done = subprocess.run(
        [sys.executable, "-m", "carom", *arguments], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 1, done.stdout + done.stderr
    assert re.search(r"^mujoco default +▲+ ", done.stdout, re.MULTILINE)
    assert re.search(r"^mujoco tuned +≈+ ", done.stdout, re.MULTILINE)


def test_every_file_that_the_readme_links_to_exists() -> None:
    """No link of the README leads nowhere."""
    root = Path(__file__).resolve().parents[2]
    links = [link for link in re.findall(r"\]\(([^)#]+)\)", README) if "://" not in link]
    assert links
    assert [link for link in links if not (root / link).exists()] == []


def test_the_readme_is_short_and_shows_one_picture() -> None:
    """At most 110 lines, one picture of at most 50 kB, and a C compiler among what a machine needs."""
    assert len(README.splitlines()) <= 110
    (picture,) = re.findall(r"!\[.*?\]\((.*?)\)", README)
    root = Path(__file__).resolve().parents[2]
    assert (root / picture) == readme.PICTURE
    assert 0 < readme.PICTURE.stat().st_size <= 50_000
    assert "C compiler" in README


def test_the_table_is_that_of_the_committed_sample() -> None:
    """The README's table is what its script makes of the sample."""
    made = README.partition(readme.BEGIN)[2].partition(readme.END)[0]
    assert made == readme.table()
    for engine in ("PIC", "PIT", "pymunk", "PyBullet", "MuJoCo", "Box2D"):
        assert f"| {engine}" in made


@pytest.mark.long
def test_the_output_shown_is_what_the_command_prints(folder: Path) -> None:
    """Each line below the README's first command is one that it prints."""
    shown = re.search(r"^    \$ (carom run .*)\n((?:    .*\n)+)", README, re.MULTILINE)
    assert shown
    arguments, expected = shown[1].split()[1:], [" ".join(line.split()) for line in shown[2].splitlines()]
    done = subprocess.run(
        [sys.executable, "-m", "carom", *arguments], cwd=folder, capture_output=True, text=True, check=False
    )
    printed = {" ".join(line.split()) for line in done.stdout.splitlines()}
    assert len(expected) == 4
    assert set(expected) <= printed
