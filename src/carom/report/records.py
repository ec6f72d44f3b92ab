"""The rows for other programs: every number as JSON lines, and JUnit XML, which continuous integration shows as tests.

The first of the JSON lines says what all rows were made on and by.
"""

from __future__ import annotations

import dataclasses
import json
import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from carom.comparator import Errors, Grade, LocalScore, Score, Verdict
from carom.comparator.consistency import Consistency
from carom.errors import InputError
from carom.limits import MOST_BYTES, MOST_VALUES, values_in
from carom.report import wording
from carom.report.files import FORMATS, fields_of, plain
from carom.report.grid import BROKEN, Mark, mark_of, reasons_of
from carom.runs.job import Method
from carom.runs.results import Results, Row, violates
from carom.text import shortened, visible

__all__ = ["OF_SPINS", "junit", "read_records", "record", "records"]

_SKIPPED = {Mark.UNSUPPORTED, Mark.UNAVAILABLE, Mark.UNGRADED, Mark.UNSCORED}

#: Of the parts of a score, what is of spins.
OF_SPINS = frozenset({"spin", "final_spin", "angular", "angular_excess", "arm"})

#: XML 1.0 can't hold these characters, not even escaped; an engine's message may well.
_FORBIDDEN = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def records(results: Results) -> str:
    """Return one line of strict JSON for the whole run, and one a row; a number that is not finite is null."""
    scored = [(row.job.scene.name, row.job.dt_s, row.score) for row in results.rows if row.score is not None]
    head = {
        "format": FORMATS["results"],
        "rows": len(results.rows),
        "environment": results.environment,
        "command": results.command,
        "elapsed_s": results.elapsed_s,
        "verdicts": {verdict.name.lower(): verdict.value for verdict in Verdict},
        "scenes": {name: _of_scene(score) for name, _, score in scored},
        "sampling": list({(name, dt_s): _of_pit(name, dt_s, score) for name, dt_s, score in scored}.values()),
    }
    return "".join(f"{_WRITE(plain(line))}\n" for line in (head, *map(_fields, results.rows)))


