"""Journals: one line of JSON for each thing that is finished, only ever appended to: nothing written is at risk.

Each append is one write of whole lines to a file opened for appending, and is on the disk before it returns. A process
killed in the middle can leave one torn line, the last; the next one to open the journal cuts it off. The first line
says what the journal is of. Floats are written as the shortest text that reads back as the same float, to the bit;
NaN and infinities are strings. Control characters are escapes, so that nothing but its end breaks a line.
"""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from types import MappingProxyType
from typing import Any, Generic, Protocol, TypeVar, runtime_checkable

from pydantic import ValidationError

from carom.errors import InputError
from carom.execution.codec import Codec
from carom.execution.job import Answer
from carom.execution.pool import Closeable
from carom.support.escaping import shortened, visible
from carom.support.limits import MOST_VALUES, values_in

#: Raised when a field changes its meaning or goes; a new field with a default does not raise it.
JOURNAL_FORMAT = 5

#: No line is longer: read, with what is made of it, it would take hundreds of megabytes. An entry that is larger is not
#: kept, and found anew after a resume.
LONGEST_LINE = 64 * 2**20
_REMOVE = "remove the line, or name another folder"
#: Read at a time, from the end backwards, in search of the end of a line.
_BLOCK = 2**20

K = TypeVar("K")
T = TypeVar("T")


@runtime_checkable
class PartialEntry(Protocol):
    """A value that several questions led to, and says whether an engine broke one of them off."""

    @property
    def cut_off(self) -> bool:
        """Whether another time there may be more of it."""


@dataclass(frozen=True)
class JournalEntry(Generic[K, T]):
    """What came of an ask: a line of a journal.

    Attributes:
        key: What tells it from the others; see `carom.execution.scheduler.TaskRequest`.
        answer: What was asked for, or why there is none.
    """

    key: K
    answer: Answer[T]

    @property
    def cut_off(self) -> bool:
        """Whether an engine, or its adapter, broke it off: another time it may not."""
        value = self.answer.value
        return self.answer.status.is_failure or (isinstance(value, PartialEntry) and value.cut_off)


class MemoryJournal(Generic[K, T]):
    """Entries, kept while this process lasts."""

    def __init__(self) -> None:
        self._entries: dict[K, JournalEntry[K, T]] = {}

    @property
    def entries(self) -> Mapping[K, JournalEntry[K, T]]:
        """Every entry that counts, by its key; where one stands there twice, the later one."""
        return MappingProxyType(self._entries)

    def add(self, entries: Iterable[JournalEntry[K, T]]) -> None:
        """Keep entries."""
        self._entries.update((entry.key, entry) for entry in entries)


class Journal(MemoryJournal[K, T], Closeable):
    """Entries in a file that is open for appending, by one process at a time; used as a context manager.

    Args:
        of: What it is a journal of, in words.
        kind: The type of its entries, whose key and value are what JSON can hold.
        path: The file; made where it does not exist, in a folder that does.
        stamp: What a run that continues from the journal must share with the one that began it.
        resume: Whether a journal that exists is continued; it is refused otherwise.
        retry: Whether it is continued, and what an engine broke off counts as not run.

    Raises:
        InputError: The file exists and neither `resume` nor `retry` is set, is no journal of this kind, stamp and
            format, or is being written by another process.
    """

    def __init__(
        self,
        of: str,
        kind: type[JournalEntry[K, T]],
        path: Path,
        stamp: Mapping[str, Any] = MappingProxyType({}),
        *,
        resume: bool = False,
        retry: bool = False,
    ) -> None:
        super().__init__()
        self.path = path
        self._codec = Codec[JournalEntry[K, T]](kind)
        self._file = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o644)
        try:
            _lock(self._file, path)  # first: what another process is writing now is no result to go on with
            if not (resume or retry) and os.fstat(self._file).st_size:
                hints = ["continue from them by --resume, or name another one"]
                raise InputError(f"{path} holds results already", hints=hints)
            found = self._read({"journal": of, "format": JOURNAL_FORMAT, **stamp})
        except BaseException:
            os.close(self._file)
            raise
        super().add(entry for entry in found if not (retry and entry.cut_off))

    def add(self, entries: Iterable[JournalEntry[K, T]]) -> None:
        """Write entries, all in one piece, and return when they are on the disk."""
        found = list(entries)
        lines = (visible(self._codec.dumps(entry).decode()).encode() for entry in found)
        self._append(line for line in lines if len(line) <= LONGEST_LINE)
        super().add(found)

    def close(self) -> None:
        """Close the file; the lock goes with it. A journal without an entry leaves nothing behind."""
        # Ctrl-C can come between a line and what is remembered of it: the file decides.
        if not self._entries:
            remove_unused(self.path)
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

    def _read(self, stamp: Mapping[str, Any]) -> list[JournalEntry[K, T]]:
        """Return what the file holds; in an empty one, write down what it is to be of."""
        stamp = json.loads(json.dumps(stamp))
        whole, size = _whole(self._file), os.fstat(self._file).st_size
        lines = _lines(self._file, whole)
        head = next(lines, b"")
        there = _parsed(head)
        if head and there != stamp:
            what = _difference(there, stamp) if isinstance(there, dict) else "its first line does not say what it is of"
            raise InputError(f"{self.path} is no journal of this work: {what}", hints=["name another folder"])
        found = []
        for number, line in enumerate(lines, start=2):
            if len(line) > LONGEST_LINE:
                limit = f"is longer than {LONGEST_LINE >> 20} MiB, which none of Carom's is"
                raise InputError(f"{self.path}, line {number} {limit}", hints=[_REMOVE])
            try:
                found.append(self._codec.loads(line))
            except ValidationError as error:
                first = error.errors()[0]
                where = ".".join(map(str, first["loc"][1:])) or "the line"
                what = f"{self.path}, line {number}: {shortened(where)}: {first['msg']}"
                raise InputError(what, hints=[_REMOVE]) from None
        if whole < size:  # a torn line goes only where all before it is sound
            os.ftruncate(self._file, whole)
        if not head:
            self._append([json.dumps(stamp).encode()])
        return found


