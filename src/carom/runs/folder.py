"""Working folders of worker processes, removed when their owner ends, or at the next start where it was killed."""

from __future__ import annotations

import os
import shutil
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path

__all__ = ["Folder"]

PREFIX = "carom-worker-"

#: Held locked by the owner as long as it lives, and only Carom's folders have one.
LOCK = "carom.lock"
WORK = "work"


class Folder:
    """An empty folder for a worker process.

    Attributes:
        path: Where it is.
    """

    def __init__(self) -> None:
        import fcntl  # where there is none, there are no workers

        _clear_abandoned()
        self._root = Path(tempfile.mkdtemp(prefix=PREFIX))
        self.path = self._root / WORK
        self.path.mkdir()
        # It has its name only when it is locked, so that nobody finds it abandoned before.
        self._lock = os.open(self._root / f"{LOCK}.new", os.O_CREAT | os.O_RDWR, 0o600)
        fcntl.flock(self._lock, fcntl.LOCK_EX)
        os.rename(self._root / f"{LOCK}.new", self._root / LOCK)

    def close(self) -> None:
        """Remove the folder with all that lies in it."""
        _remove(self._root)
        os.close(self._lock)


@cache
def _clear_abandoned() -> None:
    """Remove, once a process, the folders whose owners were killed."""
    import fcntl

    for root in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
        with suppress(OSError):  # another's, or removed meanwhile
            lock = os.open(root / LOCK, os.O_RDWR | os.O_NOFOLLOW)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                _remove(root)
            finally:
                os.close(lock)


def _remove(root: Path) -> None:
    """Remove a folder; its lock goes last, so that what could not be removed is found again."""
    with suppress(RecursionError):  # folders in folders beyond what Python goes down to
        for where, folders, _ in os.walk(root):
            for folder in (os.path.join(where, name) for name in folders):
                if not os.path.islink(folder):
                    os.chmod(folder, 0o700)  # an engine can have forbidden to list it
        shutil.rmtree(root / WORK, ignore_errors=True)
    if not (root / WORK).exists():
        shutil.rmtree(root, ignore_errors=True)
