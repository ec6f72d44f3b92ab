"""Section that compares the errors of each engine with PIT's errors.

PIT's errors show the effect of checking once per step.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Sequence
from functools import partial
from typing import NamedTuple

from carom.execution.job import Method
from carom.report import svg
from carom.report.document import Cell, Column, Figure, Figures, Media, Section, Table, Text
from carom.studies.cross_check.grid import Grid, GridCell
from carom.support import formatting

#: Width of the chart, width on a phone, height of a line, and margins for names and for the axis, in inches.
_WIDTH_IN, _NARROW_IN, _LINE_IN, _NAMES_IN, _FOOT_IN = 10.5, 4.0, 0.22, 1.3, 0.5

TITLE = "Error of each engine, and the part that sampling does not explain"
CAPTION = (
    "A ring is at an engine's largest velocity error. A filled disc is at the part of this error that sampling does "
    "not explain. Both numbers are medians over scenes."
)

NOTE = (
    "0 is no error, 1 is the error of checking once per step, and a number above 1 is worse than PIT. Numbers are "
    "medians over scenes. The smallest and the largest number are in brackets."
)
DETAIL_NOTE = (
    "For 'error / PIT's', the largest velocity error is divided by PIT's largest velocity error over the phases of the "
    "step. Spin errors are divided in the same way, and the larger of the two ratios counts. For a missed impact, the "
    "error is the whole change of velocity or spin. The 'velocity error not from sampling' is the smaller of the "
    "deviations from PIT and from PIC, divided by the greatest speed. Time errors do not count, because checking once "
    "per step is late by up to a step. Scenes without a unique answer are omitted."
)


class EngineCost(NamedTuple):
    """An engine and profile, compared with PIT at each scene's largest step size.

    Attributes:
        method: The engine and profile.
        cells: The runs in scenes that PIT also ran. Scenes whose simultaneous impacts have no unique result are
            omitted.
    """

    method: Method
    cells: tuple[GridCell, ...]

    @property
    def cost_ratios(self) -> list[float]:
        """The run's error divided by PIT's, for each scene in which this ratio is known."""
        return [cell.cost for cell in self.cells if not math.isnan(cell.cost)]

    @property
    def scenes_unlike_pit(self) -> list[str]:
        """Names of the scenes in which impacts or errors differ from PIT's by more than rounding."""
        return [cell.scene for cell in self.cells if not cell.line.equals_pit]

    @property
    def worse_than_pit(self) -> int:
        """Number of scenes with errors above PIT's largest error."""
        return sum(cell.cost > 1 and not cell.line.equals_pit for cell in self.cells)

    @property
    def own_errors(self) -> list[float]:
        """The velocity error that checking once per step does not explain, for each scene in which it is known."""
        return _select_known_errors(cell.line.own_velocity for cell in self.cells)

    @property
    def total_errors(self) -> list[float]:
        """The largest velocity error relative to the reference, for each scene in which it is known."""
        return _select_known_errors(cell.errors.velocity for cell in self.cells)


def _select_known_errors(errors: Iterable[float | None]) -> list[float]:
    return [error for error in errors if error is not None and not math.isnan(error)]


def measure_engine_costs(grid: Grid) -> tuple[EngineCost, ...]:
    """Compare the errors of every engine with PIT's errors; return an empty tuple if PIT was not run."""

    def list_cells(method: Method) -> tuple[GridCell, ...]:
        cells = grid.list_cells(method)
        return tuple(cell for cell in cells if cell.scored and cell.pit and cell.line.outcome_taken is None)

    found = (EngineCost(method, list_cells(method)) for method in grid.methods if not method.is_own)
    return tuple(cost for cost in found if cost.cells)


def build_sampling_cost_section(grid: Grid) -> Section:
    """Return a section with a chart of velocity errors, and a table that compares each engine with PIT."""
    found = measure_engine_costs(grid)
    if not found:
        return Section("", ())
    chart = Figures((Figure(partial(draw_sampling_costs, found), CAPTION, TITLE),), large=True)
    columns = [one for one in _COLUMNS if any(one.build_cell(cost).text != formatting.ABSENT for cost in found)]
    blocks = (
        *((chart,) if any(cost.own_errors for cost in found) else ()),
        Table(columns, found, only=Media.IN_FULL),
        Text(NOTE, Media.IN_FULL),
        Text(DETAIL_NOTE, Media.ON_PAPER, folded=True),
    )
    return Section("The cost of sampling", blocks)


def draw_sampling_costs(found: Sequence[EngineCost], narrow: bool = False) -> str:
    """Draw each engine's velocity error as SVG, and the part of it that checking once per step does not explain."""
    with svg.use_drawing_style():
        drawn_costs = [
            (p, statistics.median(p.total_errors), statistics.median(p.own_errors))
            for p in found
            if p.total_errors and p.own_errors
        ]
        width, height = _NARROW_IN if narrow else _WIDTH_IN, _FOOT_IN + _LINE_IN * max(2, len(drawn_costs))
        figure = svg.build_figure(width, height)
        left = _NAMES_IN / width
        axes = figure.add_axes((left, _FOOT_IN / height, 0.97 - left, 0.96 - _FOOT_IN / height))
        along = svg.scale_error_axis(axes, "x", [value for _, *both in drawn_costs for value in both], narrow=narrow)
        for k, (cost, total, own) in enumerate(drawn_costs):
            style = svg.choose_line_style(cost.method.engine, profile=cost.method.profile)
            color, dash = style["color"], style["linestyle"]
            axes.plot([along(own), along(total)], [-k, -k], color=color, linestyle=dash, linewidth=2.0, alpha=0.6)
            axes.plot([along(total)], [-k], "o", color=color, markerfacecolor=svg.SURFACE, markersize=8)
            axes.plot([along(own)], [-k], "o", color=color, markersize=6)
        # Leave a margin of half a line above the first line and below the last line.
        axes.set(ylim=(0.5 - max(2, len(drawn_costs)), 0.5), xlabel="velocity error / greatest speed")
        axes.set_yticks([-k for k in range(len(drawn_costs))], [cost.method.title for cost, _, _ in drawn_costs])
        svg.finish(axes)
        return svg.render(figure, TITLE, narrow=narrow)


def _format_median(numbers: Sequence[float]) -> Cell | str:
    """Format the median, the smallest and the largest of several numbers."""
    if not numbers:
        return formatting.ABSENT
    low, high = formatting.format_number(min(numbers)), formatting.format_number(max(numbers))
    return Cell(formatting.format_number(statistics.median(numbers)), f"({low} to {high})" if low != high else "")


def _format_equal_scenes(cost: EngineCost) -> Cell:
    unlike, count = cost.scenes_unlike_pit, len(cost.cells)
    return Cell(f"{count - len(unlike)} of {count}", title=f"not in {formatting.join_words(unlike)}" if unlike else "")


_COLUMNS = (
    Column("engine", lambda cost: cost.method.title),
    Column("error / PIT's, median", lambda cost: _format_median(cost.cost_ratios)),
    Column("no error", lambda cost: f"{cost.cost_ratios.count(0.0)} of {len(cost.cells)}"),
    Column("worse than PIT", lambda cost: f"{cost.worse_than_pit} of {len(cost.cells)}"),
    Column("equals PIT", _format_equal_scenes),
    Column("velocity error not from sampling, median", lambda cost: _format_median(cost.own_errors)),
    Column("impacts missed", lambda cost: str(sum(cell.missed for cell in cost.cells))),
    Column("missed by PIT", lambda cost: str(sum(int(cell.pit.get("missed") or 0) for cell in cost.cells))),
)
