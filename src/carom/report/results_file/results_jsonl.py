"""Writer and reader of results.jsonl, which contains every number of a cross-check as JSON lines.

The first line contains the machine, the versions and the command, which are the same for all runs.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from carom.comparator import Score
from carom.errors import InputError
from carom.execution.results import Results, Row
from carom.report.files import FORMATS
from carom.report.results_file.line_codec import format_line, read_line
from carom.report.results_file.lines import RowLine, Summary, build_line, build_summary
from carom.support.escaping import escape_controls, shorten
from carom.support.limits import MOST_BYTES, MOST_VALUES, count_values


def format_records(results: Results) -> str:
    """Return a line of strict JSON for the whole cross-check, and a line for each run.

    A number that is not finite becomes null.
    """
    return "".join(f"{line}\n" for line in (format_line(build_summary(results)), *map(format_record, results.rows)))


def format_record(row: Row) -> str:
    """Return the line of a run, without a line break."""
    line = dataclasses.replace(build_line(row), local=_summarise_local_errors(row.score) if row.score else None)
    return format_line(line, spins=row.job.scene.arrays.turns)


def read_records(path: Path) -> tuple[Summary, list[RowLine]]:
    """Read a file that `format_records` has written: its first line, and the lines of all runs.

    Raises:
        InputError: The file can't be read, has another format, is incomplete, or has an invalid field.
    """
    summary, rows = stream_records(path)
    return summary, list(rows)


def stream_records(path: Path) -> tuple[Summary, Iterator[RowLine]]:
    """Read a file that `format_records` has written, line by line, so that the file need not fit into memory.

    The iterator checks whether the number of lines is as stated in the first line.

    Raises:
        InputError: The file has one of the faults that the docstring of `read_records` lists. The iterator can also
            raise this error.
    """
    texts = _read_lines(path)
    first_line = next(texts, b"{}")
    head = _parse_head(path, first_line)

    def read_rows() -> Iterator[RowLine]:
        count = 0
        for count, text in enumerate(texts, start=1):
            try:
                row = read_line(RowLine, text, path, count + 1)
            except InputError:
                _require_whole(path, head, count + sum(1 for _ in texts))
                raise
            yield row
        _require_whole(path, head, count)

    return read_line(Summary, first_line, path, 1), read_rows()


_WANTED = FORMATS["results"]
#: Formats that Carom reads. Format 2 has other words for diverged runs.
_READABLE = (2, _WANTED)
_READS = (
    f"; this Carom reads complete files of formats {' and '.join(map(str, _READABLE))}: run the cross-check again, or "
    "use the version that wrote the file"
)
_ASK = f"give the folder of a report, or a results.jsonl that `carom run --out` wrote (format {_WANTED})"


def _parse_head(path: Path, text: bytes) -> dict[str, Any]:
    """Return the first line. Raise an error if it is not the first line of a format that Carom reads."""
    try:
        head = json.loads(text)
    except UnicodeError as error:
        raise InputError(f"{path} can't be read: {error}", hints=[_ASK]) from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}, line 1: invalid JSON ({shorten(str(error), 200)})", hints=[_ASK]) from None
    if not isinstance(head, dict):
        raise InputError(f"{path}, line 1: not a JSON object", hints=[_ASK])
    if (found := head.get("format")) is None:
        raise InputError(f"{path} is not the results.jsonl of a cross-check", hints=[_ASK])
    if found not in _READABLE:
        raise InputError(f"{path} is of format {escape_controls(shorten(str(found)))}{_READS}")
    return head


def _require_whole(path: Path, head: Mapping[str, Any], rows: int) -> None:
    if (stated_rows := head.get("rows")) != rows:
        raise InputError(f"{path} has {rows} of {escape_controls(shorten(str(stated_rows)))} rows{_READS}")


def _read_lines(path: Path) -> Iterator[bytes]:
    """Yield the lines of a file. Raise an error if a line or the file exceeds its limit."""
    size = values = 0
    try:
        with path.open("rb") as file:
            number = 0
            while line := file.readline(MOST_BYTES[".json"] + 1):  # names may contain other line separators
                number, size, found = number + 1, size + len(line), count_values(line)
                values += found
                _require_limits(str(path), ".jsonl", size, values)
                _require_limits(f"{path}, line {number}", ".json", len(line), found)
                yield line.removesuffix(b"\n")
    except OSError as error:
        raise InputError(f"{path} can't be read: {error.strerror or error}", hints=[_ASK]) from None


def _require_limits(source: str, kind: str, size: int, values: int) -> None:
    if size > MOST_BYTES[kind] or values > MOST_VALUES[kind]:
        limit = f"{MOST_BYTES[kind] >> 20} MiB, or {MOST_VALUES[kind]:,} values"
        raise InputError(f"{source} is larger than the limit for results: {limit}", hints=[_ASK])


def _summarise_local_errors(score: Score) -> dict[str, int | float]:
    """Return the median and the largest error over all impacts, for each kind of error.

    A line with the errors of all impacts would be too long. A kind without any known error is omitted, for example
    spin errors if no disc spins.
    """
    local = score.local
    sampled = ("sampling_velocity", "solver_velocity", "sampling_spin", "solver_spin")
    kinds = ("velocity", "spin", "time_s", "restitution", "energy", *sampled)
    found = {
        **{f"{kind}_median": local.median(kind) for kind in kinds},
        **{f"{kind}_worst": local.worst(kind) for kind in kinds},
    }
    known_values = {name: value for name, value in found.items() if not math.isnan(value)}
    return {"scored": local.scored, "spurious": len(local.spurious), **known_values}
