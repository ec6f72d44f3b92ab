"""Marks of the outcomes of runs, and the grid of a cross-check: scenes in rows, engines and profiles in columns."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from carom.comparator import Grade
from carom.comparator.thresholds import THRESHOLDS
from carom.execution.job import Method, Status
from carom.execution.results import Results, Row
from carom.model.scene import Scene
from carom.model.trace import Outcome
from carom.report import formatting

#: Reason where a column has no row for a scene: `carom.execution` drops a profile with the settings of another one.
NOT_PLANNED = "no row of its own: its settings at this step are those of another profile of the engine"
NO_REFERENCE = "PIC does not solve this scene, so there is no reference to compare the run with"


class Mark(Enum):
    """The outcome of a cell. Each mark has its own symbol, so that colour is never the only sign."""

    EXACT = ("exact", "✓", Grade.EXACT, "green")
    EXACT_32 = ("exact (float32)", "✓", "to the rounding of the 32-bit floats that the method declares", "green")
    CLOSE = ("close", "≃", Grade.CLOSE, "green")
    SAMPLED = ("sampled", "≈", Grade.SAMPLED, "cyan")
    INACCURATE = ("inaccurate", "▲", Grade.INACCURATE, "yellow")
    PARTED = ("parted", "↗", Grade.PARTED, "yellow")
    PARTED_INACCURATE = ("parted inaccurate", "⇗", Grade.PARTED_INACCURATE, "red")
    WRONG = ("wrong", "✗", Grade.WRONG, "bold red")
    UNGRADED = ("not graded", "○", Grade.UNGRADED, "dim")
    UNSCORED = ("not scored", "?", "ran, but PIC can't solve the scene, so there is nothing to compare it with", "dim")
    UNSUPPORTED = ("unsupported", "∅", "asks for more than the engine declares, or than a cross-check follows", "dim")
    UNAVAILABLE = ("unavailable", "∅", "the engine is not installed here", "dim")
    CRASHED = ("crashed", "†", "the engine ended its process", "bold magenta")
    TIMED_OUT = ("timed out", "⧖", "the engine gave no answer in time", "bold magenta")
    FAILED = ("failed", "!", "the adapter raised an error, or answered what can't be", "bold magenta")
    ABSENT = ("not planned", "·", "these settings were run under another profile's name", "dim")

    def __init__(self, word: str, symbol: str, meaning: Grade | str, style: str) -> None:
        self.word = word
        self.symbol = symbol
        # A grade's sentence begins with its own word, which is shown next to it already.
        self.meaning = meaning.value.partition(": ")[2] if isinstance(meaning, Grade) else meaning
        self.style = style

    @property
    def css(self) -> str:
        """Class of the mark in the HTML report."""
        return self.word.partition(",")[0].replace(" ", "-")

    @property
    def sentence(self) -> str:
        """The word of the mark and its meaning."""
        return f"{self.word}: {self.meaning}"

    @property
    def ran(self) -> bool:
        """Whether the engine gave an answer that was compared with the reference."""
        return self in _OF_GRADE.values() or self in _OF_WIDTH.values()


_OF_GRADE = {grade: Mark[grade.name] for grade in Grade}
_OF_WIDTH = {32: Mark.EXACT_32}
_OF_STATUS = {status: Mark[status.name] for status in Status if status is not Status.RAN}

#: The grade behind each mark that has one.
GRADED = {mark: grade for grade, mark in _OF_GRADE.items()} | dict.fromkeys(_OF_WIDTH.values(), Grade.EXACT)
#: Marks of runs in which the engine returned no complete answer.
BROKEN = frozenset({Mark.CRASHED, Mark.TIMED_OUT, Mark.FAILED})


def mark_of(row: Row | None) -> Mark:
    """Return the mark of a row; None is a cell without a planned row."""
    if row is None:
        return Mark.ABSENT
    return parse_mark(row.status, row.grade, row.score.float_bits if row.score else None)


def parse_mark(status: Status, grade: Grade | None, float_bits: int | None) -> Mark:
    """Return the mark of a row from the fields of its record."""
    if status is not Status.RAN:
        return _OF_STATUS[status]
    return Mark.UNSCORED if grade is None else mark_of_grade(grade, float_bits or 64)


def mark_of_grade(grade: Grade, float_bits: int) -> Mark:
    """Return the mark of a grade; *exact* has a mark for each width of floats."""
    mark = _OF_GRADE[grade]
    return _OF_WIDTH.get(float_bits, mark) if mark is Mark.EXACT else mark


def reasons_of(row: Row | None) -> tuple[str, ...]:
    """Return every verdict with its numbers, or why there is none, as sentences without a full stop."""
    if row is None:
        return (NOT_PLANNED,)
    if row.reason:
        return (row.reason,)
    if row.score is None:
        return (NO_REFERENCE,)
    # The engine's own warning, such as a reset, comes first if it ended the run.
    warnings = row.trace.notes if row.trace is not None and row.trace.outcome is Outcome.WARNED else ()
    untimed = (f"not timed: {row.untimed}",) if row.untimed else ()
    return (*warnings, *(f"{finding.verdict.value} ({finding.reason})" for finding in row.score.findings), *untimed)


class GridColumn(NamedTuple):
    """A method, and whether it is one of Carom's own."""

    method: Method
    own: bool

    @property
    def engine(self) -> str:
        """Name of the adapter."""
        return self.method.engine

    @property
    def profile(self) -> str:
        """The profile as it is shown: with what was tried instead of its own settings."""
        return self.method.profile_shown

    @property
    def label(self) -> str:
        """The engine's name in headings: Carom's methods by their initials, an adapter by its name."""
        return self.engine.upper() if self.own else self.engine

    @property
    def name(self) -> str:
        """Engine and profile in one word group."""
        return f"{self.label} {self.profile}".rstrip()


