"""The report as Markdown, in the order of the HTML report, with tables in place of its charts."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence

from carom.report import wording
from carom.report.certified_reach import CERTIFIED_NOTE
from carom.report.grid import GridCell
from carom.report.phrases import (
    AGREEMENT_NOTE,
    FIGURE_NOTE,
    HORIZON_NOTE,
    KNOWN_NOTE,
    PRICE_NOTE,
    PROFILE_NOTE,
    RUN_TIME_NOTE,
    SPREAD_NOTE,
    TITLE,
    agreement_lines,
    caption,
    trend_note,
    trend_scenes,
    unrun_lines,
)
from carom.report.price import price_lines
from carom.report.view import View

__all__ = ["markdown"]


def markdown(view: View) -> str:
    """Return the report."""
    return "\n".join(_lines(view)) + "\n"


def _lines(view: View) -> Iterator[str]:
    grid = view.grid
    yield f"# {TITLE}"
    for sentence in view.summary.sentences:
        yield from ("", _text(sentence))
    yield from ("", f"## Every scene on every engine, at {grid.step_phrase}", "")
    yield from _table(
        ["scene", *(column.name for column in grid.columns)],
        ([_scene(view, row.scene.name), *map(_cell, row.cells)] for row in grid.rows),
    )
    yield ""
    for mark in grid.marks:
        yield f"- {mark.symbol} **{mark.word}**: {_text(mark.meaning)}"
    yield from ("", FIGURE_NOTE)
    if grid.unrun:
        yield from ("", "### Not scored, and why", "")
        for line in unrun_lines(grid):
            yield f"- {_text(line)}"
    if view.prices:
        yield from ("", "### The price of sampling", "", PRICE_NOTE, "")
        yield from (f"- {_text(line)}" for line in price_lines(view.prices))
    yield from ("", "### Profiles and variants", "", PROFILE_NOTE, "")
    yield from _table(["engine", *view.profiles.profiles], ([line.engine, *line.cells] for line in view.profiles.lines))
    if view.agreements:
        yield from ("", "### Held against PIT", "", AGREEMENT_NOTE, "")
        yield from (f"- {_text(line)}" for line in agreement_lines(view.agreements))
    if view.horizons:
        yield from ("", "### Horizons", "", HORIZON_NOTE, "")
        yield from _table(["scene", "believed"], view.horizons)
    yield from _spread(view)
    yield from _trend(view)
    if view.paper or view.worst:
        yield from ("", "## What goes wrong", "")
        for entry in (*view.paper, *view.worst):
            found, expected = len(entry.observed.impacts), len(entry.reference.impacts)
            yield f"- **{_text(entry.scene_name)}**, {found} impacts where PIC has {expected}. {_text(caption(entry))}"
    if view.known:
        yield from ("", "## Known answers", "", KNOWN_NOTE, "")
        yield from _table(
            ["scene", "source", "impacts", "deviation of PIC"],
            ([line.scene, line.source, line.impacts, line.deviation] for line in view.known),
        )
    if view.certified:
        yield from ("", "## How far the reference is certified", "", CERTIFIED_NOTE, "")
        yield from (f"- {_text(line.sentence)}" for line in view.certified)
    if view.run_times:
        yield from ("", "## Run time", "", RUN_TIME_NOTE, "")
        yield from _table(
            ["engine", "median", "range", "scenes"],
            (
                [
                    t.column.name,
                    wording.ratio(t.median),
                    f"{wording.ratio(t.low)} to {wording.ratio(t.high)}",
                    str(t.scenes),
                ]
                for t in view.run_times
            ),
        )
    yield from ("", "## Machine, versions, settings", "")
    yield from _table(["", ""], view.environment)
    yield ""
    for used in view.settings:
        values = ", ".join(
            f"{setting.name} = {setting.value}" + (f" ({setting.varies})" if setting.varies else "")
            for setting in used.settings
        )
        yield f"- **{_text(used.column.name)}**: {_text(used.description)} Used on {_text(used.scene)}: {_text(values)}"
    yield from ("", "Made by", "", *(f"    {line}" for line in view.command.splitlines()))


def _spread(view: View) -> Iterator[str]:
    if not view.spreads:
        return
    yield from ("", "## Spread over phases, at the coarsest step", "", SPREAD_NOTE, "")
    head = [
        "scene",
        "engine",
        "phases",
        "Δv median",
        "Δv worst",
        "time median",
        "time worst",
        "missed",
        "PIT must miss",
    ]
    yield from _table(
        head,
        (
            [
                line.scene,
                line.column.name,
                str(line.phases),
                line.velocity_median,
                line.velocity_worst,
                line.time_median,
                line.time_worst,
                line.missed,
                line.pit_missed,
            ]
            for line in view.spreads
            if line.coarsest
        ),
    )


def _trend(view: View) -> Iterator[str]:
    trend = view.trend
    if not trend.drawable:
        return
    parts = [wording.part(part) for part in trend.parts]
    yield from ("", "## Error against step", "", _text(trend_note(trend)), "")
    yield from _table(
        ["engine", *(f"velocity error at {part}" for part in parts), *(f"scenes wrong at {part}" for part in parts)],
        (
            [
                series.column.name,
                *(wording.ABSENT if p.median is None else wording.number(p.median) for p in series.points),
                *(f"{p.wrong} of {p.graded}" for p in series.points),
            ]
            for series in trend.series
        ),
    )
    yield ""
    yield from (f"- {_text(line)}" for line in trend_scenes(trend))


def _scene(view: View, name: str) -> str:
    note = view.certified_to(name)
    return f"{name} ({note})" if note else name


def _cell(cell: GridCell) -> str:
    return f"{cell.mark.symbol} {cell.mark.word} {cell.figure}".rstrip()


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    yield _row(head)
    yield _row(["---"] * len(head), raw=True)
    yield from map(_row, rows)


def _row(cells: Sequence[str], *, raw: bool = False) -> str:
    return f"| {' | '.join(cell if raw else _text(cell) for cell in cells)} |"


def _text(text: str) -> str:
    """Return text that Markdown shows as it is: one line, no markup, no table border, no HTML."""
    return re.sub(r"([\\`*_\[\]<>|])", r"\\\1", re.sub(r"\s+", " ", text)).replace("&", "&amp;")
