"""Document and JSON file of `carom stress`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from urllib.parse import quote

from carom.execution.job import Method, Status
from carom.report.document import Block, Cell, Column, Document, Legend, Lines, Media, Section, Table, Text
from carom.report.files import fields_of, format_json
from carom.report.provenance import build_provenance, format_command
from carom.report.render.html import render_html
from carom.report.render.markdown import render_markdown
from carom.studies.stress.result import CellEnding, CellResult, StressResults, StressRow
from carom.support import formatting
from carom.support.folders import write_files

#: Names of the kinds of tests in documents. Each key is the name of the kind in files and on the command line.
WORDS = {"attack": "stress test", "relation": "invariance", "complaint": "reported bug"}

HEADINGS = {"attack": "Where each method fails", "relation": "Invariances", "complaint": "Scenes of reported bugs"}

NOTES = {
    "attack": "A cell shows the value at which a method first fails, starting from the harmless end of the range. If "
    "the method passes the whole range, the cell shows 'to' and the last value. The second line of a cell shows the "
    "error at the last value at which the method passed. The bar shows the passed part of the range, in decades.",
    "relation": "A cell shows how much the changed scene's result differs from the expected result. Differences "
    "are divided by the largest radius or the greatest speed; 0 means that the results are bit-identical.",
    "complaint": "'seen' marks a method that still has the reported bug. The number shows how much the method's "
    "result deviates from the known answer.",
}

#: Largest number of methods for which the summary has a sentence for each method. For more methods, the summary is a
#: ranking.
SENTENCES = 4

HEAT = (
    "Each character is one test, the hardest first. '=' is a pass, '-' is a test that was not run, and a digit n is a "
    "failure after n tenths of the range."
)

#: Largest number of methods that a sentence names. If there are more methods, a sentence states only their number.
FEW = 3

#: Symbol and CSS class of a cell, and colours of the classes on a terminal.
_GOOD, _WAY, _BAD, _NOT = ("=", "exact"), ("~", "inaccurate"), ("x", "wrong"), ("-", "not-scored")
_STYLES = {"exact": "green", "inaccurate": "yellow", "wrong": "red", "not-scored": "dim"}
_SHOWN = {
    **dict.fromkeys((CellEnding.PASSES, CellEnding.HOLDS, CellEnding.NOT_SEEN), _GOOD),
    **dict.fromkeys((CellEnding.FAILS_AT_START, CellEnding.VIOLATED, CellEnding.SEEN), _BAD),
    CellEnding.FAILS_AT_SIZE: _WAY,
    CellEnding.NOT_RUN: _NOT,
}
#: Column headings in the table of methods, each with the outcome that is counted in this column, in the order of
#: `HEADINGS`.
_COUNTED = (("passed", CellEnding.PASSES), ("hold", CellEnding.HOLDS), ("seen", CellEnding.SEEN))
_MEANINGS = (
    (_GOOD, "passes", "passes the whole range, or keeps the invariance, or does not have the bug"),
    (_WAY, "fails at", "passes the harmless end, and fails at the shown value"),
    (_BAD, "fails", "fails at the harmless end, or violates the invariance, or has the bug"),
    (_NOT, "not run", "the method is unavailable, or does not support the scene"),
)


def write_stress(results: StressResults, document: Document, folder: Path) -> Path:
    """Write `stress.html`, `stress.md` and `stress.json` into a folder, and return the path of the page.

    Raises:
        MissingExtraError: jinja2 is not installed.
        InputError: The folder is not writable, or contains files that Carom did not write.
    """
    pages = {"stress.html": render_html(document), "stress.md": render_markdown(document)}
    return write_files(folder, "stress", pages | {"stress.json": _format_json(results)})


def build_stress_document(results: StressResults) -> Document:
    """Return a document with the results by method, a table for each kind of test, and details of each result."""
    kinds = {kind: _sort_worst_first(results, [one for one in results.rows if one.kind == kind]) for kind in HEADINGS}
    sections = (
        Section("Results by method", tuple(_build_method_blocks(results, kinds))),
        *(section for kind, rows in kinds.items() if rows for section in _build_kind_sections(results, kind, rows)),
        *build_provenance(results.environment, results.command, results.elapsed_s),
    )
    return Document("Carom: stress", tuple(_describe_results(results, kinds)), sections)


def _sort_worst_first(results: StressResults, rows: list[StressRow]) -> list[StressRow]:
    """Sort stress tests by the average fraction of the range that methods pass, smallest first.

    Invariances and reported bugs keep their order.
    """

    def compute_passed_part(row: StressRow) -> float:
        depths = [row.compute_depth(result) for _, result in _list_cells(results, row)]
        known = [depth for depth in depths if depth is not None]
        return sum(known) / len(known) if known else 1.0

    return sorted(rows, key=compute_passed_part)


def _build_method_blocks(results: StressResults, kinds: Mapping[str, list[StressRow]]) -> Iterator[Block]:
    """Yield a table with a heat map and the numbers of passed tests for each method, and texts about the methods."""
    stress_tests = kinds["attack"]
    columns = [Column("method", lambda method: method.label)]
    for group, tests in formatting.group_by((row.group, row) for row in stress_tests).items():
        columns.append(Column(group or WORDS["attack"], partial(_build_heat_cell, results, tests), f"of {len(tests)}"))
    only = Media.IN_FULL if stress_tests else Media.EVERYWHERE  # a terminal shows sentences instead of these columns
    for (head, ending), rows in zip(_COUNTED, kinds.values(), strict=True):
        if rows:
            count = partial(_format_count_of, results, rows, ending)
            columns.append(Column(head, count, f"of {len(rows)}", number=True, only=only))
    if stress_tests:
        columns.append(
            Column("fails first", lambda one: _find_first_failure(results, stress_tests, one)[1], only=Media.IN_FULL)
        )
    if stress_tests and len(results.methods) > SENTENCES:
        said = (_describe_method(results, stress_tests, method, short=True) for method in results.methods)
        yield Lines(tuple(said), Media.TERMINAL)
    yield Table(columns, results.methods, css="methods")
    if stress_tests:
        yield Text(HEAT, Media.TERMINAL | Media.DETAIL)
    marks = ((Cell(word, symbol=sign, css=css), meaning) for (sign, css), word, meaning in _MEANINGS)
    yield Legend(tuple(marks), Media.PAGE)


def _list_endings(results: StressResults, rows: list[StressRow], method: Method) -> list[CellEnding]:
    """Return the outcomes of all tests that ran with a method."""
    endings = [results.cells[row.name, method.name].ending for row in rows]
    return [ending for ending in endings if ending is not CellEnding.NOT_RUN]


def _format_count_of(results: StressResults, rows: list[StressRow], ending: CellEnding, method: Method) -> str:
    return str(_list_endings(results, rows, method).count(ending))


def _build_heat_cell(results: StressResults, rows: list[StressRow], method: Method) -> Cell:
    """Return a cell with the number of passed tests of a group.

    A terminal shows one character for each test instead of the number.
    """
    run_endings = _list_endings(results, rows, method)
    passed = run_endings.count(CellEnding.PASSES)
    _, css = _WAY if passed else _BAD
    if passed == len(run_endings):
        _, css = _GOOD if run_endings else _NOT
    signs = "".join(_format_sign(row, results.cells[row.name, method.name]) for row in rows)
    total_text = f" of {len(run_endings)}" if len(run_endings) < len(rows) else ""
    return Cell(f"{passed}{total_text}", short=signs, css=css, style=_STYLES[css], title=signs)


def _format_sign(row: StressRow, result: CellResult) -> str:
    """Return the character that shows a test's outcome: passed, not run, or failed after n tenths of the range."""
    depth = row.compute_depth(result)
    if depth is None:
        return _NOT[0]
    return _GOOD[0] if result.ending is CellEnding.PASSES else str(min(9, int(10 * depth)))


