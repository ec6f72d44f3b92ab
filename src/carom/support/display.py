"""Display of results. `carom` registers the functions, so this module imports none of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from carom.support.escaping import visible

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame

_view: Callable[[str], Callable[..., Any]]


def shown_by(view: Callable[[str], Callable[..., Any]]) -> None:
    """Register the function that returns a view by name: ``summary``, ``html_of``, ``plot`` or ``to_pandas``."""
    global _view  # noqa: PLW0603 - set once, by the package when it is imported
    _view = view


class Shown:
    """A result that is displayed in a few lines. The dataclass is declared with ``repr=False``."""

    def __repr__(self) -> str:
        text: str = _view("summary")(self)
        return visible(text)

    def __str__(self) -> str:
        return repr(self)

    def _repr_html_(self) -> str | None:
        page: str | None = _view("html_of")(self)
        return page and visible(page)


class Drawn(Shown):
    """A result with a picture."""

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the result with matplotlib on `ax`, by default on new axes, and return the axes.

        Raises:
            MissingExtraError: The extra `report` is not installed.
            InputError: A number of a trace is NaN or infinite.
        """
        axes: Axes = _view("plot")(self, ax)
        return axes


class Tabular(Drawn):
    """A result that is also a table."""

    def to_pandas(self) -> DataFrame:
        """Return a data frame with a row for each impact or run. Names of columns contain units.

        Raises:
            MissingExtraError: pandas is not installed.
        """
        frame: DataFrame = _view("to_pandas")(self)
        return frame
