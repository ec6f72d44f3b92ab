"""Python function `carom.tune`, which searches for an engine's best settings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.catalogue import resolve_scenes
from carom.comparator.thresholds import THRESHOLDS
from carom.engines.registry import resolve_engine
from carom.execution.job import Progress, no_progress
from carom.model.scene import Scene
from carom.report.document import Document
from carom.report.notebook import ShownResult
from carom.report.svg import format_tick
from carom.studies.tune.document import FOUND_LABEL, build_tune_document
from carom.studies.tune.options import TuneOptions
from carom.studies.tune.run import SCENES, Tuning
from carom.studies.tune.run import tune as found_by

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, repr=False)
class ShownTuning(ShownResult, Tuning):
    """Result of a search that can be printed, shown in a notebook and plotted.

    The plot compares the first profile with the best settings: it shows each scene's error, divided by PIT's error.
    """

    def _show(self) -> tuple[Document, str, Callable[[Axes], None]]:
        document = build_tune_document(self, [scene.name for scene in self.scenes])
        return document, f"Error by scene, with different settings of {self.engine}", partial(_draw, self)


def tune(
    engine: str, scenes: Sequence[Scene | str] | None = None, *, progress: Progress | None = None, **options: Any
) -> ShownTuning:
    """Search an engine's searchable settings (knobs) for the values that make its error smallest.

    `print(result)` shows the same text as `carom tune`. A notebook shows a picture of the result. `result.plot()` draws
    the error of each scene.

    Args:
        engine: Name of the adapter.
        scenes: Scenes, or their names in the catalogue (default: the group `classics`).
        progress: Function that is called after each trial with the number of trials, the expected number of trials, and
            a description.
        options: ``trials``, ``profile``, ``scheduler`` and the other fields of
            `carom.studies.tune.options.TuneOptions`.

    Raises:
        InputError: The adapter declares no searchable settings or can run no scene, or an option is invalid.
        UnknownNameError: The engine, the profile or a scene does not exist.
        UnavailableError: The engine is not installed.
        MissingExtraError: The extra `tune` is not installed.

    Examples:
        >>> found = carom.tune("pymunk", ["paper/late"], trials=1)
        >>> found.engine, [scene.name for scene in found.scenes]
        ('pymunk', ['paper/late'])
    """
    parsed_options = TuneOptions.build_from_arguments("tune", options)
    on, _ = resolve_scenes([SCENES] if scenes is None else scenes)
    return ShownTuning.of(found_by(resolve_engine(engine), on, parsed_options, progress=progress or no_progress))


def _draw(tuning: Tuning, axes: Axes) -> None:
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
