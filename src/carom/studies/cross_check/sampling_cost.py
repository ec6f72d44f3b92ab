"""Section on the cost of sampling: each engine's error over PIT's, and the error that sampling does not explain."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from carom.comparator import Grade, Score
from carom.comparator.thresholds import THRESHOLDS
from carom.report import formatting
from carom.report.document import DETAIL, IN_FULL, ON_PAPER, Block, Cell, Column, Section, Table, Text
from carom.report.grid import Grid, GridColumn
from carom.report.svg import MUTED, SURFACE, drawing, finish, line_style, new_figure, render

#: Sizes of the chart, of a line in it, and of the margins for names and for the axis, inches.
_WIDTH_IN, _LINE_IN, _NAMES_IN, _FOOT_IN = 10.5, 0.22, 1.3, 0.5
#: Part of the axis for errors within rounding, wide enough for two labels next to each other.
_STRIP = 0.14

#: An engine counts as equal to PIT where it equals PIT in at least this share of the scenes in which it has an error.
MOSTLY = 0.5

PRICE_TITLE = "What sampling costs each engine, and what error is its own"
PRICE_CAPTION = (
    "A ring: the largest velocity error against PIC. A disc: what of it sampling does not explain. Medians over "
    "scenes; the line between them is the price of sampling."
)

PRICE_NOTE = (
    "No error of this table is of a time. A method that checks once per step is late by up to a step whatever else it "
    "does. What it pays is its largest velocity error over PIT's at worst over the phases of the same step, or, where "
    "that is more, its largest spin error over PIT's: 1 pays the price of sampling, 0 none of it, and above 1 does "
    "worse than checking once per step; an impact that is missed is off by all that it changes. Of its own is the "
    "velocity error, over the scene's greatest speed, that sampling does not explain: against PIT, or against PIC "
    "where that is less; beyond a horizon it is told impact by impact, from the engine's own state before. Medians "
    "over scenes, with least and greatest; scenes without a unique answer are left out."
)
PRICE_SHORT = (
    "Error / PIT's: largest velocity or spin error over PIT's worst at any phase of the step (1: all, 0: none)"
)


@dataclass(frozen=True)
class EngineCost:
    """An engine's profile at each scene's coarsest step, compared with PIT there.

    Attributes:
        column: The engine and profile.
        scores: Its scores by name of the scene, where the scene has one answer and PIT was run.
    """

    column: GridColumn
    scores: dict[str, Score]

    @property
    def cost_ratios(self) -> list[float]:
        """The error over PIT's in each scene that has one."""
        return [score.price_paid for score in self.scores.values() if not math.isnan(score.price_paid)]

    @property
    def equal_scores(self) -> list[Score]:
        """Scores with the same impacts and errors as PIT, to rounding."""
        return [score for score in self.scores.values() if score.equals_pit]

    @property
    def equal_scores_with_error(self) -> list[Score]:
        """Scores equal to PIT's that have an error, all of which is the cost of sampling."""
        return [score for score in self.equal_scores if _has_error(score)]

    @property
    def scores_with_error(self) -> list[Score]:
        """Scores with an error larger than rounding."""
        return [score for score in self.scores.values() if _has_error(score)]

    @property
    def scenes_unlike_pit(self) -> list[str]:
        """Names of the scenes in which it does not equal PIT."""
        return [name for name, score in self.scores.items() if not score.equals_pit]

    @property
    def scores_worse_than_pit(self) -> list[Score]:
        """Scores with larger errors than PIT at worst that do not equal PIT's."""
        return [score for score in self.scores.values() if score.price_paid > 1 and not score.equals_pit]

    @property
    def pit_difference(self) -> float:
        """Largest difference from PIT where scores are equal: velocity over the speed, or time over the duration."""
        errors = [(s.against_pit, s.scales.time_s) for s in self.equal_scores_with_error if s.against_pit is not None]
        found = [number for e, duration_s in errors for number in (e.velocity, abs(e.time_s) / duration_s)]
        return max((number for number in found if not math.isnan(number)), default=0.0)

    @property
    def own(self) -> list[float]:
        """The velocity error that sampling does not explain, in each scene that has one."""
        found = (score.own_velocity for score in self.scores.values())
        return [error for error in found if error is not None and not math.isnan(error)]

    @property
    def total(self) -> list[float]:
        """The largest velocity error against the reference, in each scene that has one."""
        return [s.total.velocity for s in self.scores.values() if not math.isnan(s.total.velocity)]

    @property
    def local_own_errors(self) -> list[float]:
        """The same for each impact from the engine's own state before it, in scenes with a horizon."""
        return [
            min(error, solver_error)
            for score in self.scores.values()
            if score.horizon_s is not None
            for error, solver_error in zip(score.local.velocity, score.local.solver_velocity, strict=True)
            if math.isfinite(error) and math.isfinite(solver_error)
        ]


def _has_error(score: Score) -> bool:
    """Whether a score is not exact and has an impact to be graded by."""
    return score.grade is not Grade.EXACT and not (score.grade is Grade.UNGRADED and not score.expected)


def measure_engine_costs(grid: Grid) -> tuple[EngineCost, ...]:
    """Measure the cost of sampling for every engine except Carom's own methods; empty where PIT was not run."""
    found = []
    for column in grid.columns.values():
        ran = {cell.row.job.scene.name: cell.row.score for cell in grid.cells(column) if cell.row is not None}
        scores = {n: s for n, s in ran.items() if s is not None and s.sampling is not None and s.convention is None}
        if scores and not column.own:
            found.append(EngineCost(column, scores))
    return tuple(found)


