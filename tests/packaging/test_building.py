"""With a compiler, without one, and with one that is told to use all that the processor has: the bits are the same."""

from __future__ import annotations

import platform
import sys
import zipfile
from pathlib import Path
from typing import Any

import pytest
from tests.forms import needs_extension
from tests.packaging.building import copy_of_the_tree, install, make_wheel, report_of, run

pytestmark = pytest.mark.long

NO_COMPILER = {"CC": "/nonexistent", "CAROM_REQUIRE_EXTENSION": "0"}

#: Tests that compare forms, and the physics with exact results.
IDENTITY = ("tests/unit/core", "tests/unit/physics", "tests/unit/solvers")


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the source tree, in which nothing is built."""
    return copy_of_the_tree(tmp_path_factory.mktemp("tree"))


@pytest.fixture(scope="module")
def bits(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Results of the Carom that the tests run on."""
    results: dict[str, Any] = report_of(None, tmp_path_factory.mktemp("away"))["results"]
    return results


def test_without_a_compiler_plain_python_gives_the_same_bits(tree: Path, tmp_path: Path, bits: dict[str, Any]) -> None:
    """Without a C compiler the install succeeds, and the same results come out; notes say so, and the remedy."""
    done = make_wheel(tree, tmp_path, NO_COMPILER)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "the extension was not built, plain Python will serve" in done.stdout + done.stderr
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        assert not [name for name in archive.namelist() if name.endswith((".so", ".pyd"))]
    # Tagged for this platform, it would be taken from a cache where there is a compiler.
    assert wheel.stem.split("-")[2:] == ["py3", "none", "any"]
    report = report_of(install(wheel, tmp_path / "site"), tmp_path)
    assert not report["compiled"]
    assert "install a C compiler" in report["notes"][0]
    assert report["results"] == bits


def test_continuous_integration_refuses_to_do_without_the_extension(tree: Path, tmp_path: Path) -> None:
    """With CAROM_REQUIRE_EXTENSION=1, a compiler that fails is an error."""
    done = make_wheel(tree, tmp_path, {"CC": "false", "CAROM_REQUIRE_EXTENSION": "1"})
    assert done.returncode != 0
    assert not list(tmp_path.glob("*.whl"))


@needs_extension
def test_a_stale_extension_is_refused_with_the_command_that_mends_it(tmp_path: Path) -> None:
    """After a change of a source the tests say what to do; doing it is enough, also where a file is only renamed."""
    tree = copy_of_the_tree(tmp_path)
    for module in tree.rglob("*.pyx"):
        if module.name != "built.pyx":  # the one that stands for all: the others would only take time
            module.unlink()
    command = (sys.executable, "setup.py", "--quiet", "build_ext", "--inplace", "--force")
    source = tree / "src/carom/core/impact.h"

    def collects() -> bool:
        pytest_ = (sys.executable, "-m", "pytest", "--collect-only", "-q", "tests/unit/test_errors.py")
        done = run(*pytest_, cwd=tree, check=False, env={"PYTHONPATH": str(tree / "src")})
        assert done.returncode == 0 or "setup.py build_ext --inplace --force" in done.stderr, done.stdout + done.stderr
        return done.returncode == 0

    run(*command, cwd=tree)
    assert collects()
    text = source.read_text()
    source.write_text(text + "/* A comment more. */\n")
    assert not collects()
    source.write_text(text)
    source.rename(source.with_name("renamed.h"))
    assert not collects()
    run(*command, cwd=tree)
    assert collects()
    # A compiler that is gone leaves no module of before behind.
    run(*command, cwd=tree, env=NO_COMPILER)
    assert not list((tree / "src").rglob("*.so"))


@needs_extension
def test_what_has_not_changed_is_not_compiled_again(tmp_path: Path) -> None:
    """After an edit the modules that depend on it are compiled, and the one that contains the digest of all sources."""
    tree = copy_of_the_tree(tmp_path)
    for module in tree.rglob("*.pyx"):
        if module.name not in ("built.pyx", "tree.pyx", "primitives.pyx"):  # the others would only take time
            module.unlink()

    def compiled() -> set[str]:
        before = {path: path.stat().st_mtime_ns for path in tree.rglob("*.so")}
        run(sys.executable, "setup.py", "--quiet", "build_ext", "--inplace", cwd=tree)
        after = {path: path.stat().st_mtime_ns for path in tree.rglob("*.so")}
        return {path.name.partition(".")[0] for path in after if before.get(path) != after[path]}

    assert compiled() == {"_cython", "built", "tree", "primitives"}
    assert compiled() == set()
    for name, dependent in (
        ("broad_phase/tree.pyx", {"tree"}),
        ("core/formulas.pxd", {"primitives"}),
        ("core/laws.pxd", set()),
    ):
        source = tree / "src/carom" / name
        source.write_text(source.read_text() + "# A comment more.\n")
        assert compiled() == {"built"} | dependent
    for name in ("pair.h", "event_driven.c"):
        source = tree / "src/carom/core" / name
        source.write_text(source.read_text() + "/* A comment more. */\n")
        assert compiled() == {"built", "tree", "primitives"}
    with (tree / "setup.py").open("a") as setup:
        setup.write("# A comment more.\n")
    assert compiled() == {"_cython", "built", "tree", "primitives"}


@needs_extension
@pytest.mark.skipif(sys.platform != "linux", reason="reads the processor's features from /proc/cpuinfo")
def test_nothing_is_fused_where_the_processor_could(tmp_path: Path) -> None:
    """Built for this very processor, with its multiply-add, the extension passes the tests of all bits."""
    tree = copy_of_the_tree(tmp_path)
    build = (sys.executable, "setup.py", "--quiet", "build_ext", "--inplace")
    run(*build, cwd=tree, env={"CAROM_REQUIRE_EXTENSION": "1", "CFLAGS": "-march=native"})
    if platform.machine() == "x86_64" and " avx " in Path("/proc/cpuinfo").read_text():
        assert "vmulsd" in run("objdump", "-d", tree / "tests/probe.abi3.so").stdout  # or nothing was tested
    native = {"PYTHONPATH": str(tree / "src")}
    found = run(sys.executable, "-c", "import carom.built; print(carom.built.__file__)", cwd=tree, env=native).stdout
    assert Path(found.strip()).is_relative_to(tree)
    run(sys.executable, "-m", "pytest", "-q", "-n", "0", *IDENTITY, cwd=tree, env=native)
