"""The diagrams of a bench: error against run time, error against the step, run time against the step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np

from carom.bench.results import Curve, Point, SceneBench
from carom.comparator.thresholds import THRESHOLDS
from carom.report import wording
from carom.report.svg import MUTED, SERIES, drawing, finish, framed, line_style, plain_number, png, render

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["Diagram", "diagram_png", "diagram_svg", "is_floor"]

_WIDTH_IN, _HEIGHT_IN = 7.6, 4.9
#: An error at rounding is drawn at the foot of the diagram, half a decade below the least of the others.
_FOOT = 10.0**0.5


class Diagram(StrEnum):
    """What stands on the axes; the value is the name on the command line."""

    ERROR_TIME = "error-time"
    ERROR_DT = "error-dt"
    TIME_DT = "time-dt"

    @property
    def heading(self) -> str:
        """The diagram's heading."""
        return {
            Diagram.ERROR_TIME: "Error against run time",
            Diagram.ERROR_DT: "Error against the step",
            Diagram.TIME_DT: "Run time against the step",
        }[self]


def is_floor(curve: Curve) -> bool:
    """Whether the curve is PIC's own: its error does not depend on the step, and so it is what exactness costs."""
    return curve.engine == "pic" and curve.profile == "tuned"


def diagram_svg(bench: SceneBench, axes: Diagram, error_label: str, whole: bool = False) -> str:
    """Return a diagram as SVG that takes its colours from the page around it."""
    with drawing():
        figure = _figure(bench, axes, error_label, whole)
        return render(figure, f"{axes.heading}, {bench.scene.name}")


def diagram_png(bench: SceneBench, axes: Diagram, error_label: str, foot: Sequence[str], whole: bool = False) -> bytes:
    """Return a diagram as PNG, with the lines at its foot that say how it was made."""
    with drawing():
        figure = _figure(bench, axes, error_label, whole, foot)
        return png(figure)


def _figure(bench: SceneBench, kind: Diagram, error_label: str, whole: bool, foot: Sequence[str] = ()) -> Figure:
    figure, axes = framed(_WIDTH_IN, _HEIGHT_IN, f"{bench.scene.name}: {kind.heading.lower()}", foot)
    axes.set_xscale("log")
    axes.set_yscale("log")
    floor = _floor(bench)
    for curve in bench.curves:
        _draw(axes, bench, curve, kind, floor, whole)
    _front(axes, bench, kind, floor, whole)
    _decorate(axes, bench, kind, error_label, floor, whole)
    finish(axes)
    return figure


def _floor(bench: SceneBench) -> float:
    """Return where errors at rounding are drawn."""
    seen = [
        point.error
        for curve in bench.curves
        for point in curve.points
        if point.error > THRESHOLDS.rounding and math.isfinite(point.error)
    ]
    return 10.0 ** math.floor(math.log10(min(seen, default=1e-3))) / _FOOT


def _largest(bench: SceneBench) -> float:
    drawn = [point.error for curve in bench.curves for point in curve.points if math.isfinite(point.error)]
    return max([*drawn, 0.05])


def _seconds(point: Point, whole: bool) -> float:
    if point.timing is None:
        return math.nan
    return (point.timing.whole_s if whole else point.timing.advance_s).median


def _height(point: Point, floor: float) -> float:
    return max(point.error, floor) if point.error > THRESHOLDS.rounding else floor


def _place(point: Point, kind: Diagram, floor: float, whole: bool) -> tuple[float, float]:
    match kind:
        case Diagram.ERROR_TIME:
            return _seconds(point, whole), _height(point, floor)
        case Diagram.ERROR_DT:
            return point.dt_s, _height(point, floor)
        case Diagram.TIME_DT:
            return point.dt_s, _seconds(point, whole)


def _draw(axes: Axes, bench: SceneBench, curve: Curve, kind: Diagram, floor: float, whole: bool) -> None:
    engines = list(dict.fromkeys(entry.engine for entry in bench.curves))
    default = curve.profile == "default"
    style = line_style(engines.index(curve.engine), pit=curve.engine == "pit", hollow=default)
    own = [point for point in curve.points if not point.reason and not math.isnan(point.error)]
    places = [_place(point, kind, floor, whole) for point in own]
    kept = [(place, point) for place, point in zip(places, own, strict=True) if not any(map(math.isnan, place))]
    if not kept:
        return
    marks = {name: style.pop(name) for name in ("marker", "markersize", "markerfacecolor")}
    axes.plot(*zip(*(place for place, _ in kept), strict=True), label=_label(curve), **style)
    for (x, y), point in kept:
        sound = kind is Diagram.TIME_DT or point.sound
        # What missed or invented an impact has an error for the others alone: a cross, never a full mark.
        as_drawn = marks if sound else {**marks, "marker": "x", "markersize": 6.0}
        axes.plot([x], [y], color=style["color"], linestyle="none", zorder=4, **as_drawn)
    _bars(axes, kept, kind, floor, whole, style["color"])


