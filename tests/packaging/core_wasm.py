"""Build of `core.wasm`, the core for the page: ``make generated``, or ``python -m tests.packaging.core_wasm``.

The same sources give the same bytes in any folder. A digest of the sources, of the flags and of the compiler's version
is a section of the file, so that a test finds a stale file without the compiler. pyproject.toml pins the compiler, zig.
"""

import hashlib
import os
import subprocess
import sys
import tempfile
import tomllib
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CORE_WASM = ROOT / "src/carom/web/core.wasm"
SECTION = b"carom.sources"
_CUSTOM = 0
#: Every file that is compiled. They include the loops.
_COMPILED = ("wasm/memory.c", "wasm/pic.c", "wasm/pit.c")
#: Small rather than fast: the page has ten discs. `inline` would make copies of functions.
_FLAGS = (
    *("-target", "wasm32-freestanding", "-mcpu=generic+nontrapping_fptoint+bulk_memory", "-std=c11"),
    *("-Oz", "-Xclang", "-Oz", "-Dinline=", "-mllvm", "-inline-threshold=-20"),
    *("-DCAROM_PLAIN_FRAMES", "-ffp-contract=off", "-fno-math-errno", "-g0", "-s"),
    *("-nostdlib", "-Wl,--no-entry", "-Isrc", "-Isrc/carom/core/wasm/include"),
)


def read_pinned_compiler() -> str:
    """Return the requirement of the compiler that is pinned, as ``ziglang==0.13.0``."""
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    (pinned,) = extras["wasm"]
    return str(pinned)


def compute_sources_digest() -> str:
    """Return the digest of the sources, the flags and the version of the compiler."""
    digest = hashlib.sha256(" ".join([read_pinned_compiler(), *_COMPILED, *_FLAGS]).encode())
    core = ROOT / "src/carom/core"
    for path in sorted([*core.rglob("*.h"), *core.rglob("*.c")]):
        content = path.read_bytes().replace(b"\r\n", b"\n")
        digest.update(f"\n{path.relative_to(core).as_posix()} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def read_sources_digest(wasm: bytes) -> str:
    """Return the digest of the sources that a file was built from; empty if it has none."""
    return wasm.rpartition(_name(SECTION))[2].decode() if _name(SECTION) in wasm else ""  # it is the last section


def build(root: Path = ROOT) -> bytes:
    """Return the file, built from the sources below a folder."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "core.wasm")
        caches = {"ZIG_GLOBAL_CACHE_DIR": f"{folder}/global", "ZIG_LOCAL_CACHE_DIR": f"{folder}/local"}
        python_path = zig_environment(Path(folder, "zig"))
        sources = [f"src/carom/core/{name}" for name in _COMPILED]
        command = [sys.executable, "-m", "ziglang", "cc", *_FLAGS, "-o", str(out), *sources]
        subprocess.run(command, check=True, cwd=root, env=os.environ | caches | python_path)
        return out.read_bytes() + _section(SECTION, compute_sources_digest().encode())


def zig_environment(folder: Path) -> dict[str, str]:
    """Return the variables with which ``python -m ziglang`` is the pinned version, downloaded if it is missing."""
    return {} if _is_installed() else {"PYTHONPATH": _download_zig(folder)}


def main() -> None:
    """Write the file that the page contains."""
    wasm = build()
    CORE_WASM.write_bytes(wasm)
    sys.stdout.write(f"{CORE_WASM.relative_to(ROOT)}: {len(wasm)} bytes\n")


def _is_installed() -> bool:
    name, _, pinned = read_pinned_compiler().partition("==")
    try:
        return version(name) == pinned
    except PackageNotFoundError:
        return False


def _download_zig(folder: Path) -> str:
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--target", str(folder), read_pinned_compiler()]
    subprocess.run(pip, check=True)
    return str(folder)


def _name(name: bytes) -> bytes:
    return bytes([len(name)]) + name


def _section(name: bytes, content: bytes) -> bytes:
    """Return a section of up to 127 bytes."""
    filled = _name(name) + content
    return bytes([_CUSTOM, len(filled)]) + filled


if __name__ == "__main__":
    main()
