"""A diff of two cross-checks as a document."""

from __future__ import annotations

from collections import Counter

from carom.pages import wording
from carom.pages.document import EVERYWHERE, PAGE, Cell, Column, Document, Section, Table, Text
from carom.studies.diff.run import Change, Diff, Kind

__all__ = ["diff_document"]

#: As many rows as a comment on a pull request holds, whose length is limited, and as somebody reads on a terminal.
MOST_ROWS = 50

_COLUMNS = (
    Column("cell", lambda change: Cell(change.scene, f"{change.method}, {wording.step(change.dt_s)}")),
    Column("change", lambda change: Cell(change.kind.value, _marks(change), css=change.new.css)),
    Column("before → after", lambda change: Cell("; ".join(map(str, change.measures)), css="prose")),
    Column("cause", lambda change: Cell("; ".join(change.causes), css="prose")),
)


def diff_document(found: Diff, old: str, new: str) -> Document:
    """Return the document: a sentence that sums it up, the worst cell, and all that changed, the worst first.

    Args:
        found: What changed.
        old: What was held against what, in the reader's words.
        new: The other.
    """
    changes, left_out = found.changes, len(found.changes) - MOST_ROWS
    note = f"{left_out} more are not shown; --page FILE writes all of them" if left_out > 0 else ""
    tables = (
        Table(_COLUMNS, changes, css="cells diff", only=PAGE),
        Table(_COLUMNS, changes[:MOST_ROWS], note=note, only=EVERYWHERE - PAGE),
    )
    around = Text(f"Not the same in both runs: {'; '.join(found.around)}.")
    sections = (
        *((Section("What changed, the worst first", tables),) if changes else ()),
        *((Section("Versions and machine", (around,)),) if found.around else ()),
    )
    return Document(f"Carom diff: {old} → {new}", tuple(_lead(found)), sections)


def _lead(found: Diff) -> list[str]:
    tally = Counter(change.kind for change in found.changes)
    counted = [f"{tally[kind]} {kind.value}" for kind in Kind if tally[kind]]
    same = wording.count(found.unchanged, "cell")
    lead = [f"{wording.capitalised(wording.listed(counted))}; {same} without a change." if counted else ""]
    if not counted:
        lead = [f"No change: {same} compared, all as before to rounding."]
    if tally[Kind.WORSE]:
        worst = found.changes[0]
        numbers = "; ".join(map(str, worst.measures[:3]))
        where = f"{worst.scene} on {worst.method} at {wording.step(worst.dt_s)}"
        lead.append(f"Worst: {where}, {_marks(worst)}{numbers and f' ({numbers})'}.")
    return lead


def _marks(change: Change) -> str:
    old, new = change.old.word, change.new.word
    return f"{old} → {new}" if old != new else f"{new}, as before"