@dataclass(frozen=True)
class GridCell:
    """One cell of the grid.

    Attributes:
        column: Its engine and profile.
        mark: The outcome.
        figure: The number that matters most, in words; empty where there is none.
        compact: The same for a terminal.
        reasons: Every verdict with its numbers, or why it was not run, as sentences.
        row: The row behind it; None where none was planned.
    """

    column: GridColumn
    mark: Mark
    figure: str
    compact: str
    reasons: tuple[str, ...]
    row: Row | None

    @property
    def has_replay(self) -> bool:
        """Whether there is a run and a reference for a replay."""
        return self.row is not None and self.row.trace is not None and self.row.score is not None


@dataclass(frozen=True)
class GridRow:
    """One scene and its cells, in the order of the columns."""

    scene: Scene
    cells: tuple[GridCell, ...]


@dataclass(frozen=True)
class NotRun:
    """Cells, at any step, that were not run or not scored for the same reason."""

    mark: Mark
    reason: str
    columns: tuple[str, ...]
    scenes: tuple[str, ...]
    everywhere: bool  # whether these are all scenes of the cross-check


@dataclass(frozen=True)
class Grid:
    """All cells at each scene's coarsest step, and what was not run at any step.

    Attributes:
        columns: By method, in the order of the rows.
        rows: Scenes.
        own_frame_rate: Whether each scene's coarsest step is its own frame.
        unrun: What was not run, and why.
    """

    columns: Mapping[Method, GridColumn]
    rows: tuple[GridRow, ...]
    own_frame_rate: bool
    unrun: tuple[NotRun, ...]

    @property
    def step_phrase(self) -> str:
        """The steps of the cells, as a phrase."""
        return "each scene's own frame rate" if self.own_frame_rate else "the coarsest step"

    def cells(self, column: GridColumn) -> tuple[GridCell, ...]:
        """Return the cells of a column."""
        return tuple(cell for row in self.rows for cell in row.cells if cell.column == column)

    def tally(self, column: GridColumn) -> tuple[tuple[Mark, int], ...]:
        """Return how many cells of a column have each mark, in the order of the marks."""
        found = Counter(cell.mark for cell in self.cells(column))
        return tuple((mark, found[mark]) for mark in Mark if found[mark])

    @property
    def marks(self) -> tuple[Mark, ...]:
        """The marks for the legend of this grid: the grades, and any other mark that occurs."""
        present = {cell.mark for row in self.rows for cell in row.cells}
        grades = set(_OF_GRADE.values()) - {Mark.UNGRADED}
        return tuple(mark for mark in Mark if mark in present | grades)


