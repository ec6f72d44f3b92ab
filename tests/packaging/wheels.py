"""Build wheels and test them with each CPython: ``make wheels``, or ``python -m tests.packaging.wheels FOLDER``.

Each interpreter installs one wheel into a new environment, once with each supported NumPy, and runs the tests of
`[tool.cibuildwheel]` in `pyproject.toml`. Missing interpreters are reported. Then zig builds a wheel for musl, whose
libraries are checked; it is not run.

Needs the network: for NumPy, for the requirements of the tests, and for zig.
"""

import argparse
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from tests.packaging.building import ROOT, copy_tree, run

#: The oldest NumPy that is allowed, where there is a wheel of it, and the newest of all.
_NUMPY = {"3.11": ("1.26.*", "2.*"), "3.12": ("1.26.*", "2.*"), "3.13": ("2.*",)}
_MUSL = "x86_64-linux-musl"


def main() -> int:
    """Build both wheels, test one, and print the results; return 1 if a test fails or a wheel is wrong."""
    parser = argparse.ArgumentParser(prog="python -m tests.packaging.wheels", description=__doc__)
    parser.add_argument("folder", type=Path, help="where wheels and environments are made")
    parser.add_argument("pythons", nargs="*", default=[f"python{name}" for name in _NUMPY], help="interpreters")
    asked = parser.parse_args()
    folder: Path = asked.folder.resolve()
    shutil.rmtree(folder, ignore_errors=True)
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation"]
    run(*build, "--outdir", folder, copy_tree(folder / "tree"))
    (wheel,) = folder.glob("*.whl")
    failed = False
    for line, good in (*_try_wheel(folder, wheel, asked.pythons), _build_for_musl(folder)):
        failed |= not good
        sys.stdout.write(f"{line}\n")
        sys.stdout.flush()
    return int(failed)


def _try_wheel(folder: Path, wheel: Path, pythons: Sequence[str]) -> Iterator[tuple[str, bool]]:
    """Yield a line for each interpreter and NumPy, and whether its tests pass; a missing interpreter passes."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["cibuildwheel"]
    words = shlex.split(settings["test-command"].replace("{project}", str(ROOT)))
    tests = [word for word in words if "/tests/" in word]
    for python in pythons:
        version = _version_of(python)
        if version is None:
            yield f"{python}: not here, not tried", True
            continue
        for numpy in _NUMPY.get(version, ("2.*",)):
            site = folder / f"{version}-{numpy[0]}"
            run(python, "-m", "venv", site)
            own, extras = site / "bin" / "python", ",".join(settings["test-extras"])
            wanted = [f"{wheel}[{extras}]", f"numpy=={numpy}", *settings["test-requires"]]
            run(own, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *wanted)
            done = run(own, "-m", "pytest", "-q", "-p", "no:cacheprovider", *tests, check=False)
            what = "import sys, numpy; print('CPython', sys.version.split()[0] + ', NumPy', numpy.__version__)"
            yield f"{run(own, '-c', what).stdout.strip()}: {done.stdout.splitlines()[-1]}", done.returncode == 0


def _version_of(python: str) -> str | None:
    """Return the version of an interpreter; None if there is none."""
    command = [python, "-c", "import sys; print('%d.%d' % sys.version_info[:2])"]
    try:
        done = subprocess.run(command, check=False, capture_output=True, text=True)
    except OSError:
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def _build_for_musl(folder: Path) -> tuple[str, bool]:
    """Build a wheel for musl from a tree without builds, and return the libraries that its modules need."""
    run(sys.executable, "-m", "pip", "install", "--quiet", "--target", folder / "zig", "ziglang")
    zig = f"{sys.executable} -m ziglang cc -target {_MUSL}"
    wanted = {"CC": zig, "LDSHARED": f"{zig} -shared", "PYTHONPATH": str(folder / "zig")}
    setup = [sys.executable, "setup.py", "--quiet", "bdist_wheel", "--plat-name", "musllinux_1_2_x86_64"]
    run(*setup, "--dist-dir", folder / "musl", cwd=copy_tree(folder / "tree-musl"), env=wanted)
    (wheel,) = (folder / "musl").glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        modules = [name for name in archive.namelist() if name.endswith(".so")]
        archive.extractall(folder / "musl", modules)
    headers = [run("objdump", "-p", folder / "musl" / name).stdout for name in modules]
    needed = {name for text in headers for name in re.findall(r"NEEDED\s+(\S+)", text)}
    line = f"{wheel.name}: {len(modules)} modules, which need {', '.join(sorted(needed))}; untried, never loaded"
    return line, bool(modules) and needed == {"libc.so"} and not any("GLIBC" in text for text in headers)


if __name__ == "__main__":
    raise SystemExit(main())
