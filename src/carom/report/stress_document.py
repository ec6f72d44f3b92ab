"""A stress campaign as a document, and as JSON."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from functools import partial
from pathlib import Path

from carom.folders import write_files
from carom.report import wording
from carom.report.document import ON_PAPER, PAGE, Cell, Column, Document, Lines, Section, Table, Text
from carom.report.files import as_json
from carom.report.made import making
from carom.report.render import html, markdown
from carom.runs.job import Method, Status
from carom.stress.spots import Line, Spot, SpotEnding, StressResults

__all__ = ["stress_document", "write_stress"]

HEADINGS = {
    "attack": "Where each method gives way",
    "relation": "Relations that need no truth",
    "complaint": "Scenes from real complaints",
}

NOTES = {
    "attack": "The size at which a method first gives way, from the harmless end of the axis on; 'to' marks a method "
    "that stands as far as the axis goes. Below it, the error where it was last seen to stand.",
    "relation": "How far a changed scene is from the changed answer, over the scene's own length or speed, the worse "
    "of the two; 0 is equal to the bit.",
    "complaint": "Whether a method today does what was reported; the figure is its deviation from the known answer.",
}

#: The sign of a cell, and the class of its colours.
_GOOD, _BAD = ("=", "exact"), ("x", "wrong")
_SHOWN = {
    SpotEnding.GIVES_WAY: ("~", "inaccurate"),
    SpotEnding.STANDS: _GOOD,
    SpotEnding.NEVER_STOOD: _BAD,
    SpotEnding.HOLDS: _GOOD,
    SpotEnding.FAILS: _BAD,
    SpotEnding.STILL_DOES: _BAD,
    SpotEnding.DOES_NOT: _GOOD,
    SpotEnding.NOT_RUN: ("-", "not-scored"),
}


def write_stress(results: StressResults, folder: Path) -> Path:
    """Write `stress.html`, `stress.md` and `stress.json` into a folder, in place of older ones; return the page.

    Raises:
        MissingExtraError: jinja2, of the extra `report`, is not installed.
        InputError: The folder can't be written into, or holds files of others.
    """
    document = stress_document(results)
    contents = {"stress.html": html(document), "stress.md": markdown(document), "stress.json": _json(results)}
    return write_files(folder, "stress", contents)


def stress_document(results: StressResults) -> Document:
    """Return a campaign: for each kind of line a table, and why its cells are as they are."""
    return Document(
        "Carom: stress",
        tuple(_summary(results)),
        (
            *(section for kind in HEADINGS for section in _group(results, kind, _of(results, kind))),
            *making(results.environment, results.command, results.elapsed_s),
        ),
    )


def _group(results: StressResults, kind: str, lines: list[Line]) -> Iterator[Section]:
    if not lines:
        return
    columns = [Column(kind, lambda line: line.name), Column("axis", lambda line: line.axis)]
    columns += [Column(method.engine, partial(_cell, results, method), method.profile) for method in results.methods]
    table = Table(columns, lines, note=NOTES[kind], css="grid")
    yield Section(HEADINGS[kind], (table, Text("A cell leads to the scene that shows its number: run it.", PAGE)))
    why = tuple(said for line in lines for said in _why(results, line))
    yield Section(f"{HEADINGS[kind]}: why", (Lines(why),), level=3)
    asked = tuple(said for line in lines for said in _asked(results, line))
    yield Section(f"{HEADINGS[kind]}: what is asked, and what is true", (Lines(asked, ON_PAPER),), level=3)


def _why(results: StressResults, line: Line) -> Iterator[str]:
    """Say why cells of a line are as they are: each reason with the methods that it holds for."""
    found: dict[str, list[str]] = {}
    for method, spot in _spots(results, line):
        found.setdefault(spot.reason, []).append(method.name)
    return (f"{line.name}, {', '.join(names)}: {reason}" for reason, names in found.items() if reason)


def _asked(results: StressResults, line: Line) -> Iterator[str]:
    """Say what is asked and what is true, and name the scene files that show a line's numbers."""
    thread = f" {line.link}" if line.link else ""
    yield f"{line.name}: {line.gives_way} Truth: {line.truth}.{thread}"
    for method, spot in _spots(results, line):
        if spot.scenes:
            yield f"{line.name} on {method.name}: {', '.join(spot.scenes)}"


