"""Try the extension on ARM without an ARM machine: ``make arm``, or ``python -m tests.packaging.arm FOLDER``.

zig compiles the core and the C that Cython made for aarch64, twice: as every wheel is, and with products fused into
sums. Debian's arm64 Python runs both under qemu-user. The first must give the digests of this machine,
`tests.packaging.digests`; the second must not, or the comparison would see nothing. Downloads, some 250 MB, stay in the
folder.

Needs a Debian or Ubuntu of any version (apt-get, dpkg), and the network; not root, and no container.
"""

import argparse
import json
import os
import re
import shutil
import sys
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path

import pydantic
from tests.packaging.building import ROOT, run
from tests.packaging.digests import digests

import carom
from carom.core.extension import compute_sources_digest

#: bookworm: its Python is the oldest that the extension is made for.
_DEBIAN, _PYTHON, _GLIBC = "bookworm", "3.11", "2.36"
_PACKAGES = (
    *(f"libpython{_PYTHON}-{part}" for part in ("minimal", "stdlib", "dev")),
    *(f"python{_PYTHON}-minimal", "libc6", "zlib1g", "libexpat1", "libffi8", "libssl3", "libstdc++6", "libgcc-s1"),
    *("libbz2-1.0", "liblzma5", "libuuid1", "libcrypt1"),
)
#: With code of their own for each processor; what else is imported is plain Python, taken from this environment.
_WHEELS = ("numpy", "pydantic_core", "python-flint")
#: As in setup.py, except for the last.
_FLAGS = ("-std=c11", "-O3", "-fno-math-errno", "-fno-trapping-math", "-g0", "-w", "-DPy_LIMITED_API=0x030B0000")
_FORMS = {"as wheels are": "-ffp-contract=off", "with products fused into sums": "-ffp-contract=fast"}


def main() -> int:
    """Download, build and run both forms, and print the number of equal digests; return 1 if it is wrong."""
    parser = argparse.ArgumentParser(prog="python -m tests.packaging.arm", description=__doc__)
    parser.add_argument("folder", type=Path, help="where downloads and builds are kept")
    folder: Path = parser.parse_args().folder.resolve()
    _download(folder)
    here, failed = digests(), False
    for form, flag in _FORMS.items():
        there = _run(folder, _build(folder / flag.rpartition("=")[2], folder / "system", flag))
        equal = sum(there[name] == digest for name, digest in here.items())
        failed |= (equal == len(here)) != (flag == _FORMS["as wheels are"])
        sys.stdout.write(f"aarch64, {form}: {equal} of {len(here)} digests are those of this machine\n")
        sys.stdout.writelines(f"  differs: {name}\n" for name, digest in here.items() if there[name] != digest)
    return int(failed)


def _download(folder: Path) -> None:
    """Bring zig, qemu, Debian's Python for arm64 and the wheels into the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    if (folder / "complete").exists():
        return
    pip = [sys.executable, "-m", "pip"]
    run(*pip, "install", "--quiet", "--target", folder / "zig", "ziglang")
    newest = (f"--platform=manylinux_2_{minor}_aarch64" for minor in (17, 24, 26, 27, 28))
    only = (f"--python-version={_PYTHON}", "--implementation=cp", "--abi=cp311", "--abi=abi3", "--only-binary=:all:")
    pinned = [f"{name}=={version(name)}" for name in _WHEELS]
    run(*pip, "install", "--quiet", "--no-deps", "--target", folder / "site", *newest, *only, *pinned)
    for machine, packages, place in (("arm64", _PACKAGES, "system"), (_own_machine(), ("qemu-user-static",), "qemu")):
        apt, debs = folder / f"apt-{machine}", folder / f"debs-{place}"
        for part in ("state/lists/partial", "cache/archives/partial"):
            (apt / part).mkdir(parents=True, exist_ok=True)
        (apt / "state/status").touch()
        keys = "/usr/share/keyrings/debian-archive-keyring.gpg"
        (apt / "sources").write_text(f"deb [signed-by={keys}] http://deb.debian.org/debian {_DEBIAN} main\n")
        options = {
            "APT::Architecture": machine,
            "APT::Architectures": machine,
            "Dir::State": apt / "state",
            "Dir::State::status": apt / "state/status",
            "Dir::Cache": apt / "cache",
            "Dir::Etc::sourcelist": apt / "sources",
            "Dir::Etc::sourceparts": "-",
        }
        command = ["apt-get", "-qq", *(f"-o{name}={value}" for name, value in options.items())]
        debs.mkdir(exist_ok=True)
        run(*command, "update")
        run(*command, "download", *packages, cwd=debs)
        for deb in debs.glob("*.deb"):
            run("dpkg", "-x", deb, folder / place)
    (folder / "complete").touch()


def _own_machine() -> str:
    """Return Debian's word for this machine."""
    return run("dpkg", "--print-architecture").stdout.strip()


def _build(out: Path, system: Path, flag: str) -> Path:
    """Compile every module for aarch64, next to the plain files of the package; return the folder."""
    shutil.rmtree(out, ignore_errors=True)
    package = Path(carom.__file__).parent
    shutil.copytree(package, out / "carom", ignore=shutil.ignore_patterns("*.so", "__pycache__"))
    made = ROOT / "build" / "cython"
    modules = {path.relative_to(package.parent).with_suffix(""): _sources(path) for path in package.rglob("*.pyx")}
    modules[Path("carom", "_cython")] = [made / "carom" / "_cython.c"]
    include = system / "usr" / "include"
    zig = [sys.executable, "-m", "ziglang", "cc", "-target", f"aarch64-linux-gnu.{_GLIBC}", "-shared", "-fPIC", *_FLAGS]
    zig += [flag, f"-DCAROM_SOURCES={compute_sources_digest()}", f"-I{include / f'python{_PYTHON}'}", f"-I{include}"]

    def compile_module(name: Path) -> None:
        module = (out / name).with_suffix(".abi3.so")
        command: list[str | Path] = [*zig, f"-I{package.parent}", *modules[name], "-o", module]
        run(*command, env={"PYTHONPATH": str(system.parent / "zig")})

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(compile_module, sorted(modules)))
    return out


def _sources(module: Path) -> list[Path]:
    """Return the C files of a module: what Cython made of its .pyx, and those that its first line names."""
    made = ROOT / "build" / "cython" / "src" / module.relative_to(Path(carom.__file__).parents[1]).with_suffix(".c")
    named = re.match(r"# distutils: sources = (.+)", module.read_text(encoding="utf-8"))
    return [made, *(ROOT / name for name in (named[1].split() if named else ()))]


def _run(folder: Path, package: Path) -> dict[str, str]:
    """Return the digests that an emulated processor gives."""
    system, pure = folder / "system", Path(pydantic.__file__).parents[1]
    emulator, python = folder / "qemu/usr/bin/qemu-aarch64-static", system / f"usr/bin/python{_PYTHON}"
    command: list[str | Path] = [emulator, "-L", system, python, "-S", "-m", "tests.packaging.digests"]
    path = os.pathsep.join(map(str, (package, folder / "site", ROOT, pure)))
    return dict(json.loads(run(*command, env={"PYTHONPATH": path}).stdout))


if __name__ == "__main__":
    raise SystemExit(main())
