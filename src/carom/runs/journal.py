"""The journal of a sweep: one line of JSON a finished cell, only ever appended to, so that nothing written is at risk.

Each append is one write of whole lines to a file opened for appending, and is on the disk before it returns. A process
killed in the middle can leave one torn line, the last; the next one to open the journal cuts it off. Floats are
written as the shortest text that reads back as the same float, to the bit; NaN is null, infinity the string "inf".
"""

from __future__ import annotations

import dataclasses
import errno
import json
import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType, TracebackType
from typing import Any, Self

from carom.errors import InputError
from carom.runs.cell_score import CellKey, CellResult, Measures
from carom.runs.results import Status

__all__ = ["FORMAT", "Journal", "LineFile", "canonical", "decode", "encode", "read_journal"]

#: Raised when a field changes its meaning or goes; a new field does not raise it.
FORMAT = 1

_FLOATS = frozenset(field.name for field in dataclasses.fields(Measures) if field.type == "float")


def encode(result: CellResult) -> str:
    """Return the line of a result, without its end."""
    key, measures = result.key, result.measures
    line: dict[str, object] = {
        "format": FORMAT,
        "scene": result.scene,
        "scene_sha256": key.scene_sha256,
        "engine": key.engine,
        "profile": key.profile,
        "dt_s": key.dt_s,
        "phase": key.phase,
        "versions": dict(key.versions),
        "status": result.status.name.lower(),
        "reason": result.reason,
    }
    for field in dataclasses.fields(Measures):
        line[field.name] = None if measures is None else _plain(getattr(measures, field.name))
    return json.dumps(line, ensure_ascii=False, allow_nan=False, separators=(",", ":"))


def decode(line: str) -> CellResult:
    """Return the result of a line.

    Raises:
        ValueError: The line is no JSON, or not a line of a journal of this format.
    """
    content = json.loads(line)
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise ValueError(f"not a line of a journal of format {FORMAT}")
    try:
        key = CellKey(
            content["scene_sha256"],
            content["engine"],
            content["profile"],
            float(content["dt_s"]),
            float(content["phase"]),
            tuple(sorted(content["versions"].items())),
        )
        status = Status[content["status"].upper()]
        values = {field.name: content[field.name] for field in dataclasses.fields(Measures)}
        measures = Measures(**{name: _value(name, value) for name, value in values.items()})
        return CellResult(key, content["scene"], status, content["reason"], measures if status is Status.RAN else None)
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"a field is missing or of the wrong kind: {error}") from error


def _plain(value: object) -> object:
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return value


def _value(name: str, value: Any) -> Any:
    if name not in _FLOATS:
        return value
    return math.nan if value is None else float(value)


class LineFile:
    """A file of JSON lines that is open for appending, by one process at a time; used as a context manager.

    Args:
        path: The file; made where it does not exist.
        resume: Whether a file that exists is gone on with; it is refused otherwise.

    Attributes:
        path: The file.
        found: The whole lines that it held when it was opened.

    Raises:
        InputError: The file exists and `resume` is not set, or another process writes to it.
    """

    def __init__(self, path: Path, *, resume: bool = False) -> None:
        self.path = path
        if not resume and path.exists() and path.stat().st_size:
            raise InputError(f"{path} holds results already: go on with them by --resume, or name another --out")
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o644)
        try:
            _lock(self._file, path)
            self.found = _cut_torn_line(self._file)
        except BaseException:
            os.close(self._file)
            raise

    def append(self, lines: Iterable[str]) -> None:
        """Write lines, all in one piece, and return when they are on the disk."""
        data = "".join(f"{line}\n" for line in lines).encode()
        written = os.write(self._file, data)
        if written != len(data):  # a full disk; what is torn is cut off at the next start
            raise OSError(errno.ENOSPC, "no space left for results", str(self.path))
        os.fsync(self._file)

    def close(self) -> None:
        """Close the file; the lock goes with it."""
        os.close(self._file)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class Journal(LineFile):
    """The journal of a sweep, open for appending.

    Raises:
        InputError: As for any `LineFile`; or a line that is not the last is no line of a journal.
    """

    def __init__(self, path: Path, *, resume: bool = False) -> None:
        super().__init__(path, resume=resume)
        try:
            self._results = {result.key: result for result in _decoded(self.found, path)}
        except BaseException:
            self.close()
            raise

    @property
    def results(self) -> Mapping[CellKey, CellResult]:
        """Every result in the journal, by its key; where a cell stands there twice, the later one."""
        return MappingProxyType(self._results)

    def add(self, results: Sequence[CellResult]) -> None:
        """Write results, all in one piece, and return when they are on the disk."""
        self.append(encode(result) for result in results)
        self._results.update((result.key, result) for result in results)


def read_journal(path: Path) -> list[CellResult]:
    """Return the results of a journal, in the order in which they were finished, a torn last line left out.

    Raises:
        InputError: A line that is not the last is no line of a journal.
    """
    return list(_decoded(_whole_lines(path.read_bytes()), path))


def canonical(path: Path) -> list[str]:
    """Return the content of a journal in an order that does not depend on which cell was finished first.

    Two journals hold the same results, to the bit, where these lists are equal.
    """
    return sorted({result.key: encode(result) for result in read_journal(path)}.values())


def _lock(file: int, path: Path) -> None:
    try:
        import fcntl
    except ImportError:  # not a POSIX system: nothing keeps two processes apart there
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)  # let go of by the system when the process ends, however
    except OSError:
        raise InputError(
            f"{path} is being written by another process; end that one first, or name another --out"
        ) from None


def _cut_torn_line(file: int) -> bytes:
    data = b""
    while chunk := os.read(file, 1 << 20):
        data += chunk
    whole = _whole_lines(data)
    if len(whole) != len(data):
        os.ftruncate(file, len(whole))
        os.fsync(file)
    return whole


def _whole_lines(data: bytes) -> bytes:
    """Return the data up to the end of the last whole line; a last line that is no JSON is torn, too."""
    whole = data[: data.rfind(b"\n") + 1]
    last = whole.rstrip(b"\n").rpartition(b"\n")[2]
    if last:
        try:
            json.loads(last)
        except ValueError:  # after a loss of power a file can end in zeros
            return whole[: whole.rstrip(b"\n").rfind(b"\n") + 1]
    return whole


def _decoded(data: bytes, path: Path) -> Iterator[CellResult]:
    for number, line in enumerate(data.splitlines(), start=1):
        try:
            yield decode(line.decode())
        except ValueError as error:
            raise InputError(f"{path}, line {number}: {error}; remove the line, or name another --out") from None
