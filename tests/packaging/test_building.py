"""Builds with a compiler, without one, for all of this processor, and with sanitizers: the bits are the same."""

import os
import platform
import sys
from pathlib import Path
from typing import Any

import pytest
from tests.packaging import core_wasm
from tests.packaging.building import copy_tree, install, make_wheel, run, run_bits

pytestmark = pytest.mark.release

#: Programs by which a C compiler is called, beginnings of their names.
COMPILERS = ("gcc", "cc", "clang", "c99", "c89", "x86_64-linux-gnu-", "aarch64-linux-gnu-")

#: Tests that compare forms, and the physics with exact results.
IDENTITY = ("tests/unit/core", "tests/unit/solvers")


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the source tree, in which nothing is built."""
    return copy_tree(tmp_path_factory.mktemp("tree"))


@pytest.fixture(scope="module")
def expected_results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Results of the Carom that the tests run on."""
    results: dict[str, Any] = run_bits(None, tmp_path_factory.mktemp("away"))["results"]
    return results


@pytest.fixture(scope="module")
def no_compiler_environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Environment in which every program of PATH is found, except for C compilers."""
    programs = tmp_path_factory.mktemp("programs")
    for folder in os.get_exec_path():
        for program in Path(folder).glob("*"):
            if not program.name.startswith(COMPILERS) and not (programs / program.name).is_symlink():
                (programs / program.name).symlink_to(program)
    return {"PATH": str(programs), "CC": ""}


def list_build_requirements(tree: Path, environment: dict[str, str]) -> str:
    """Return what a wheel and an editable install require for their build, as two lists."""
    code = "import carom_build as b; print(b.get_requires_for_build_wheel(), b.get_requires_for_build_editable())"
    backend = {"PYTHONPATH": str(tree / "build_backend")}
    return run(sys.executable, "-c", code, cwd=tree, env=backend | environment).stdout.splitlines()[-1]


def test_zig_builds_the_same_bits_without_a_compiler(
    tree: Path, tmp_path: Path, expected_results: dict[str, Any], no_compiler_environment: dict[str, str]
) -> None:
    """Without a C compiler the build requires the pinned ziglang, and its wheel gives the same bits."""
    pinned = core_wasm.read_pinned_compiler()
    assert list_build_requirements(tree, no_compiler_environment) == f"{[pinned]} {[pinned]}"
    done = make_wheel(tree, tmp_path, core_wasm.zig_environment(tmp_path / "zig") | no_compiler_environment)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "-m ziglang cc -mcpu=baseline" in done.stdout + done.stderr
    (wheel,) = tmp_path.glob("*.whl")
    report = run_bits(install(wheel, tmp_path / "site"), tmp_path)
    assert report["notes"] == []
    assert report["results"] == expected_results


def test_build_needs_no_zig_with_a_compiler(tree: Path) -> None:
    """With a C compiler the build requires no further package."""
    assert list_build_requirements(tree, {}) == "[] []"


def test_failing_compiler_makes_no_wheel(tmp_path: Path) -> None:
    """If the compiler fails, the build fails and leaves no wheel."""
    # A tree of its own: where another test has built, nothing is left to compile.
    assert make_wheel(copy_tree(tmp_path / "tree"), tmp_path, {"CC": "false"}).returncode != 0
    assert not list(tmp_path.glob("*.whl"))


def test_stale_extension_is_refused_with_the_build_command(tmp_path: Path) -> None:
    """With a changed or renamed source, or a failed build, pytest refuses to run and names the build command."""
    tree = copy_tree(tmp_path)
    for module in tree.rglob("*.pyx"):
        if module.name not in ("built.pyx", "damped_time.pyx"):  # what collecting imports: the others only take time
            module.unlink()
    command = (sys.executable, "setup.py", "--quiet", "build_ext", "--inplace", "--force")
    source = tree / "src/carom/core/impact_law.h"

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
    # A build that fails leaves the modules of before, and they are still refused.
    source = tree / "src/carom/core/straight/pair_time.h"
    source.write_text(source.read_text() + "/* A comment more. */\n")
    assert run(*command, cwd=tree, check=False, env={"CC": "false"}).returncode != 0
    assert not collects()


def test_only_changed_modules_are_compiled_again(tmp_path: Path) -> None:
    """After an edit only modules that depend on it, and the one with the digest of all sources, are compiled."""
    tree = copy_tree(tmp_path)
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
        ("model/broad_phase/tree.pyx", {"tree"}),
        ("core/formulas.pxd", {"primitives"}),
        ("core/record_rows.pxd", set()),
    ):
        source = tree / "src/carom" / name
        source.write_text(source.read_text() + "# A comment more.\n")
        assert compiled() == {"built"} | dependent
    for name in ("straight/pair_time.h", "pic/event_loop.c"):
        source = tree / "src/carom/core" / name
        source.write_text(source.read_text() + "/* A comment more. */\n")
        assert compiled() == {"built", "tree", "primitives"}
    with (tree / "setup.py").open("a") as setup:
        setup.write("# A comment more.\n")
    assert compiled() == {"_cython", "built", "tree", "primitives"}


@pytest.mark.skipif(sys.platform != "linux", reason="reads the processor's features from /proc/cpuinfo")
def test_native_build_fuses_no_multiply_add(tmp_path: Path) -> None:
    """Built with `-march=native`, the extension passes the tests that compare all bits."""
    tree = copy_tree(tmp_path)
    build = (sys.executable, "setup.py", "--quiet", "build_ext", "--inplace")
    run(*build, cwd=tree, env={"CFLAGS": "-march=native"})
    if platform.machine() == "x86_64" and " avx " in Path("/proc/cpuinfo").read_text():
        assert "vmulsd" in run("objdump", "-d", tree / "tests/core_functions.abi3.so").stdout  # or nothing was tested
    native = {"PYTHONPATH": str(tree / "src")}
    code = "import carom.core.built; print(carom.core.built.__file__)"
    assert Path(run(sys.executable, "-c", code, cwd=tree, env=native).stdout.strip()).is_relative_to(tree)
    run(sys.executable, "-m", "pytest", "-q", "-n", "0", *IDENTITY, cwd=tree, env=native)


@pytest.mark.skipif(sys.platform != "linux", reason="preloads the sanitizers' libraries of GCC")
def test_sanitizers_find_no_fault_in_the_core(tmp_path: Path) -> None:
    """Address and undefined-behaviour sanitizers find nothing in the tests of the core and the solvers."""
    tree = copy_tree(tmp_path)
    sanitizers = "-fsanitize=address,undefined"
    flags = {"CFLAGS": f"{sanitizers} -fno-sanitize-recover=all", "LDFLAGS": sanitizers}
    run(sys.executable, "setup.py", "--quiet", "build_ext", "--inplace", cwd=tree, env=flags)
    libraries = [run("gcc", f"-print-file-name={name}").stdout.strip() for name in ("libasan.so", "libubsan.so")]
    # Each allocation apart, so that the sanitizer sees its end; Python itself leaks what lives as long as the process.
    checked = {"PYTHONPATH": str(tree / "src"), "PYTHONMALLOC": "malloc", "ASAN_OPTIONS": "detect_leaks=0"}
    checked["LD_PRELOAD"] = ":".join(libraries)
    run(sys.executable, "-m", "pytest", "-q", "-n", "0", *IDENTITY, cwd=tree, env=checked)
