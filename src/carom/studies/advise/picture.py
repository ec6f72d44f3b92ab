"""What the adviser found as a picture: the error against the step, engine by engine, with the demand as a line."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from carom.pages.inline import axes_of, with_picture
from carom.pages.render.terminal import plain_text
from carom.pages.svg import line_style, plain_number
from carom.studies.advise.document import advice_document
from carom.studies.advise.run import Advice

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["ShownAdvice"]


@dataclass(frozen=True, repr=False)
class ShownAdvice(Advice):
    """What the adviser says, and shows by itself."""

    def __repr__(self) -> str:
        return plain_text(advice_document(self))

    def _repr_html_(self) -> str | None:
        """Return its lines and its picture as HTML; None where the extra `report` is missing."""
        return with_picture(
            partial(_draw, self), f"Direction error against steps a second: {self.scene.name}", repr(self)
        )

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the direction error against the step, a line a method, the demand as a line, and return the axes.

        Raises:
            MissingExtraError: The extra `report` is not installed.
        """
        axes = axes_of(ax)
        _draw(self, axes)
        return axes


def _draw(advice: Advice, axes: Axes) -> None:
    for answer in advice.answers:
        found = [trial for trial in answer.trials if not trial.reason and not math.isnan(trial.direction_error_rad)]
        style = line_style(answer.method.engine, profile=answer.method.profile)
        rates = [1.0 / trial.dt_s for trial in found]
        # A logarithm has no 0: what is exact lies on the lower edge.
        degrees = [max(math.degrees(trial.direction_error_rad), _LEAST_DEG) for trial in found]
        axes.plot(rates, degrees, label=f"{answer.method.engine} {answer.method.profile_shown}", **style)
        lost = [(rate, error) for rate, error, trial in zip(rates, degrees, found, strict=True) if trial.lost]
        axes.plot(*zip(*lost, strict=True), "x", color=style["color"], markersize=9.0) if lost else None
    demand = math.degrees(advice.demand.direction_error_rad)
    axes.axhline(demand, color="black", linewidth=0.8, linestyle=":", label=f"demand: {plain_number(demand, 0.0)}°")
    axes.set(xscale="log", yscale="log", xlabel="steps a second")
    axes.set_ylabel("direction wrong by, degrees (x: impacts lost)")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(plain_number)
    axes.grid(which="major", alpha=0.18, linewidth=0.6)
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=8)


#: Rounding of a direction in 64 bits is some 1e-14 degrees; no demand is near this.
_LEAST_DEG = 1e-9
