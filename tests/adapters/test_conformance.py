"""Carom's own adapters, held to the suite that everybody else's are held to, by the command that everybody runs.

Those of engines that are no part of `all` are run with `-m engines`.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from tests.adapters.conftest import NAMES
from tests.hazards.measures import ENGINES
from tests.lengths import long_after
from tests.stage import Named

from carom.runs.plan import DEFAULT_PROFILES

KNOWN_FAILURES = Path(__file__).parent / "carom-known-failures.toml"
OF_ENGINES = Path(__file__).parents[1] / "engines"

#: Profiles other than the usual ones. Left out are those in which one setting is put back (`no-ccd`), and the cylinders
#: that are free to turn: that they tip over is what they are for.
PROFILES = {
    "pic": ["tuned"],  # there is nothing to tune: its profiles are the same settings
    "pit": ["tuned"],
    "pymunk": ["tuned", "located"],  # none of its cases fails as shipped either (run by hand)
    "pybullet": [*DEFAULT_PROFILES, "cylinder"],
    "mujoco": [*DEFAULT_PROFILES, "cylinder"],
}


@pytest.mark.parametrize(
    "name",
    [
        *long_after(0, NAMES),
        *(pytest.param(name, marks=pytest.mark.engines) for name in ENGINES if name not in NAMES),
    ],
)
def test_adapter_conforms_but_for_its_known_failures(name: str, named: Named, tmp_path: Path) -> None:
    """`pytest --carom-engine` passes in a folder without tests: what fails is listed, with its reason."""
    named(name)
    known = KNOWN_FAILURES if name in NAMES else OF_ENGINES / f"{name}-known-failures.toml"
    command = [sys.executable, "-m", "pytest", "--carom-engine", name]
    command += [f"--carom-known-failures={known}"] if known.exists() else []
    profiles = PROFILES.get(name, []) if name in NAMES else ["all"]
    command += [f"--carom-profile={profile}" for profile in profiles]
    done = subprocess.run([*command, "-W", "error", "-q"], capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{name}: " in done.stdout
    assert " 0 failed" in done.stdout