_WRITE = json.JSONEncoder(ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode


def record(row: Row) -> str:
    """Return the line of a row, without its end."""
    return _WRITE(plain(_fields(row)))


def _of_scene(score: Score) -> dict[str, object]:
    """What is the same for all rows of a scene."""
    names = ("expected", "horizon_s", "beyond_horizon")
    return {**{name: getattr(score, name) for name in names}, "scales": score.scales}


def _of_pit(scene: str, dt_s: float, score: Score) -> dict[str, object]:
    """What PIT's errors are at a step of a scene, which every row there is held against."""
    errors = dataclasses.asdict(score.sampling) if score.sampling else {}
    return {
        "scene": scene,
        "dt_s": dt_s,
        "missed": None if score.pit_missed is None else len(score.pit_missed),
        **errors,
    }


def read_records(path: Path) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return what `records` wrote: the head, and the rows.

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
    ask = f"give a report's folder, or the results.jsonl that `carom run --report` wrote (format {FORMATS['results']})"
    most_bytes, most_values = MOST_BYTES[".jsonl"], MOST_VALUES[".jsonl"]
    try:
        with path.open("rb") as file:
            data = file.read(most_bytes + 1)
        if len(data) > most_bytes or values_in(data) > most_values:
            most = f"{most_bytes >> 20} MiB, or {most_values:,} values"
            raise InputError(f"{path} is larger than {most}, the limit for results; {ask}")
        texts = data.decode().split("\n")  # a name may hold other signs that break lines
    except (OSError, UnicodeError) as error:
        raise InputError(f"{path} can't be read: {getattr(error, 'strerror', None) or error}; {ask}") from None
    del data
    for number, text in enumerate(texts[:-1] if texts[-1] == "" else texts, start=1):
        try:
            line = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise InputError(f"{path}, line {number}: no JSON ({shortened(str(error), 200)}); {ask}") from None
        if not isinstance(line, dict):
            raise InputError(f"{path}, line {number}: no JSON object; {ask}")
        yield line


def _fields(row: Row) -> dict[str, object]:
    job, score, trace = row.job, row.score, row.trace
    return {
        "scene": job.scene.name,
        "engine": job.engine,
        "profile": job.profile,
        "tried": dict(job.method.tried),
        "dt_s": job.dt_s,
        "refinement": job.refinement,
        "status": row.status,
        "reason": "; ".join(reasons_of(row)) if not mark_of(row).ran else "",
        "grade": row.grade,
        "verdicts": score.findings if score else (),
        "matched": len(score.errors) if score else None,
        **{name: getattr(score, name, None) for name in ("missed", "spurious", "undecided")},
        **{name: _of_scores(row, getattr(score, name, None)) for name in ("total", "against_pit")},
        "own_velocity": score.own_velocity if score else None,
        "price_paid": _paid(score.price_paid) if score else None,
        **{name: getattr(score, name, None) for name in ("float_bits", "equals_pit", "edits")},
        "local": _local(score) if score else None,
        "local_truth": _of_steps(score.local_truth) if score else None,
        "parted_s": score.parted_s if score else None,
        "pit_parted_s": score.pit_parted_s if score else None,
        "consistency": _of_scores(row, score.consistency) if score else None,
        "outcome_taken": _outcome(score) if score else None,
        "spread": row.spread,
        "counts": trace.counts if trace else None,
        "outcome": trace.outcome if trace else None,
        "notes": trace.notes if trace else (),
        "settings": trace.settings if trace else None,
        "timing": row.timing,
        "untimed": row.untimed,
        "time_ratio": row.time_ratio,
    }


def _of_scores(row: Row, part: Errors | Consistency | None) -> dict[str, object] | None:
    """Return the fields of a part of a score: those of spins only where discs turn."""
    if part is None:
        return None
    turns = row.job.scene.arrays.turns
    return {name: value for name, value in fields_of(part).items() if turns or name not in OF_SPINS}


def _paid(price: float) -> float | str:
    """A price that is infinite is one still, which JSON has no number for; a mass is written in the same way."""
    return "inf" if math.isinf(price) else price


def _local(score: Score) -> dict[str, object]:
    """Medians and largest of the local errors: one entry an impact would be too long a line.

    A kind of error that no impact has, of spins where nothing turns say, is left out.
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


def _of_steps(local: LocalScore | None) -> dict[str, object] | None:
    """Return the numbers of local truth, its grade with them."""
    return None if local is None else {**fields_of(local), "grade": local.grade}


def _outcome(score: Score) -> dict[str, object] | None:
    match = score.convention
    if match is None:
        return None
    return {
        "admissible": [outcome.how for outcome in match.outcomes],
        "nearest": match.nearest,
        "distance": match.distance,
        "matches": match.matches,
    }


def junit(results: Results, fail_on: Grade | None = Grade.INACCURATE) -> str:
    """Return one test case a cell, a suite for each engine and profile.

    A case fails where its grade is `fail_on` or worse; None: no grade fails.
    """
    suites: dict[Method, list[Row]] = {}
    for row in results.rows:
        suites.setdefault(row.job.method, []).append(row)
    root = ET.Element("testsuites", {"name": "carom", **_counts(results.rows, fail_on)})
    for method, rows in suites.items():
        name = _clean(f"{method.engine} {method.profile_shown}")
        fields = {"name": name, "timestamp": results.environment.date, **_counts(rows, fail_on)}
        suite = ET.SubElement(root, "testsuite", fields)
        for row in rows:
            _case(suite, row, fail_on)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _kind(row: Row, fail_on: Grade | None) -> str:
    """Return what JUnit calls what came of a row; empty where it passes."""
    if fail_on is not None and violates(row, fail_on):
        return "failure"
    mark = mark_of(row)
    return "error" if mark in BROKEN else "skipped" if mark in _SKIPPED else ""


def _case(suite: ET.Element, row: Row, fail_on: Grade | None) -> None:
    mark, reasons = mark_of(row), reasons_of(row)
    case = ET.SubElement(
        suite,
        "testcase",
        classname=_clean(f"carom.{row.job.engine}.{row.job.method.profile_shown}"),
        name=_clean(f"{row.job.scene.name} at {wording.step(row.job.dt_s)}"),
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
