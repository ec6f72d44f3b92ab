"""What each cell of a stress table says: the only place where its numbers become text."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from carom.report import wording
from carom.runs.job import Status
from carom.stress.results import Ending, Line, Spot, StressResults

__all__ = ["HEADINGS", "NOTES", "TITLE", "CellText", "cell_text", "groups", "reasons", "summary"]

TITLE = "Carom: stress"

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

_CSS = {
    Ending.GIVES_WAY: "inaccurate",
    Ending.STANDS: "exact",
    Ending.NEVER_STOOD: "wrong",
    Ending.HOLDS: "exact",
    Ending.FAILS: "wrong",
    Ending.STILL_DOES: "wrong",
    Ending.DOES_NOT: "exact",
    Ending.NOT_RUN: "not-scored",
}

_MARK = {
    Ending.GIVES_WAY: "~",
    Ending.STANDS: "=",
    Ending.NEVER_STOOD: "x",
    Ending.HOLDS: "=",
    Ending.FAILS: "x",
    Ending.STILL_DOES: "x",
    Ending.DOES_NOT: "=",
    Ending.NOT_RUN: "-",
}


class CellText(NamedTuple):
    """A cell, as a table shows it."""

    mark: str
    text: str
    error: str
    css: str
    scene: str


def cell_text(spot: Spot) -> CellText:
    """Return what a cell shows."""
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
    return CellText(_MARK[spot.ending], text, error, _CSS[spot.ending], spot.scenes[0] if spot.scenes else "")


def groups(results: StressResults) -> Iterator[tuple[str, list[Line]]]:
    """Return the kinds of lines that there are, each with its lines."""
    for kind in HEADINGS:
        lines = [line for line in results.lines if line.kind == kind]
        if lines:
            yield kind, lines


def reasons(results: StressResults, line: Line) -> list[tuple[str, list[str]]]:
    """Return why cells of a line are as they are: each reason with the methods that it holds for."""
    found: dict[str, list[str]] = {}
    for method in results.methods:
        spot = results.spots[line.name, method.name]
        if spot.reason:
            found.setdefault(spot.reason, []).append(method.name)
    return list(found.items())


def summary(results: StressResults) -> list[str]:
    """Return what was found, in plain sentences."""
    sentences = []
    attacks = [line for line in results.lines if line.kind == "attack"]
    if attacks:
        counts = []
        for method in results.methods:
            endings = [results.spots[line.name, method.name].ending for line in attacks]
            if all(ending is Ending.NOT_RUN for ending in endings):
                continue
            counts.append(f"{method.name} {sum(ending is Ending.STANDS for ending in endings)}")
        sentences.append(
            f"Of {wording.count(len(attacks), 'attack')}, stood as far as the axis goes: {wording.listed(counts)}."
        )
    relations = [line for line in results.lines if line.kind == "relation"]
    if relations:
        counts = []
        for method in results.methods:
            endings = [results.spots[line.name, method.name].ending for line in relations]
            if not all(ending is Ending.NOT_RUN for ending in endings):
                counts.append(f"{method.name} {sum(ending is Ending.HOLDS for ending in endings)}")
        sentences.append(f"Of {wording.count(len(relations), 'relation')}, hold: {wording.listed(counts)}.")
    complaints = [line for line in results.lines if line.kind == "complaint"]
    if complaints:
        sentences.append(_complaints(results, complaints))
    form = "the quick form" if results.quick else "the full form"
    sentences.append(f"This is {form}; it took {wording.seconds(results.elapsed_s)}.")
    return sentences


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