def _describe_method(results: StressResults, rows: list[StressRow], method: Method, *, short: bool = False) -> str:
    """Describe how many stress tests a method passes, and the test in which it fails earliest."""
    run_endings = _list_endings(results, rows, method)
    if not run_endings:
        return f"{method.phrase}: none of {formatting.format_count(len(rows), WORDS['attack'])} could be run."
    unrun = f" ({len(rows) - len(run_endings)} could not be run)" if len(run_endings) < len(rows) and not short else ""
    passes = f"{method.phrase} passes {run_endings.count(CellEnding.PASSES)} of {len(run_endings)}{unrun}"
    row, first = _find_first_failure(results, rows, method)
    if row is None:
        return f"{passes}."
    quantity = "" if short else f" ({row.axis.partition(', ')[0]})"
    return f"{passes}; it first fails in {first.text}{quantity}."


def _find_first_failure(results: StressResults, rows: list[StressRow], method: Method) -> tuple[StressRow | None, Cell]:
    """Return the failed test in which a method passes the smallest fraction of the range, and a cell that shows it."""
    cells = [(row, results.cells[row.name, method.name]) for row in rows]
    failed = [one for one in cells if one[1].ending not in {CellEnding.PASSES, CellEnding.NOT_RUN}]
    if not failed:
        return None, Cell("")
    row, result = min(failed, key=lambda one: one[0].compute_depth(one[1]) or 0.0)
    at = "" if result.ending is CellEnding.FAILS_AT_START else "at "
    text = f"{row.name} {at}{_format_result(result)}"
    return row, Cell(text, title=result.reason, link=f"#{_build_anchor(row, method)}")