def _label(curve: Curve) -> str:
    return f"{curve.engine} {curve.profile}{_order(curve)}"


def _bars(
    axes: Axes, kept: Sequence[tuple[tuple[float, float], Point]], kind: Diagram, floor: float, whole: bool, colour: str
) -> None:
    """Draw the quartiles of run time, and the errors from the luckiest start to the unluckiest."""
    for (x, y), point in kept:
        if kind is not Diagram.ERROR_DT and point.timing is not None:
            found = point.timing.whole_s if whole else point.timing.advance_s
            ends = (found.low, found.high)
            across, up = (ends, (y, y)) if kind is Diagram.ERROR_TIME else ((x, x), ends)
            axes.plot(across, up, color=colour, linewidth=0.8, alpha=0.6, zorder=2)
        if kind is not Diagram.TIME_DT and point.error > THRESHOLDS.rounding:
            axes.plot((x, x), (max(point.error_least, floor), y), color=colour, linewidth=0.8, alpha=0.35, zorder=2)


def _order(curve: Curve) -> str:
    order = curve.order
    if math.isnan(order.low):
        return ""
    # Two decimals: what an interval so narrow around 0 would say in three digits more is nothing.
    return f"\norder {order.exponent:.2f} ({order.low:.2f} to {order.high:.2f})"


def _front(axes: Axes, bench: SceneBench, kind: Diagram, floor: float, whole: bool) -> None:
    if kind is not Diagram.ERROR_TIME or len(bench.front) < 2:
        return
    places = [_place(point, kind, floor, whole) for point in bench.front]
    axes.plot(
        [x for x, _ in places],
        [y for _, y in places],
        color=MUTED,
        linewidth=7.0,
        alpha=0.16,
        solid_capstyle="round",
        zorder=1,
        drawstyle="steps-post",
        label="Pareto front",
    )


def _decorate(axes: Axes, bench: SceneBench, kind: Diagram, error_label: str, floor: float, whole: bool) -> None:
    pic = next((curve for curve in bench.curves if is_floor(curve)), None)
    cost = (
        min((s for p in pic.points if not math.isnan(s := _seconds(p, whole))), default=math.nan) if pic else math.nan
    )
    if not math.isnan(cost) and kind is Diagram.ERROR_TIME:
        axes.axvline(cost, color=SERIES[0], linewidth=0.9, linestyle=":", zorder=1, label="what PIC costs")
    if not math.isnan(cost) and kind is Diagram.TIME_DT:
        axes.axhline(cost, color=SERIES[0], linewidth=0.9, linestyle=":", zorder=1, label="what PIC costs")
    clock = "run time with preparation" if whole else "run time of all steps"
    if kind is Diagram.TIME_DT:
        axes.set_ylabel(f"{clock}, s")
    else:
        axes.set_ylabel(error_label)
        ticks = [10.0**k for k in range(round(math.log10(floor * _FOOT)), 2) if 10.0**k < 2.0 * _largest(bench)]
        axes.set_yticks([floor, *ticks], [f"≤ {wording.number(THRESHOLDS.rounding)}", *map(wording.number, ticks)])
        axes.set_ylim(floor / 10.0**0.25, 2.0 * _largest(bench))
    if kind is Diagram.ERROR_TIME:
        axes.set_xlabel(f"{clock}, s")
        _pit_axis(axes, bench, whole)
    else:
        steps = sorted({point.dt_s for curve in bench.curves for point in curve.points}, reverse=True)
        axes.set_xlim(max(steps) * 1.2, min(steps) / 1.2)  # from coarse to fine in the direction of reading
        axes.set_xticks(steps, [wording.step(dt_s).removesuffix(" s") for dt_s in steps], fontsize=7.5)
        axes.set_xlabel("step, s")
        axes.minorticks_off()
    if kind is Diagram.ERROR_TIME:
        axes.xaxis.set_major_formatter(plain_number)
    if kind is Diagram.TIME_DT:
        axes.yaxis.set_major_formatter(plain_number)


def _pit_axis(axes: Axes, bench: SceneBench, whole: bool) -> None:
    """Add an axis in units of PIT's run time at the coarsest step: the scale that other machines share."""
    pit = [p for c in bench.curves if c.engine == "pit" for p in c.points if p.timing is not None]
    if not pit:
        return
    coarsest = max(pit, key=lambda point: point.dt_s)
    unit = _seconds(coarsest, whole)
    above = axes.secondary_xaxis("top", functions=(lambda s: np.divide(s, unit), lambda r: np.multiply(r, unit)))
    above.set_xlabel(f"in units of PIT at {wording.step(coarsest.dt_s)}, timed in the same rounds", fontsize=7.5)
    above.xaxis.set_major_formatter(plain_number)
    above.tick_params(labelsize=7.5)
