"""What each engine pays of the price of sampling, and what error is left that sampling does not explain."""

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

#: Of the chart, of a line in it, and of the room for names and for what stands below.
_WIDTH_IN, _LINE_IN, _NAMES_IN, _FOOT_IN = 10.5, 0.22, 1.3, 0.5
#: What is rounding has a strip of its own: its part of the axis, where two labels stand side by side.
_STRIP = 0.14

#: An engine is said to be PIT in disguise where it equals PIT in at least this share of the scenes that it is off in.
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
class EnginePrice:
    """An engine's profile at each scene's coarsest step, compared with PIT there.

    Attributes:
        column: The engine and profile.
        scores: Its scores by name of the scene, where the scene has one answer and PIT was run.
    """

    column: GridColumn
    scores: dict[str, Score]

    @property
    def paid(self) -> list[float]:
        """The error over PIT's in each scene that has one."""
        return [score.price_paid for score in self.scores.values() if not math.isnan(score.price_paid)]

    @property
    def equal(self) -> list[Score]:
        """Those in which it finds PIT's very impacts, with PIT's errors, to rounding."""
        return [score for score in self.scores.values() if score.equals_pit]

    @property
    def disguised(self) -> list[Score]:
        """Those of them in which there is an error at all, for sampling to be the whole of it."""
        return [score for score in self.equal if _has_error(score)]

    @property
    def off(self) -> list[Score]:
        """Those in which it is off by more than rounding."""
        return [score for score in self.scores.values() if _has_error(score)]

    @property
    def different(self) -> list[str]:
        """Names of the scenes in which it does not."""
        return [name for name, score in self.scores.items() if not score.equals_pit]

    @property
    def worse(self) -> list[Score]:
        """Those in which it pays more than PIT at worst, and is not PIT to rounding."""
        return [score for score in self.scores.values() if score.price_paid > 1 and not score.equals_pit]

    @property
    def beside_pit(self) -> float:
        """Largest difference from PIT in its disguise: velocity over the speed, or time over the duration."""
        errors = [(s.against_pit, s.scales.time_s) for s in self.disguised if s.against_pit is not None]
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
    def local_own(self) -> list[float]:
        """The same of each impact from the engine's own state before it, in scenes that are believed to a horizon."""
        return [
            min(error, beside_pit)
            for score in self.scores.values()
            if score.horizon_s is not None
            for error, beside_pit in zip(score.local.velocity, score.local.solver_velocity, strict=True)
            if math.isfinite(error) and math.isfinite(beside_pit)
        ]


def _has_error(score: Score) -> bool:
    """Whether a score shows an error: it is not exact, and not without an impact to be graded by."""
    return score.grade is not Grade.EXACT and not (score.grade is Grade.UNGRADED and not score.expected)


def prices(grid: Grid) -> tuple[EnginePrice, ...]:
    """Return what every engine pays that is not Carom's own; empty where PIT was not run."""
    found = []
    for column in grid.columns.values():
        ran = {cell.row.job.scene.name: cell.row.score for cell in grid.cells(column) if cell.row is not None}
        scores = {n: s for n, s in ran.items() if s is not None and s.sampling is not None and s.convention is None}
        if scores and not column.own:
            found.append(EnginePrice(column, scores))
    return tuple(found)


def price_section(found: Sequence[EnginePrice]) -> Section:
    """Return a row an engine: what it pays of the price of sampling, and what is its own."""
    said = tuple(Text(sentence, IN_FULL) for sentence in (_agreement(found),) if sentence)
    told = [column for column in _COLUMNS if any(column.cell(price).text != formatting.ABSENT for price in found)]
    table: tuple[Block, ...] = (Text(PRICE_NOTE, ON_PAPER), Table(told, found, only=IN_FULL))
    return Section("The price of sampling", (*said, *table, Text(PRICE_SHORT, DETAIL)) if found else (), level=3)


def price_chart(found: Sequence[EnginePrice], label: str) -> str:
    """Return, for each engine, its velocity error against PIC and what of it is its own, as SVG."""
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


def _agreement(found: Sequence[EnginePrice]) -> str:
    """Say which engines are PIT in disguise; nothing where none is."""
    close = [entry for entry in found if entry.disguised and len(entry.disguised) >= MOSTLY * len(entry.off)]
    if not close:
        return ""
    shares = [
        f"of {entry.column.name} in {len(entry.disguised)} of {formatting.count(len(entry.off), 'scene')}"
        for entry in close
    ]
    largest = formatting.number(max(entry.beside_pit for entry in close))
    does = "it does" if len(close) == 1 else "they do"
    return (
        f"Of the scenes with an error, sampling is the whole of it {formatting.listed(shares)}: there {does} exactly "
        "what "
        f"PIT does at the same step, to rounding (largest difference {largest})."
    )


def _over(numbers: Callable[[EnginePrice], list[float]]) -> Callable[[EnginePrice], Cell | str]:
    """Return what a column says of numbers, one a scene or an impact: the median, with the least and the greatest."""

    def say(price: EnginePrice) -> Cell | str:
        known = numbers(price)
        if not known:
            return formatting.ABSENT
        low, high = formatting.number(min(known)), formatting.number(max(known))
        return Cell(formatting.number(statistics.median(known)), f"({low} to {high})" if low != high else "")

    return say


def _of(count: int, price: EnginePrice) -> str:
    return f"{count} of {len(price.scores)}"


def _equal(price: EnginePrice) -> Cell:
    # The longer list is not the one to read.
    short = 0 < len(price.different) <= len(price.equal)
    return Cell(_of(len(price.equal), price), f"not {formatting.listed(price.different)}" if short else "")


_COLUMNS = (
    Column("engine", lambda price: price.column.name),
    Column("error / PIT's, median", _over(lambda price: price.paid)),
    Column("pays nothing", lambda price: _of(price.paid.count(0.0), price)),
    Column("worse than PIT", lambda price: _of(len(price.worse), price)),
    Column("equals PIT", _equal),
    Column("velocity error of its own, median", _over(lambda price: price.own)),
    Column("impacts missed", lambda price: str(sum(len(score.missed) for score in price.scores.values()))),
    Column("by PIT", lambda price: str(sum(len(score.pit_missed or ()) for score in price.scores.values()))),
    Column("velocity error of its own, impact by impact", _over(lambda price: price.local_own)),
)
