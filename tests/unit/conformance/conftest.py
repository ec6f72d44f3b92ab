"""A project of somebody else's, in a folder of its own, with a distribution of adapters on its path."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.installed_adapters import write_distribution
from tests.processes import run_command

TOYS = """
import time
from carom.engines.api import Engine
from carom_adapters.pit import PitAdapter, PitWorld

class Toy(PitAdapter):
    def __init__(self, name):
        self.name = name

class Hangs(Toy):
    def prepare(self, scene, settings):
        time.sleep(3600)

class Missing(Toy):
    engine = Engine("Missing", module="surely_not_installed", install="pip install surely-not-installed")

sound, hangs, missing = Toy("sound"), Hangs("hangs"), Missing("missing")
"""

#: Runs pytest with these arguments in the project.
Pytest = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A folder without tests; its adapters are next to it, like another distribution's."""
    site = tmp_path / "site"
    write_distribution(site, "Carom_Toys", {name: f"toy_adapters:{name}" for name in ("sound", "hangs", "missing")})
    (site / "toy_adapters.py").write_text(TOYS)
    folder = tmp_path / "project"
    folder.mkdir()
    return folder


@pytest.fixture
def run_pytest(project: Path) -> Pytest:
    """Run pytest in the project, in a process of its own."""

    def run(*arguments: str, before: str = "") -> subprocess.CompletedProcess[str]:
        code = f"import sys\n{before}\nimport pytest\nsys.exit(pytest.main(sys.argv[1:]))"
        return run_command(
            [sys.executable, "-c", code, *arguments],
            cwd=project,
            check=False,
            env={**os.environ, "PYTHONPATH": str(project.parent / "site"), "COLUMNS": "200"},
        )

    return run
