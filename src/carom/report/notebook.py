"""Results in notebooks: their text and pictures as HTML, and the function `plot`, which draws results."""

from __future__ import annotations

import dataclasses
import math
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from html import escape
from typing import TYPE_CHECKING, Any, Self

from carom.comparator import Score
from carom.comparator.non_finite import find_non_finite
from carom.errors import InputError
from carom.execution.describe_engines import EngineList
from carom.execution.results import Results
from carom.model.scene import Scene
from carom.model.trace import Trace
from carom.report.files import find_missing_package, require_report_extra
from carom.report.outcome_marks import Mark, mark_of, mark_of_grade
from carom.report.picture import draw_start, draw_traces
from carom.report.svg import INK, SERIES, SURFACE, build_figure, render, use_drawing_style
from carom.solvers.certified.result import CertifiedTrace
from carom.support import formatting
from carom.support.checks import check_instance
from carom.support.limits import MOST_DISCS_DRAWN

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from carom.report.document import Document

#: Two sizes of pictures in a notebook: for a scene, a trace or results of runs, and for the result of a study.
_SIZE_IN, _STUDY_SIZE_IN = (5.0, 3.6), (7.0, 3.8)
#: Size of a picture that a phone shows without scrolling.
_NARROW_IN = (3.9, 4.6)
#: Largest number of impacts for a picture in a notebook's cell; `plot` has no limit.
_MOST_IMPACTS_DRAWN = 1000
#: Colours of bars: green, light blue, blue, ochre, plum, violet, red. Bars of other outcomes are grey.
_COLOUR = {
    Mark.EXACT: SERIES[0],
    Mark.CLOSE: "#3f8fc4",
    Mark.SAMPLED: SERIES[1],
    Mark.INACCURATE: "#8a6d00",
    Mark.DIVERGED: "#a8447f",
    Mark.DIVERGED_INACCURATE: "#5b4fa8",
    Mark.WRONG: SERIES[2],
}
_OTHER = SERIES[7]


def html_of(result: object) -> str | None:
    """Return a result as HTML: its text, and its picture if it has one; None if the extra `report` is not installed.

    Names are escaped, and the HTML contains no script.
    """
    if find_missing_package():
        return None
    if isinstance(result, Score):
        below = f"<table><tbody>{''.join(_score_rows(result))}</tbody></table>"
    else:
        below = f'<pre style="color:{INK}">{escape(str(result))}</pre>'
        if _has_picture(result):
            drawn = render_picture(partial(_draw, result), str(result).partition("\n")[0], _SIZE_IN)
            below = f'<div style="max-width:34em">{drawn}</div>{below}'
    return f'<div style="background:{SURFACE};color:{INK};padding:.5em;overflow:auto">{below}</div>'


def plot(result: object, axes: Axes | None = None) -> Axes:
    """Draw a scene, a trace or results on the given axes, or on new axes of pyplot, and return the axes.

    Raises:
        MissingExtraError: The extra `report` is not installed.
        InputError: A number of the trace is NaN or infinite.
    """
    axes = get_axes(axes, _SIZE_IN)
    _draw(result, axes)
    return axes


def plot_beside(*traces: Trace) -> list[Axes]:
    """Draw traces of one scene next to each other on a new figure, to the same scale, and return the figure's axes.

    Args:
        traces: At least one trace. Parts far outside the picture of the first trace are cut off.

    Raises:
        MissingExtraError: The extra `report` is not installed.
        InputError: There is no trace, two traces are of different scenes, or a number of a trace is NaN or infinite.

    Examples:
        >>> reference = carom.solve_pic("paper/missed")
        >>> left, right = carom.plot_beside(reference, carom.solve_pit(reference.scene))
        >>> left.get_title(), right.get_title()
        ('pic', 'pit')
    """
    require_report_extra()
    if not traces:
        raise InputError("plot_beside needs at least one trace")
    for k, trace in enumerate(traces):
        check_instance(f"traces[{k}]", trace, Trace)
        if trace.scene != traces[0].scene:
            raise InputError(f"the traces belong to two scenes, {traces[0].scene.name!r} and {trace.scene.name!r}")
        _require_finite(trace)
    from matplotlib import pyplot as plt

    width, height = _SIZE_IN
    size = (width * len(traces), height)
    several = list(plt.subplots(1, len(traces), figsize=size, layout="constrained", squeeze=False)[1][0])
    draw_traces(several, traces)
    for axes, trace in zip(several, traces, strict=True):
        axes.set_title(f"{trace.method} {trace.profile_shown}".strip())
    return several


