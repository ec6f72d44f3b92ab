"""How errors shrink with the step: medians over one set of scenes, so that a point compares with its neighbours."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from carom.comparator.thresholds import THRESHOLDS
from carom.execution.results import Results, Row
from carom.report import formatting
from carom.report.document import ON_PAPER, Cell, Column, Figure, Figures, Lines, Section, Table, Text
from carom.report.grid import Grid, GridColumn, Mark, mark_of
from carom.report.svg import INK, MUTED, drawing, finish, framed, line_style, render

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_WIDTH_IN, _HEIGHT_IN = 5.6, 4.0


@dataclass(frozen=True)
class TrendPoint:
    """One engine and profile at one refinement.

    Attributes:
        median: Median over scenes of the largest velocity error; None where no scene has one.
        low: Least of these errors.
        high: Greatest of them.
        scenes: How many scenes are in it.
        wrong: How many of all graded scenes are wrong.
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
    """The points of an engine and profile, one for each refinement.

    Attributes:
        column: The engine and profile.
        points: One for each refinement.
        name: What the legend and the table call it.
    """

    column: GridColumn
    points: tuple[TrendPoint, ...]
    name: str


@dataclass(frozen=True)
class Trend:
    """Error against step.

    Attributes:
        parts: The step of each refinement in parts of the scene's coarsest, 1 first.
        coarsest_s: Least and greatest of the scenes' coarsest steps, seconds.
        series: One for each column of the grid; one for all profiles of a method of Carom's own that gave the same.
        scenes: Names of the scenes in the velocity medians.
        left_out: Why the others are not, and which they are.
    """

    parts: tuple[float, ...]
    coarsest_s: tuple[float, float]
    series: tuple[Series, ...]
    scenes: tuple[str, ...]
    left_out: tuple[tuple[str, tuple[str, ...]], ...]


def build_trend(results: Results, grid: Grid) -> Trend:
    """Derive the series.

    A median is of use only over the same scenes at every step, so the scenes are chosen once: those in which PIT, at
    every step that was run, finds an impact and gets its velocity wrong by more than rounding.
    """
    by_scene = formatting.together((row.job.scene.name, row) for row in results.rows)
    by_place = formatting.together(((grid.columns[row.job.method], row.job.refinement), row) for row in results.rows)
    refinements = sorted({refinement for _, refinement in by_place})
    coarsest = {row.job.scene.name: row.job.dt_s for row in results.rows if row.job.refinement == 0}
    parts: dict[int, list[float]] = {k: [] for k in refinements}
    for row in results.rows:
        if row.job.scene.name in coarsest:
            parts[row.job.refinement].append(row.job.dt_s / coarsest[row.job.scene.name])
    chosen, left_out = _choose(by_scene)
    return Trend(
        parts=tuple(map(statistics.median, parts.values())),
        coarsest_s=(min(coarsest.values(), default=0.0), max(coarsest.values(), default=0.0)),
        series=tuple(
            _merged(
                {
                    column: tuple(_point(by_place.get((column, k), ()), chosen) for k in refinements)
                    for column in grid.columns.values()
                }
            )
        ),
        scenes=tuple(chosen),
        left_out=left_out,
    )


def _merged(points: Mapping[GridColumn, tuple[TrendPoint, ...]]) -> Iterator[Series]:
    """Yield the series of each column; profiles of a method of Carom's own that gave the same are one, without profile.

    PIC has nothing to set, and is run under the name of each profile all the same: two lines of it would be one line
    with two names. Engines' profiles differ in settings, and stay apart even where their results agree.
    """
    seen: set[tuple[str, tuple[TrendPoint, ...]]] = set()
    for column, own in points.items():
        alike = column.own and any(
            other.engine == column.engine and other != column and found == own for other, found in points.items()
        )
        if not alike or (column.engine, own) not in seen:
            seen.add((column.engine, own))
            yield Series(column, own, column.label if alike else column.name)


