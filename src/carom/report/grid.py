"""The view that all formats share: scenes down, engines and profiles across, at each scene's coarsest step."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from carom.comparator.thresholds import THRESHOLDS
from carom.report import wording
from carom.report.marks import Mark, mark_of
from carom.runs.results import Results, Row
from carom.scene import Scene
from carom.trace import Outcome

__all__ = ["Column", "Grid", "GridCell", "GridRow", "Unrun", "build_grid", "is_own_method", "reasons_of"]

#: Where a column has no row for a scene; `carom.runs` drops a profile whose settings another one has too.
NOT_PLANNED = "no row of its own: its settings at this step are those of another profile of the engine"
NO_REFERENCE = "PIC does not solve this scene, so there is no reference to hold the run against"


class Column(NamedTuple):
    """An engine with a profile.

    Attributes:
        engine: Name of the adapter.
        profile: Name of the profile.
        own: Whether it is one of Carom's own methods.
    """

    engine: str
    profile: str
    own: bool

    @property
    def label(self) -> str:
        """What a heading calls the engine: Carom's methods by their initials, an adapter by its name."""
        return self.engine.upper() if self.own else self.engine

    @property
    def name(self) -> str:
        """Engine and profile in one word group."""
        return f"{self.label} {self.profile}"


@dataclass(frozen=True)
class GridCell:
    """One cell of the grid.

    Attributes:
        column: Its engine and profile.
        mark: What came of it.
        figure: The number that matters most, in words; empty where there is none.
        compact: The same for a terminal.
        reasons: Every verdict with its numbers, or why it was not run, as sentences.
        row: The row behind it; None where none was planned.
    """

    column: Column
    mark: Mark
    figure: str
    compact: str
    reasons: tuple[str, ...]
    row: Row | None

    @property
    def plays(self) -> bool:
        """Whether there is a run and a reference, so that the one can be played beside the other."""
        return self.row is not None and self.row.trace is not None and self.row.score is not None


@dataclass(frozen=True)
class GridRow:
    """One scene and its cells, in the order of the columns."""

    scene: Scene
    group: str
    cells: tuple[GridCell, ...]

    @property
    def short_name(self) -> str:
        """The scene's name without its group."""
        return self.scene.name.removeprefix(f"{self.group}/") if self.group else self.scene.name


class Unrun(NamedTuple):
    """Cells, at any step, that were not run or not scored for one and the same reason."""

    mark: Mark
    reason: str
    columns: tuple[str, ...]
    scenes: tuple[str, ...]
    everywhere: bool  # whether these are all scenes of the cross-check


@dataclass(frozen=True)
class Grid:
    """All cells at each scene's coarsest step, and what was not run at any step.

    Attributes:
        columns: Engines with profiles, in the order of the rows.
        rows: Scenes, those of a group together.
        own_frame_rate: Whether each scene's coarsest step is its own frame.
        unrun: What was not run, and why.
    """

    columns: tuple[Column, ...]
    rows: tuple[GridRow, ...]
    own_frame_rate: bool
    unrun: tuple[Unrun, ...]

    @property
    def step_phrase(self) -> str:
        """At which steps the cells are, for a sentence."""
        return "each scene's own frame rate" if self.own_frame_rate else "the coarsest step"

    @property
    def groups(self) -> tuple[tuple[str, tuple[GridRow, ...]], ...]:
        """The rows by group, groups in the order in which they first come."""
        names = dict.fromkeys(row.group for row in self.rows)
        return tuple((name, tuple(row for row in self.rows if row.group == name)) for name in names)

    def cells(self, column: Column) -> tuple[GridCell, ...]:
        """Return the cells of a column."""
        index = self.columns.index(column)
        return tuple(row.cells[index] for row in self.rows)

    def tally(self, column: Column) -> tuple[tuple[Mark, int], ...]:
        """Return how many cells of a column have each mark, in the order of the marks."""
        found = Counter(cell.mark for cell in self.cells(column))
        return tuple((mark, found[mark]) for mark in Mark if found[mark])

    @property
    def marks(self) -> tuple[Mark, ...]:
        """The marks that a reader of this grid needs explained: the grades, and whatever else occurs."""
        present = {cell.mark for row in self.rows for cell in row.cells}
        grades = {Mark.EXACT, Mark.CLOSE, Mark.SAMPLED, Mark.INACCURATE, Mark.WRONG}
        return tuple(mark for mark in Mark if mark in present | grades)


