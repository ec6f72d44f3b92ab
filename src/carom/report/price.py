"""What each engine pays of the price of sampling, and what error is left that sampling does not explain."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from carom.comparator import Score
from carom.report import wording
from carom.report.document import IN_FULL, Cell, Table
from carom.report.document import Column as Head
from carom.report.grid import Column, Grid

__all__ = ["Price", "price_table", "prices"]


@dataclass(frozen=True)
class Price:
    """An engine's profile at each scene's coarsest step, held against PIT there.

    Attributes:
        column: The engine and profile.
        scores: Its scores by name of the scene, where the scene has one answer and PIT was run.
    """

    column: Column
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


def prices(grid: Grid) -> tuple[Price, ...]:
    """Return what every engine pays that is not Carom's own; empty where PIT was not run."""
    found = []
    for column in grid.columns:
        ran = {cell.row.job.scene.name: cell.row.score for cell in grid.cells(column) if cell.row is not None}
        scores = {n: s for n, s in ran.items() if s is not None and s.sampling is not None and s.convention is None}
        if scores and not column.own:
            found.append(Price(column, scores))
    return tuple(found)


def price_table(found: Iterable[Price]) -> Table:
    """Return a row an engine: what it pays of the price of sampling, and what is its own."""
    return Table.made(_COLUMNS, found, only=IN_FULL)


def _over(numbers: Callable[[Price], list[float]]) -> Callable[[Price], Cell | str]:
    """Return what a column says of numbers, one a scene or an impact: the median, with the least and the greatest."""

    def say(price: Price) -> Cell | str:
        known = numbers(price)
        if not known:
            return wording.ABSENT
        low, high = wording.number(min(known)), wording.number(max(known))
        return Cell(wording.number(statistics.median(known)), f"({low} to {high})" if low != high else "")

    return say


def _of(count: int, price: Price) -> str:
    return f"{count} of {len(price.scores)}"


def _equal(price: Price) -> Cell:
    # The longer list is not the one to read.
    short = 0 < len(price.different) <= len(price.equal)
    return Cell(_of(len(price.equal), price), f"not {wording.listed(price.different)}" if short else "")


#: The columns: heading, and what it says of an engine. Another one is another line.
_COLUMNS: tuple[tuple[Head | str, Callable[[Price], Cell | str]], ...] = (
    ("engine", lambda price: price.column.name),
    ("price paid, median", _over(lambda price: price.paid)),
    ("pays nothing", lambda price: _of(price.paid.count(0.0), price)),
    ("worse than PIT", lambda price: _of(len(price.worse), price)),
    ("equals PIT", _equal),
    ("of its own, median", _over(lambda price: price.own)),
    ("impacts missed", lambda price: str(sum(len(score.missed) for score in price.scores.values()))),
    ("by PIT", lambda price: str(sum(score.pit_missed or 0 for score in price.scores.values()))),
    ("of its own from its own states", _over(lambda price: price.local_own)),
)
