"""Object files kept on disk from one start of Python to the next.

They lie beside the source, in ``__pycache__``, or where that cannot be written, in the user's cache directory; the
environment variable ``CAROM_CACHE_DIR`` names another place. A file is written whole under another name and then
renamed, so that several processes may compile at once; it bears digests of what it is for and of what it holds, so that
one damaged or made for another machine counts as none. No failure here is an error: the unit is compiled anew.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib.util
import os
import sys
import uuid
from pathlib import Path

__all__ = ["holds", "read", "write"]

_MAGIC = b"carom unit 1\n"
_DIGEST = 32  # bytes of a SHA-256
#: Files kept of one function: of other machines that share the directory, of other Pythons, of benchmarks' variants.
_KEPT = 8


def holds(source: str, name: str) -> bool:
    """Whether there is a file for a name, for whatever machine: a question that loads nothing."""
    return any(next(directory.glob(f"{name}.*.unit"), None) is not None for directory in _directories(source))


def read(source: str, name: str, key: str) -> bytes | None:
    """Return what was kept, or None.

    Args:
        source: The file that the function is defined in.
        name: Name of the function and digest of its code.
        key: All that the object file hangs on.
    """
    purpose = _digest(key.encode())
    for directory in _directories(source):
        path = _path(directory, name, purpose)
        with contextlib.suppress(OSError):
            content = path.read_bytes()
            head, kept = content[: len(_MAGIC) + 2 * _DIGEST], content[len(_MAGIC) + 2 * _DIGEST :]
            if head == _MAGIC + purpose + _digest(kept):
                with contextlib.suppress(OSError):
                    os.utime(path)  # what is in use is not cleared away
                return kept
    return None


def write(source: str, name: str, key: str, content: bytes) -> Path | None:
    """Keep an object file; return where, or None where nothing can be written."""
    purpose = _digest(key.encode())
    for directory in _directories(source):
        path = _path(directory, name, purpose)
        temporary = path.with_name(f"{path.name}.{uuid.uuid4().hex}")
        try:
            directory.mkdir(mode=0o700, parents=True, exist_ok=True)
            temporary.write_bytes(_MAGIC + purpose + _digest(content) + content)
            temporary.replace(path)
        except OSError:
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)
            continue
        _clear(directory, name.rpartition("_")[0])
        return path
    return None


def _clear(directory: Path, function: str) -> None:
    """Delete all files of a function but those used last."""
    with contextlib.suppress(OSError):
        used = {path: path.stat().st_mtime for path in directory.glob(f"{function}_{'[0-9a-f]' * 16}.*.unit*")}
        for path in sorted(used, key=lambda path: used[path])[:-_KEPT]:
            path.unlink(missing_ok=True)


def _path(directory: Path, name: str, purpose: bytes) -> Path:
    return directory / f"{name}.{purpose.hex()[:8]}.unit"


def _directories(source: str) -> list[Path]:
    """Return where to look, and to write, in this order."""
    named = os.environ.get("CAROM_CACHE_DIR")
    if named:
        return [Path(named)]
    places = [Path(importlib.util.cache_from_source(source)).parent]
    with contextlib.suppress(RuntimeError):  # no home directory
        places.append(_users_directory() / "carom")
    return places


def _users_directory() -> Path:
    """Return the directory that the platform sets aside for what can be made anew."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


def _digest(content: bytes) -> bytes:
    return hashlib.sha256(content).digest()
