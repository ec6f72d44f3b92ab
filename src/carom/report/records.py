"""Results for other programs: every number as JSON lines, and JUnit XML for continuous integration.

The first of the JSON lines says what all rows were made on and by.
"""

from __future__ import annotations

import dataclasses
import json
import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Literal, cast
from xml.etree import ElementTree as ET

from carom.comparator import Grade, Score, Verdict
from carom.errors import InputError
from carom.execution.job import Method
from carom.execution.results import Results, Row, violates
from carom.report import formatting
from carom.report.files import FORMATS
from carom.report.grid import BROKEN, Mark, mark_of, reasons_of
from carom.report.record import RowLine, SceneLine, Summary, Taken, VerdictLine, read_line, text_of
from carom.support.escaping import shortened, visible
from carom.support.limits import MOST_BYTES, MOST_VALUES, values_in

_SKIPPED = {Mark.UNSUPPORTED, Mark.UNAVAILABLE, Mark.UNGRADED, Mark.UNSCORED}

#: Characters that XML 1.0 can't contain, not even escaped, but that an engine's message may contain.
_FORBIDDEN = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def records(results: Results) -> str:
    """Return one line of strict JSON for the whole run and one per row; a number that is not finite is null."""
    return "".join(f"{line}\n" for line in (text_of(_summary(results)), *map(record, results.rows)))


def record(row: Row) -> str:
    """Return the line of a row, without its end."""
    return text_of(_line(row), spins=row.job.scene.arrays.turns)


def _summary(results: Results) -> Summary:
    scored = [(row.job.scene.name, row.job.dt_s, row.score) for row in results.rows if row.score is not None]
    return Summary(
        format=FORMATS["results"],
        rows=len(results.rows),
        environment=results.environment,
        command=results.command,
        elapsed_s=results.elapsed_s,
        verdicts={verdict.name.lower(): verdict.value for verdict in Verdict},
        scenes={
            name: SceneLine(score.expected, score.horizon_s, score.beyond_horizon, score.scales)
            for name, _, score in scored
        },
        sampling=tuple({(name, dt_s): _of_pit(name, dt_s, score) for name, dt_s, score in scored}.values()),
    )


def _of_pit(scene: str, dt_s: float, score: Score) -> dict[str, str | int | float | None]:
    """Return PIT's errors at a step of a scene, with which all rows there are compared."""
    errors = dataclasses.asdict(score.sampling) if score.sampling else {}
    return {
        "scene": scene,
        "dt_s": dt_s,
        "missed": None if score.pit_missed is None else len(score.pit_missed),
        **errors,
    }


def read_records(path: Path) -> tuple[Summary, list[RowLine]]:
    """Read the text written by `records`: the summary, and the lines of the rows.

    Raises:
        InputError: The file can't be read, is of another format, not whole, or a field is not as declared.
    """
    head, rows = raw_records(path)
    return read_line(Summary, head, path, 1), [read_line(RowLine, row, path, k) for k, row in enumerate(rows, start=2)]


