"""Journals: one line of JSON for each thing that is finished, only ever appended to: nothing written is at risk.

Each append is one write of whole lines to a file opened for appending, and is on the disk before it returns. A process
killed in the middle can leave one torn line, the last; the next one to open the journal cuts it off. The first line
says what the journal is of. Floats are written as the shortest text that reads back as the same float, to the bit;
NaN and infinities are strings.
"""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Callable, Hashable, Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Generic, TypeVar

from pydantic import ValidationError

from carom.errors import InputError
from carom.runs.pool import Closing
from carom.runs.wire import Codec

__all__ = ["Journal", "canonical"]

#: Raised when a field changes its meaning or goes; a new field with a default does not raise it.
JOURNAL_FORMAT = 3

T = TypeVar("T")


class Journal(Closing, Generic[T]):
    """A journal that is open for appending, by one process at a time; used as a context manager.

    Args:
        path: The file; made where it does not exist.
        kind: The type of an entry: a dataclass of what JSON can hold.
        key: What tells an entry from the others.
        stamp: What whoever goes on with the journal must share with who began it.
        resume: Whether a journal that exists is gone on with; it is refused otherwise.

    Raises:
        InputError: The file exists and `resume` is not set, is no journal of this kind, stamp and format, or is being
            written by another process.
    """

    def __init__(
        self,
        path: Path,
        kind: type[T],
        key: Callable[[T], Hashable],
        *,
        stamp: Mapping[str, Any] = MappingProxyType({}),
        resume: bool = False,
    ) -> None:
        self.path = path
        self._codec = Codec[T](kind)
        self._key = key
        if not resume and path.exists() and path.stat().st_size:
            raise InputError(f"{path} holds results already: go on with them by --resume, or name another folder")
        self._own_folder = not path.parent.exists()
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o644)
        try:
            _lock(self._file, path)
            self._entries = self._read({"journal": kind.__name__, "format": JOURNAL_FORMAT, **stamp})
        except BaseException:
            os.close(self._file)
            raise

    @property
    def entries(self) -> Mapping[Hashable, T]:
        """Every entry, by its key; where one stands there twice, the later one."""
        return MappingProxyType(self._entries)

    def add(self, entries: Iterable[T]) -> None:
        """Write entries, all in one piece, and return when they are on the disk."""
        found = list(entries)
        self._append(map(self._codec.dumps, found))
        self._entries.update((self._key(entry), entry) for entry in found)

    def close(self) -> None:
        """Close the file; the lock goes with it. A journal without an entry leaves nothing behind."""
        # Ctrl-C can come between a line and what is remembered of it: the file decides.
        if not self._entries and os.pread(self._file, os.fstat(self._file).st_size, 0).count(b"\n") <= 1:
            self.discard()
            if self._own_folder and not any(self.path.parent.iterdir()):
                self.path.parent.rmdir()
        os.close(self._file)

    def discard(self) -> None:
        """Remove the file: what it was kept for is finished and lies elsewhere."""
        self.path.unlink(missing_ok=True)

    def _append(self, lines: Iterable[bytes]) -> None:
        data = b"".join(line + b"\n" for line in lines)
        written = os.write(self._file, data)
        if written != len(data):  # a full disk; what is torn is cut off at the next start
            raise OSError(errno.ENOSPC, "no space left for results", str(self.path))
        os.fsync(self._file)

    def _read(self, stamp: Mapping[str, Any]) -> dict[Hashable, T]:
        """Return what the file holds; in an empty one, write down what it is to be of."""
        stamp = json.loads(json.dumps(stamp))
        data = self.path.read_bytes()
        whole = _whole_lines(data)
        head, *lines = whole.splitlines() or [b""]
        there = _parsed(head)
        if head and there != stamp:
            what = _difference(there, stamp) if isinstance(there, dict) else "its first line does not say what it is of"
            raise InputError(f"{self.path} is no journal of this work: {what}; name another folder")
        found: dict[Hashable, T] = {}
        for number, line in enumerate(lines, start=2):
            try:
                entry = self._codec.loads(line)
            except ValidationError as error:
                first = error.errors()[0]
                where = ".".join(map(str, first["loc"][1:])) or "the line"
                what = f"{self.path}, line {number}: {where}: {first['msg']}"
                raise InputError(f"{what}; remove the line, or name another folder") from None
            found[self._key(entry)] = entry
        if len(whole) < len(data):  # a torn line goes only where all before it is sound
            os.ftruncate(self._file, len(whole))
        if not head:
            self._append([json.dumps(stamp).encode()])
        return found


def canonical(path: Path) -> list[bytes]:
    """Return the lines of a journal in an order that does not depend on which job was finished first.

    Two journals hold the same, to the bit, where these lists are equal.
    """
    return sorted(set(_whole_lines(path.read_bytes()).splitlines()))


def _difference(there: Mapping[str, Any], here: Mapping[str, Any]) -> str:
    if there.get("format") != JOURNAL_FORMAT:
        of = f"it is of format {there.get('format')}, as another version of Carom wrote it"
        return f"{of}, and this one is {JOURNAL_FORMAT}"
    name = next(name for name in (*here, *there) if there.get(name) != here.get(name))
    return f"its {name} is {there.get(name)}, and this one's {here.get(name)}"


def _parsed(line: bytes) -> Any:
    """Return what a line says; None where it is no JSON."""
    try:
        return json.loads(line)
    except ValueError:
        return None


def _lock(file: int, path: Path) -> None:
    try:
        import fcntl
    except ImportError:  # not a POSIX system: nothing keeps two processes apart there
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)  # let go of by the system when the process ends, however
    except OSError:
        raise InputError(
            f"{path} is being written by another process; end that one first, or name another folder"
        ) from None


def _whole_lines(data: bytes) -> bytes:
    """Return the data up to the end of the last whole line; a last line that is no JSON is torn, too."""
    whole = data[: data.rfind(b"\n") + 1]
    last = whole.rstrip(b"\n").rpartition(b"\n")[2]
    if last and _parsed(last) is None:  # after a loss of power a file can end in zeros
        return whole[: whole.rstrip(b"\n").rfind(b"\n") + 1]
    return whole
