"""A stress campaign as a document, and as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from carom.report.cross_check import environment_facts
from carom.report.document import ON_PAPER, PAGE, Cell, Code, Column, Document, Lines, Section, Table, Text
from carom.report.render import html, markdown
from carom.report.stress_text import HEADINGS, NOTES, TITLE, cell_text, groups, reasons, summary
from carom.report.write import replace_all

if TYPE_CHECKING:
    from carom.stress.results import Line, Spot, StressResults

__all__ = ["StressPaths", "stress_document", "write_stress"]

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
        TITLE,
        tuple(summary(results)),
        (
            *(section for kind, lines in groups(results) for section in _group(results, kind, lines)),
            Section("Machine and versions", (environment_facts(results.environment, results.elapsed_s),)),
            Section("Made by", (Code(results.command, ON_PAPER),), level=3),
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
        f"{HEADINGS[kind]}: why",
        (Lines(tuple(why for line in lines for why in _why(results, line))),),
        level=3,
    )
    yield Section(
        f"{HEADINGS[kind]}: what is asked, and what is true",
        (Lines(tuple(said for line in lines for said in (_asked(line), *_scenes(results, line))), ON_PAPER),),
        level=3,
    )


def _cell(spot: Spot) -> Cell:
    shown = cell_text(spot)
    return Cell(
        shown.text,
        shown.error,
        title=spot.reason,
        css=shown.css,
        symbol=shown.mark,
        link=spot.scenes[0] if spot.scenes else "",
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
    for reason, names in reasons(results, line):
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
            {
                **asdict(line),
                "cells": [results.spots[line.name, method.name].as_json() for method in results.methods],
            }
            for line in results.lines
        ],
    }
    return json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
