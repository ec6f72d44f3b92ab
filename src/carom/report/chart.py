"""The two charts of error against step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from carom.comparator.thresholds import THRESHOLDS
from carom.report import wording
from carom.report.grid import Column
from carom.report.svg import INK, MUTED, SERIES, drawing, new_figure, render
from carom.report.trend import Series, Trend

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["velocity_chart", "wrong_chart"]

_WIDTH_IN, _HEIGHT_IN = 5.1, 3.5
#: Room for the axes' own labels on the left and for the names of the lines on the right, parts of the figure's width.
_AXES = (0.175, 0.15, 0.445, 0.825)
_LINE_PT = 11.0
_MARKERS = "osD^vP*X"
#: Ends of two lines that lie closer than this part of the axis carry one label.
_SAME = 0.012


class _End(NamedTuple):
    """Where a line ends on the right, and whose it is."""

    height: float  # in parts of the axis, upwards
    column: Column


def velocity_chart(trend: Trend, label: str) -> str:
    """Return the chart of the median velocity error against the step, as SVG."""
    with drawing():
        figure = new_figure(_WIDTH_IN, _HEIGHT_IN)
        axes = figure.add_axes(_AXES)
        seen = [p.median for s in trend.series for p in s.points if p.median is not None and _drawn(p.median)]
        bottom = 10.0 ** math.floor(math.log10(min(seen, default=0.1)))
        top = 10.0 ** math.ceil(math.log10(max(seen, default=1.0) * 1.01))
        floor = bottom / 10.0**0.35
        axes.set_yscale("log")
        axes.set_ylim(bottom / 10.0**0.7, top)
        axes.axhspan(bottom / 10.0**0.7, bottom, color=MUTED, alpha=0.1, linewidth=0)
        _x_axis(axes, trend)
        ends = []
        for series in trend.series:
            heights = [
                math.nan if p.median is None else min(max(p.median, floor), top) if not _exact(p.median) else floor
                for p in series.points
            ]
            _line(axes, trend, series, heights)
            if series.column.engine == "pit":
                low = [max(p.low, floor) for p in series.points]
                axes.fill_between(
                    trend.parts,
                    low,
                    [min(max(p.high, floor), top) for p in series.points],
                    color=INK,
                    alpha=0.08,
                    linewidth=0,
                )
            if not math.isnan(heights[-1]):
                ends.append(_End(_height(axes, heights[-1]), series.column))
        _end_labels(axes, ends)
        ticks = [10.0**k for k in range(round(math.log10(bottom)), round(math.log10(top)) + 1)]
        axes.set_yticks([floor, *ticks], [f"≤ {wording.number(THRESHOLDS.rounding)}", *map(wording.number, ticks)])
        axes.minorticks_off()
        axes.set_ylabel("velocity error, median over scenes", labelpad=2)
        return render(figure, label)


def wrong_chart(trend: Trend, label: str) -> str:
    """Return the chart of the number of scenes that are wrong against the step, as SVG."""
    with drawing():
        from matplotlib.ticker import MaxNLocator

        figure = new_figure(_WIDTH_IN, _HEIGHT_IN)
        axes = figure.add_axes(_AXES)
        most = max((p.wrong for s in trend.series for p in s.points), default=0)
        axes.set_ylim(-0.05 * max(most, 1), 1.08 * max(most, 1))
        _x_axis(axes, trend)
        ends = []
        for series in trend.series:
            heights = [float(p.wrong) if p.graded else math.nan for p in series.points]
            _line(axes, trend, series, heights)
            if not math.isnan(heights[-1]):
                ends.append(_End(_height(axes, heights[-1]), series.column))
        _end_labels(axes, ends)
        axes.yaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_ylabel("scenes with an impact missed or invented")
        return render(figure, label)


def _drawn(value: float) -> bool:
    """Whether a value has a height of its own: rounding is drawn at the foot, what is infinite at the top."""
    return not _exact(value) and math.isfinite(value)


def _exact(value: float) -> bool:
    return bool(value <= THRESHOLDS.rounding)


def _height(axes: Axes, value: float) -> float:
    return float(axes.transAxes.inverted().transform(axes.transData.transform((1.0, value)))[1])


def _x_axis(axes: Axes, trend: Trend) -> None:
    axes.set_xscale("log")
    # From coarse to fine in the direction of reading.
    axes.set_xlim(max(trend.parts) * 1.25, min(trend.parts) / 1.25)
    axes.set_xticks(trend.parts, [wording.part(part) for part in trend.parts])
    axes.minorticks_off()
    low, high = (wording.step(dt_s) for dt_s in trend.coarsest_s)
    between = high if low == high else f"{high} to {low}"
    axes.set_xlabel(f"step, in parts of the scene's coarsest ({between})")
    axes.grid(axis="y", color=MUTED, alpha=0.2, linewidth=0.6)


def _line(axes: Axes, trend: Trend, series: Series, heights: Sequence[float]) -> None:
    engines = list(dict.fromkeys(entry.column.engine for entry in trend.series))
    engine = engines.index(series.column.engine)
    is_pit = series.column.engine == "pit"
    # PIT is the line that others are to be seen on, so it is broad and lies below them.
    axes.plot(
        trend.parts,
        heights,
        color=INK if is_pit else SERIES[engine % len(SERIES)],
        linewidth=4.0 if is_pit else 1.4,
        alpha=0.35 if is_pit else 1.0,
        linestyle="--" if series.column.profile == "default" else "-",
        marker=_MARKERS[engine % len(_MARKERS)],
        markersize=5.5,
        markerfacecolor="none" if series.column.profile == "default" else None,
        solid_capstyle="round",
        zorder=2 if is_pit else 3,
        clip_on=False,
    )


def _end_labels(axes: Axes, ends: Sequence[_End]) -> None:
    """Name the lines at their right ends; those that end together share a label, and labels keep clear of others."""
    clusters: list[list[_End]] = []
    for end in sorted(ends):
        if clusters and end.height - clusters[-1][-1].height < _SAME:
            clusters[-1].append(end)
        else:
            clusters.append([end])
    line = _LINE_PT / (_AXES[3] * _HEIGHT_IN * 72.0)
    texts = [_names([end.column for end in cluster]) for cluster in clusters]
    at = [sum(end.height for end in cluster) / len(cluster) for cluster in clusters]
    half = [line * len(text) / 2.0 for text in texts]
    centres = _apart(at, half)
    for height, centre, text in zip(at, centres, texts, strict=True):
        axes.annotate(
            "\n".join(text),
            xy=(1.0, height),
            xytext=(1.06, centre),
            xycoords="axes fraction",
            textcoords="axes fraction",
            va="center",
            ha="left",
            annotation_clip=False,
            linespacing=1.15,
            arrowprops={"arrowstyle": "-", "color": MUTED, "linewidth": 0.6, "shrinkA": 1, "shrinkB": 1},
        )


def _apart(at: Sequence[float], half: Sequence[float]) -> list[float]:
    """Push blocks apart: upwards first, then back down from the top, where that has pushed one out."""
    centres = list(at)
    for k in range(len(centres)):
        least = half[k] if k == 0 else centres[k - 1] + half[k - 1] + half[k]
        centres[k] = max(centres[k], least)
    for k in reversed(range(len(centres))):
        most = 1.0 - half[k] if k == len(centres) - 1 else centres[k + 1] - half[k + 1] - half[k]
        centres[k] = min(centres[k], most)
    return centres


def _names(columns: Sequence[Column]) -> list[str]:
    profiles: dict[str, list[str]] = {}
    for column in sorted(columns, key=lambda column: (not column.own, column.label)):
        profiles.setdefault(column.label, []).append(column.profile)
    return [f"{label} {' + '.join(names)}" for label, names in profiles.items()]
