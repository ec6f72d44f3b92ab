"""Report of a cross-check rebuilt from results.jsonl without running engines.

Positions and states are not in the records, so there are no replays, no pictures and no tables of impacts.
"""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import fields
from functools import partial

from carom.comparator import Errors
from carom.execution.job import Method
from carom.report import formatting
from carom.report.document import IN_FULL, ON_PAPER, PAGE, Cell, Column, Document, Headline, Lines, Section, Table, Text
from carom.report.grid import Mark, parse_mark
from carom.report.provenance import making
from carom.report.record import RowLine, Summary
from carom.studies.cross_check.tables import mark_cell

ABOUT = (
    "Drawn from results.jsonl, without running anything. Replays and pictures need the states of the runs, which it "
    "does not hold: the command that made it makes them."
)

_Kind = tuple[Method, Sequence[RowLine]]


def rebuild_document(summary: Summary, lines: Sequence[RowLine]) -> Document:
    """Build the document of a cross-check from its records."""
    methods = formatting.together((_method(line), line) for line in lines)
    coarse = [line for line in lines if line.refinement == 0]
    tally = Counter(map(_mark, coarse))
    counted = "; ".join(f"{tally[mark]} {mark.word}" for mark in Mark if tally[mark])
    of = f"{formatting.count(len(coarse), 'cell')} of {formatting.count(len({line.scene for line in lines}), 'scene')}"
    unrun = (line for line in lines if line.reason)
    reasons = dict.fromkeys(f"{_method(line).label}, {_mark(line).word}: {line.reason}" for line in unrun)
    return Document(
        "Carom cross-check, from its records",
        Headline(f"Of {of} at each scene's coarsest step: {counted}."),
        (
            Section("Every method at each scene's coarsest step", (_methods(list(methods.items())),)),
            Section("Every scene on every engine", (_grid(coarse, list(methods)),), only=IN_FULL, short="Every scene"),
            Section("Not scored, and why", (Lines(tuple(reasons)),) if reasons else (), level=3, only=IN_FULL),
            *making(summary.environment, summary.command, summary.elapsed_s),
            Section("What is not here", (Text(ABOUT, ON_PAPER - PAGE),), level=3),
            Section("Every cell, at every step", (_cells(lines),), only=PAGE),
        ),
        about=ABOUT,
    )


def _method(line: RowLine) -> Method:
    return Method(line.engine, line.profile, tuple(line.tried.items()))


def _mark(line: RowLine) -> Mark:
    return parse_mark(line.status, line.grade, line.float_bits)


def _methods(found: Sequence[_Kind]) -> Table:
    present = {_mark(line) for _, lines in found for line in lines if line.refinement == 0}
    columns = (
        Column("method", lambda item: item[0].label),
        *(Column(mark.word, partial(_count, mark), number=True) for mark in Mark if mark in present),
        Column("error / PIT's, median", _median_price, number=True),
    )
    return Table(columns, found)


def _count(mark: Mark, item: _Kind) -> str:
    return str(sum(_mark(line) is mark for line in item[1] if line.refinement == 0))


def _median_price(item: _Kind) -> str:
    paid = [float(line.price_paid) for line in item[1] if line.refinement == 0 and line.price_paid is not None]
    return formatting.number(statistics.median(paid), 3) if paid else formatting.ABSENT


def _grid(coarse: Sequence[RowLine], methods: Sequence[Method]) -> Table:
    cells = {(line.scene, _method(line)): line for line in coarse}

    def cell(method: Method, scene: str) -> Cell:
        line = cells.get((scene, method))
        if line is None:
            return mark_cell(Mark.ABSENT)
        mark = mark_cell(_mark(line))
        return Cell(mark.text, _figure(line), css=mark.css, symbol=mark.symbol, title="; ".join(_reasons(line)))

    columns = (
        Column("scene", str),
        *(Column(method.engine, partial(cell, method), method.profile_shown) for method in methods),
    )
    return Table(columns, list(dict.fromkeys(line.scene for line in coarse)), css="grid")


def _figure(line: RowLine) -> str:
    """Format the numbers of missed and invented impacts, else the velocity error."""
    if line.total is None:
        return ""
    counts = ((line.missed, "missed"), (line.spurious, "invented"))
    lost = ", ".join(f"{len(which)} {word}" for which, word in counts if which)
    return lost or formatting.number(line.total.velocity)


def _reasons(line: RowLine) -> Iterator[str]:
    if line.reason:
        yield line.reason
    yield from (f"{found.verdict.replace('_', ' ')} ({found.reason})" for found in line.verdicts)


def _cells(lines: Sequence[RowLine]) -> Table:
    columns = (
        Column("scene", lambda line: line.scene),
        Column("engine", lambda line: line.engine),
        Column("profile", lambda line: _method(line).profile_shown),
        Column("step", lambda line: formatting.step(line.dt_s)),
        Column("grade", lambda line: mark_cell(_mark(line))),
        *(Column(metric.metadata["name"], partial(_metric, metric.name)) for metric in fields(Errors)),
        Column("verdicts", lambda line: Cell("; ".join(_reasons(line)), css="prose")),
    )
    return Table(columns, lines, folded=formatting.count(len(lines), "cell"), css="cells", packed=True)


def _metric(name: str, line: RowLine) -> str:
    return formatting.ABSENT if line.total is None else formatting.number(getattr(line.total, name))