def _draw(result: object, axes: Axes) -> None:
    match result:
        case Scene():
            draw_start(axes, result)
        case Trace():
            _require_finite(result)
            draw_traces([axes], [result])
        case CertifiedTrace():
            _draw(result.trace, axes)
        case Results():
            _draw_results(result, axes)
        case _:
            raise TypeError(f"a {type(result).__name__} can't be drawn")


def _require_finite(trace: Trace) -> None:
    if broken := find_non_finite(trace):
        raise InputError(f"{broken}: a trace with a number that is not finite can't be drawn")


def _draw_results(result: Results, axes: Axes) -> None:
    """Draw one bar per method.

    Each part of a bar shows the number of runs with one outcome. The best outcome is on the left.
    """
    tally = Counter((row.job.method.name, mark_of(row)) for row in result.rows)
    methods = list(dict.fromkeys(method for method, _ in tally))
    ends = [0] * len(methods)
    for mark in Mark:
        counts = [tally[method, mark] for method in methods]
        if any(counts):
            colour, label = _COLOUR.get(mark, _OTHER), f"{mark.symbol} {mark.word}"
            axes.barh(methods, counts, left=ends, color=colour, label=label)
            ends = [end + count for end, count in zip(ends, counts, strict=True)]
    axes.invert_yaxis()
    axes.locator_params(axis="x", integer=True)
    axes.set_xlabel("runs")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)


def _has_picture(result: object) -> bool:
    if isinstance(result, CertifiedTrace):
        return _has_picture(result.trace)
    if isinstance(result, Trace):
        return _has_picture(result.scene) and len(result.impacts) <= _MOST_IMPACTS_DRAWN and not find_non_finite(result)
    if isinstance(result, EngineList):
        return False
    return not isinstance(result, Scene) or len(result.discs) <= MOST_DISCS_DRAWN


def _score_rows(score: Score) -> Iterator[str]:
    rows = {
        "grade": mark_of_grade(score.grade, score.float_bits).sentence,
        "impacts expected": str(score.expected),
        "missed": str(len(score.missed)),
        "invented": str(len(score.spurious)),
    }
    if not math.isnan(score.price_paid):  # an error that was not measured has no row
        rows["error / PIT's"] = formatting.format_number(score.price_paid)
    for metric in dataclasses.fields(score.total):
        unit = {"s": " s", "rad": " rad"}.get(metric.name.rpartition("_")[2], "")
        error = getattr(score.total, metric.name)
        if not math.isnan(error):
            rows[metric.metadata["name"]] = formatting.format_number(error) + unit
    rows |= {finding.verdict.value: finding.reason for finding in score.findings}
    for name, value in rows.items():
        yield f'<tr><th style="text-align:left">{escape(name)}</th><td>{escape(value)}</td></tr>'


class ShownResult:
    """Base class of study results that can be printed, plotted, and shown in a notebook with a picture."""

    def _show(self) -> tuple[Document, str, Callable[[Axes], None]]:
        """Return the document of the result, the title of its picture, and the function that draws the picture."""
        raise NotImplementedError

    @classmethod
    def of(cls, found: Any) -> Self:
        """Copy the fields of a study's result to an instance of this class."""
        return cls(**{field.name: getattr(found, field.name) for field in dataclasses.fields(found)})

    def __repr__(self) -> str:
        from carom.report.render.terminal import render_plain_text  # imported here, because this module imports Rich

        return render_plain_text(self._show()[0])

    def _repr_html_(self) -> str | None:
        """Return the result as HTML, with a picture; None if the extra `report` is not installed."""
        if find_missing_package():
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
    draw: Callable[[Axes], None], title: str, size_in: tuple[float, float] = _STUDY_SIZE_IN, *, narrow: bool = False
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


def get_axes(ax: Axes | None, size_in: tuple[float, float] = _STUDY_SIZE_IN) -> Axes:
    """Return the given axes, or new axes.

    Raises:
        MissingExtraError: The extra `report` is not installed.
    """
    require_report_extra()
    if ax is not None:
        return ax
    from matplotlib import pyplot as plt

    return plt.subplots(figsize=size_in, layout="constrained")[1]