def sampling_cost_section(found: Sequence[EngineCost]) -> Section:
    """Return one row per engine: its error over PIT's, and the error that sampling does not explain."""
    said = tuple(Text(sentence, IN_FULL) for sentence in (_describe_pit_like_engines(found),) if sentence)
    told = [column for column in _COLUMNS if any(column.cell(price).text != formatting.ABSENT for price in found)]
    table: tuple[Block, ...] = (Text(PRICE_NOTE, ON_PAPER), Table(told, found, only=IN_FULL))
    return Section("The price of sampling", (*said, *table, Text(PRICE_SHORT, DETAIL)) if found else (), level=3)


def draw_sampling_costs(found: Sequence[EngineCost], label: str) -> str:
    """Draw each engine's velocity error against PIC, and the part that sampling does not explain, as SVG."""
    with drawing():
        shown = [(p, statistics.median(p.total), statistics.median(p.own)) for p in found if p.total and p.own]
        height = _FOOT_IN + _LINE_IN * max(2, len(shown))
        figure = new_figure(_WIDTH_IN, height)
        axes = figure.add_axes(
            (_NAMES_IN / _WIDTH_IN, _FOOT_IN / height, 0.97 - _NAMES_IN / _WIDTH_IN, 0.96 - _FOOT_IN / height)
        )
        errors = [value for _, total, own in shown for value in (total, own) if THRESHOLDS.rounding < value < math.inf]
        bottom = 10.0 ** math.floor(math.log10(min(errors, default=0.1)))
        top = 10.0 ** math.ceil(math.log10(max(errors, default=1.0) * 1.01))
        strip = (top / bottom) ** (_STRIP / (1.0 - _STRIP))
        floor = bottom / math.sqrt(strip)

        def along(value: float) -> float:
            at: float = min(max(value, floor), top) if value > THRESHOLDS.rounding else floor
            return at

        for k, (price, total, own) in enumerate(shown):
            style = line_style(price.column.engine, profile=price.column.method.profile)
            colour, dash = style["color"], style["linestyle"]
            axes.plot([along(own), along(total)], [-k, -k], color=colour, linestyle=dash, linewidth=2.0, alpha=0.6)
            axes.plot([along(total)], [-k], "o", color=colour, markerfacecolor=SURFACE, markersize=8)
            axes.plot([along(own)], [-k], "o", color=colour, markersize=6)
        axes.set_xscale("log")
        axes.set_xlim(bottom / strip, top)
        axes.set_ylim(0.5 - max(2, len(shown)), 0.5)  # half a line above the first and below the last
        axes.axvspan(bottom / strip, bottom, color=MUTED, alpha=0.1, linewidth=0)
        ticks = [10.0**k for k in range(round(math.log10(bottom)), round(math.log10(top)) + 1)]
        axes.set_xticks(
            [floor, *ticks], [f"≤ {formatting.number(THRESHOLDS.rounding)}", *map(formatting.number, ticks)]
        )
        axes.minorticks_off()
        axes.set_yticks([-k for k in range(len(shown))], [price.column.name for price, _, _ in shown])
        axes.set_xlabel("velocity error, over the scene's greatest speed")
        finish(axes)
        return render(figure, label)


def _describe_pit_like_engines(found: Sequence[EngineCost]) -> str:
    """Describe which engines equal PIT; empty if none does."""
    close = [
        entry
        for entry in found
        if entry.equal_scores_with_error and len(entry.equal_scores_with_error) >= MOSTLY * len(entry.scores_with_error)
    ]
    if not close:
        return ""
    shares = []
    for entry in close:
        scenes = formatting.count(len(entry.scores_with_error), "scene")
        shares.append(f"of {entry.column.name} in {len(entry.equal_scores_with_error)} of {scenes}")
    largest = formatting.number(max(entry.pit_difference for entry in close))
    does = "it does" if len(close) == 1 else "they do"
    return (
        f"Of the scenes with an error, sampling is the whole of it {formatting.listed(shares)}: there {does} exactly "
        "what "
        f"PIT does at the same step, to rounding (largest difference {largest})."
    )


def _median_column(numbers: Callable[[EngineCost], list[float]]) -> Callable[[EngineCost], Cell | str]:
    """Return a column's text for numbers of scenes or impacts: the median, with the least and the greatest."""

    def say(price: EngineCost) -> Cell | str:
        known = numbers(price)
        if not known:
            return formatting.ABSENT
        low, high = formatting.number(min(known)), formatting.number(max(known))
        return Cell(formatting.number(statistics.median(known)), f"({low} to {high})" if low != high else "")

    return say


def _format_count(count: int, price: EngineCost) -> str:
    return f"{count} of {len(price.scores)}"


def _format_equal_scenes(price: EngineCost) -> Cell:
    # Only the shorter of the two lists is shown.
    short = 0 < len(price.scenes_unlike_pit) <= len(price.equal_scores)
    return Cell(
        _format_count(len(price.equal_scores), price),
        f"not {formatting.listed(price.scenes_unlike_pit)}" if short else "",
    )


_COLUMNS = (
    Column("engine", lambda price: price.column.name),
    Column("error / PIT's, median", _median_column(lambda price: price.cost_ratios)),
    Column("pays nothing", lambda price: _format_count(price.cost_ratios.count(0.0), price)),
    Column("worse than PIT", lambda price: _format_count(len(price.scores_worse_than_pit), price)),
    Column("equals PIT", _format_equal_scenes),
    Column("velocity error of its own, median", _median_column(lambda price: price.own)),
    Column("impacts missed", lambda price: str(sum(len(score.missed) for score in price.scores.values()))),
    Column("by PIT", lambda price: str(sum(len(score.pit_missed or ()) for score in price.scores.values()))),
    Column("velocity error of its own, impact by impact", _median_column(lambda price: price.local_own_errors)),
)
