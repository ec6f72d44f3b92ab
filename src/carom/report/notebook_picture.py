"""Results of studies in notebooks, which show a drawing above the text of the terminal."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from html import escape
from typing import TYPE_CHECKING, Any, Self

from carom.errors import MissingExtraError
from carom.report.files import require_report_extra
from carom.report.svg import build_figure, render, use_drawing_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from carom.report.document import Document

#: Size of a picture in a notebook.
SIZE_IN = (7.0, 3.8)
#: Size of a picture that a phone shows without scrolling.
_NARROW_IN = (3.9, 4.6)


class ShownResult:
    """Base class of study results that can be printed, plotted, and shown in a notebook with a picture."""

    def _show(self) -> tuple[Document, str, Callable[[Axes], None]]:
        """Return the document of the result, and the title and the drawing function of its picture."""
        raise NotImplementedError

    @classmethod
    def of(cls, found: Any) -> Self:
        """Copy the fields of a study's result to an instance of this class."""
        return cls(**{field.name: getattr(found, field.name) for field in fields(found)})

    def __repr__(self) -> str:
        from carom.report.render.terminal import render_plain_text  # imports Rich

        return render_plain_text(self._show()[0])

    def _repr_html_(self) -> str | None:
        """Return the result as HTML, with a picture; None if the extra `report` is not installed."""
        try:
            require_report_extra()
        except MissingExtraError:
            return None
        _, title, draw = self._show()
        return f'<div style="max-width:46em">{render_picture(draw, title)}</div><pre>{escape(repr(self))}</pre>'

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the picture of the result on the given axes, or on new ones, and return the axes.

        Raises:
            MissingExtraError: The extra `report` is not installed.
        """
        axes = get_axes(ax)
        self._show()[2](axes)
        return axes


def render_picture(
    draw: Callable[[Axes], None], title: str, size_in: tuple[float, float] = SIZE_IN, *, narrow: bool = False
) -> str:
    """Draw on new axes and return the picture as SVG. A narrow picture fits a phone.

    Raises:
        MissingExtraError: The extra `report` is not installed.
    """
    with use_drawing_style():
        figure = build_figure(*(_NARROW_IN if narrow else size_in))
        figure.set_layout_engine("constrained")
        draw(figure.add_subplot())
        return render(figure, title, narrow=narrow)


def get_axes(ax: Axes | None, size_in: tuple[float, float] = SIZE_IN) -> Axes:
    """Return the given axes, or new axes.

    Raises:
        MissingExtraError: The extra `report` is not installed.
    """
    require_report_extra()
    if ax is not None:
        return ax
    from matplotlib import pyplot as plt

    return plt.subplots(figsize=size_in, layout="constrained")[1]
