"""The file results.jsonl: every number of a cross-check as JSON lines, written and read.

The first line describes the machine, versions and command of all rows.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from carom.comparator import Score
from carom.errors import InputError
from carom.execution.results import Results, Row
from carom.report.files import FORMATS
from carom.report.record import RowLine, Summary
from carom.report.record_json import read_line, text_of
from carom.report.row_lines import line_of, summary_of
from carom.support.escaping import shortened, visible
from carom.support.limits import MOST_BYTES, MOST_VALUES, values_in


def records(results: Results) -> str:
    """Return one line of strict JSON for the whole run and one per row. A number that is not finite becomes null."""
    return "".join(f"{line}\n" for line in (text_of(summary_of(results)), *map(record, results.rows)))


def record(row: Row) -> str:
    """Return the line of a row, without line break."""
    line = dataclasses.replace(line_of(row), local=_local(row.score) if row.score else None)
    return text_of(line, spins=row.job.scene.arrays.turns)


_ASK = f"give the folder of a report, or a results.jsonl by `carom run --out` (format {FORMATS['results']})"


def read_records(path: Path) -> tuple[Summary, list[RowLine]]:
    """Read a file written by `records`: the summary, and the lines of the rows.

    Raises:
        InputError: The file can't be read, has another format, is incomplete, or has an invalid field.
    """
    head, rows = raw_records(path)
    return read_line(Summary, head, path, 1), [read_line(RowLine, row, path, k) for k, row in enumerate(rows, start=2)]


def raw_records(path: Path) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Read a file of results as plain JSON objects, without validation of their fields.

    Raises:
        InputError: The file can't be read, has another format, or is incomplete.
    """
    lines = list(_lines(path))
    head, rows = (lines[0], lines[1:]) if lines else ({}, [])
    found, wanted = head.get("format"), FORMATS["results"]
    if found != wanted or head.get("rows") != len(rows):
        said = visible(shortened(str(head.get("rows") if found == wanted else found)))
        what = f"has {len(rows)} of {said} rows" if found == wanted else f"is of format {said}"
        if found is None:
            raise InputError(f"{path} is no results.jsonl of a cross-check", hints=[_ASK])
        raise InputError(
            f"{path} {what}; this Carom reads complete files of format {wanted}: run the cross-check again, or "
            "use the version that wrote the file"
        )
    return head, rows


def _lines(path: Path) -> Iterator[dict[str, Any]]:
    most_bytes, most_values = MOST_BYTES[".jsonl"], MOST_VALUES[".jsonl"]
    try:
        with path.open("rb") as file:
            data = file.read(most_bytes + 1)
        if len(data) > most_bytes or values_in(data) > most_values:
            most = f"{most_bytes >> 20} MiB, or {most_values:,} values"
            raise InputError(f"{path} is larger than {most}, the limit for results", hints=[_ASK])
        texts = data.decode().split("\n")  # not splitlines: a name may contain other line separators
    except (OSError, UnicodeError) as error:
        raise InputError(f"{path} can't be read: {getattr(error, 'strerror', None) or error}", hints=[_ASK]) from None
    del data
    for number, text in enumerate(texts[:-1] if texts[-1] == "" else texts, start=1):
        try:
            line = json.loads(text)
        except (ValueError, RecursionError) as error:
            what = f"{path}, line {number}: invalid JSON ({shortened(str(error), 200)})"
            raise InputError(what, hints=[_ASK]) from None
        if not isinstance(line, dict):
            raise InputError(f"{path}, line {number}: not a JSON object", hints=[_ASK])
        yield line


def _local(score: Score) -> dict[str, int | float]:
    """Return the median and the largest of each local error. All impacts would make lines too long.

    Kinds that no impact has are omitted, such as spin errors if no disc spins.
    """
    local = score.local
    sampled = ("sampling_velocity", "solver_velocity", "sampling_spin", "solver_spin")
    kinds = ("velocity", "spin", "time_s", "restitution", "energy", *sampled)
    found = {
        **{f"{kind}_median": local.median(kind) for kind in kinds},
        **{f"{kind}_worst": local.worst(kind) for kind in kinds},
    }
    said = {name: value for name, value in found.items() if not math.isnan(value)}
    return {"scored": local.scored, "spurious": len(local.spurious), **said}
