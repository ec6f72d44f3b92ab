"""Journals: append-only files with one line of JSON per result. An interrupted study resumes from its journal.

Each append writes complete lines at once. A process that is killed loses no complete line, but can leave an incomplete
last line. An incomplete last line is removed when the journal is opened again. The first line identifies the study. A
float is written as the shortest text that reads back as the same float. NaN and infinities are written as strings.
Control characters are escaped, so that a line contains no line break.
"""

from __future__ import annotations

import errno
import json
import math
import os
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Generic, TypeVar

from pydantic import ValidationError

from carom.errors import InputError
from carom.execution.codec import Codec
from carom.execution.job import Answer, T
from carom.execution.pool import Closeable
from carom.support.escaping import escape_controls, shorten
from carom.support.limits import MOST_VALUES, count_values

#: Version of the format. The version increases when a field is removed or changes its meaning, but not when a field is
#: added.
JOURNAL_FORMAT = 7

#: Longest line, in bytes. Reading a longer line would take hundreds of megabytes of memory. A result that needs a
#: longer line is not stored, and a resumed study computes the result again.
LONGEST_LINE = 64 * 2**20

#: A line that is written is flushed to the disk if the last flush was at least this many seconds ago. A flush can take
#: as long as a run. A power failure loses the lines that were not flushed; the end of a process loses none.
FLUSH_PERIOD_S = 1.0
_REMOVE = "remove the line, or name another folder"

K = TypeVar("K")


@dataclass(frozen=True)
class JournalEntry(Generic[K, T]):
    """One line of a journal: the answer to a task request.

    Attributes:
        key: Key of the request; see `carom.execution.scheduler.TaskRequest`.
        answer: The answer of the task.
    """

    key: K
    answer: Answer[T]

    @property
    def cut_off(self) -> bool:
        """Whether the engine or its adapter failed, so that a second attempt may succeed.

        A value that needed several tasks has its own attribute `cut_off`: whether one of these tasks failed.
        """
        return self.answer.status.is_failure or bool(getattr(self.answer.value, "cut_off", False))


class MemoryJournal(Generic[K, T]):
    """Journal that stores its entries in memory only, not in a file."""

    def __init__(self) -> None:
        self._entries: dict[K, JournalEntry[K, T]] = {}

    @property
    def entries(self) -> Mapping[K, JournalEntry[K, T]]:
        """All entries by key. A later entry replaces an earlier entry with the same key."""
        return MappingProxyType(self._entries)

    def add(self, entries: Iterable[JournalEntry[K, T]]) -> None:
        """Add entries."""
        self._entries.update((entry.key, entry) for entry in entries)


