"""Base classes of results, with methods that show a result as text, HTML, plot or table.

`carom.report` contains the display functions. This module finds the display functions by `carom.support.hooks`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.support import hooks
from carom.support.escaping import escape_controls

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame


class Shown:
    """A result whose ``repr`` is a short summary. Subclasses are dataclasses with ``repr=False``."""

    def __repr__(self) -> str:
        return escape_controls(hooks.find_view("summary")(self))

    def __str__(self) -> str:  # Pydantic's models define another `__str__`
        return repr(self)

    def _repr_html_(self) -> str | None:
        page: str | None = hooks.find_view("html_of")(self)
        return page and escape_controls(page)


class Drawn(Shown):
    """A result that can also be plotted."""

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the result with matplotlib on the axes `ax`, by default on new axes, and return the axes.

        Raises:
            MissingExtraError: The extra `report` is not installed.
            InputError: A number of a trace is NaN or infinite.
        """
        axes: Axes = hooks.find_view("plot")(self, ax)
        return axes


class Tabular(Drawn):
    """A result that can also be exported as a data frame."""

    def to_pandas(self) -> DataFrame:
        """Return a data frame with a row for each impact or run. Names of columns contain units.

        Raises:
            MissingExtraError: pandas is not installed.
        """
        frame: DataFrame = hooks.find_view("to_pandas")(self)
        return frame
