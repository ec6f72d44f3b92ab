"""Sections on PIC's traces: the time up to which they are reliable, and their deviations from known answers."""

from __future__ import annotations

import math
from typing import NamedTuple

from carom.catalogue import KnownAnswer
from carom.comparator.thresholds import THRESHOLDS
from carom.report.document import Block, Cell, Column, Lines, Media, Section, Table, Text
from carom.studies.cross_check.grid import Grid
from carom.support import formatting

#: Largest number of PIC's traces that a terminal lists. If there are more traces to list, only the page lists them.
MOST_LISTED = 3

REFERENCE_NOTE = (
    "After its horizon, a reference is unreliable because of rounding errors. Therefore later impacts are only "
    "compared with impacts that PIC computes from the engine's own state. For a certified scene, the horizon comes "
    "from a certified run, in which every digit is proven. For any other scene, the horizon is an estimate."
)
ESTIMATE_NOTE = (
    "For the estimate, PIC is run twice: with the scene's numbers, and with numbers that are moved by one unit in the "
    "last place."
)
REST_NOTE = (
    "Impacts are compared until a lasting contact begins: a disc comes to rest, slides or rolls. Every later step is "
    "compared with a step of PIC that starts from the run's own state."
)
KNOWN_NOTE = (
    "Known answers come from mathematics or a cited source, never from Carom itself. An error of time is divided by "
    "the scene's duration, an error of velocity by the greatest speed, and an error of position by the scene's extent."
)


def build_reference_section(grid: Grid) -> Section:
    """Return a section that lists certified traces, traces that are only partly reliable, and lasting contact."""
    results, lines = grid.results, []
    for name in dict.fromkeys((*results.certified, *results.horizons)):
        phrases = [str(results.certified[name])] if name in results.certified else []
        until_s, reference = results.horizons.get(name), results.references[name]
        times = reference.impacts["time_s"]
        reliable = len(times) if until_s is None else int((times <= until_s).sum())
        if until_s is not None and until_s < reference.contact_s and reliable < len(times):
            until = formatting.format_seconds(until_s)
            phrases.append(f"the reference is reliable for {reliable} of {len(times)} impacts, up to {until}")
        if phrases:
            lines.append(f"{name}: {'; '.join(phrases)}.")
    rests = [
        f"{name}: runs are compared up to {formatting.format_seconds(reference.contact_s)} of "
        f"{formatting.format_seconds(reference.scene.duration_s)}, when a disc {reference.contact_of_disc}."
        for name, reference in results.references.items()
        if reference.contact_s < math.inf
    ]
    blocks: list[Block] = []
    if lines:
        listed = _build_lines(lines, short=len(lines) <= MOST_LISTED)
        blocks += [listed, Text(REFERENCE_NOTE, Media.ON_PAPER), Text(ESTIMATE_NOTE, Media.ON_PAPER, folded=True)]
    if rests:
        blocks += [_build_lines(rests, short=len(results.references) == 1), Text(REST_NOTE, Media.ON_PAPER)]
    return Section("Reliability of the reference", tuple(blocks), level=3)


def _build_lines(lines: list[str], *, short: bool) -> Lines:
    folded = "" if len(lines) <= MOST_LISTED else formatting.format_count(len(lines), "scene")
    return Lines(tuple(lines), Media.EVERYWHERE if short else Media.IN_FULL, folded=folded)


class _Known(NamedTuple):
    """A scene's known answer, and how far PIC's result deviates from this answer."""

    scene: str
    answer: KnownAnswer
    deviation: float


def _format_deviation(known: _Known) -> str:
    sign = "✓" if known.deviation <= THRESHOLDS.rounding else "✗"
    far = math.isinf(known.deviation)
    return f"{sign} {'an impact is missing or wrong' if far else formatting.format_number(known.deviation)}"


def _build_source_cell(known: _Known) -> Cell:
    convention = f". Convention: {known.answer.convention}" if known.answer.convention else ""
    return Cell(f"{known.answer.source}{convention}", css="prose")


def build_known_answers_section(grid: Grid) -> Section:
    """Return a section that lists each scene's known answer, and how far PIC's result deviates from this answer."""
    columns = (
        Column("scene", lambda known: known.scene),
        Column("source", _build_source_cell),
        Column("impacts", lambda known: str("not known" if (n := known.answer.count) is None else n), number=True),
        Column("deviation of PIC", _format_deviation, number=True),
    )
    found = [_Known(name, *answer) for name, answer in grid.results.known.items()]
    blocks = (Table(columns, found, only=Media.ON_PAPER), Text(KNOWN_NOTE, Media.ON_PAPER)) if found else ()
    return Section("Known answers", blocks)
