"""The source distribution holds what building and testing need, the wheel what running needs; both work."""

import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
from tests.packaging.building import ROOT, install, report_of, run

pytestmark = pytest.mark.release

#: Carom's own methods and the engines.
BUILT_IN = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"]["carom.adapters"].keys()


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the sdist of this tree, and the wheel made from that sdist and from nothing else."""
    out = tmp_path_factory.mktemp("dist")
    # Without --wheel or --sdist, `build` makes the wheel from the unpacked sdist: what is left out of it would show.
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", out, ROOT)
    return out


def wheel_names(built: Path) -> set[str]:
    with zipfile.ZipFile(next(built.glob("*.whl"))) as archive:
        return set(archive.namelist())


def c_sources() -> set[str]:
    """Return the C files of the package, without what Cython writes."""
    return {path.relative_to(ROOT / "src").as_posix() for path in (ROOT / "src").rglob("*.c")}


def test_the_sdist_holds_what_the_tests_and_docs_need(built: Path) -> None:
    """The sdist carries adapters, tests, docs, the Makefile, the extension's sources; nothing compiled, no report."""
    with tarfile.open(next(built.glob("*.tar.gz"))) as archive:
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
    assert {name for name in names if name.endswith(".c")} == {f"src/{name}" for name in c_sources()}


def test_one_wheel_serves_all_versions_of_python(built: Path) -> None:
    """The wheel's name says CPython 3.11, its stable interface, and the platform: it serves every later version."""
    (wheel,) = built.glob("*.whl")
    _, _, python, abi, platform = wheel.stem.split("-")
    assert (python, abi) == ("cp311", "abi3")
    assert platform != "any"


def test_the_wheel_holds_code_data_and_nothing_else(built: Path) -> None:
    """The wheel carries every file of both packages: code, data, stubs, the extension and its sources; and no tests."""
    names = wheel_names(built)
    made = {"__pycache__", "node_modules"}
    for folder, package in (("src", "carom"), ("adapters", "carom_adapters")):
        for path in (ROOT / folder / package).rglob("*"):
            if path.is_file() and made.isdisjoint(path.parts) and path.suffix not in {".so", ".pyd"}:
                assert path.relative_to(ROOT / folder).as_posix() in names
    assert not [name for name in names if not name.startswith(("carom/", "carom_adapters/", "carom-"))]
    assert not [name for name in names if name.endswith(".pyc") or "node_modules" in name]
    assert {name for name in names if name.endswith(".c")} == c_sources()


def test_the_wheel_holds_every_module_of_the_extension(built: Path) -> None:
    """There is one compiled module for each .pyx file, and the one that all share."""
    compiled = {name.partition(".")[0] for name in wheel_names(built) if name.endswith((".so", ".pyd"))}
    sources = {path.relative_to(ROOT / "src").with_suffix("").as_posix() for path in (ROOT / "src").rglob("*.pyx")}
    assert compiled == sources | {"carom/core/_cython"}


def test_the_installed_wheel_runs_compiled_and_finds_every_adapter(built: Path, tmp_path: Path) -> None:
    """Installed from the wheel alone, away from the source tree, Carom runs compiled and finds all its adapters."""
    report = report_of(install(next(built.glob("*.whl")), tmp_path / "site"), tmp_path)
    assert report["notes"] == []
    assert report["engines"] == dict.fromkeys(BUILT_IN, "carom")
