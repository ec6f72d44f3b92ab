"""What each engine pays of the price of sampling, and what error is left that sampling does not explain."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from carom.comparator import Score
from carom.report import wording
from carom.report.document import ON_PAPER, TERMINAL, Cell, Column, Section, Table, Text
from carom.report.grid import Grid, GridColumn

__all__ = ["EnginePrice", "price_section", "prices"]

PRICE_NOTE = (
    "A method that looks once a step is late by up to a step whatever else it does. What it pays is its largest "
    "velocity error over PIT's at worst over the phases of the same step: 1 pays the price of sampling, 0 none of it, "
    "and above 1 does worse than looking once a step; an impact that is missed is off by all that it changes. Of its "
    "own is what sampling does not explain: the error against PIT, or against PIC where that is less; beyond a horizon "
    "it is told impact by impact, from the engine's own state before. Medians over scenes, with least and greatest."
)
PRICE_SHORT = (
    "Price paid: largest velocity error over PIT's at worst over the phases of the same step (1: all of it, 0: none)"
)


@dataclass(frozen=True)
class EnginePrice:
    """An engine's profile at each scene's coarsest step, held against PIT there.

    Attributes:
        column: The engine and profile.
        scores: Its scores by name of the scene, where the scene has one answer and PIT was run.
    """

    column: GridColumn
    scores: dict[str, Score]

    @property
    def paid(self) -> list[float]:
        """The price paid in each scene that has one."""
        return [score.price_paid for score in self.scores.values() if not math.isnan(score.price_paid)]

    @property
    def equal(self) -> list[Score]:
        """Those in which it finds PIT's very impacts, with PIT's errors, to rounding."""
        return [score for score in self.scores.values() if score.equals_pit]

    @property
    def different(self) -> list[str]:
        """Names of the scenes in which it does not."""
        return [name for name, score in self.scores.items() if not score.equals_pit]

    @property
    def worse(self) -> list[Score]:
        """Those in which it pays more than PIT at worst, by more than rounding."""
        return [score for score in self.scores.values() if score.price_paid > 1 and not score.equals_pit]

    @property
    def beside_pit(self) -> float:
        """Largest difference from PIT where it equals PIT: velocity over the speed, or time over the duration."""
        errors = [(score.against_pit, score.scales.time_s) for score in self.equal if score.against_pit is not None]
        found = [number for e, duration_s in errors for number in (e.velocity, abs(e.time_s) / duration_s)]
        return max((number for number in found if not math.isnan(number)), default=0.0)

    @property
    def own(self) -> list[float]:
        """The velocity error that sampling does not explain, in each scene that has one."""
        found = (score.own_velocity for score in self.scores.values())
        return [error for error in found if error is not None and not math.isnan(error)]

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
    blocks = (Text(PRICE_NOTE, ON_PAPER), Table(_COLUMNS, found), Text(PRICE_SHORT, TERMINAL)) if found else ()
    return Section("The price of sampling", blocks, level=3)


def _over(numbers: Callable[[EnginePrice], list[float]]) -> Callable[[EnginePrice], Cell | str]:
    """Return what a column says of numbers, one a scene or an impact: the median, with the least and the greatest."""

    def say(price: EnginePrice) -> Cell | str:
        known = numbers(price)
        if not known:
            return wording.ABSENT
        low, high = wording.number(min(known)), wording.number(max(known))
        return Cell(wording.number(statistics.median(known)), f"({low} to {high})" if low != high else "")

    return say


def _of(count: int, price: EnginePrice) -> str:
    return f"{count} of {len(price.scores)}"


def _equal(price: EnginePrice) -> Cell:
    # The longer list is not the one to read.
    short = 0 < len(price.different) <= len(price.equal)
    return Cell(_of(len(price.equal), price), f"not {wording.listed(price.different)}" if short else "")


_COLUMNS = (
    Column("engine", lambda price: price.column.name),
    Column("price paid, median", _over(lambda price: price.paid)),
    Column("pays nothing", lambda price: _of(price.paid.count(0.0), price)),
    Column("worse than PIT", lambda price: _of(len(price.worse), price)),
    Column("equals PIT", _equal),
    Column("of its own, median", _over(lambda price: price.own)),
    Column("impacts missed", lambda price: str(sum(len(score.missed) for score in price.scores.values()))),
    Column("by PIT", lambda price: str(sum(score.pit_missed or 0 for score in price.scores.values()))),
    Column("of its own from its own states", _over(lambda price: price.local_own)),
)