def _spots(results: StressResults, line: Line) -> list[tuple[Method, Spot]]:
    return [(method, results.spots[line.name, method.name]) for method in results.methods]


def _json(results: StressResults) -> str:
    engines = [results.engines[method.engine] for method in results.methods]
    return as_json(
        "stress",
        quick=results.quick,
        command=results.command,
        elapsed_s=results.elapsed_s,
        environment=results.environment,
        methods=[
            {**asdict(method), "version": engine.version, "unavailable": engine.unavailable}
            for method, engine in zip(results.methods, engines, strict=True)
        ],
        lines=[{**asdict(line), "cells": [spot for _, spot in _spots(results, line)]} for line in results.lines],
    )


def _cell(results: StressResults, method: Method, line: Line) -> Cell:
    spot = results.spots[line.name, method.name]
    value = "" if spot.value is None else wording.number(spot.value)
    match spot.ending:
        case SpotEnding.STANDS:
            text = f"to {value}"
        case SpotEnding.NEVER_STOOD if spot.reason.startswith((Status.TIMED_OUT.value, Status.CRASHED.value)):
            text = f"{spot.reason.partition(':')[0]} at {value}"  # nothing is known of what it would have answered
        case SpotEnding.NEVER_STOOD:
            text = f"from {value}"
        case SpotEnding.NOT_RUN:
            text = spot.reason.partition(":")[0]
        case SpotEnding.STILL_DOES | SpotEnding.DOES_NOT:
            text = f"{'does it' if spot.ending is SpotEnding.STILL_DOES else 'does not'} {value}".rstrip()
        case _:
            text = value or spot.reason.partition(":")[0]
    error = "" if spot.error is None else wording.number(spot.error)
    symbol, css = _SHOWN[spot.ending]
    link = spot.scenes[0] if spot.scenes else ""
    return Cell(text, error, title=spot.reason, css=css, symbol=symbol, link=link)


def _of(results: StressResults, kind: str) -> list[Line]:
    return [line for line in results.lines if line.kind == kind]


def _summary(results: StressResults) -> Iterator[str]:
    for kind, what, good in (
        ("attack", "stood as far as the axis goes", SpotEnding.STANDS),
        ("relation", "hold", SpotEnding.HOLDS),
    ):
        lines = _of(results, kind)
        counts = []
        for method in results.methods:
            endings = [results.spots[line.name, method.name].ending for line in lines]
            if any(ending is not SpotEnding.NOT_RUN for ending in endings):
                counts.append(f"{method.name} {endings.count(good)}")
        if lines:
            yield f"Of {wording.count(len(lines), kind)}, {what}: {wording.listed(counts)}."
    if complaints := _of(results, "complaint"):
        yield _complaints(results, complaints)
    form = "the quick form" if results.quick else "the full form"
    yield f"This is {form}; it took {wording.seconds(results.elapsed_s)}."


def _complaints(results: StressResults, complaints: list[Line]) -> str:
    """Say of how many complaints about an engine that is driven here that engine still does what was reported."""
    still, not_any_more, not_here = [], [], 0
    for line in complaints:
        own = [results.spots[line.name, m.name] for m in results.methods if m.engine == line.about]
        ran = [spot for spot in own if spot.ending is not SpotEnding.NOT_RUN]
        if not ran:
            not_here += 1
        elif any(spot.ending is SpotEnding.STILL_DOES for spot in ran):
            still.append(line.name)
        else:
            not_any_more.append(line.name)
    parts = [f"Of {wording.count(len(complaints), 'complaint')}"]
    if still:
        parts.append(f"still seen on the engine itself: {wording.listed(still)}")
    if not_any_more:
        parts.append(f"not seen there any more: {wording.listed(not_any_more)}")
    if not_here:
        parts.append(f"{not_here} of an engine or a scene that can't be run here")
    return "; ".join(parts) + "."
