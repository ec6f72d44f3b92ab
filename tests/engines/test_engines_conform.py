"""The engines held to the suite that everybody's are held to, by the command that everybody runs."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from importlib import metadata
from pathlib import Path

import pytest

from carom.adapter import Adapter
from carom.registry import ENTRY_POINT_GROUP

#: Those that tests/adapters drives.
BROUGHT_BY_ALL = {"box2d", "mujoco", "pic", "pit", "pybullet", "pymunk"}
NAMES = sorted(
    point.name
    for point in metadata.entry_points(group=ENTRY_POINT_GROUP)
    if point.value.startswith("carom_adapters.") and point.name not in BROUGHT_BY_ALL
)


@pytest.mark.parametrize("name", NAMES)
def test_adapter_conforms_but_for_its_known_failures(
    name: str, named: Callable[[str], Adapter], tmp_path: Path
) -> None:
    """`pytest --carom-engine` passes for every profile: what fails is listed, with its reason."""
    named(name)
    command = [sys.executable, "-m", "pytest", "--carom-engine", name, "--carom-profile=all", "-W", "error", "-q"]
    if (known := Path(__file__).parent / f"{name}-known-failures.toml").exists():
        command.append(f"--carom-known-failures={known}")
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert " 0 failed" in done.stdout
