"""Diagram of the error in each scene, with the first profile and with the best settings."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.comparator.thresholds import THRESHOLDS
from carom.report.svg import format_tick
from carom.studies.tune.document import FOUND_LABEL

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from carom.studies.tune.run import Tuning


def draw_errors(tuning: Tuning, axes: Axes) -> None:
    """Draw each scene's error, divided by PIT's error. A cross marks a scene that is graded wrong or did not run."""
    names = [scene.name for scene in tuning.scenes]
    rows = range(len(names))
    # An exact result is drawn as if its error were rounding, and NaN is not drawn.
    limits = (THRESHOLDS.rounding, 1.0 / THRESHOLDS.rounding)
    before, after = (
        np.clip([one.error_ratio for one in settings.results], *limits) for settings in (tuning.first, tuning.best)
    )
    axes.hlines(rows, before, after, color="black", linewidth=0.8, alpha=0.4)
    for errors, label, marker, runs in (
        (before, tuning.options.profile, "o", tuning.first.results),
        (after, FOUND_LABEL, "D", tuning.best.results),
    ):
        (drawn,) = axes.plot(errors, rows, marker, label=label, markersize=5.0)
        wrong = [k for k in rows if runs[k].is_wrong]
        axes.plot([errors[k] for k in wrong], wrong, "x", color=drawn.get_color(), markersize=9.0)
    axes.axvline(1.0, color="black", linewidth=0.8, linestyle=":", label="PIT")
    axes.set(xscale="log", xlabel="error / PIT's (x: graded wrong or not run)", yticks=rows, yticklabels=names)
    axes.xaxis.set_major_formatter(format_tick)
    axes.invert_yaxis()
    axes.grid(which="major", axis="x", alpha=0.18, linewidth=0.6)
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=8)
