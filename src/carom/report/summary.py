"""The verdict of a whole cross-check, in a few plain sentences derived from its rows."""

from __future__ import annotations

from collections import Counter

from carom.comparator.thresholds import THRESHOLDS
from carom.report import wording
from carom.report.grid import Grid
from carom.report.marks import Mark
from carom.report.price import Price
from carom.runs.results import Results

__all__ = ["agreement", "summarise"]

#: An engine is said to be PIT in disguise where it equals PIT in at least this share of the scenes.
MOSTLY = 0.5


def summarise(results: Results, grid: Grid) -> tuple[str, ...]:
    """Return the sentences that stand first in every format: what PIC is worth here, and the grades."""
    return (_reference(results), _counts(grid))


def _reference(results: Results) -> str:
    if not results.known:
        return "None of these scenes has a known answer, so PIC is the reference here without a proof of its own."
    deviations = {name: deviation for name, (_, deviation) in results.known.items()}
    off = [name for name, deviation in deviations.items() if not deviation <= THRESHOLDS.rounding]
    if off:
        right = f"{len(deviations) - len(off)} of {wording.count(len(deviations), 'known answer')}"
        return f"PIC reproduces {right} to rounding; it does not reproduce {wording.listed(off)}."
    which = f"all {len(deviations)} known answers" if len(deviations) > 1 else "the one known answer"
    return f"PIC reproduces {which} (largest deviation {wording.number(max(deviations.values()))})."


def _counts(grid: Grid) -> str:
    columns = [column for column in grid.columns if not column.own]
    what = "engine run"
    if not columns:  # Carom's own methods only: then it is PIT that is held against PIC
        columns = [column for column in grid.columns if column.engine != "pic"] or list(grid.columns)
        names = list(dict.fromkeys(column.label for column in columns))
        what = f"{names[0]} run" if len(names) == 1 else "run"
    tally: Counter[Mark] = Counter(
        cell.mark for column in columns for cell in grid.cells(column) if cell.mark is not Mark.ABSENT
    )
    ran = sum(n for mark, n in tally.items() if mark.ran)
    parts = [f"{tally[mark]} {mark.word}" for mark in Mark if mark.ran and tally[mark]]
    not_run = [f"{tally[mark]} {mark.word}" for mark in Mark if not mark.ran and tally[mark]]
    sentence = f"Of {wording.count(ran, what)} at {grid.step_phrase}: {'; '.join(parts)}."
    if not ran:
        sentence = f"No {what} at {grid.step_phrase} could be scored."
    return f"{sentence} Not scored: {'; '.join(not_run)}." if not_run else sentence


def agreement(found: tuple[Price, ...]) -> str:
    """Return who is PIT in disguise; empty where nobody is."""
    close = [entry for entry in found if entry.equal and len(entry.equal) >= MOSTLY * len(entry.scores)]
    if not close:
        return ""
    shares = [
        f"of {entry.column.name} in {len(entry.equal)} of {wording.count(len(entry.scores), 'scene')}"
        for entry in close
    ]
    largest = wording.number(max(entry.beside_pit for entry in close))
    does = "it does" if len(close) == 1 else "they do"
    return (
        f"Sampling is the whole error {wording.listed(shares)}: there {does} exactly what PIT does at the same step, "
        f"to rounding (largest difference {largest})."
    )