def _build_kind_sections(results: StressResults, kind: str, rows: list[StressRow]) -> Iterator[Section]:
    """Yield a section with a table of all tests of one kind, and a section with details of each result."""
    columns = [
        Column(WORDS[kind], lambda row: Cell(row.name, title=row.axis)),
        # On a page, the varied quantity is shown with the details of each result.
        Column("axis", lambda row: row.axis, only=Media.MARKDOWN | Media.DETAIL),
        *(Column(method.engine, partial(_build_cell, results, method), method.profile) for method in results.methods),
    ]
    table = Table(columns, rows, note=NOTES[kind], css="grid", only=Media.IN_FULL)
    yield Section(
        HEADINGS[kind],
        (table, Text("A cell links to the details of the result: reason, scene and command.", Media.PAGE)),
    )
    why = tuple(reason for row in rows for reason in _list_reasons(results, row))
    yield Section(f"{HEADINGS[kind]}: reasons", (Lines(why, Media.DETAIL),), level=3)
    yield Section(f"{HEADINGS[kind]}: evidence", tuple(_build_evidence_table(results, row) for row in rows), level=3)


def _list_reasons(results: StressResults, row: StressRow) -> Iterator[str]:
    """Yield the reasons why methods failed a test, each with the methods."""
    found = formatting.group_by((result.reason, method.name) for method, result in _list_cells(results, row))
    return (f"{row.name}, {', '.join(names)}: {reason}" for reason, names in found.items() if reason)


def _build_evidence_table(results: StressResults, row: StressRow) -> Table:
    """Return a table with the details of a test for each method: the result, the scene and a command."""
    columns = (
        Column("method", lambda cell: Cell(cell[0].name, anchor=_build_anchor(row, cell[0]))),
        Column("result", lambda cell: Cell(cell[1].ending.value, symbol=_SHOWN[cell[1].ending][0])),
        Column("value", lambda cell: _format_number(cell[1].value), number=True),
        Column("passes up to", lambda cell: _format_number(cell[1].passes_until), number=True),
        Column("error at that value", lambda cell: _format_number(cell[1].error), number=True),
        Column("why", lambda cell: Cell(cell[1].reason, css="prose")),
        Column("scene", lambda cell: Cell(", ".join(cell[1].scenes), link=next(iter(cell[1].scenes), ""))),
        Column("command, in this folder", lambda cell: _format_command(*cell)),
    )
    thread = f" {row.link}" if row.link else ""
    return Table(
        columns,
        _list_cells(results, row),
        title=f"{row.name}: {row.axis}",
        note=f"{formatting.capitalise(row.failure_rule).rstrip('.')}. Exact answer: {row.truth}.{thread}",
        folded=f"{row.name}: {row.axis}",
        css="cells",
        only=Media.ON_PAPER,
    )


def _build_anchor(row: StressRow, method: Method) -> str:
    """Return the anchor of a result's details within the page."""
    return quote(f"{row.name}/{method.name}")


def _format_number(value: float | None) -> str:
    return "" if value is None else formatting.format_number(value, 4)


def _format_command(method: Method, result: CellResult) -> str:
    if not result.scenes or result.ending is CellEnding.NOT_RUN:
        return ""
    return format_command(("run", *result.scenes), method)


def _list_cells(results: StressResults, row: StressRow) -> list[tuple[Method, CellResult]]:
    return [(method, results.cells[row.name, method.name]) for method in results.methods]


def _format_result(result: CellResult) -> str:
    """Describe a result by a word or a number."""
    value = "" if result.value is None else formatting.format_number(result.value)
    match result.ending:
        case CellEnding.PASSES:
            return f"to {value}"
        case CellEnding.FAILS_AT_START if result.status in {Status.TIMED_OUT, Status.CRASHED}:
            return f"{result.status.value} at {value}"  # the engine failed, so the result is unknown
        case CellEnding.FAILS_AT_START:
            return f"from {value}"
        case CellEnding.NOT_RUN:
            return result.status.value
        case CellEnding.SEEN | CellEnding.NOT_SEEN:
            return f"{'seen' if result.ending is CellEnding.SEEN else 'not seen'} {value}".rstrip()
        case _:
            return value or result.reason.partition(":")[0]