def build_grid(results: Results) -> Grid:
    """Build the grid of a cross-check."""
    own = {info.name for info in results.engines if info.engine == "Carom"}
    methods = list(dict.fromkeys(row.job.method for row in results.rows))
    # A profile can come in at a later step only; among an engine's columns its own order decides.
    engines = list(dict.fromkeys(method.engine for method in methods))
    methods.sort(key=lambda method: engines.index(method.engine))
    columns = {method: GridColumn(method, method.engine in own) for method in methods}
    coarsest = {(row.job.scene.name, row.job.method): row for row in results.rows if row.job.refinement == 0}
    scenes = {row.job.scene.name: row.job.scene for row in results.rows}
    rows = (
        GridRow(scene, tuple(_cell(column, coarsest.get((name, method))) for method, column in columns.items()))
        for name, scene in scenes.items()
    )
    frames = (row.job.dt_s * row.job.scene.frame_rate_hz for row in coarsest.values())
    return Grid(
        columns,
        tuple(rows),
        own_frame_rate=all(math.isclose(frame, 1.0, rel_tol=formatting.WHOLE) for frame in frames),
        unrun=_group_not_run(results, columns, len(scenes)),
    )


def _cell(column: GridColumn, row: Row | None) -> GridCell:
    figure, compact = _figure(row)
    return GridCell(column, mark_of(row), figure, compact, reasons_of(row), row)


def _figure(row: Row | None) -> tuple[str, str]:
    """Return the number that matters most: impacts missed or invented, else velocity or spin, else time."""
    if row is None or row.score is None:
        return "", ""
    score = row.score
    missed, invented = len(score.missed), len(score.spurious)
    if missed or invented:
        parts = [f"{missed} of {score.expected} missed"] if missed else []
        parts += [f"{invented} invented"] if invented else []
        return ", ".join(parts), formatting.lost(missed, invented)
    if not score.errors:
        if score.undecided:
            return f"{len(score.undecided)} of {score.expected} undecided", ""
        return "none compared" if score.beyond_horizon else "no impact", ""
    # Velocities after a head-on impact are right however late it is found: then its time is shown.
    time_s, rounding = score.total.time_s, THRESHOLDS.rounding_of(score.float_bits)
    velocity, spin = score.total.velocity, score.total.spin
    rounding_s = THRESHOLDS.time_rounding_of(score.float_bits, score.scales.time_s, row.job.dt_s)
    if velocity <= rounding and not spin > rounding and abs(time_s) > rounding_s:
        away = formatting.steps(abs(time_s), row.job.dt_s)
        return f"{away} {'late' if time_s > 0 else 'early'}", away
    symbol, worse = ("RΔω", spin) if spin > velocity else ("Δv", velocity)  # if no disc spins, spin is NaN
    shown = formatting.number(worse)
    paid = "" if math.isnan(score.price_paid) else f", {formatting.number(score.price_paid)} of PIT's"
    return f"{symbol} {shown}{paid}", shown


def _group_not_run(results: Results, columns: Mapping[Method, GridColumn], scene_count: int) -> tuple[NotRun, ...]:
    found: dict[tuple[Mark, str, str], tuple[dict[str, None], dict[str, None]]] = {}
    for row in results.rows:
        mark = mark_of(row)
        if not mark.ran:
            names, scenes = found.setdefault((mark, row.job.engine, "; ".join(reasons_of(row))), ({}, {}))
            names[columns[row.job.method].name] = None
            scenes[row.job.scene.name] = None
    return tuple(
        NotRun(mark, reason, tuple(names), tuple(scenes), len(scenes) == scene_count)
        for (mark, _, reason), (names, scenes) in found.items()
    )
