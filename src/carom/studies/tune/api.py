"""Python function `carom.tune`, which searches for an engine's best settings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from carom.catalogue import resolve_scenes
from carom.engines.registry import resolve_engine
from carom.execution.job import Progress, no_progress
from carom.model.scene import Scene
from carom.studies.tune import run
from carom.studies.tune.options import TuneOptions
from carom.studies.tune.run import Tuning


def tune(
    engine: str, scenes: Sequence[Scene | str] | None = None, *, progress: Progress | None = None, **options: Any
) -> Tuning:
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
    on, _ = resolve_scenes([run.SCENES] if scenes is None else scenes)
    return run.tune(resolve_engine(engine), on, parsed_options, progress=progress or no_progress)