class Journal(MemoryJournal[K, T], Closeable):
    """Journal in a file. Only one process at a time can open the file. Use the journal in a ``with`` statement.

    Args:
        study: Name of the content, such as "scores". The file's first line contains this name.
        kind: Type of the entries. Keys and values of entries must be convertible to JSON.
        path: The file, in an existing folder. The file is created if it does not exist.
        stamp: Options that affect the results. A journal can be continued only if its first line contains the same
            options.
        resume: Whether to continue an existing journal. If false, an existing journal is an error.
        retry: Whether to continue an existing journal, and to repeat the tasks in which an engine failed.

    Raises:
        InputError: The file exists, and neither `resume` nor `retry` is set. The file has another content, stamp or
            format. Another process is writing the file.
    """

    def __init__(
        self,
        study: str,
        kind: type[JournalEntry[K, T]],
        path: Path,
        stamp: Mapping[str, Any] = MappingProxyType({}),
        *,
        resume: bool = False,
        retry: bool = False,
    ) -> None:
        super().__init__()
        self.path = path
        self._flushed_s = -math.inf
        self._codec = Codec[JournalEntry[K, T]](kind)
        self._file = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o644)
        try:
            _lock(self._file, path)  # the lock comes first, so that no entry is read while another process writes
            if not (resume or retry) and os.fstat(self._file).st_size:
                hint = "continue with --resume, or name another folder"
                raise InputError(f"{path} already contains results", hints=[hint])
            stored = self._read({"journal": study, "format": JOURNAL_FORMAT, **stamp})
        except BaseException:
            os.close(self._file)
            raise
        super().add(entry for entry in stored if not (retry and entry.cut_off))

    def add(self, entries: Iterable[JournalEntry[K, T]]) -> None:
        """Write entries with a single system call."""
        added = list(entries)
        lines = (escape_controls(self._codec.dumps(entry).decode()).encode() for entry in added)
        self._append(line for line in lines if len(line) <= LONGEST_LINE)
        super().add(added)

    def close(self) -> None:
        """Close the file and release its lock. A journal without entries is removed."""
        # Ctrl-C can interrupt between the write and the update of `_entries`, so the file itself is checked.
        if not self._entries:
            remove_unused(self.path)
        os.close(self._file)

    def _append(self, lines: Iterable[bytes]) -> None:
        data = b"".join(line + b"\n" for line in lines)
        if os.write(self._file, data) != len(data):  # the disk is full; the next start removes the incomplete line
            raise OSError(errno.ENOSPC, "no space left for results", str(self.path))
        if time.monotonic() - self._flushed_s >= FLUSH_PERIOD_S:
            os.fsync(self._file)
            self._flushed_s = time.monotonic()

    def _read(self, stamp: Mapping[str, Any]) -> list[JournalEntry[K, T]]:
        """Return the entries of the file. Write the first line into an empty file."""
        stamp = json.loads(json.dumps(stamp))
        lines = _read_lines(self._file)
        head = next(lines, b"")
        stored = _parse_line(head)
        if head and stored != stamp:
            problem = "its first line does not state what the file contains"
            problem = _describe_difference(stored, stamp) if isinstance(stored, dict) else problem
            raise InputError(f"{self.path} is not a journal of this work: {problem}", hints=["name another folder"])
        found, end = [], len(head)
        for number, line in enumerate(lines, start=2):
            if len(line) > LONGEST_LINE + 1:  # the limit does not include the line feed
                problem = f"is longer than {LONGEST_LINE >> 20} MiB, the limit of Carom's lines"
                raise InputError(f"{self.path}, line {number} {problem}", hints=[_REMOVE])
            try:
                found.append(self._codec.loads(line))
            except ValidationError as error:
                first = error.errors()[0]
                field = ".".join(map(str, first["loc"][1:])) or "the line"
                problem = f"{self.path}, line {number}: {shorten(field)}: {first['msg']}"
                raise InputError(problem, hints=[_REMOVE]) from None
            end += len(line)
        if end < os.fstat(self._file).st_size:  # remove an incomplete line after all lines before it are validated
            os.ftruncate(self._file, end)
        if not head:
            self._append([json.dumps(stamp).encode()])
        return found


def remove_unused(path: Path) -> None:
    """Remove the journal at a path if it contains only its first line."""
    if not path.exists():
        return
    with path.open("rb") as file:
        file.readline(LONGEST_LINE)
        is_used = file.read(1) != b""
    if not is_used:
        path.unlink()


def _describe_difference(stored: Mapping[str, Any], stamp: Mapping[str, Any]) -> str:
    if stored.get("format") != JOURNAL_FORMAT:
        format_note = f"it has the format {shorten(repr(stored.get('format')))} of another version of Carom"
        return f"{format_note}, and this version uses {JOURNAL_FORMAT}"

    def show(value: object) -> str:
        return shorten(escape_controls(str(value)))

    # An option that is missing in one of the two stamps is a difference, even if its value is null.
    common = stored.keys() & stamp.keys()
    names = [name for name in {**stamp, **stored} if name not in common or stored[name] != stamp[name]]
    options = [map(show, (name, stored.get(name, "absent"), stamp.get(name, "absent"))) for name in names]
    return "; ".join(f"its {name} is {found}, but this study's is {own}" for name, found, own in options)


def _parse_line(line: bytes) -> Any:
    """Return the JSON value of a line; None if the line is not JSON, or contains more values than Carom ever writes."""
    try:
        return json.loads(line) if count_values(line) <= MOST_VALUES[".json"] else None
    except (ValueError, RecursionError):
        return None


def _lock(file: int, path: Path) -> None:
    try:
        import fcntl
    except ImportError:  # systems other than POSIX have no lock
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)  # the system releases the lock however the process ends
    except OSError:
        problem = "is being written by another process; end that process first, or name another folder"
        raise InputError(f"{path} {problem}") from None


def _read_lines(file: int) -> Iterator[bytes]:
    """Yield the lines of a file, except an incomplete last line: one without line feed, or one that is not JSON.

    After a power failure a file can end in zeros. If a line is longer than `LONGEST_LINE`, only its beginning is
    yielded. The yielded beginning is also longer than `LONGEST_LINE`, so callers can detect it.
    """
    previous = b""
    with open(file, "rb", closefd=False) as stream:
        while line := stream.readline(LONGEST_LINE + 2):
            if previous:
                yield previous
            previous = line
    if previous.endswith(b"\n") and _parse_line(previous) is not None:
        yield previous