def remove_unused(path: Path) -> None:
    """Remove a journal in which nothing stands but what it is of, where there is one."""
    if not path.exists():
        return
    with path.open("rb") as file:
        used = len([*islice(_lines(file.fileno(), os.fstat(file.fileno()).st_size), 2)]) > 1
    if not used:
        path.unlink()


def canonical(path: Path) -> list[bytes]:
    """Return the lines of a journal in an order that does not depend on which job was finished first.

    Two journals hold the same, to the bit, where these lists are equal.
    """
    with path.open("rb") as file:
        return sorted({*_lines(file.fileno(), _whole(file.fileno()))})


def _difference(there: Mapping[str, Any], here: Mapping[str, Any]) -> str:
    if there.get("format") != JOURNAL_FORMAT:
        of = f"it is of format {shortened(repr(there.get('format')))}, as another version of Carom wrote it"
        return f"{of}, and this one is {JOURNAL_FORMAT}"
    # A name that only one of the two has differs, though it be null.
    names = [name for name in {**here, **there} if (name in there, there.get(name)) != (name in here, here.get(name))]
    return "; ".join(
        f"its {shortened(visible(name))} is {shortened(visible(str(there.get(name, 'absent'))))}, and this one's "
        f"{shortened(visible(str(here.get(name, 'absent'))))}"
        for name in names
    )


def _parsed(line: bytes) -> Any:
    """Return what a line says; None where it is no JSON, or has more values than any line of Carom's."""
    try:
        return json.loads(line) if values_in(line) <= MOST_VALUES[".json"] else None
    except (ValueError, RecursionError):
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


def _whole(file: int) -> int:
    """Return where the last whole line ends; a last line that is no JSON is torn, too."""
    size = os.fstat(file).st_size
    end = _after_line_feed(file, size)
    begin = _after_line_feed(file, end - 1)
    while end and begin == end - 1:  # what is empty is no line
        end, begin = begin, _after_line_feed(file, begin - 1)
    # After a loss of power a file can end in zeros.
    return begin if begin < end and _parsed(_read(file, begin, min(end, begin + LONGEST_LINE))) is None else end


def _after_line_feed(file: int, end: int) -> int:
    """Return the place after the last line feed before `end`; 0 where there is none."""
    while end > 0:
        begin = max(0, end - _BLOCK)
        found = os.pread(file, end - begin, begin).rfind(b"\n")
        if found >= 0:
            return begin + found + 1
        end = begin
    return 0


def _lines(file: int, end: int) -> Iterator[bytes]:
    """Yield the lines up to `end` without their line feeds; of one that is too long no more than shows that it is."""
    with open(file, "rb", closefd=False) as stream:
        stream.seek(0)
        while (left := end - stream.tell()) > 0:
            line = stream.readline(min(left, LONGEST_LINE + 2))
            yield line.removesuffix(b"\n")


def _read(file: int, begin: int, end: int) -> bytes:
    return os.pread(file, end - begin, begin)