def is_own_method(results: Results) -> Mapping[str, bool]:
    """Return, by adapter name, whether an engine asked for is one of Carom's own methods."""
    return {info.name: info.engine == "Carom" for info in results.engines}


def build_grid(results: Results) -> Grid:
    """Derive the grid."""
    own = is_own_method(results)
    columns = tuple(
        Column(engine, profile, own.get(engine, False))
        for engine, profile in dict.fromkeys((row.job.engine, row.job.profile) for row in results.rows)
    )
    # A profile can come in at a later step only; among an engine's columns its own order decides.
    engines = list(dict.fromkeys(column.engine for column in columns))
    columns = tuple(sorted(columns, key=lambda column: engines.index(column.engine)))
    coarsest = {
        (row.job.scene.name, row.job.engine, row.job.profile): row for row in results.rows if row.job.refinement == 0
    }
    scenes = {row.job.scene.name: row.job.scene for row in results.rows}
    rows = tuple(
        GridRow(
            scene=scene,
            group=name.partition("/")[0] if "/" in name else "",
            cells=tuple(_cell(column, coarsest.get((name, column.engine, column.profile))) for column in columns),
        )
        for name, scene in scenes.items()
    )
    return Grid(
        columns=columns,
        rows=rows,
        own_frame_rate=all(
            math.isclose(row.job.dt_s * row.job.scene.frame_rate_hz, 1.0, rel_tol=wording.WHOLE)
            for row in coarsest.values()
        ),
        unrun=_unrun(results, own, len(scenes)),
    )


def reasons_of(row: Row | None) -> tuple[str, ...]:
    """Return every verdict with its numbers, or why there is none, as sentences without a full stop."""
    if row is None:
        return (NOT_PLANNED,)
    if row.reason:
        return (row.reason,)
    if row.score is None:
        return (NO_REFERENCE,)
    # An engine that was cut short on its own warning, a reset say, is told in its own words first.
    warned = row.trace.notes if row.trace is not None and row.trace.outcome is Outcome.WARNED else ()
    untimed = (f"not timed: {row.untimed}",) if row.untimed else ()
    return (*warned, *(f"{finding.verdict.value} ({finding.reason})" for finding in row.score.findings), *untimed)


def _cell(column: Column, row: Row | None) -> GridCell:
    figure, compact = _figure(row)
    return GridCell(column, mark_of(row), figure, compact, reasons_of(row), row)


def _figure(row: Row | None) -> tuple[str, str]:
    """Return the number that matters most: impacts missed or invented, else velocity, else time."""
    if row is None or row.score is None:
        return "", ""
    score = row.score
    missed, invented = len(score.missed), len(score.spurious)
    if missed or invented:
        parts = [f"{missed} of {score.expected} missed"] if missed else []
        parts += [f"{invented} invented"] if invented else []
        compact = " ".join(([f"-{missed}"] if missed else []) + ([f"+{invented}"] if invented else []))
        return ", ".join(parts), compact
    if not score.errors:
        return "all beyond the horizon" if score.beyond_horizon else "no impact", ""
    # Head-on, velocities come out right however late the impact is found: then the time is what there is to say.
    time_s, rounding = score.total.time_s, THRESHOLDS.rounding_of(score.float_bits)
    if score.total.velocity <= rounding and abs(time_s) > rounding * score.scales.time_s:
        away = wording.steps(abs(time_s), row.job.dt_s)
        return f"{away} {'late' if time_s > 0 else 'early'}", away.replace(" steps", " dt").replace(" step", " dt")
    shown = wording.number(score.total.velocity)
    paid = "" if math.isnan(score.price_paid) else f", pays {wording.number(score.price_paid)}"
    return f"Δv {shown}{paid}", shown


def _unrun(results: Results, own: Mapping[str, bool], scene_count: int) -> tuple[Unrun, ...]:
    found: dict[tuple[Mark, str, str], tuple[dict[str, None], dict[str, None]]] = {}
    for row in results.rows:
        mark = mark_of(row)
        if mark.ran:
            continue
        engine, reason = row.job.engine, "; ".join(reasons_of(row))
        columns, scenes = found.setdefault((mark, engine, reason), ({}, {}))
        columns[Column(engine, row.job.profile, own.get(engine, False)).name] = None
        scenes[row.job.scene.name] = None
    return tuple(
        Unrun(mark, reason, tuple(columns), tuple(scenes), len(scenes) == scene_count)
        for (mark, _, reason), (columns, scenes) in found.items()
    )
