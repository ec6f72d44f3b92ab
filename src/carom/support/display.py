"""Base classes of results, with methods that show a result as text, HTML, plot or table.

The package `carom` registers the display functions, so that this module need not import `carom.report`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from carom.support.escaping import escape_controls

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame

_view: Callable[[str], Callable[..., Any]]


def set_view_finder(view: Callable[[str], Callable[..., Any]]) -> None:
    """Register `view`, which returns a display function for a name such as ``summary`` or ``plot``."""
    global _view  # noqa: PLW0603 - set once, when the package is imported
    _view = view


class Shown:
    """A result whose ``repr`` is a short summary. Subclasses are dataclasses with ``repr=False``."""

    def __repr__(self) -> str:
        return escape_controls(_view("summary")(self))

    def __str__(self) -> str:  # Pydantic's models have another text
        return repr(self)

    def _repr_html_(self) -> str | None:
        page: str | None = _view("html_of")(self)
        return page and escape_controls(page)


class Drawn(Shown):
    """A result that can also be plotted."""

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the result with matplotlib on the axes `ax`, by default on new axes, and return the axes.

        Raises:
            MissingExtraError: The extra `report` is not installed.
            InputError: A number of a trace is NaN or infinite.
        """
        axes: Axes = _view("plot")(self, ax)
        return axes


class Tabular(Drawn):
    """A result that can also be exported as a data frame."""

    def to_pandas(self) -> DataFrame:
        """Return a data frame with a row for each impact or run. Names of columns contain units.

        Raises:
            MissingExtraError: pandas is not installed.
        """
        frame: DataFrame = _view("to_pandas")(self)
        return frame
