"""Python function `carom.advise`, which recommends step sizes for a scene."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from carom.engines.registry import resolve_engine
from carom.execution.job import Progress, no_progress
from carom.execution.pool import Pool
from carom.model.scene import Scene, to_scene
from carom.report.document import Document
from carom.report.notebook import ShownResult
from carom.studies.advise.document import build_advice_document
from carom.studies.advise.figure import draw_advice, format_title
from carom.studies.advise.options import AdviceOptions
from carom.studies.advise.run import Advice
from carom.studies.advise.run import advise as found_by

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, repr=False)
class ShownAdvice(ShownResult, Advice):
    """Result of `carom.advise`, which can be printed, shown in a notebook and plotted.

    The plot shows the direction error against steps per second.
    """

    def _show(self) -> tuple[Document, str, Callable[[Axes], None]]:
        return build_advice_document(self), format_title(self), partial(draw_advice, self)


def advise(
    scene: Scene | str,
    engine_names: Sequence[str] | None = None,
    *,
    progress: Progress | None = None,
    pool: Pool | None = None,
    **options: Any,
) -> ShownAdvice:
    """For each engine, find the largest step sizes at which it misses no impact of a scene and meets a target accuracy.

    `print(result)` shows the same text as `carom advise`. A notebook shows a picture of the result. `result.plot()`
    draws the error against steps per second.

    Args:
        scene: The scene, or its name in the catalogue.
        engine_names: Names of adapters (default: all installed ones).
        progress: Function that is called with the number of finished tasks, the number of all tasks, and a description.
        pool: Pool of worker processes, which is not closed (default: a new pool, which is closed at the end).
        options: ``direction_error_rad``, ``profiles``, ``scheduler`` and the other fields of
            `carom.studies.advise.options.AdviceOptions`.

    Raises:
        InputError: PIC can't solve the scene, the scene has no impact, its first impact has no reliable result, or an
            option is invalid.
        UnknownNameError: The scene or an engine does not exist.

    Examples:
        >>> advice = carom.advise("paper/late", ["pymunk"], profiles=["tuned"], phases=1)
        >>> advice.scene.name
        'paper/late'
    """
    scene = to_scene(scene)
    parsed_options = AdviceOptions.build_from_arguments("advise", options, engines=engine_names)
    parsed_options = replace(
        parsed_options, engines=parsed_options.engines and [resolve_engine(word) for word in parsed_options.engines]
    )
    with parsed_options.open_pool() if pool is None else nullcontext(pool) as opened:
        found = found_by(scene, parsed_options, opened, progress=progress or no_progress)
    return ShownAdvice.of(found)
