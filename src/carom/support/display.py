"""How results show themselves: `carom` itself says what does it, when it is asked, so that nothing here imports it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from carom.support.escaping import visible

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame

_view: Callable[[str], Callable[..., Any]]


def shown_by(view: Callable[[str], Callable[..., Any]]) -> None:
    """Say what returns the function that shows a result as ``summary``, ``html_of``, ``plot`` or ``to_pandas`` says."""
    global _view  # noqa: PLW0603 - told once, by the package when it is imported
    _view = view


class Shown:
    """A result that is shown in a few lines. A dataclass of its kind is declared with ``repr=False``."""

    def __repr__(self) -> str:
        text: str = _view("summary")(self)
        return visible(text)

    def __str__(self) -> str:
        return repr(self)

    def _repr_html_(self) -> str | None:
        page: str | None = _view("html_of")(self)
        return page and visible(page)


class Drawn(Shown):
    """A result that has a picture."""

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw it with matplotlib on `ax`, on new axes where none are given, and return the axes.

        Raises:
            MissingExtraError: The extra `report` is not installed.
            InputError: A number of a trace is NaN or infinite.
        """
        axes: Axes = _view("plot")(self, ax)
        return axes


class Tabular(Drawn):
    """A result that is a table, too."""

    def to_pandas(self) -> DataFrame:
        """Return it as a data frame, the units in the names of its columns: a row an impact, or a run.

        Raises:
            MissingExtraError: pandas is not installed.
        """
        frame: DataFrame = _view("to_pandas")(self)
        return frame
