"""The diagrams of a bench: error against run time, error against the step, run time against the step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from carom.comparator.thresholds import THRESHOLDS
from carom.pages import wording
from carom.pages.svg import MUTED, SERIES, aim, drawing, finish, framed, line_style, plain_number, png, render
from carom.studies.bench.axes import Diagram
from carom.studies.bench.noise import Spread
from carom.studies.bench.result import Curve, Point, SceneBench
from carom.studies.bench.tables import is_floor, point_anchor, point_name
from carom.studies.bench.timing_pass import CellTiming

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH_IN, _HEIGHT_IN = 8.6, 5.2
#: An error at rounding is drawn at the foot of the diagram, half a decade below the least of the others.
_FOOT = 10.0**0.5


def diagram_svg(bench: SceneBench, axes: Diagram, error_label: str, whole: bool = False) -> str:
    """Return a diagram as SVG that takes its colours from the page around it."""
    with drawing():
        points = [point for curve in bench.curves for point in curve.points]
        links = {point_anchor(bench.scene.name, point): point_name(point) for point in points}
        return render(_figure(bench, axes, error_label, whole), f"{axes.heading}, {bench.scene.name}", links)


def diagram_png(bench: SceneBench, axes: Diagram, error_label: str, foot: Sequence[str]) -> bytes:
    """Return a diagram as PNG, with the lines at its foot that say how it was made."""
    with drawing():
        return png(_figure(bench, axes, error_label, whole=False, foot=foot))


def _figure(bench: SceneBench, kind: Diagram, error_label: str, whole: bool, foot: Sequence[str] = ()) -> Figure:
    figure, axes = framed(_WIDTH_IN, _HEIGHT_IN, f"{bench.scene.name}: {kind.heading.lower()}", foot)
    axes.set_xscale("log")
    axes.set_yscale("log")
    errors = [error for curve in bench.curves for point in curve.points if math.isfinite(error := point.error)]
    least = min((error for error in errors if error > THRESHOLDS.rounding), default=1e-3)
    foot_at = 10.0 ** math.floor(math.log10(least)) / _FOOT
    drawn = _Drawing(axes, bench, kind, whole, foot_at, max([*errors, 0.05]))
    for curve in bench.curves:
        drawn.curve(curve)
    drawn.front()
    drawn.cost_of_pic()
    drawn.scales(error_label)
    finish(axes)
    return figure


@dataclass(frozen=True)
class _Drawing:
    """A diagram while it is drawn: with preparation or not, errors at rounding at the floor, and up to the largest."""

    axes: Axes
    bench: SceneBench
    kind: Diagram
    whole: bool
    floor: float
    largest: float

    def clock(self, timing: CellTiming) -> Spread:
        return timing.whole_s if self.whole else timing.advance_s

    def seconds(self, point: Point) -> float:
        return math.nan if point.timing is None else self.clock(point.timing).median

    def place(self, point: Point) -> tuple[float, float]:
        height = max(point.error, self.floor) if point.error > THRESHOLDS.rounding else self.floor
        match self.kind:
            case Diagram.ERROR_TIME:
                return self.seconds(point), height
            case Diagram.ERROR_DT:
                return point.dt_s, height
            case Diagram.TIME_DT:
                return point.dt_s, self.seconds(point)

    def curve(self, curve: Curve) -> None:
        style = line_style(curve.engine, profile=curve.profile)
        own = [(self.place(p), p) for p in curve.points if not p.reason and not math.isnan(p.error)]
        kept = [(place, point) for place, point in own if not any(map(math.isnan, place))]
        if not kept:
            return
        marks = {name: style.pop(name) for name in ("marker", "markersize", "markerfacecolor")}
        label = f"{curve.engine} {curve.profile}{_order(curve)}"
        self.axes.plot(*zip(*(place for place, _ in kept), strict=True), label=label, **style)
        for (x, y), point in kept:
            sound = self.kind is Diagram.TIME_DT or point.sound
            # What missed or invented an impact has an error for the others alone: a cross, never a full mark.
            as_drawn = marks if sound else {**marks, "marker": "x", "markersize": 6.0}
            self.axes.plot([x], [y], color=style["color"], linestyle="none", zorder=4, **as_drawn)
        for (x, y), point in kept:
            self.bars(x, y, point, style["color"])
            aim(self.axes, x, y, point_anchor(self.bench.scene.name, point))

    def bars(self, x: float, y: float, point: Point, colour: str) -> None:
        """Draw the quartiles of run time, and the errors from the luckiest start to the unluckiest."""
        if self.kind is not Diagram.ERROR_DT and point.timing is not None:
            found = self.clock(point.timing)
            ends = (found.low, found.high)
            across, up = (ends, (y, y)) if self.kind is Diagram.ERROR_TIME else ((x, x), ends)
            self.axes.plot(across, up, color=colour, linewidth=0.8, alpha=0.6, zorder=2)
        if self.kind is not Diagram.TIME_DT and point.error > THRESHOLDS.rounding:
            least = max(point.error_least, self.floor)
            self.axes.plot((x, x), (least, y), color=colour, linewidth=0.8, alpha=0.35, zorder=2)

    def front(self) -> None:
        if self.kind is Diagram.ERROR_TIME and len(self.bench.front) > 1:
            self.axes.plot(
                *zip(*map(self.place, self.bench.front), strict=True),
                color=MUTED,
                linewidth=7.0,
                alpha=0.16,
                solid_capstyle="round",
                zorder=1,
                drawstyle="steps-post",
                label="Pareto front",
            )

    def cost_of_pic(self) -> None:
        clocks = [self.seconds(p) for curve in self.bench.curves if is_floor(curve) for p in curve.points if p.timing]
        if clocks and self.kind is not Diagram.ERROR_DT:
            line = self.axes.axvline if self.kind is Diagram.ERROR_TIME else self.axes.axhline
            line(min(clocks), color=SERIES[0], linewidth=0.9, linestyle=":", zorder=1, label="what PIC costs")

    def scales(self, error_label: str) -> None:
        axes = self.axes
        clock = "run time with preparation" if self.whole else "run time of all steps"
        if self.kind is Diagram.TIME_DT:
            axes.set_ylabel(f"{clock}, s")
            axes.yaxis.set_major_formatter(plain_number)
        else:
            axes.set_ylabel(error_label)
            most = 2.0 * self.largest
            ticks = [10.0**k for k in range(round(math.log10(self.floor * _FOOT)), 2) if 10.0**k < most]
            axes.set_yticks(
                [self.floor, *ticks], [f"≤ {wording.number(THRESHOLDS.rounding)}", *map(wording.number, ticks)]
            )
            axes.set_ylim(self.floor / 10.0**0.25, most)
        if self.kind is Diagram.ERROR_TIME:
            axes.set_xlabel(f"{clock}, s")
            axes.xaxis.set_major_formatter(plain_number)
            self.axis_of_pit()
        else:
            steps = sorted({point.dt_s for curve in self.bench.curves for point in curve.points}, reverse=True)
            axes.set_xlim(max(steps) * 1.2, min(steps) / 1.2)  # from coarse to fine in the direction of reading
            axes.set_xticks(steps, [wording.step(dt_s).removesuffix(" s") for dt_s in steps], fontsize=7.5)
            axes.set_xlabel("step, s")
            axes.minorticks_off()

    def axis_of_pit(self) -> None:
        """Add an axis in units of PIT's run time at the coarsest step: the scale that other machines share."""
        pit = [p for curve in self.bench.curves if curve.engine == "pit" for p in curve.points if p.timing]
        if not pit:
            return
        coarsest = max(pit, key=lambda point: point.dt_s)
        unit = self.seconds(coarsest)
        above = self.axes.secondary_xaxis(
            "top", functions=(lambda s: np.divide(s, unit), lambda r: np.multiply(r, unit))
        )
        above.set_xlabel(f"in units of PIT at {wording.step(coarsest.dt_s)}, timed in the same rounds", fontsize=7.5)
        above.xaxis.set_major_formatter(plain_number)
        above.tick_params(labelsize=7.5)


def _order(curve: Curve) -> str:
    order = curve.order
    if math.isnan(order.low):
        return ""
    # Two decimals: what an interval so narrow around 0 would say in three digits more is nothing.
    return f"\norder {order.exponent:.2f} ({order.low:.2f} to {order.high:.2f})"
