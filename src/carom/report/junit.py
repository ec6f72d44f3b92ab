"""The rows as JUnit XML, which continuous integration systems show as tests."""

from __future__ import annotations

import re
from collections.abc import Sequence
from xml.etree import ElementTree as ET

from carom.report import wording
from carom.report.grid import Column, is_own_method, reasons_of
from carom.report.marks import Mark, mark_of
from carom.runs.results import Results, Row

__all__ = ["junit"]

_FAILURES = {Mark.INACCURATE, Mark.WRONG}
_ERRORS = {Mark.CRASHED, Mark.TIMED_OUT, Mark.FAILED}
_SKIPPED = {Mark.UNSUPPORTED, Mark.UNAVAILABLE, Mark.UNGRADED, Mark.UNSCORED}

#: XML 1.0 can't hold these characters, not even escaped; an engine's message may well.
_FORBIDDEN = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def junit(results: Results) -> str:
    """Return one test case a cell, a suite for each engine and profile."""
    own = is_own_method(results)
    suites: dict[Column, list[Row]] = {}
    for row in results.rows:
        engine = row.job.engine
        suites.setdefault(Column(engine, row.job.profile, own.get(engine, False)), []).append(row)
    root = ET.Element("testsuites", {"name": "carom", **_counts(results.rows)})
    for column, rows in suites.items():
        suite = ET.SubElement(
            root,
            "testsuite",
            {
                "name": _clean(f"{column.engine} {column.profile}"),
                "timestamp": results.environment.date,
                **_counts(rows),
            },
        )
        for row in rows:
            _case(suite, column, row)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _case(suite: ET.Element, column: Column, row: Row) -> None:
    mark, reasons = mark_of(row), reasons_of(row)
    case = ET.SubElement(
        suite,
        "testcase",
        classname=_clean(f"carom.{column.engine}.{column.profile}"),
        name=_clean(f"{row.job.scene.name} at {wording.step(row.job.dt_s)}"),
        time=f"{_seconds(row):.6f}",
    )
    kind = "failure" if mark in _FAILURES else "error" if mark in _ERRORS else "skipped" if mark in _SKIPPED else ""
    if kind:
        found = ET.SubElement(case, kind, message=_clean(f"{mark.word}: {reasons[0]}"))
        if kind != "skipped":
            found.set("type", mark.word)
            found.text = _clean("\n".join(reasons))


def _counts(rows: Sequence[Row]) -> dict[str, str]:
    marks = [mark_of(row) for row in rows]
    return {
        "tests": str(len(rows)),
        "failures": str(sum(mark in _FAILURES for mark in marks)),
        "errors": str(sum(mark in _ERRORS for mark in marks)),
        "skipped": str(sum(mark in _SKIPPED for mark in marks)),
        "time": f"{sum(map(_seconds, rows)):.6f}",
    }


def _seconds(row: Row) -> float:
    return row.timing.prepare_s + row.timing.advance_s if row.timing else 0.0


def _clean(text: str) -> str:
    return _FORBIDDEN.sub("\N{REPLACEMENT CHARACTER}", text)
