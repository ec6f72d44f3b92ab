"""JUnit XML of a cross-check, for continuous integration."""

from __future__ import annotations

import re
from collections.abc import Sequence
from xml.etree import ElementTree as ET

from carom.comparator import Grade
from carom.execution.results import Results, Row, is_violation
from carom.report.outcome_marks import BROKEN, Mark, mark_of
from carom.report.results_file.lines import build_line, list_reasons
from carom.support import formatting

_SKIPPED = {Mark.UNSUPPORTED, Mark.UNAVAILABLE, Mark.UNGRADED, Mark.UNSCORED}

#: Characters that an engine's message may contain, but that are forbidden in XML 1.0, even as escapes.
_FORBIDDEN = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def render_junit(results: Results, fail_on: Grade | None = Grade.INACCURATE) -> str:
    """Return JUnit XML with a test case for each run, and a test suite for each engine and profile.

    A test case fails if the run's grade is `fail_on` or worse. If `fail_on` is None, no grade is a failure.
    """
    suites = formatting.group_by((row.job.method, row) for row in results.rows)
    root = ET.Element("testsuites", {"name": "carom", **_count_outcomes(results.rows, fail_on)})
    for method, rows in suites.items():
        name = _clean(method.name.replace("/", " ", 1))
        fields = {"name": name, "timestamp": results.environment.date, **_count_outcomes(rows, fail_on)}
        suite = ET.SubElement(root, "testsuite", fields)
        for row in rows:
            _add_case(suite, row, fail_on)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _classify_row(row: Row, fail_on: Grade | None) -> str:
    """Return the name of the JUnit element for the outcome of a run; an empty text if the test passes."""
    if fail_on is not None and is_violation(row, fail_on):
        return "failure"
    mark = mark_of(row)
    if mark in BROKEN:
        return "error"
    return "skipped" if mark in _SKIPPED else ""


def _add_case(suite: ET.Element, row: Row, fail_on: Grade | None) -> None:
    mark, reasons = mark_of(row), list_reasons(build_line(row))
    case = ET.SubElement(
        suite,
        "testcase",
        classname=_clean(f"carom.{row.job.method.name.replace('/', '.', 1)}"),
        name=_clean(f"{row.job.scene.name} at {formatting.format_step(row.job.dt_s)}"),
        time=f"{_compute_seconds(row):.6f}",
    )
    if kind := _classify_row(row, fail_on):
        found = ET.SubElement(case, kind, message=_clean(f"{mark.word}: {reasons[0]}"))
        if kind != "skipped":
            found.set("type", mark.word)
            found.text = _clean("\n".join(reasons))


def _count_outcomes(rows: Sequence[Row], fail_on: Grade | None) -> dict[str, str]:
    kinds = [_classify_row(row, fail_on) for row in rows]
    return {
        "tests": str(len(rows)),
        "failures": str(kinds.count("failure")),
        "errors": str(kinds.count("error")),
        "skipped": str(kinds.count("skipped")),
        "time": f"{sum(map(_compute_seconds, rows)):.6f}",
    }


def _compute_seconds(row: Row) -> float:
    return row.timing.prepare_s + row.timing.advance_s if row.timing else 0.0


def _clean(text: str) -> str:
    return _FORBIDDEN.sub("\N{REPLACEMENT CHARACTER}", text)
