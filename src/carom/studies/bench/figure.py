"""Diagrams of a bench: error against run time, error against step size, and run time against step size."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from carom.comparator.thresholds import THRESHOLDS
from carom.report import svg
from carom.studies.bench.options import Diagram, ErrorKind
from carom.studies.bench.result import Curve, Point, SceneBench, read_run_time
from carom.studies.bench.tables import EXACT, build_point_anchor, format_milliseconds, format_point_name
from carom.support import formatting

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH_IN, _HEIGHT_IN = 7.4, 4.8
#: Factor by which exact results are drawn below the lowest tick of the logarithmic axis.
_FOOT = 10.0**0.5
#: Errors at which the diagram has guide lines: a hundredth and a thousandth.
_MARKED = (1e-2, 1e-3)


def render_diagram_svg(bench: SceneBench, axes: Diagram, error: ErrorKind, narrow: bool = False) -> str:
    """Return a diagram as SVG with the colours of the page. A narrow diagram fits a phone."""
    with svg.use_drawing_style():
        links = {build_point_anchor(bench.scene.name, point): format_point_name(point) for point in bench.points}
        figure = _draw_figure(bench, axes, error, narrow=narrow)
        return svg.render(figure, f"{axes.heading}, {bench.scene.name}", links, narrow=narrow)


def render_diagram_png(bench: SceneBench, axes: Diagram, error: ErrorKind, foot: Sequence[str]) -> bytes:
    """Return a diagram as PNG, with the lines of text in `foot` at its bottom."""
    with svg.use_drawing_style():
        return svg.render_png(_draw_figure(bench, axes, error, foot))


def _draw_figure(
    bench: SceneBench, kind: Diagram, error: ErrorKind, foot: Sequence[str] = (), *, narrow: bool = False
) -> Figure:
    title = bench.scene.name if narrow else f"{bench.scene.name}: {kind.heading.lower()}"
    figure, axes = svg.build_framed_figure(_WIDTH_IN, _HEIGHT_IN, title, foot, narrow=narrow)
    axes.set(xscale="log", yscale="log")
    errors = [point.error for point in bench.points if math.isfinite(point.error)]
    above = [one for one in errors if one > THRESHOLDS.rounding] or [1e-3]
    floor = 10.0 ** math.floor(math.log10(min(above))) / _FOOT
    drawn = _Drawing(axes, bench, kind, error, floor, max([*above, 0.02]))
    drawn.set_scales()
    for curve in bench.curves:
        drawn.draw_curve(curve)
    svg.finish(axes)
    svg.label_lines(figure, axes, drawn.ends)
    return figure


@dataclass
class _Drawing:
    """A diagram under construction. Points with errors within rounding are drawn at the height `floor`."""

    axes: Axes
    bench: SceneBench
    kind: Diagram
    error: ErrorKind
    floor: float
    largest: float
    ends: list[svg.LineEnd] = field(default_factory=list)

    @property
    def unit(self) -> float:
        """Factor that converts an error to the unit of the axis."""
        return 100.0 if self.error.is_percent else 1.0

    def compute_place(self, point: Point) -> tuple[float, float]:
        height = self.unit * (max(point.error, self.floor) if point.error > THRESHOLDS.rounding else self.floor)
        time_ms = 1e3 * read_run_time(point)
        along = time_ms if self.kind is Diagram.ERROR_TIME else point.dt_s
        return along, time_ms if self.kind is Diagram.TIME_DT else height

    def draw_curve(self, curve: Curve) -> None:
        style = svg.choose_line_style(curve.engine, profile=curve.profile)
        placed_points = [(self.compute_place(p), p) for p in curve.points if not p.reason and not math.isnan(p.error)]
        drawn_points = [(place, point) for place, point in placed_points if all(map(math.isfinite, place))]
        if not drawn_points:
            return
        name = {"pit": "PIT"}.get(curve.engine, curve.method.label)
        end = drawn_points[-1][0]
        if curve.is_pic:
            name, end = "PIC", (self.axes.get_xlim()[1], end[1])
            self.draw_exact(drawn_points, style)
        else:
            marks = {key: style.pop(key) for key in ("marker", "markersize", "markerfacecolor")}
            self.axes.plot(*zip(*(place for place, _ in drawn_points), strict=True), **style)
            for (x, y), point in drawn_points:
                sound = self.kind is Diagram.TIME_DT or point.is_correct
                # A point with missed or invented impacts is drawn as a cross, because the error is measured only at the
                # impacts that the method finds.
                as_drawn = marks if sound else {**marks, "marker": "x", "markersize": 6.0}
                self.axes.plot([x], [y], color=style["color"], linestyle="none", zorder=4, **as_drawn)
        for (x, y), point in drawn_points:
            svg.draw_link_target(self.axes, x, y, build_point_anchor(self.bench.scene.name, point))
        self.ends.append(svg.LineEnd(*end, name, style["color"]))

    def draw_exact(self, drawn_points: Sequence[tuple[tuple[float, float], Point]], style: dict[str, object]) -> None:
        """Draw PIC as a line across the diagram. If the diagram shows run times, also draw a mark at PIC's run time."""
        (x, y), point = drawn_points[0]
        self.axes.axhline(y, color=style["color"], linewidth=1.8, zorder=2)
        if self.kind is not Diagram.ERROR_DT:
            self.axes.plot([x], [y], "o", color=style["color"], markersize=8.0, zorder=4)
        if point.timing is not None and self.kind is Diagram.ERROR_TIME:
            spent = f"PIC: exact in {format_milliseconds(point.timing.advance_s)} ms"
            self.axes.annotate(spent, (x, y), (4, 7), textcoords="offset points", fontsize=8.5, color=svg.INK)

    def set_scales(self) -> None:
        axes, points = self.axes, [point for point in self.bench.points if not point.reason]
        if self.kind is Diagram.TIME_DT:
            axes.set_ylabel("run time, ms")
            axes.yaxis.set_major_formatter(svg.format_tick)
        else:
            self.set_error_scale()
        if self.kind is Diagram.ERROR_TIME:
            axes.set_xlabel("run time, ms")
            axes.xaxis.set_major_formatter(svg.format_tick)
            times = [x for x, _ in map(self.compute_place, points) if math.isfinite(x)]
            axes.set_xlim(min(times) / 1.6, 1.6 * max(times))
        else:
            steps = sorted({point.dt_s for point in points}, reverse=True)
            axes.set_xlim(max(steps) * 1.2, min(steps) / 1.2)  # the left end of the axis has the large step sizes
            axes.set_xticks(steps, [formatting.format_step(dt_s).removesuffix(" s") for dt_s in steps], fontsize=7.5)
            axes.set_xlabel("step, s")
            axes.minorticks_off()

    def set_error_scale(self) -> None:
        axes, axis_max = self.axes, 2.0 * self.largest
        axes.set_ylabel(self.error.label)
        ticks = [10.0**k for k in range(round(math.log10(self.floor * _FOOT)), 2) if 10.0**k < axis_max]
        marked = [tick for tick in ticks if self.error.is_percent and any(math.isclose(tick, m) for m in _MARKED)]
        words = [
            formatting.format_percent(t) if t in marked else formatting.format_number(self.unit * t) for t in ticks
        ]
        axes.set_yticks([self.unit * one for one in (self.floor, *ticks)], [EXACT, *words])
        axes.set_ylim(self.unit * self.floor / 10.0**0.25, self.unit * axis_max)
        for one in marked:
            axes.axhline(self.unit * one, color=svg.MUTED, linewidth=0.9, linestyle=(0, (4, 3)), zorder=1)