def raw_records(path: Path) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Read the same as plain JSON objects, without validation of their fields.

    Raises:
        InputError: The file can't be read, is of another format, or not whole.
    """
    lines = list(_lines(path))
    head, rows = (lines[0], lines[1:]) if lines else ({}, [])
    found, wanted = head.get("format"), FORMATS["results"]
    if found != wanted or head.get("rows") != len(rows):
        said = visible(shortened(str(head.get("rows") if found == wanted else found)))
        what = f"has {len(rows)} of {said} rows" if found == wanted else f"is of format {said}"
        raise InputError(
            f"{path} {what}; this Carom reads whole files of format {wanted}: run the cross-check again, or read it "
            "with the version that wrote it"
        )
    return head, rows


def _lines(path: Path) -> Iterator[dict[str, Any]]:
    ask = f"give a report's folder, or the results.jsonl that `carom run --out` wrote (format {FORMATS['results']})"
    most_bytes, most_values = MOST_BYTES[".jsonl"], MOST_VALUES[".jsonl"]
    try:
        with path.open("rb") as file:
            data = file.read(most_bytes + 1)
        if len(data) > most_bytes or values_in(data) > most_values:
            most = f"{most_bytes >> 20} MiB, or {most_values:,} values"
            raise InputError(f"{path} is larger than {most}, the limit for results", hints=[ask])
        texts = data.decode().split("\n")  # a name may hold other signs that break lines
    except (OSError, UnicodeError) as error:
        raise InputError(f"{path} can't be read: {getattr(error, 'strerror', None) or error}", hints=[ask]) from None
    del data
    for number, text in enumerate(texts[:-1] if texts[-1] == "" else texts, start=1):
        try:
            line = json.loads(text)
        except (ValueError, RecursionError) as error:
            what = f"{path}, line {number}: no JSON ({shortened(str(error), 200)})"
            raise InputError(what, hints=[ask]) from None
        if not isinstance(line, dict):
            raise InputError(f"{path}, line {number}: no JSON object", hints=[ask])
        yield line


#: Fields of a score that a line has unchanged, under the same names.
_OF_SCORE = (
    *("missed", "spurious", "undecided", "total", "against_pit", "own_velocity", "equals_pit", "edits"),
    *("local_truth", "parted_s", "pit_parted_s", "consistency"),
)


def _line(row: Row) -> RowLine:
    job, score, trace = row.job, row.score, row.trace
    told: dict[str, Any] = {name: getattr(score, name) if score else None for name in _OF_SCORE}
    return RowLine(
        scene=job.scene.name,
        engine=job.engine,
        profile=job.profile,
        tried=dict(job.method.tried),
        dt_s=job.dt_s,
        refinement=job.refinement,
        status=row.status,
        reason="; ".join(reasons_of(row)) if not mark_of(row).ran else "",
        grade=row.grade,
        verdicts=tuple(VerdictLine(one.verdict.name.lower(), one.reason) for one in score.findings) if score else (),
        matched=len(score.errors) if score else None,
        **told,
        price_paid=_paid(score.price_paid) if score else None,
        float_bits=cast("Literal[32, 64]", score.float_bits) if score else None,
        local=_local(score) if score else None,
        outcome_taken=_outcome(score) if score else None,
        spread=row.spread,
        counts=trace.counts if trace else None,
        outcome=trace.outcome if trace else None,
        notes=tuple(trace.notes) if trace else (),
        settings=trace.settings if trace else None,
        timing=row.timing,
        untimed=row.untimed,
        time_ratio=row.time_ratio,
    )


def _paid(price: float) -> float | Literal["inf"]:
    """Return a ratio, or the text ``inf`` for an infinite one, which JSON has no number for."""
    return "inf" if math.isinf(price) else price


def _local(score: Score) -> dict[str, int | float]:
    """Return medians and largest local errors: one entry per impact would make lines too long.

    A kind of error that no impact has, of spins, say, if no disc spins, is left out.
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


def _outcome(score: Score) -> Taken | None:
    match = score.convention
    if match is None:
        return None
    return Taken(tuple(outcome.how for outcome in match.outcomes), match.nearest, match.distance, match.matches)


def junit(results: Results, fail_on: Grade | None = Grade.INACCURATE) -> str:
    """Return one test case per cell, and one suite per engine and profile.

    A case fails where its grade is `fail_on` or worse; None: no grade fails.
    """
    suites: dict[Method, list[Row]] = {}
    for row in results.rows:
        suites.setdefault(row.job.method, []).append(row)
    root = ET.Element("testsuites", {"name": "carom", **_counts(results.rows, fail_on)})
    for method, rows in suites.items():
        name = _clean(method.name.replace("/", " ", 1))
        fields = {"name": name, "timestamp": results.environment.date, **_counts(rows, fail_on)}
        suite = ET.SubElement(root, "testsuite", fields)
        for row in rows:
            _case(suite, row, fail_on)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _kind(row: Row, fail_on: Grade | None) -> str:
    """Return JUnit's word for the outcome of a row; empty where it passes."""
    if fail_on is not None and violates(row, fail_on):
        return "failure"
    mark = mark_of(row)
    return "error" if mark in BROKEN else "skipped" if mark in _SKIPPED else ""


def _case(suite: ET.Element, row: Row, fail_on: Grade | None) -> None:
    mark, reasons = mark_of(row), reasons_of(row)
    case = ET.SubElement(
        suite,
        "testcase",
        classname=_clean(f"carom.{row.job.method.name.replace('/', '.', 1)}"),
        name=_clean(f"{row.job.scene.name} at {formatting.step(row.job.dt_s)}"),
        time=f"{_seconds(row):.6f}",
    )
    if kind := _kind(row, fail_on):
        found = ET.SubElement(case, kind, message=_clean(f"{mark.word}: {reasons[0]}"))
        if kind != "skipped":
            found.set("type", mark.word)
            found.text = _clean("\n".join(reasons))


def _counts(rows: Sequence[Row], fail_on: Grade | None) -> dict[str, str]:
    kinds = [_kind(row, fail_on) for row in rows]
    return {
        "tests": str(len(rows)),
        "failures": str(kinds.count("failure")),
        "errors": str(kinds.count("error")),
        "skipped": str(kinds.count("skipped")),
        "time": f"{sum(map(_seconds, rows)):.6f}",
    }


def _seconds(row: Row) -> float:
    return row.timing.prepare_s + row.timing.advance_s if row.timing else 0.0


def _clean(text: str) -> str:
    return _FORBIDDEN.sub("\N{REPLACEMENT CHARACTER}", text)
