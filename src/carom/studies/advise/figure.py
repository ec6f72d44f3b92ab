"""Diagram of the direction error against steps per second, with a line for each method and for the accuracy target."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

from carom.report.notebook import render_picture
from carom.report.svg import INK, choose_line_style, format_tick
from carom.studies.advise.run import Advice

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Smallest error in the diagram, in degrees. This error is larger than the rounding error of a direction, and smaller
#: than any accuracy target.
_LEAST_DEG = 1e-9


def format_title(advice: Advice) -> str:
    """Return the diagram's title, which describes it for screen readers."""
    return f"Direction error against steps per second: {advice.scene.name}"


def render_advice_svg(advice: Advice, narrow: bool = False) -> str:
    """Return the diagram for a page. A narrow diagram fits a phone.

    Raises:
        MissingExtraError: The extra `report` is not installed.
    """
    return render_picture(partial(draw_advice, advice, narrow=narrow), format_title(advice), narrow=narrow)


def draw_advice(advice: Advice, axes: Axes, *, narrow: bool = False) -> None:
    """Draw the direction error against steps per second."""
    for answer in advice.answers:
        found = [trial for trial in answer.trials if not trial.reason and not math.isnan(trial.direction_error_rad)]
        style = choose_line_style(answer.method.engine, profile=answer.method.profile)
        rates = [1.0 / trial.dt_s for trial in found]
        # A logarithmic axis has no 0, so exact results are drawn at the lower edge.
        degrees = [max(math.degrees(trial.direction_error_rad), _LEAST_DEG) for trial in found]
        axes.plot(rates, degrees, label=answer.method.label, **style)
        lossy_points = [
            (rate, error) for rate, error, trial in zip(rates, degrees, found, strict=True) if trial.lost_phases
        ]
        if lossy_points:
            axes.plot(*zip(*lossy_points, strict=True), "x", color=style["color"], markersize=9.0)
    target_degrees = math.degrees(advice.options.direction_error_rad)
    axes.axhline(
        target_degrees, color=INK, linewidth=0.8, linestyle=":", label=f"target: {format_tick(target_degrees, 0.0)}°"
    )
    axes.set(xscale="log", yscale="log", xlabel="steps per second", ylabel="direction error, degrees")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(format_tick)
    axes.grid(which="major", alpha=0.18, linewidth=0.6)
    below: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.4, -0.16), "ncols": 2}
    place = below if narrow else {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0)}
    axes.legend(frameon=False, fontsize=8, **place)
