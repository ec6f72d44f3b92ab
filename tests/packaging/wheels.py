"""Make wheels, and try them on each CPython here: ``make wheels``, or ``python -m tests.packaging.wheels FOLDER``.

One wheel is installed by every interpreter into an environment of its own, once with each NumPy that it has to run
with, and has to pass there what every wheel has to pass: `[tool.cibuildwheel]` in `pyproject.toml`. An interpreter that
is missing is said to be. Then zig makes a wheel for musl, which is looked at, and run by nothing.

Needs the network: for NumPy, for what tests need, and for zig.
"""

import argparse
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from tests.packaging.building import ROOT, copy_tree

#: The oldest NumPy that is allowed, where there is a wheel of it, and the newest of all.
_NUMPY = {"3.11": ("1.26.*", "2.*"), "3.12": ("1.26.*", "2.*"), "3.13": ("2.*",)}
_MUSL = "x86_64-linux-musl"


def main() -> int:
    """Make both wheels, try one, and say what came of it; 1 where tests fail or a wheel is not what it has to be."""
    parser = argparse.ArgumentParser(prog="python -m tests.packaging.wheels", description=__doc__)
    parser.add_argument("folder", type=Path, help="where wheels and environments are made")
    parser.add_argument("pythons", nargs="*", default=[f"python{name}" for name in _NUMPY], help="interpreters")
    asked = parser.parse_args()
    folder: Path = asked.folder.resolve()
    shutil.rmtree(folder, ignore_errors=True)
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation"]
    _call([*build, "--outdir", folder, copy_tree(folder / "tree")])
    (wheel,) = folder.glob("*.whl")
    failed = False
    for line, good in (*_try_wheel(folder, wheel, asked.pythons), _build_for_musl(folder)):
        failed |= not good
        sys.stdout.write(f"{line}\n")
        sys.stdout.flush()
    return int(failed)


def _try_wheel(folder: Path, wheel: Path, pythons: Sequence[str]) -> Iterator[tuple[str, bool]]:
    """Yield a line for each interpreter and NumPy, and whether all is well: it is where an interpreter is missing."""
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
            _call([python, "-m", "venv", site])
            own, extras = site / "bin" / "python", ",".join(settings["test-extras"])
            wanted = [f"{wheel}[{extras}]", f"numpy=={numpy}", *settings["test-requires"]]
            _call([own, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *wanted])
            done = _call([own, "-m", "pytest", "-q", "-p", "no:cacheprovider", *tests], check=False)
            what = "import sys, numpy; print('CPython', sys.version.split()[0] + ', NumPy', numpy.__version__)"
            yield f"{_call([own, '-c', what]).stdout.strip()}: {done.stdout.splitlines()[-1]}", done.returncode == 0


def _version_of(python: str) -> str | None:
    """Return the version of an interpreter; None where there is none, as behind a name that starts nothing."""
    command = [python, "-c", "import sys; print('%d.%d' % sys.version_info[:2])"]
    try:
        done = subprocess.run(command, check=False, capture_output=True, text=True)
    except OSError:
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def _build_for_musl(folder: Path) -> tuple[str, bool]:
    """Make a wheel for musl, of a tree in which nothing is built, and say which libraries its modules need."""
    _call([sys.executable, "-m", "pip", "install", "--quiet", "--target", folder / "zig", "ziglang"])
    zig = f"{sys.executable} -m ziglang cc -target {_MUSL}"
    wanted = {"CC": zig, "LDSHARED": f"{zig} -shared", "PYTHONPATH": str(folder / "zig")}
    setup = [sys.executable, "setup.py", "--quiet", "bdist_wheel", "--plat-name", "musllinux_1_2_x86_64"]
    _call([*setup, "--dist-dir", folder / "musl"], copy_tree(folder / "tree-musl"), wanted)
    (wheel,) = (folder / "musl").glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        modules = [name for name in archive.namelist() if name.endswith(".so")]
        archive.extractall(folder / "musl", modules)
    headers = [_call(["objdump", "-p", folder / "musl" / name]).stdout for name in modules]
    needed = {name for text in headers for name in re.findall(r"NEEDED\s+(\S+)", text)}
    line = f"{wheel.name}: {len(modules)} modules, which need {', '.join(sorted(needed))}; untried, never loaded"
    return line, bool(modules) and needed == {"libc.so"} and not any("GLIBC" in text for text in headers)


def _call(
    command: Sequence[str | Path], folder: Path = ROOT, more: dict[str, str] | None = None, *, check: bool = True
) -> subprocess.CompletedProcess[str]:
    """Run a program; what it printed is shown where it fails unexpectedly."""
    environment = {**os.environ, **(more or {})}
    words = [str(word) for word in command]
    done = subprocess.run(words, check=False, cwd=folder, env=environment, capture_output=True, text=True)
    if check and done.returncode:
        raise SystemExit(f"{shlex.join(words)} failed:\n{done.stdout}{done.stderr}")
    return done


if __name__ == "__main__":
    raise SystemExit(main())
