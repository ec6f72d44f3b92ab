"""A stress campaign as a document, and as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import NamedTuple

from carom.report import wording
from carom.report.document import ON_PAPER, PAGE, Cell, Column, Document, Lines, Section, Table, Text
from carom.report.made import making
from carom.report.render import html, markdown
from carom.report.write import replace_all
from carom.runs.job import Status
from carom.stress.results import Ending, Line, Spot, StressResults

__all__ = ["StressPaths", "stress_document", "write_stress"]

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
    Ending.GIVES_WAY: ("~", "inaccurate"),
    Ending.STANDS: _GOOD,
    Ending.NEVER_STOOD: _BAD,
    Ending.HOLDS: _GOOD,
    Ending.FAILS: _BAD,
    Ending.STILL_DOES: _BAD,
    Ending.DOES_NOT: _GOOD,
    Ending.NOT_RUN: ("-", "not-scored"),
}


#: Raised when a field changes its meaning or goes; a new field does not raise it.
FORMAT = 1


class StressPaths(NamedTuple):
    """The files of a stress report."""

    html: Path
    markdown: Path
    json: Path


def write_stress(results: StressResults, folder: Path) -> StressPaths:
    """Write `stress.html`, `stress.md` and `stress.json` into a folder, in place of older ones.

    Raises:
        MissingExtraError: jinja2, of the extra `report`, is not installed.
        OSError: The folder can't be written to.
    """
    paths = StressPaths(*(folder / f"stress.{ending}" for ending in ("html", "md", "json")))
    document = stress_document(results)
    texts = (html(document), markdown(document), _json(results))
    folder.mkdir(parents=True, exist_ok=True)
    replace_all(dict(zip(paths, texts, strict=True)))
    return paths


def stress_document(results: StressResults) -> Document:
    """Return a campaign: for each kind of line a table, and why its cells are as they are."""
    return Document(
        "Carom: stress",
        tuple(_summary(results)),
        (
            *(section for kind, lines in _groups(results) for section in _group(results, kind, lines)),
            *making(results.environment, results.command, results.elapsed_s),
        ),
    )


def _group(results: StressResults, kind: str, lines: list[Line]) -> Iterator[Section]:
    methods = results.methods
    table = Table(
        (Column(kind), Column("axis"), *(Column(method.engine, method.profile) for method in methods)),
        tuple(
            (line.name, line.axis, *(_cell(results.spots[line.name, method.name]) for method in methods))
            for line in lines
        ),
        note=NOTES[kind],
        css="grid",
    )
    yield Section(HEADINGS[kind], (table, Text("A cell leads to the scene that shows its number: run it.", PAGE)))
    yield Section(
        f"{HEADINGS[kind]}: why", (Lines(tuple(why for line in lines for why in _why(results, line))),), level=3
    )
    yield Section(
        f"{HEADINGS[kind]}: what is asked, and what is true",
        (Lines(tuple(said for line in lines for said in (_asked(line), *_scenes(results, line))), ON_PAPER),),
        level=3,
    )


def _asked(line: Line) -> str:
    thread = f" {line.link}" if line.link else ""
    return f"{line.name}: {line.gives_way} Truth: {line.truth}.{thread}"


def _scenes(results: StressResults, line: Line) -> Iterator[str]:
    """Name the scene files that show a line's numbers."""
    for method in results.methods:
        files = results.spots[line.name, method.name].scenes
        if files:
            yield f"{line.name} on {method.name}: {', '.join(files)}"


def _why(results: StressResults, line: Line) -> Iterator[str]:
    for reason, names in _reasons(results, line):
        yield f"{line.name}, {', '.join(names)}: {reason}"


def _json(results: StressResults) -> str:
    content = {
        "format": FORMAT,
        "quick": results.quick,
        "command": results.command,
        "elapsed_s": results.elapsed_s,
        "environment": asdict(results.environment),
        "methods": [
            {**asdict(method), "version": engine.version, "unavailable": engine.unavailable}
            for method in results.methods
            for engine in [results.engines[method.engine]]
        ],
        "lines": [
            {**asdict(line), "cells": [results.spots[line.name, method.name].as_json() for method in results.methods]}
            for line in results.lines
        ],
    }
    return json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _cell(spot: Spot) -> Cell:
    value = "" if spot.value is None else wording.number(spot.value)
    match spot.ending:
        case Ending.STANDS:
            text = f"to {value}"
        case Ending.NEVER_STOOD if spot.reason.startswith((Status.TIMED_OUT.value, Status.CRASHED.value)):
            text = f"{spot.reason.partition(':')[0]} at {value}"  # nothing is known of what it would have answered
        case Ending.NEVER_STOOD:
            text = f"from {value}"
        case Ending.NOT_RUN:
            text = spot.reason.partition(":")[0]
        case Ending.STILL_DOES | Ending.DOES_NOT:
            text = f"{'does it' if spot.ending is Ending.STILL_DOES else 'does not'} {value}".rstrip()
        case _:
            text = value or spot.reason.partition(":")[0]
    error = "" if spot.error is None else wording.number(spot.error)
    symbol, css = _SHOWN[spot.ending]
    link = spot.scenes[0] if spot.scenes else ""
    return Cell(text, error, title=spot.reason, css=css, symbol=symbol, link=link)


def _groups(results: StressResults) -> Iterator[tuple[str, list[Line]]]:
    """Return the kinds of lines that there are, each with its lines."""
    for kind in HEADINGS:
        lines = [line for line in results.lines if line.kind == kind]
        if lines:
            yield kind, lines


def _reasons(results: StressResults, line: Line) -> list[tuple[str, list[str]]]:
    """Return why cells of a line are as they are: each reason with the methods that it holds for."""
    found: dict[str, list[str]] = {}
    for method in results.methods:
        spot = results.spots[line.name, method.name]
        if spot.reason:
            found.setdefault(spot.reason, []).append(method.name)
    return list(found.items())


def _summary(results: StressResults) -> Iterator[str]:
    """Return what was found, in plain sentences."""
    for kind, what, good in (
        ("attack", "stood as far as the axis goes", Ending.STANDS),
        ("relation", "hold", Ending.HOLDS),
    ):
        lines = [line for line in results.lines if line.kind == kind]
        counts = []
        for method in results.methods:
            endings = [results.spots[line.name, method.name].ending for line in lines]
            if any(ending is not Ending.NOT_RUN for ending in endings):
                counts.append(f"{method.name} {endings.count(good)}")
        if lines:
            yield f"Of {wording.count(len(lines), kind)}, {what}: {wording.listed(counts)}."
    if complaints := [line for line in results.lines if line.kind == "complaint"]:
        yield _complaints(results, complaints)
    form = "the quick form" if results.quick else "the full form"
    yield f"This is {form}; it took {wording.seconds(results.elapsed_s)}."


def _complaints(results: StressResults, complaints: list[Line]) -> str:
    """Say of how many complaints about an engine that is driven here that engine still does what was reported."""
    still, not_any_more, not_here = [], [], 0
    for line in complaints:
        own = [results.spots[line.name, m.name] for m in results.methods if m.engine == line.about]
        ran = [spot for spot in own if spot.ending is not Ending.NOT_RUN]
        if not ran:
            not_here += 1
        elif any(spot.ending is Ending.STILL_DOES for spot in ran):
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
