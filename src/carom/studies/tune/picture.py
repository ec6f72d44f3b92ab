"""What a search for settings found as a picture: the error scene by scene, before and after."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from carom.comparator.thresholds import THRESHOLDS
from carom.pages.inline import axes_of, with_picture
from carom.pages.render.terminal import plain_text
from carom.pages.svg import plain_number
from carom.studies.tune.document import FOUND, tune_document
from carom.studies.tune.merit import Judged
from carom.studies.tune.run import Tuning

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, repr=False)
class ShownTuning(Tuning):
    """What a search found, and shows by itself."""

    def __repr__(self) -> str:
        return plain_text(tune_document(self, [scene.name for scene in self.scenes]))

    def _repr_html_(self) -> str | None:
        """Return its lines and its picture as HTML; None where the extra `report` is missing."""
        return with_picture(partial(_draw, self), f"Error by scene, settings of {self.engine}", repr(self))

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the error over PIT's of each scene, with the first profile and with the best settings; return the axes.

        Raises:
            MissingExtraError: The extra `report` is not installed.
        """
        axes = axes_of(ax)
        _draw(self, axes)
        return axes


def _draw(found: Tuning, axes: Axes) -> None:
    names = [scene.name for scene in found.scenes]
    rows = range(len(names))
    before, after = ([_shown(one) for one in by.judged] for by in (found.first, found.best))
    axes.hlines(rows, before, after, color="black", linewidth=0.8, alpha=0.4)
    for errors, label, marker, runs in (
        (before, found.options.profile, "o", found.first.judged),
        (after, FOUND, "D", found.best.judged),
    ):
        (drawn,) = axes.plot(errors, rows, marker, label=label, markersize=5.0)
        wrong = [k for k in rows if runs[k].wrong]
        axes.plot([errors[k] for k in wrong], wrong, "x", color=drawn.get_color(), markersize=9.0)
    axes.axvline(1.0, color="black", linewidth=0.8, linestyle=":", label="checking once per step")
    axes.set(xscale="log", xlabel="error over PIT's (x: impacts missed or spurious)", yticks=rows, yticklabels=names)
    axes.xaxis.set_major_formatter(plain_number)
    axes.invert_yaxis()
    axes.grid(which="major", axis="x", alpha=0.18, linewidth=0.6)
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=8)


def _shown(judged: Judged) -> float:
    """Return where an error is drawn: what is exact lies at rounding, and NaN is drawn nowhere."""
    if math.isnan(judged.price):
        return math.nan
    return min(max(judged.price, THRESHOLDS.rounding), 1.0 / THRESHOLDS.rounding)
