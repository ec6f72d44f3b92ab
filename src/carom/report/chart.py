"""The charts of a cross-check: error against step, and what of it is an engine's own."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from typing import TYPE_CHECKING

from carom.comparator.thresholds import THRESHOLDS
from carom.report import wording
from carom.report.price import Price
from carom.report.svg import INK, MUTED, SURFACE, drawing, finish, framed, line_style, render
from carom.report.trend import Point, Series, Trend

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["price_chart", "velocity_chart", "wrong_chart"]

_WIDTH_IN, _HEIGHT_IN = 5.6, 4.0
_PRICE_WIDTH_IN = 9.0


def velocity_chart(trend: Trend, label: str) -> str:
    """Return the chart of the median velocity error against the step, as SVG."""
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

        def height(point: Point) -> float:
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
        axes.set_yticks([floor, *ticks], [f"≤ {wording.number(THRESHOLDS.rounding)}", *map(wording.number, ticks)])
        axes.set_ylabel("velocity error, median over scenes", labelpad=2)
        _x_axis(axes, trend)
        return render(figure, label)


def wrong_chart(trend: Trend, label: str) -> str:
    """Return the chart of the number of scenes that are wrong against the step, as SVG."""
    with drawing():
        from matplotlib.ticker import MaxNLocator

        figure, axes = framed(_WIDTH_IN, _HEIGHT_IN)
        most = max((p.wrong for s in trend.series for p in s.points), default=0)
        axes.set_ylim(-0.05 * max(most, 1), 1.08 * max(most, 1))
        for series in trend.series:
            _line(axes, trend, series, [float(p.wrong) if p.graded else math.nan for p in series.points])
        axes.yaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_ylabel("scenes with an impact missed or invented")
        _x_axis(axes, trend)
        return render(figure, label)


def _x_axis(axes: Axes, trend: Trend) -> None:
    axes.set_xscale("log")
    # From coarse to fine in the direction of reading.
    axes.set_xlim(max(trend.parts) * 1.25, min(trend.parts) / 1.25)
    axes.set_xticks(trend.parts, [wording.part(part) for part in trend.parts])
    axes.minorticks_off()
    low, high = (wording.step(dt_s) for dt_s in trend.coarsest_s)
    between = high if low == high else f"{high} to {low}"
    axes.set_xlabel(f"step, in parts of the scene's coarsest ({between})")
    finish(axes)


def _line(axes: Axes, trend: Trend, series: Series, heights: Sequence[float]) -> None:
    engines = list(dict.fromkeys(entry.column.engine for entry in trend.series))
    column = series.column
    style = line_style(engines.index(column.engine), pit=column.engine == "pit", hollow=column.profile == "default")
    axes.plot(trend.parts, heights, label=column.name, clip_on=False, **style)


def price_chart(found: Sequence[Price], label: str) -> str:
    """Return, for each engine, its velocity error against PIC and what of it is its own, as SVG."""
    with drawing():
        shown = [(p, statistics.median(p.total), statistics.median(p.own)) for p in found if p.total and p.own]
        figure, axes = framed(_PRICE_WIDTH_IN, 1.9 + 0.24 * len(shown))
        errors = [value for _, total, own in shown for value in (total, own) if THRESHOLDS.rounding < value < math.inf]
        bottom = 10.0 ** math.floor(math.log10(min(errors, default=0.1)))
        floor, top = bottom / 10.0**0.35, 10.0 ** math.ceil(math.log10(max(errors, default=1.0) * 1.01))

        def along(value: float) -> float:
            at: float = min(max(value, floor), top) if value > THRESHOLDS.rounding else floor
            return at

        for k, (_, total, own) in enumerate(shown):
            colour = line_style(k, pit=False, hollow=False)["color"]
            axes.plot([along(own), along(total)], [-k, -k], color=colour, linewidth=2.0, alpha=0.6)
            axes.plot([along(total)], [-k], "o", color=colour, markerfacecolor=SURFACE, markersize=8)
            axes.plot([along(own)], [-k], "o", color=colour, markersize=6)
        axes.set_xscale("log")
        axes.set_xlim(bottom / 10.0**0.7, top)
        axes.axvspan(bottom / 10.0**0.7, bottom, color=MUTED, alpha=0.1, linewidth=0)
        ticks = [10.0**k for k in range(round(math.log10(bottom)), round(math.log10(top)) + 1)]
        axes.set_xticks([floor, *ticks], [f"≤ {wording.number(THRESHOLDS.rounding)}", *map(wording.number, ticks)])
        axes.minorticks_off()
        axes.set_yticks([-k for k in range(len(shown))], [price.column.name for price, _, _ in shown])
        axes.set_xlabel("velocity error, over the scene's greatest speed")
        finish(axes)
        return render(figure, label)
