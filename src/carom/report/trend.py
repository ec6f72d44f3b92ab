"""How errors shrink with the step: medians over one set of scenes, so that a point compares with its neighbours."""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping
from dataclasses import dataclass

from carom.comparator.thresholds import THRESHOLDS
from carom.report.grid import Column, Grid
from carom.report.marks import Mark, mark_of
from carom.runs.results import Results, Row

__all__ = ["Point", "Series", "Trend", "build_trend"]

_Rows = Mapping[tuple[str, Column, int], Row]


@dataclass(frozen=True)
class Point:
    """One engine and profile at one refinement.

    Attributes:
        median: Median over scenes of the largest velocity error; None where no scene has one.
        low: Least of these errors.
        high: Greatest of them.
        scenes: How many scenes are in it.
        wrong: How many of all graded scenes miss or invent an impact.
        graded: How many scenes were graded.
    """

    median: float | None
    low: float
    high: float
    scenes: int
    wrong: int
    graded: int


@dataclass(frozen=True)
class Series:
    """The points of an engine and profile, one for each refinement."""

    column: Column
    points: tuple[Point, ...]


@dataclass(frozen=True)
class Trend:
    """Error against step.

    Attributes:
        parts: The step of each refinement in parts of the scene's coarsest, 1 first.
        coarsest_s: Least and greatest of the scenes' coarsest steps, seconds.
        series: One for each column of the grid.
        scenes: Names of the scenes in the velocity medians.
        left_out: Why the others are not, and which they are.
    """

    parts: tuple[float, ...]
    coarsest_s: tuple[float, float]
    series: tuple[Series, ...]
    scenes: tuple[str, ...]
    left_out: tuple[tuple[str, tuple[str, ...]], ...]

    @property
    def drawable(self) -> bool:
        """Whether there is anything to draw."""
        return any(point.graded for series in self.series for point in series.points)


def build_trend(results: Results, grid: Grid) -> Trend:
    """Derive the series.

    A median is of use only over the same scenes at every step, so the scenes are chosen once: those in which PIT, at
    every step that was run, finds an impact and gets its velocity wrong by more than rounding.
    """
    by_name = {(column.engine, column.profile): column for column in grid.columns}
    rows = {
        (row.job.scene.name, by_name[row.job.engine, row.job.profile], row.job.refinement): row for row in results.rows
    }
    refinements = sorted({row.job.refinement for row in results.rows})
    names = [row.scene.name for row in grid.rows]
    coarsest = {name: row.job.dt_s for (name, _, refinement), row in rows.items() if refinement == 0}
    chosen, left_out = _choose(rows, names)
    return Trend(
        parts=tuple(
            statistics.median(
                row.job.dt_s / coarsest[name] for (name, _, at), row in rows.items() if at == k and name in coarsest
            )
            for k in refinements
        ),
        coarsest_s=(min(coarsest.values(), default=0.0), max(coarsest.values(), default=0.0)),
        series=tuple(
            Series(column, tuple(_point(rows, column, k, names, chosen) for k in refinements))
            for column in grid.columns
        ),
        scenes=tuple(chosen),
        left_out=left_out,
    )


def _choose(rows: _Rows, names: list[str]) -> tuple[list[str], tuple[tuple[str, tuple[str, ...]], ...]]:
    chosen, exact, missed, without, other = [], [], [], [], []
    for name in names:
        scores = [row.score for (scene, _, _), row in rows.items() if scene == name and row.score is not None]
        sampling = [math.nan if score.sampling is None else score.sampling.velocity for score in scores]
        if not scores or any(mark_of(row) is Mark.UNGRADED for (scene, _, _), row in rows.items() if scene == name):
            other.append(name)
        elif not scores[0].expected:
            without.append(name)
        elif any(map(math.isnan, sampling)):
            missed.append(name)
        elif max(sampling) <= THRESHOLDS.rounding:
            exact.append(name)
        else:
            chosen.append(name)
    reasons = (
        ("as PIT is wrong there in time only, its velocities are right at any step", exact),
        ("as PIT finds no impact at one of the steps, so that it has no velocity to be wrong", missed),
        ("as there is no impact", without),
        ("as the scene is not graded", other),
    )
    return chosen, tuple((why, tuple(names)) for why, names in reasons if names)


def _point(rows: _Rows, column: Column, refinement: int, names: list[str], chosen: list[str]) -> Point:
    own = {name: rows[name, column, refinement] for name in names if (name, column, refinement) in rows}
    marks = [mark_of(row) for row in own.values()]
    errors = [
        score.total.velocity
        for name in chosen
        if name in own and (score := own[name].score) is not None and not math.isnan(score.total.velocity)
    ]
    return Point(
        median=statistics.median(errors) if errors else None,
        low=min(errors, default=0.0),
        high=max(errors, default=0.0),
        scenes=len(errors),
        wrong=marks.count(Mark.WRONG),
        graded=sum(mark.ran and mark is not Mark.UNGRADED for mark in marks),
    )
