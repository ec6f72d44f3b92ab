"""What the adviser found, for who works in Python: it prints, shows and draws itself."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from carom.pages.inline import axes_of, with_picture
from carom.pages.render.terminal import plain_text
from carom.studies.advise.document import advice_document
from carom.studies.advise.figure import draw_advice, title_of
from carom.studies.advise.run import Advice

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
