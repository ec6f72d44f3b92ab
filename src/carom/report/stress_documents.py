"""A stress campaign as documents: a table on the terminal, Markdown, HTML and JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rich import box
from rich.table import Table
from rich.text import Text

from carom.report import wording
from carom.report.extra import rendered
from carom.report.markdown import _table as markdown_table
from carom.report.markdown import _text as markdown_text
from carom.report.stress_text import HEADINGS, NOTES, TITLE, cell_text, columns, groups, reasons, summary
from carom.report.write import replace_all

if TYPE_CHECKING:
    from carom.stress.results import Line, StressResults

__all__ = ["StressPaths", "stress_summary", "stress_tables", "write_stress"]

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
    texts = (_html(results), _markdown(results), _json(results))
    folder.mkdir(parents=True, exist_ok=True)
    replace_all(dict(zip(paths, texts, strict=True)))
    return paths


def stress_summary(results: StressResults) -> str:
    """Return what was found, in plain sentences."""
    return "\n".join(summary(results))


def stress_tables(results: StressResults) -> Iterator[Table]:
    """Return a table for each kind of line, its reasons below it."""
    for kind, lines in groups(results):
        table = Table(title=HEADINGS[kind], title_justify="left", caption=NOTES[kind], caption_justify="left")
        table.box, table.pad_edge = box.SIMPLE_HEAD, False
        table.add_column(kind, no_wrap=True)
        methods, with_axis = columns(results, kind, lines), kind in {"attack", "own"}
        if with_axis:
            table.add_column("axis" if kind == "attack" else "what", max_width=34 if kind == "attack" else None)
        for method in methods:
            table.add_column(Text(f"{method.engine}\n{method.profile}"))
        for line in lines:
            cells = [cell_text(results.spots[line.name, method.name]) for method in methods]
            shown = [f"{c.mark} {c.text}" + (f"\n  {c.error}" if c.error else "") for c in cells]
            table.add_row(Text(line.name), *([Text(line.axis)] if with_axis else []), *map(Text, shown))
        yield table
        why = Table(title="Why", title_justify="left", box=None, show_header=False, pad_edge=False)
        why.add_column(no_wrap=True)
        why.add_column()
        for line in lines:
            for reason, names in reasons(results, line):
                why.add_row(Text(line.name), Text(f"{', '.join(names)}: {reason}"))
        if why.row_count:
            yield why


def _markdown(results: StressResults) -> str:
    return "\n".join(_markdown_lines(results)) + "\n"


def _markdown_lines(results: StressResults) -> Iterator[str]:
    yield f"# {TITLE}"
    for sentence in summary(results):
        yield from ("", markdown_text(sentence))
    for kind, lines in groups(results):
        yield from ("", f"## {HEADINGS[kind]}", "", NOTES[kind], "")
        rows, methods = [], columns(results, kind, lines)
        for line in lines:
            cells = [cell_text(results.spots[line.name, method.name]) for method in methods]
            rows.append(
                [line.name, line.axis, *(f"{c.mark} {c.text}" + (f" ({c.error})" if c.error else "") for c in cells)]
            )
        yield from markdown_table([kind, "axis", *(method.name for method in methods)], rows)
        yield from ("", "### Why, and which scene shows it", "")
        for line in lines:
            yield f"- **{line.name}**: {markdown_text(line.gives_way)} Truth: {markdown_text(line.truth)}."
            if line.link:
                yield f"  - <{line.link}>"
            for reason, names in reasons(results, line):
                yield f"  - {', '.join(names)}: {markdown_text(reason)}"
            for name, files in _files(results, line):
                yield f"  - {name}: {', '.join(f'`{file}`' for file in files)}"
    yield from ("", "## Machine and versions", "")
    yield from markdown_table(["", ""], _environment(results))
    yield from ("", "Made by", "", f"    {results.command}")


def _files(results: StressResults, line: Line) -> Iterator[tuple[str, tuple[str, ...]]]:
    for method in results.methods:
        spot = results.spots[line.name, method.name]
        if spot.scenes:
            yield method.name, spot.scenes


def _environment(results: StressResults) -> list[list[str]]:
    here = results.environment
    return [
        ["Date", here.date],
        ["Processor", f"{here.processor}, {wording.count(here.cores, 'core')}"],
        ["System", here.system],
        ["Python", here.python],
        ["Carom", here.carom],
        ["Versions", ", ".join(f"{name} {version}" for name, version in here.versions.items())],
        ["Whole run", wording.seconds(results.elapsed_s)],
    ]


def _html(results: StressResults) -> str:
    return rendered(
        "stress.html.j2",
        title=TITLE,
        results=results,
        sentences=summary(results),
        groups=[
            (
                kind,
                HEADINGS[kind],
                NOTES[kind],
                columns(results, kind, lines),
                [
                    (
                        line,
                        [
                            (cell_text(spot), spot)
                            for spot in (
                                results.spots[line.name, method.name] for method in columns(results, kind, lines)
                            )
                        ],
                        reasons(results, line),
                    )
                    for line in lines
                ],
            )
            for kind, lines in groups(results)
        ],
        environment=_environment(results),
    )


def _json(results: StressResults) -> str:
    content = {
        "format": FORMAT,
        "quick": results.quick,
        "command": results.command,
        "elapsed_s": results.elapsed_s,
        "environment": asdict(results.environment),
        "methods": [asdict(method) for method in results.methods],
        "lines": [
            {
                **asdict(line),
                "cells": [results.spots[line.name, method.name].as_json() for method in results.methods],
            }
            for line in results.lines
        ],
    }
    return json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
