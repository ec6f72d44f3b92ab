"""Cache of installed releases, with a limited size. Each release has a separate folder.

A folder is filled under a temporary name and renamed when it is complete, so an interrupted installation is never used.
Each running `carom history` holds a shared lock. Folders are only removed with an exclusive lock, so folders in use are
never removed.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import sys
import sysconfig
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from carom.studies.history.registry_clients import Client

#: Name of the file that lists the packages in a folder. If a folder lacks this file, its installation is incomplete.
_NOTE = "carom-release.json"


@dataclass(frozen=True)
class ReleaseCache:
    """Installed releases. Each release has its own folder in the cache's folder."""

    root: Path

    def find(self, registry: str, package: str, version: str) -> Path | None:
        """Return the folder of an installed release; None if the release is not installed."""
        note = self._folder(registry, package, version) / _NOTE
        try:
            json.loads(note.read_text(encoding="utf-8"))  # a power failure can leave an empty or zero-filled file
        except (OSError, ValueError, RecursionError):
            return None
        with suppress(OSError):
            os.utime(note)  # mark as recently used
        return note.parent

    def install(self, client: Client, registry: str, package: str, version: str) -> Path:
        """Install a release if it is not yet installed, and return its folder.

        For pip, the folder must be first on Python's path. For npm, the folder contains a `node_modules`.

        Raises:
            ClientError: The release can't be installed.
            OSError: The release's folder can't be written.
        """
        if (cached_folder := self.find(registry, package, version)) is not None:
            return cached_folder
        place = self._folder(registry, package, version)
        place.parent.mkdir(parents=True, exist_ok=True)
        new = Path(tempfile.mkdtemp(prefix=".new-", dir=place.parent))
        try:
            (new / _NOTE).write_text(json.dumps(client.install(package, version, new)), encoding="utf-8")
            if place.is_dir() and not place.is_symlink():
                shutil.rmtree(place, ignore_errors=True)  # a folder without the list of packages is incomplete
            else:
                place.unlink(missing_ok=True)
            try:
                new.rename(place)
            except OSError:
                if self.find(registry, package, version) is None:  # not installed by another process meanwhile
                    raise
        finally:
            shutil.rmtree(new, ignore_errors=True)
        return place

    def versions(self, registry: str, package: str) -> tuple[str, ...]:
        """Return the installed versions of a package."""
        tag = f"-{_build_platform_tag(registry)}"
        notes = self._folder(registry, package, "0").parent.glob(f"*{tag}/{_NOTE}")
        return tuple(note.parent.name.removesuffix(tag) for note in notes)

    def prune(self, most_bytes: float) -> None:
        """Remove interrupted installations.

        Then keep only the most recently used releases, with a total size of at most `most_bytes` bytes.
        """
        for broken in self.root.glob("*/*/.new-*"):
            shutil.rmtree(broken, ignore_errors=True)
        notes = sorted(self.root.glob(f"*/*/*/{_NOTE}"), key=lambda note: note.lstat().st_mtime, reverse=True)
        total = 0
        for note in notes:
            total += sum(path.lstat().st_size for path in note.parent.rglob("*") if not path.is_dir())
            if total > most_bytes:
                shutil.rmtree(note.parent, ignore_errors=True)

    def _folder(self, registry: str, package: str, version: str) -> Path:
        name = re.sub(r"[^A-Za-z0-9._-]+", "_", package)
        return self.root / registry / name / f"{version}-{_build_platform_tag(registry)}"


def _build_platform_tag(registry: str) -> str:
    """Return the ending of a folder name: the machine's platform and, for pip, also the version of Python."""
    machine = re.sub(r"[^A-Za-z0-9]+", "_", sysconfig.get_platform())
    return f"cp{sys.version_info[0]}{sys.version_info[1]}-{machine}" if registry == "pip" else machine


@contextmanager
def open_release_cache(most_bytes: float, root: Path | None = None) -> Iterator[ReleaseCache]:
    """Open the cache of releases, ``$XDG_CACHE_HOME/carom/history``.

    At the end, remove old releases if the cache is too large.

    Nothing is removed while another `carom history` uses the cache.
    """
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    place = (root or cache / "carom" / "history").resolve()
    place.mkdir(parents=True, exist_ok=True)
    with (place / ".lock").open("w") as lock:
        _lock(lock.fileno(), is_exclusive=False)
        try:
            yield ReleaseCache(place)
        finally:
            if _lock(lock.fileno(), is_exclusive=True):
                ReleaseCache(place).prune(most_bytes)


def _lock(file: int, *, is_exclusive: bool) -> bool:
    """Try to acquire the exclusive or the shared lock. Return whether the lock was acquired."""
    try:
        import fcntl
    except ImportError:  # not a POSIX system, so other processes can't be detected
        return not is_exclusive
    try:
        fcntl.flock(file, (fcntl.LOCK_EX | fcntl.LOCK_NB) if is_exclusive else fcntl.LOCK_SH)
    except OSError:
        return False
    return True
