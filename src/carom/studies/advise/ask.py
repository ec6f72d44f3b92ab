"""The adviser for who works in Python: `carom.advise`."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from carom.engines.registry import resolve_engine
from carom.execution.job import Progress, no_progress
from carom.execution.pool import Pool
from carom.model.scene import Scene, as_scene
from carom.report.inline import axes_of, with_picture
from carom.report.render.terminal import plain_text
from carom.studies.advise.document import advice_document
from carom.studies.advise.figure import draw_advice, title_of
from carom.studies.advise.options import AdviceOptions
from carom.studies.advise.run import Advice
from carom.studies.advise.run import advise as found_by

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, repr=False)
class ShownAdvice(Advice):
    """What the adviser says, and shows by itself."""

    def __repr__(self) -> str:
        return plain_text(advice_document(self))

    def _repr_html_(self) -> str | None:
        """Return its lines and its picture as HTML; None where the extra `report` is missing."""
        return with_picture(partial(draw_advice, self), title_of(self), repr(self))

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the direction error against the step, a line a method, the demand as a line, and return the axes.

        Raises:
            MissingExtraError: The extra `report` is not installed.
        """
        axes = axes_of(ax)
        draw_advice(self, axes)
        return axes


def advise(
    scene: Scene | str,
    engine_names: Sequence[str] | None = None,
    *,
    progress: Progress | None = None,
    pool: Pool | None = None,
    **options: Any,
) -> ShownAdvice:
    """Return from which step on each engine never misses an impact of a scene, and meets a demand.

    It prints what `carom advise` prints, shows itself in a notebook, and `plot()` draws the error against the step.

    Args:
        scene: The scene, or its name in the catalogue.
        engine_names: Names of adapters; every one that is installed by default.
        progress: Called with (done, all, what).
        pool: Where steps are tried; it stays open. By default a new pool, which is closed.
        options: ``direction_error_rad``, ``profiles``, ``scheduler`` and the other fields of
            `carom.studies.advise.options.AdviceOptions`.

    Raises:
        InputError: The scene has no reference or no impact, or an option makes no sense.
        UnknownNameError: There is no such scene or engine.
    """
    scene = as_scene(scene)
    asked = AdviceOptions(engines=engine_names, **options)
    asked = replace(asked, engines=asked.engines and [resolve_engine(word) for word in asked.engines])
    own: AbstractContextManager[Pool] = asked.pool() if pool is None else nullcontext(pool)
    with own as opened:
        found = found_by(scene, asked, opened, progress=progress or no_progress)
    return ShownAdvice(**{field.name: getattr(found, field.name) for field in fields(found)})
