"""What numba made of units when this package was built, see `hatch_build.py`: files that come with the package.

numba's part takes most of the time of compiling, and needs nothing of the machine that the units will run on. A file is
named after the digest of all that went into the unit, byte code among it, so one made by another version of Python, or
from other source, is never taken; and after LLVM's version, which its text hangs on.
"""

from __future__ import annotations

import json
import zlib
from pathlib import Path

__all__ = ["holds", "read", "write"]

_HOME = Path(__file__).with_name("units")


def holds(name: str) -> bool:
    """Whether there is a file for a unit, by its name; looking imports nothing."""
    return next(_HOME.glob(f"{name}.*"), None) is not None


def read(name: str, directory: Path | None = None) -> list[str] | None:
    """Return the modules of a unit in LLVM's intermediate representation, or None.

    Args:
        name: Name of the unit.
        directory: Where to look; None for the package.
    """
    try:
        codes: list[str] = json.loads(zlib.decompress(((directory or _HOME) / _file(name)).read_bytes()))
    except (OSError, zlib.error, ValueError):
        return None
    return codes


def write(directory: Path, name: str, codes: list[str]) -> None:
    """Write a file into a directory."""
    (directory / _file(name)).write_bytes(zlib.compress(json.dumps(codes).encode(), 9))


def _file(name: str) -> str:
    import llvmlite.binding as llvm  # type: ignore[import-untyped] # it has no annotations

    return f"{name}.llvm{llvm.llvm_version_info[0]}.z"
