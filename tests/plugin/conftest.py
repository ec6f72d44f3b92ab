"""A fresh environment with Carom, a third party's adapter and its broken twin, each installed from a wheel."""

from __future__ import annotations

import shutil
import sys
import sysconfig
import venv
from pathlib import Path

import pytest
from tests.packaging.building import ROOT, install, make_wheel

HERE = Path(__file__).parent

#: The adapter as its author published it, built with Carom 0.1 (57060cb): old code still runs.
BUILT_WITH_0_1 = HERE / "carom_penalty-0.1-py2.py3-none-any.whl"


@pytest.fixture(scope="session")
def fresh_python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Interpreter of an environment in which three wheels are installed and nothing else."""
    folder = tmp_path_factory.mktemp("fresh")
    # Building leaves metadata next to the sources, which would be an installed adapter to every other test.
    twin = folder / "twin"
    shutil.copytree(HERE / "broken", twin, ignore=shutil.ignore_patterns("*.egg-info", "build", "__pycache__"))
    for source in (ROOT, twin):
        make_wheel(source, folder, {})
    venv.create(folder / "venv", with_pip=False)
    prefix = folder / "venv"
    python = prefix / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    site = Path(sysconfig.get_path("purelib", vars={"base": str(prefix), "platbase": str(prefix)}))
    for wheel in (BUILT_WITH_0_1, *folder.glob("*.whl")):
        install(wheel, site)
    lent = dict.fromkeys((sysconfig.get_path("purelib"), sysconfig.get_path("platlib")))
    (site / "lent.pth").write_text("".join(f"{path}\n" for path in lent))
    return python
