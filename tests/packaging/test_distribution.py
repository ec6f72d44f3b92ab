from __future__ import annotations

import json
import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

#: Carom's own methods and the three engines, as pyproject.toml declares them.
BUILT_IN = {"pic", "pit", "pymunk", "pybullet", "mujoco", "box2d"}


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the sdist of this tree, and the wheel made from that sdist and from nothing else."""
    out = tmp_path_factory.mktemp("dist")
    # Without --wheel or --sdist, `build` makes the wheel from the unpacked sdist: an sdist without adapters would show.
    subprocess.run(
        [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(out), str(ROOT)],
        check=True,
        capture_output=True,
    )
    return out


def test_the_sdist_holds_what_the_tests_and_docs_need(built: Path) -> None:
    """The sdist carries adapters, tests, docs and the Makefile."""
    with tarfile.open(next(built.glob("*.tar.gz"))) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    wanted = {
        "adapters/carom_adapters/pymunk.py",
        "src/carom/scene.schema.json",
        "tests/packaging/test_distribution.py",
        "docs/scoring.md",
        "Makefile",
    }
    assert wanted <= names


def test_the_wheel_holds_code_data_and_nothing_else(built: Path) -> None:
    """The wheel carries both packages, the schema, the report template and the typing markers, and no tests."""
    with zipfile.ZipFile(next(built.glob("*.whl"))) as archive:
        names = set(archive.namelist())
    wanted = {
        "carom/py.typed",
        "carom_adapters/py.typed",
        "carom/scene.schema.json",
        "carom/report/templates/page.html.j2",
        "carom_adapters/mujoco/world.py",
    }
    assert wanted <= names
    assert not [name for name in names if name.startswith(("tests", "docs"))]


def test_the_installed_wheel_finds_every_adapter(built: Path, tmp_path: Path) -> None:
    """Installed from the wheel alone, away from the source tree, Carom finds all its adapters by entry point."""
    target = tmp_path / "site"
    subprocess.run(
        [
            *(sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"),
            *("--disable-pip-version-check", "--target", str(target), str(next(built.glob("*.whl")))),
        ],
        check=True,
        capture_output=True,
    )
    code = (
        "import json, carom, carom.registry as r\n"
        "print(json.dumps([carom.__file__, {i.name: i.distribution for i in r.engines()}]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        check=True,
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(target)},
    )
    file, found = json.loads(done.stdout)
    assert Path(file).is_relative_to(target)
    assert found == dict.fromkeys(BUILT_IN, "carom")
