"""Sections on the reference: how far it is reliable, and which known answers it reproduces."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

from carom.catalogue import KnownAnswer
from carom.comparator.thresholds import THRESHOLDS
from carom.execution.results import Results
from carom.report import formatting
from carom.report.document import EVERYWHERE, IN_FULL, ON_PAPER, Block, Cell, Column, Lines, Section, Table, Text

#: Largest number of references that the terminal lists; more are listed in the report only.
MOST_TOLD = 3

REFERENCE_NOTE = (
    "Errors grow from impact to impact, also those of the reference. Beyond its horizon it is not believed, because "
    "rounding alone has led it elsewhere: impacts there are scored locally only, each from the engine's own state "
    "before it. A certified run, in which every digit is proven, says how far it is reliable; without one a "
    "horizon is an estimate, from what a start moved by one unit in the last place leads to."
)
REST_NOTE = (
    "Impacts are compared up to where a disc comes to rest, to slide or to roll. From there each step is compared with "
    "PIC from the run's own state: what rests must stay, and the other discs go on."
)
KNOWN_NOTE = (
    "What mathematics or a cited source says of a scene, never computed by the code under test. Times are divided by "
    "the scene's duration, velocities by its greatest speed and lengths by its extent, so the deviation has no unit."
)


def reference_section(results: Results) -> Section:
    """Describe how far references are reliable, where that is not the whole run or was asked for."""
    lines = []
    for name in dict.fromkeys((*results.certified, *results.horizons)):
        said = [str(results.certified[name])] if name in results.certified else []
        until_s, reference = results.horizons.get(name), results.references[name]
        if until_s is not None and until_s < reference.contact_s:
            times = reference.impacts["time_s"]
            reliable = int((times <= until_s).sum())
            if reliable < len(times):
                said.append(f"believed for {reliable} of {len(times)} impacts, to {formatting.seconds(until_s)}")
        if said:
            lines.append(f"{name}: {'; '.join(said)}.")
    media = EVERYWHERE if len(lines) <= MOST_TOLD else IN_FULL
    told = Lines(tuple(lines), media, folded="" if media is EVERYWHERE else formatting.count(len(lines), "scene"))
    blocks: tuple[Block, ...] = (Text(REFERENCE_NOTE, ON_PAPER), told) if lines else ()
    if rests := tuple(_describe_rests(results)):
        alone = len(results.references) == 1
        folded = "" if len(rests) <= MOST_TOLD else formatting.count(len(rests), "scene")
        blocks += (Text(REST_NOTE, ON_PAPER), Lines(rests, EVERYWHERE if alone else IN_FULL, folded=folded))
    return Section("How far the reference is believed", blocks, level=3)


def _describe_rests(results: Results) -> Iterator[str]:
    """Describe, for each scene that comes to rest, up to when runs are compared."""
    for name, reference in results.references.items():
        if reference.contact_s < math.inf:
            ended, asked = formatting.seconds(reference.contact_s), formatting.seconds(reference.scene.duration_s)
            yield f"{name}: runs are compared up to {ended} of {asked}, where a disc {reference.contact_of_disc}."


class _Known(NamedTuple):
    """A scene's known answer, and PIC's deviation from it."""

    scene: str
    answer: KnownAnswer
    deviation: float


def _known_deviation(known: _Known) -> str:
    sign = "✓" if known.deviation <= THRESHOLDS.rounding else "✗"
    far = math.isinf(known.deviation)
    return f"{sign} {'an impact is missing or wrong' if far else formatting.number(known.deviation)}"


def _known_source(known: _Known) -> Cell:
    convention = f". Convention: {known.answer.convention}" if known.answer.convention else ""
    return Cell(f"{known.answer.source}{convention}", css="prose")


def known_section(results: Results) -> Section:
    """Return every known answer, in the order of the scenes, with PIC's deviation from it."""
    columns = (
        Column("scene", lambda known: known.scene),
        Column("source", _known_source),
        Column(
            "impacts", lambda known: "not known" if known.answer.count is None else str(known.answer.count), number=True
        ),
        Column("deviation of PIC", _known_deviation, number=True),
    )
    found = [_Known(name, *answer) for name, answer in results.known.items()]
    blocks = (Text(KNOWN_NOTE, ON_PAPER), Table(columns, found, only=ON_PAPER)) if found else ()
    return Section("Known answers", blocks)
