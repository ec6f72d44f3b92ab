"""The source distribution holds what building and testing need, the wheel what running needs; both work."""

import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
from tests.packaging.building import ROOT, install, run, run_bits

pytestmark = pytest.mark.release

#: Carom's own methods and the engines.
BUILT_IN = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"]["carom.adapters"].keys()


@pytest.fixture(scope="module")
def dist_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the sdist of this tree, and the wheel made from that sdist and from nothing else."""
    out = tmp_path_factory.mktemp("dist")
    # Without --wheel or --sdist, `build` makes the wheel from the unpacked sdist: what is left out of it would show.
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", out, ROOT)
    return out


def list_wheel_files(dist_folder: Path) -> set[str]:
    with zipfile.ZipFile(next(dist_folder.glob("*.whl"))) as archive:
        return set(archive.namelist())


def list_c_sources() -> set[str]:
    """Return the C files of the package, without what Cython writes."""
    return {path.relative_to(ROOT / "src").as_posix() for path in (ROOT / "src").rglob("*.c")}


def test_sdist_contains_everything_to_build_and_test(dist_folder: Path) -> None:
    """The sdist has adapters, tests, docs, the Makefile and C sources, and no compiled file and no report."""
    with tarfile.open(next(dist_folder.glob("*.tar.gz"))) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    wanted = {
        "adapters/carom_adapters/pymunk/adapter.py",
        "src/carom/results.schema.json",
        "src/carom/scene.schema.json",
        "src/carom/core/straight/pair_time.h",
        "src/carom/core/pic/event_loop.c",
        "src/carom/core/primitives.pyx",
        "tests/packaging/test_distribution.py",
        "docs/theory/scoring.md",
        "setup.py",
        "build_backend/carom_build.py",
        "Makefile",
        ".ci/run",
    }
    assert wanted <= names
    assert not [name for name in names if name.endswith((".so", ".pyd", ".pyc")) or name.startswith("reports")]
    assert {name for name in names if name.endswith(".c")} == {f"src/{name}" for name in list_c_sources()}


def test_wheel_supports_all_later_python_versions(dist_folder: Path) -> None:
    """The wheel is tagged for CPython 3.11 with the stable ABI, which every later version supports."""
    (wheel,) = dist_folder.glob("*.whl")
    _, _, python, abi, platform = wheel.stem.split("-")
    assert (python, abi) == ("cp311", "abi3")
    assert platform != "any"


def test_wheel_contains_only_the_packages(dist_folder: Path) -> None:
    """The wheel has every file of both packages, and nothing else."""
    names = list_wheel_files(dist_folder)
    made = {"__pycache__", "node_modules"}
    for folder, package in (("src", "carom"), ("adapters", "carom_adapters")):
        for path in (ROOT / folder / package).rglob("*"):
            if path.is_file() and made.isdisjoint(path.parts) and path.suffix not in {".so", ".pyd"}:
                assert path.relative_to(ROOT / folder).as_posix() in names
    assert not [name for name in names if not name.startswith(("carom/", "carom_adapters/", "carom-"))]
    assert not [name for name in names if name.endswith(".pyc") or "node_modules" in name]
    assert {name for name in names if name.endswith(".c")} == list_c_sources()


def test_wheel_contains_every_compiled_module(dist_folder: Path) -> None:
    """The wheel has one compiled module for each .pyx file, and the shared one."""
    compiled = {name.partition(".")[0] for name in list_wheel_files(dist_folder) if name.endswith((".so", ".pyd"))}
    sources = {path.relative_to(ROOT / "src").with_suffix("").as_posix() for path in (ROOT / "src").rglob("*.pyx")}
    assert compiled == sources | {"carom/core/_cython"}


def test_installed_wheel_is_compiled_and_finds_every_adapter(dist_folder: Path, tmp_path: Path) -> None:
    """Installed away from the source tree, Carom runs compiled and finds all its adapters."""
    report = run_bits(install(next(dist_folder.glob("*.whl")), tmp_path / "site"), tmp_path)
    assert report["notes"] == []
    assert report["engines"] == dict.fromkeys(BUILT_IN, "carom")
