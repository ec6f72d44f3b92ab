"""HTML of a result for notebooks: a drawing above the lines of the terminal."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import TYPE_CHECKING

from carom.errors import MissingExtraError
from carom.report.files import require_report_extra
from carom.report.svg import drawing, new_figure, render

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Size of a picture in a notebook.
SIZE_IN = (7.0, 3.8)
#: Size of a picture that a phone shows without scrolling.
_NARROW_IN = (3.9, 4.6)


def with_picture(draw: Callable[[Axes], None], title: str, lines: str) -> str | None:
    """Return a picture with lines below as HTML; None if the extra `report` is missing."""
    try:
        require_report_extra()
    except MissingExtraError:
        return None
    return f'<div style="max-width:46em">{picture(draw, title)}</div><pre>{escape(lines)}</pre>'


def picture(
    draw: Callable[[Axes], None], title: str, size_in: tuple[float, float] = SIZE_IN, *, narrow: bool = False
) -> str:
    """Draw on new axes and return the picture as SVG. A narrow picture fits a phone.

    Raises:
        MissingExtraError: The extra `report` is not installed.
    """
    with drawing():
        figure = new_figure(*(_NARROW_IN if narrow else size_in))
        figure.set_layout_engine("constrained")
        draw(figure.add_subplot())
        return render(figure, title, narrow=narrow)


def axes_of(ax: Axes | None, size_in: tuple[float, float] = SIZE_IN) -> Axes:
    """Return the given axes, or new axes.

    Raises:
        MissingExtraError: The extra `report` is not installed.
    """
    require_report_extra()
    if ax is not None:
        return ax
    from matplotlib import pyplot as plt

    return plt.subplots(figsize=size_in, layout="constrained")[1]
