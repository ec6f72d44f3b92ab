"""Section on how errors depend on the step size. The medians at all step sizes include the same scenes."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from carom.comparator.thresholds import THRESHOLDS
from carom.execution.job import Method
from carom.report import svg
from carom.report.document import Cell, Column, Figure, Figures, Lines, Media, Section, Table, Text
from carom.report.outcome_marks import Mark
from carom.studies.cross_check.grid import Grid, GridCell, merge_own_profiles
from carom.support import formatting

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_WIDTH_IN, _HEIGHT_IN = 5.6, 4.0

DETAIL_NOTE = (
    "Medians at different step sizes are only comparable if they include the same scenes. Therefore the medians only "
    "include scenes in which PIT finds an impact at every step size, and in which PIT's velocity error exceeds "
    "rounding at some step size. A method's median omits scenes in which the method finds no impact."
)


class TrendPoint(NamedTuple):
    """Results of an engine and profile at one step size.

    Attributes:
        errors: Largest velocity error in each scene that the median includes. Scenes without a velocity error are
            omitted.
        wrong: Number of scenes with grade *wrong*.
        graded: Number of graded scenes.
    """

    errors: tuple[float, ...]
    wrong: int
    graded: int

    @property
    def median(self) -> float:
        """Median of the errors; NaN if there are no errors."""
        return statistics.median(self.errors) if self.errors else math.nan


class Series(NamedTuple):
    """Results of an engine and profile at each step size, and the name that the legend and the table show."""

    method: Method
    points: tuple[TrendPoint, ...]
    name: str


class Trend(NamedTuple):
    """Error against step size.

    Attributes:
        parts: Step sizes as fractions of each scene's largest step size, beginning with 1.
        coarsest_s: Range of the scenes' largest step sizes: the smallest and the largest of them, in seconds.
        series: One series for each method. If profiles of one of Carom's own methods have equal results, they share a
            series.
        scenes: Names of the scenes in the velocity medians.
        left_out: Names of the scenes that are not in the medians, by reason.
    """

    parts: tuple[float, ...]
    coarsest_s: tuple[float, float]
    series: tuple[Series, ...]
    scenes: tuple[str, ...]
    left_out: Mapping[str, Sequence[str]]


#: Reasons to omit a scene from the medians, in the order of the report.
_EXACT, _MISSED, _WITHOUT, _OTHER = _LEFT_OUT = (
    "PIT's velocities are correct at every step size",
    "PIT finds no impact at one of the step sizes, so PIT has no velocity error",
    "there is no impact",
    "the scene is not graded",
)


def build_trend(grid: Grid) -> Trend:
    """Compute the error and the number of *wrong* scenes for each method and step size."""
    by_place = formatting.group_by(((cell.method, cell.line.refinement), cell) for cell in grid.runs)
    coarsest = {cell.scene: cell.line.dt_s for cell in grid.runs if cell.line.refinement == 0}
    planned = [cell for cell in grid.runs if cell.scene in coarsest]
    ratios = formatting.group_by((one.line.refinement, one.line.dt_s / coarsest[one.scene]) for one in planned)
    by_scene = formatting.group_by((cell.scene, cell) for cell in grid.runs)
    why = formatting.group_by((_find_omission_reason(cells), name) for name, cells in by_scene.items())
    chosen = why.pop("", [])
    points = {
        method: tuple(_build_point(by_place.get((method, k), ()), chosen) for k in sorted(ratios))
        for method in grid.methods
    }
    return Trend(
        parts=tuple(statistics.median(ratios[k]) for k in sorted(ratios)),
        coarsest_s=(min(coarsest.values(), default=0.0), max(coarsest.values(), default=0.0)),
        series=tuple(
            Series(method, points[method], method.heading if others else method.title)
            for method, *others in merge_own_profiles(points)
        ),
        scenes=tuple(chosen),
        left_out={reason: why[reason] for reason in _LEFT_OUT if reason in why},
    )


def _find_omission_reason(cells: Sequence[GridCell]) -> str:
    """Return the reason why the scene of these cells is omitted; empty if it is used."""
    scored = [cell for cell in cells if cell.scored]
    if not scored or any(cell.mark is Mark.UNGRADED for cell in cells):
        return _OTHER
    if not scored[0].expected:
        return _WITHOUT
    sampling = [math.nan if (error := cell.pit.get("velocity")) is None else float(error) for cell in scored]
    if any(map(math.isnan, sampling)):
        return _MISSED
    return _EXACT if max(sampling) <= THRESHOLDS.rounding else ""


def _build_point(cells: Sequence[GridCell], chosen: Sequence[str]) -> TrendPoint:
    marks = [cell.mark for cell in cells]
    velocities = [cell.errors.velocity for cell in cells if cell.scene in chosen]
    errors = tuple(error for error in velocities if not math.isnan(error))
    return TrendPoint(errors, marks.count(Mark.WRONG), sum(mark.rank is not None for mark in marks))


def build_trend_section(grid: Grid) -> Section:
    """Return a section with two charts and a table: error and number of *wrong* scenes for each step size.

    The section is empty if there is only one step size, or if no run is graded.
    """
    trend = build_trend(grid)
    if len(trend.parts) == 1 or not any(point.graded for series in trend.series for point in series.points):
        return Section("", ())
    wrong = "Scenes in which a method misses or invents an impact, has impacts out of order, or ends differently."
    velocity = "Velocity error. The shaded area extends from PIT's smallest to PIT's largest error."
    charts = (
        Figure(partial(_render_chart, trend, "Median velocity error by step size", _scale_velocity_axis), velocity),
        Figure(partial(_render_chart, trend, "Scenes graded wrong, against step size", _scale_wrong_axis), wrong),
    )
    steps = [(k, f"step {formatting.format_fraction(part)}") for k, part in enumerate(trend.parts)]
    columns = [Column("engine", lambda series: series.name)]
    columns += [Column("velocity error", partial(_format_error, k), step) for k, step in steps]
    columns += [Column("scenes wrong", partial(_format_wrong, k), step) for k, step in steps]
    note = "Velocity errors are medians over scenes. In brackets: smallest error, largest error and number of scenes."
    table = Table(columns, trend.series, note=note, folded="The numbers of these charts", only=Media.ON_PAPER)
    text = "There are no medians: there is no scene in which PIT has a velocity error at every step size"
    if trend.scenes:
        scenes_used = formatting.format_count(len(trend.scenes), "scene")
        text = f"Velocity errors are medians over {scenes_used} at every step size"
    scenes = Lines(tuple(_describe_scenes(trend)), Media.ON_PAPER, folded="Scenes in the medians")
    blocks = (
        Figures(charts),
        Text(f"{text}. The charts of wrong scenes count all graded scenes.", Media.ON_PAPER),
        Text(DETAIL_NOTE, Media.ON_PAPER, folded=True),
        table,
        scenes,
    )
    return Section("Error against step size", blocks)


def _format_wrong(k: int, series: Series) -> str:
    return f"{series.points[k].wrong} of {series.points[k].graded}"


def _format_error(k: int, series: Series) -> Cell | str:
    point = series.points[k]
    if not point.errors:
        return formatting.ABSENT
    span = f"{formatting.format_number(min(point.errors))} to {formatting.format_number(max(point.errors))}"
    return Cell(formatting.format_number(point.median), f"({span}; {len(point.errors)})")


def _describe_scenes(trend: Trend) -> Iterator[str]:
    """Describe the scenes in the medians, and why other scenes are omitted."""
    if trend.scenes:
        yield f"Velocity errors are medians over {formatting.join_words(trend.scenes)}."
    for why, names in trend.left_out.items():
        yield f"These scenes are omitted, because {why}: {formatting.join_words(names)}."


def _render_chart(
    trend: Trend, label: str, scale: Callable[[Trend, Axes], Callable[[TrendPoint], float]], narrow: bool = False
) -> str:
    """Return a chart as SVG, with a line for each method.

    `scale` prepares the y axis, and returns a function that computes the height of a point on this axis.
    """
    with svg.use_drawing_style():
        figure, axes = svg.build_framed_figure(_WIDTH_IN, _HEIGHT_IN, narrow=narrow, below=len(trend.series))
        height_of = scale(trend, axes)
        for series in trend.series:
            style = svg.choose_line_style(series.method.engine, profile=series.method.profile)
            axes.plot(trend.parts, list(map(height_of, series.points)), label=series.name, clip_on=False, **style)
        low, high = (formatting.format_step(dt_s) for dt_s in trend.coarsest_s)
        between = high if low == high else f"{high} to {low}"
        axes.set(xscale="log", xlabel=f"step size, as a fraction of the largest ({between})")
        # The left end of the axis has the large step sizes.
        axes.set_xlim(max(trend.parts) * 1.25, min(trend.parts) / 1.25)
        axes.set_xticks(trend.parts, [formatting.format_fraction(part) for part in trend.parts])
        axes.minorticks_off()
        svg.finish(axes, figure if narrow else None)
        return svg.render(figure, label, narrow=narrow)


def _scale_velocity_axis(trend: Trend, axes: Axes) -> Callable[[TrendPoint], float]:
    """Prepare the y axis for velocity errors, and shade the area from PIT's smallest to PIT's largest error."""
    place = svg.scale_error_axis(axes, "y", [p.median for series in trend.series for p in series.points])
    axes.set_ylabel("velocity error, median over scenes", labelpad=2)
    for series in trend.series:
        if series.method.engine == "pit":
            low, high = ([place(end(p.errors, default=0.0)) for p in series.points] for end in (min, max))
            axes.fill_between(trend.parts, low, high, color=svg.INK, alpha=0.08, linewidth=0)
    return lambda point: place(point.median) if point.errors else math.nan


def _scale_wrong_axis(trend: Trend, axes: Axes) -> Callable[[TrendPoint], float]:
    from matplotlib.ticker import MaxNLocator

    max_wrong = max(1, *(p.wrong for series in trend.series for p in series.points))
    axes.set_ylim(-0.05 * max_wrong, 1.08 * max_wrong)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylabel("scenes graded wrong")
    return lambda point: float(point.wrong) if point.graded else math.nan