#: Why a scene is not among those whose errors are compared, in the order in which it is told.
_EXACT, _MISSED, _WITHOUT, _OTHER = _LEFT_OUT = (
    "as PIT's velocities are right there at every step that was run",
    "as PIT finds no impact at one of the steps, so that it has no velocity to be wrong",
    "as there is no impact",
    "as the scene is not graded",
)


def _choose(by_scene: Mapping[str, Sequence[Row]]) -> tuple[list[str], tuple[tuple[str, tuple[str, ...]], ...]]:
    found = formatting.together((_left_out(rows), name) for name, rows in by_scene.items())
    return found.get("", []), tuple((why, tuple(found[why])) for why in _LEFT_OUT if why in found)


def _left_out(rows: Sequence[Row]) -> str:
    """Return why the scene of these rows is left out; empty where it is chosen."""
    scores = [row.score for row in rows if row.score is not None]
    sampling = [math.nan if score.sampling is None else score.sampling.velocity for score in scores]
    if not scores or any(mark_of(row) is Mark.UNGRADED for row in rows):
        return _OTHER
    if not scores[0].expected:
        return _WITHOUT
    if any(map(math.isnan, sampling)):
        return _MISSED
    return _EXACT if max(sampling) <= THRESHOLDS.rounding else ""


def _point(rows: Sequence[Row], chosen: Sequence[str]) -> TrendPoint:
    marks = [mark_of(row) for row in rows]
    scores = [row.score for row in rows if row.job.scene.name in chosen and row.score is not None]
    errors = [score.total.velocity for score in scores if not math.isnan(score.total.velocity)]
    return TrendPoint(
        median=statistics.median(errors) if errors else None,
        low=min(errors, default=0.0),
        high=max(errors, default=0.0),
        scenes=len(errors),
        wrong=marks.count(Mark.WRONG),
        graded=sum(mark.ran and mark is not Mark.UNGRADED for mark in marks),
    )


def trend_sections(results: Results, grid: Grid) -> Iterator[Section]:
    """Yield the charts of error and of wrong scenes against the step with their numbers, where there are any."""
    trend = build_trend(results, grid)
    if not any(point.graded for series in trend.series for point in series.points):
        return
    charts = Figures(
        (
            Figure(
                partial(_velocity_chart, trend, "Median velocity error against the step"),
                "Velocity error. Shaded: from the least to the greatest scene, for PIT.",
            ),
            Figure(
                partial(_wrong_chart, trend, "Scenes graded wrong, against the step"),
                "Wrong: an impact missed, invented or out of order, a run that ends early or is not finite.",
            ),
        )
    )
    steps = [(k, f"step {formatting.part(part)}") for k, part in enumerate(trend.parts)]
    columns = [Column("engine", lambda series: series.name)]
    columns += [Column("velocity error", _at(k, _error), step) for k, step in steps]
    columns += [
        Column("scenes wrong", _at(k, lambda point: f"{point.wrong} of {point.graded}"), step) for k, step in steps
    ]
    table = Table(
        columns,
        trend.series,
        note="Velocity error: median over scenes (least to greatest; scenes).",
        folded="The numbers of these charts",
        only=ON_PAPER,
    )
    wrong = "Scenes that are wrong are counted among all graded ones."
    said = (
        f"Velocity errors are medians over the same {formatting.count(len(trend.scenes), 'scene')} at every step, or "
        "over "
        f"as many of these as a method found an impact in. {wrong}"
        if trend.scenes
        else f"In no scene does PIT have a velocity error at every step, so there are no medians. {wrong}"
    )
    scenes = Lines(tuple(_trend_scenes(trend)), ON_PAPER, folded="Which scenes these are")
    yield Section("Error against step", (charts, Text(said, ON_PAPER), table, scenes))


def _at(k: int, say: Callable[[TrendPoint], Cell | str]) -> Callable[[Series], Cell | str]:
    """Return what a column says of the k-th point of a series."""
    return lambda series: say(series.points[k])


def _error(point: TrendPoint) -> Cell | str:
    if point.median is None:
        return formatting.ABSENT
    return Cell(
        formatting.number(point.median),
        f"({formatting.number(point.low)} to {formatting.number(point.high)}; {point.scenes})",
    )


