"""The search for settings for who works in Python: `carom.tune`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

from carom.registry import engine_named
from carom.runs.job import Progress, unheard
from carom.scene import Scene, as_scene
from carom.scenes import find_scenes
from carom.studies.tune.options import TuneOptions
from carom.studies.tune.picture import ShownTuning
from carom.studies.tune.run import SCENES
from carom.studies.tune.run import tune as found_by


def tune(
    engine: str, scenes: Sequence[Scene | str] | None = None, *, progress: Progress | None = None, **options: Any
) -> ShownTuning:
    """Return the settings of an engine that give the least error, over the knobs that its adapter declares.

    It prints what `carom tune` prints, shows itself in a notebook, and `plot()` draws the error scene by scene.

    Args:
        engine: Name of the adapter.
        scenes: Scenes, or their names in the catalogue; by default those of `classics`.
        progress: Called with (done, all, what) after each trial.
        options: ``trials``, ``profile``, ``dt_s`` and the other fields of `carom.studies.tune.options.TuneOptions`.

    Raises:
        InputError: The adapter declares no knobs, can run none of the scenes, or an option makes no sense.
        UnknownNameError: There is no such engine, profile or scene.
        UnavailableError: The engine is not there.
        MissingExtraError: The extra `tune` is not installed.
    """
    asked = TuneOptions(**options)
    plain = [entry.scene for entry in find_scenes([SCENES])] if scenes is None else [as_scene(one) for one in scenes]
    found = found_by(engine_named(engine), plain, asked, progress=progress or unheard)
    return ShownTuning(**{field.name: getattr(found, field.name) for field in fields(found)})
