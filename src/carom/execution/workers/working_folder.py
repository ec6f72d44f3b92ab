"""Temporary folders in which worker processes run.

A folder's owner, the process that created the folder, removes the folder.

If the owner is killed, the next start of Carom removes the folder.
"""

from __future__ import annotations

import os
import shutil
import stat
import tempfile
from contextlib import suppress
from functools import cache
from itertools import count
from pathlib import Path

PREFIX = "carom-worker-"

#: Name of the lock file in each folder. The folder's owner holds the lock as long as the owner runs. Folders of other
#: programs contain no lock file.
LOCK = "carom.lock"
WORK = "work"


class Folder:
    """A new, empty working folder for a worker process.

    Attributes:
        path: Path of the folder.
    """

    def __init__(self) -> None:
        import fcntl  # fcntl is missing on systems without worker processes

        _clear_abandoned()
        self._root = Path(tempfile.mkdtemp(prefix=PREFIX))
        self.path = self._root / WORK
        self.path.mkdir()
        # The file is renamed to `LOCK` only after it is locked. If another process found the file unlocked, it would
        # remove the folder as abandoned.
        self._lock = os.open(self._root / f"{LOCK}.new", os.O_CREAT | os.O_RDWR, 0o600)
        fcntl.flock(self._lock, fcntl.LOCK_EX)
        os.rename(self._root / f"{LOCK}.new", self._root / LOCK)

    def close(self) -> None:
        """Remove the folder and its content."""
        _remove(self._root)
        os.close(self._lock)


@cache
def _clear_abandoned() -> None:
    """Remove folders whose owners were killed. This function runs once per process."""
    import fcntl

    for root in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
        with suppress(OSError):  # the folder belongs to another user, or is already removed
            lock = os.open(root / LOCK, os.O_RDWR | os.O_NOFOLLOW)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                _remove(root)
            finally:
                os.close(lock)


def _remove(root: Path) -> None:
    """Remove a folder. The lock file is removed last, so that a partly removed folder is found again.

    Subfolders are moved up into the folder before they are emptied, so that folders of any depth can be removed. Links
    are not followed.
    """
    try:
        top = os.open(root, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    except OSError:  # an engine may have removed or replaced the folder
        return
    try:
        todo = [name for name in os.listdir(top) if not name.startswith(LOCK)]
        used = set(todo)  # an interrupted removal may have left folders with numbers as names
        free_names = (str(number) for number in count() if str(number) not in used)
        while todo:
            name = todo.pop()
            with suppress(OSError):
                if not _is_folder(name, top):
                    os.unlink(name, dir_fd=top)
                    continue
                folder = os.open(name, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW, dir_fd=top)
                try:
                    for entry in os.listdir(folder):
                        if _is_folder(entry, folder):
                            free_name = next(free_names)
                            os.rename(entry, free_name, src_dir_fd=folder, dst_dir_fd=top)
                            todo.append(free_name)
                        else:
                            os.unlink(entry, dir_fd=folder)
                finally:
                    os.close(folder)
                os.rmdir(name, dir_fd=top)
    finally:
        os.close(top)
    if all(name.startswith(LOCK) for name in os.listdir(root)):
        shutil.rmtree(root, ignore_errors=True)


def _is_folder(name: str, parent: int) -> bool:
    """Whether the entry `name` is a folder, not a link.

    If an engine has locked the folder, make the folder accessible.
    """
    is_folder = stat.S_ISDIR(os.stat(name, dir_fd=parent, follow_symlinks=False).st_mode)
    if is_folder:
        os.chmod(name, 0o700, dir_fd=parent)
    return is_folder