def _trend_scenes(trend: Trend) -> Iterator[str]:
    """Say which scenes the velocity errors are medians of, why the others are not, and where one is missing."""
    if trend.scenes:
        yield f"Velocity errors are of {formatting.listed(trend.scenes)}."
    for why, names in trend.left_out:
        yield f"Left out, {why}: {formatting.listed(names)}."
    few = [
        f"{series.name} has {point.scenes} of the {len(trend.scenes)} at step {formatting.part(part)}"
        for series in trend.series
        for point, part in zip(series.points, trend.parts, strict=True)
        if point.scenes < len(trend.scenes)
    ]
    if few:
        yield f"Fewer scenes, where an engine matched no impact or was not run: {'; '.join(few)}."


def _velocity_chart(trend: Trend, label: str) -> str:
    with drawing():
        figure, axes = framed(_WIDTH_IN, _HEIGHT_IN)
        medians = [p.median for s in trend.series for p in s.points if p.median is not None]
        seen = [median for median in medians if median > THRESHOLDS.rounding and math.isfinite(median)]
        bottom = 10.0 ** math.floor(math.log10(min(seen, default=0.1)))
        top = 10.0 ** math.ceil(math.log10(max(seen, default=1.0) * 1.01))
        floor = bottom / 10.0**0.35  # rounding is drawn at the foot, what is infinite at the top
        axes.set_yscale("log")
        axes.set_ylim(bottom / 10.0**0.7, top)
        axes.axhspan(bottom / 10.0**0.7, bottom, color=MUTED, alpha=0.1, linewidth=0)

        def height(point: TrendPoint) -> float:
            if point.median is None:
                return math.nan
            at: float = min(max(point.median, floor), top) if point.median > THRESHOLDS.rounding else floor
            return at

        for series in trend.series:
            _line(axes, trend, series, [height(point) for point in series.points])
            if series.column.engine == "pit":
                low = [max(p.low, floor) for p in series.points]
                high = [min(max(p.high, floor), top) for p in series.points]
                axes.fill_between(trend.parts, low, high, color=INK, alpha=0.08, linewidth=0)
        ticks = [10.0**k for k in range(round(math.log10(bottom)), round(math.log10(top)) + 1)]
        axes.set_yticks(
            [floor, *ticks], [f"≤ {formatting.number(THRESHOLDS.rounding)}", *map(formatting.number, ticks)]
        )
        axes.set_ylabel("velocity error, median over scenes", labelpad=2)
        _x_axis(axes, trend)
        return render(figure, label)


def _wrong_chart(trend: Trend, label: str) -> str:
    with drawing():
        from matplotlib.ticker import MaxNLocator

        figure, axes = framed(_WIDTH_IN, _HEIGHT_IN)
        most = max((p.wrong for s in trend.series for p in s.points), default=0)
        axes.set_ylim(-0.05 * max(most, 1), 1.08 * max(most, 1))
        for series in trend.series:
            _line(axes, trend, series, [float(p.wrong) if p.graded else math.nan for p in series.points])
        axes.yaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_ylabel("scenes graded wrong")
        _x_axis(axes, trend)
        return render(figure, label)


def _x_axis(axes: Axes, trend: Trend) -> None:
    axes.set_xscale("log")
    # From coarse to fine in the direction of reading.
    axes.set_xlim(max(trend.parts) * 1.25, min(trend.parts) / 1.25)
    axes.set_xticks(trend.parts, [formatting.part(part) for part in trend.parts])
    axes.minorticks_off()
    low, high = (formatting.step(dt_s) for dt_s in trend.coarsest_s)
    between = high if low == high else f"{high} to {low}"
    axes.set_xlabel(f"step, in parts of the scene's coarsest ({between})")
    finish(axes)


def _line(axes: Axes, trend: Trend, series: Series, heights: Sequence[float]) -> None:
    column = series.column
    style = line_style(column.engine, profile=column.method.profile)
    axes.plot(trend.parts, heights, label=series.name, clip_on=False, **style)