def _build_cell(results: StressResults, method: Method, row: StressRow) -> Cell:
    result = results.cells[row.name, method.name]
    symbol, css = _SHOWN[result.ending]
    return Cell(
        _format_result(result),
        "" if result.error is None else formatting.format_number(result.error),
        title=result.reason,
        css=css,
        symbol=symbol,
        link=f"#{_build_anchor(row, method)}",
        part=row.compute_depth(result),
    )


def _describe_results(results: StressResults, kinds: Mapping[str, list[StressRow]]) -> Iterator[str]:
    test_counts = [formatting.format_count(len(rows), WORDS[kind]) for kind, rows in kinds.items() if rows]
    if kinds["attack"] and len(results.methods) <= SENTENCES:
        yield from (_describe_method(results, kinds["attack"], method) for method in results.methods)
    else:
        yield from _describe_ranking(results, "attack", kinds["attack"], CellEnding.PASSES)
    yield from _describe_ranking(results, "relation", kinds["relation"], CellEnding.HOLDS)
    if kinds["complaint"]:
        yield _describe_bug_reports(results, kinds["complaint"])
    methods, form = formatting.format_count(len(results.methods), "method"), "quick" if results.quick else "full"
    spent = formatting.format_seconds(results.elapsed_s)
    yield f"This {form} campaign ran {methods} on {formatting.join_words(test_counts)}, and took {spent}."


def _describe_ranking(results: StressResults, kind: str, rows: list[StressRow], good: CellEnding) -> Iterator[str]:
    """Yield a sentence on the best and the worst methods, and a sentence on methods that could not run every test."""
    endings = [(method.phrase, _list_endings(results, rows, method)) for method in results.methods]
    passed = formatting.group_by((ran.count(good), name) for name, ran in endings if ran and len(ran) == len(rows))
    partly = [
        f"{name} passed {ran.count(good)} of the {len(ran)} that it could run"
        for name, ran in endings
        if 0 < len(ran) < len(rows)
    ]
    if passed:
        most, fewest = max(passed), min(passed)
        each = "each " if len(passed[most]) > 1 else ""
        tests = formatting.format_count(len(rows), WORDS[kind])
        few = f"only {fewest}" if fewest else "none"
        worst = f"; {_name_methods(passed[fewest])} passed {few}" if fewest < most else ""
        yield f"{_name_methods(passed[most])} {each}passed {most} of {tests}{worst}."
    if partly and (kind != "attack" or len(partly) <= FEW):  # sentences about each method already have these numbers
        said = f": {formatting.join_words(partly)}" if len(partly) <= FEW else ""
        are = f"{formatting.format_count(len(partly), 'method')} {'is' if len(partly) == 1 else 'are'}"
        yield f"{are} not ranked, because not every {WORDS[kind]} could be run{said}."


def _name_methods(methods: list[str]) -> str:
    return formatting.join_words(methods) if len(methods) <= FEW else f"{len(methods)} methods"


def _describe_bug_reports(results: StressResults, bug_reports: list[StressRow]) -> str:
    """Describe how many reported bugs still occur in the engines that the reports are about."""
    endings = {
        row.name: {result.ending for method, result in _list_cells(results, row) if method.engine == row.about}
        for row in bug_reports
    }
    concerned = sum(bool(own_endings - {CellEnding.NOT_RUN}) for own_endings in endings.values())
    still_seen = [name for name, own_endings in endings.items() if CellEnding.SEEN in own_endings]
    names_text = f": {formatting.join_words(still_seen)}" if 0 < len(still_seen) <= FEW else ""
    count = formatting.format_count(len(bug_reports), WORDS["complaint"])
    concern, occur = ("concerns" if concerned == 1 else "concern"), ("occurs" if len(still_seen) == 1 else "occur")
    return f"{concerned} of {count} {concern} one of these engines, and {len(still_seen)} still {occur}{names_text}."


def _format_json(results: StressResults) -> str:
    infos = [(method, results.engines[method.engine]) for method in results.methods]
    methods = [{**fields_of(one), "version": info.version, "unavailable": info.unavailable} for one, info in infos]
    rows = [{**fields_of(row), "cells": [cell for _, cell in _list_cells(results, row)]} for row in results.rows]
    return format_json("stress", results, leave_out=("engines", "cells", "rows"), methods=methods, lines=rows)
