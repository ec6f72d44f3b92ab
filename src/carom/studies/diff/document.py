"""Document of `carom diff`: the number of changes, and a table of the changed runs, worst first."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial

from carom.report.document import Cell, Column, Document, Media, Section, Table, Text
from carom.studies.diff.compare_records import Change, Diff, Kind
from carom.support import formatting

#: Largest number of rows. The whole table must fit into a comment on a pull request, whose length is limited.
MOST_ROWS = 50
#: Largest numbers of groups of similar changes on a terminal, so that 25 lines suffice. The first number is for worse,
#: mixed or vanished runs, the second for other changes, and the third for runs without a grade. A group takes two lines
#: if there is only one method, and three lines otherwise.
MOST_ALONE, MOST_OF_SEVERAL = (4, 2, 1), (3, 1, 1)
#: Largest number of settings on a terminal, and largest number of characters of a value.
MOST_SETTINGS, MOST_LETTERS = 4, 40

_COLUMNS = (
    Column("cell", lambda change: Cell(change.scene, f"{change.method}, {formatting.format_step(change.dt_s)}")),
    Column("change", lambda change: Cell(_format_kind(change), _format_marks(change), css=change.new.css)),
    Column("before → after", lambda change: Cell("; ".join(map(str, change.measures)), css="prose")),
    Column("cause", lambda change: Cell("; ".join(change.causes), css="prose")),
)


#: A group of changes that agree in kind, in grades, and in the names of changed settings and versions. The first change
#: is the worst.
_Group = list[Change]


def build_diff_document(diff: Diff, old: str, new: str) -> Document:
    """Return a document with the changed runs and the numbers that changed.

    On a terminal, only the most important changes are shown, in 25 lines.

    Args:
        diff: The changes.
        old: Name of the old cross-check, as given by the user.
        new: Name of the new cross-check.
    """
    changes, left_out = diff.changes, len(diff.changes) - MOST_ROWS
    note = f"{left_out} more changes are not shown; --page FILE writes all changes" if left_out > 0 else ""
    tables = (
        Table(_COLUMNS, changes, css="cells diff", only=Media.PAGE | Media.DETAIL),
        Table(_COLUMNS, changes[:MOST_ROWS], note=note, only=Media.MARKDOWN),
    )
    around = Text(f"The two cross-checks differ in: {'; '.join(diff.environment_changes)}.", Media.IN_FULL)
    sections = (
        Section("Summary", (_build_summary_table(changes),) if changes else (), only=Media.TERMINAL),
        Section("Changes, worst first", tables if changes else (), only=Media.IN_FULL),
        Section("Versions and machine", (around,) if diff.environment_changes else (), only=Media.IN_FULL),
    )
    headline = (*_build_headline(diff), *_describe_setting_changes(changes))
    return Document(f"Carom diff: {old} → {new}", headline, sections)


def _build_summary_table(changes: Sequence[Change]) -> Table:
    """Return a table with a row for each group of similar changes.

    Changes for the worse are first, then other changes, then changes of runs without a grade.
    """
    bad = [change for change in changes if change.graded and change.kind in (Kind.WORSE, Kind.MIXED, Kind.VANISHED)]
    ungraded = [change for change in changes if not change.graded]
    other_changes = [change for change in changes if change.graded and change not in bad]
    methods = {change.method for change in changes}
    most_groups = MOST_ALONE if len(methods) == 1 else MOST_OF_SEVERAL
    kinds = zip((bad, other_changes, ungraded), most_groups, strict=True)
    groups = [group for selected, most in kinds for group in _group_changes(selected)[:most]]
    shown_count = sum(map(len, groups))
    note = (
        "" if shown_count == len(changes) else f"{shown_count} of {len(changes)} changed runs are shown; -v shows all"
    )
    columns = (
        Column("cells", lambda group: str(len(group)), number=True),
        Column("change", lambda group: Cell(_format_kind(group[0]), _format_marks(group[0]))),
        Column("example", partial(_build_example_cell, several=len(methods) > 1)),
    )
    title = "Changes, worst first" if len(methods) > 1 else f"{methods.pop()}, worst first"
    return Table(columns, groups, title=title, note=note, only=Media.TERMINAL)


def _group_changes(changes: Sequence[Change]) -> list[_Group]:
    """Group changes that have the same kind, the same grades, and the same names of changed settings.

    The groups are sorted by their worst changes.
    """

    def shared(change: Change) -> tuple[object, ...]:
        # Changed numbers of impacts and changed errors are in different groups, because they have different causes.
        counts = any(measure.is_count for measure in change.measures)
        return (change.kind, change.old, change.new, counts, tuple(name for name, _ in change.changed))

    return list(formatting.group_by((shared(change), change) for change in changes).values())


def _build_headline(diff: Diff) -> list[str]:
    tally = Counter(change.kind for change in diff.changes if change.graded)
    counted = [f"{tally[kind]} {kind.value}" for kind in Kind if tally[kind]]
    ungraded_count = sum(not change.graded for change in diff.changes)
    counted += [f"{ungraded_count} not graded"] if ungraded_count else []
    unchanged_text = formatting.format_count(diff.unchanged, "cell")
    lead = [f"No change in {unchanged_text}, except for rounding."]
    if counted:
        lead = [f"{formatting.capitalise(formatting.join_words(counted))}; {unchanged_text} unchanged."]
    if tally[Kind.WORSE] or tally[Kind.MIXED]:
        worst = diff.changes[0]
        number = f" ({worst.most_important})" if worst.most_important else ""
        run_text = f"{worst.scene} on {worst.method} at {formatting.format_step(worst.dt_s)}"
        lead.append(f"Worst: {run_text}, {_format_marks(worst)}{number}.")
    return lead


def _describe_setting_changes(changes: Sequence[Change]) -> Iterator[str]:
    """Yield a sentence that lists changed settings and versions, if there are any."""
    values = formatting.group_by(pair for change in changes for pair in change.changed)
    if not values:
        return
    phrases = []
    for name, texts in list(values.items())[:MOST_SETTINGS]:
        value = texts[0] if len(set(texts)) == 1 else f"{len(set(texts))} values"
        value = value if len(value) <= MOST_LETTERS else "changed"
        count_text = "" if len(texts) == len(changes) else f" (in {len(texts)})"
        phrases.append(f"{name.partition(': ')[2]} {value}{count_text}")
    omission = f" and {len(values) - MOST_SETTINGS} more" if len(values) > MOST_SETTINGS else ""
    yield f"Also changed in {formatting.format_count(len(changes), 'run')}: {', '.join(phrases)}{omission}."


def _format_kind(change: Change) -> str:
    return change.kind.value if change.graded else "not graded"


def _build_example_cell(group: _Group, *, several: bool) -> Cell:
    change = group[0]
    number = str(change.most_important) if change.most_important else next(iter(change.verdicts), "").partition(" (")[0]
    method = f"{change.method}: " if several else ""
    return Cell(f"{method}{change.scene}, {formatting.format_step(change.dt_s)}", number)


def _format_marks(change: Change) -> str:
    old, new = change.old.word, change.new.word
    return f"{old} → {new}" if old != new else f"{new} (unchanged)"
