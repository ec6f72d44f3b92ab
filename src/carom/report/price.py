"""How much of each engine's error is the price of sampling, and how much its own."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from carom.comparator import Score
from carom.comparator.verdict import THRESHOLDS
from carom.report import wording
from carom.report.grid import Column, Grid

__all__ = ["LocalPrice", "Price", "price_lines", "prices"]


@dataclass(frozen=True)
class LocalPrice:
    """Local errors beyond any horizon: of all impacts of the scenes that have one, or none that is believed.

    Attributes:
        impacts: How many were scored.
        sampling: Median over impacts of what PIT would err from the engine's own state, over the scene's speed.
        own: Median over impacts of the error against that.
        scenes: Names of the scenes.
    """

    impacts: int
    sampling: float
    own: float
    scenes: tuple[str, ...]


@dataclass(frozen=True)
class Price:
    """An engine's profile at each scene's coarsest step.

    Attributes:
        column: The engine and profile.
        scenes: In how many scenes both it and PIT find an impact in common.
        exact: In how many of these its velocities are right to rounding.
        equal: In how many of these it equals PIT to rounding.
        sampling: Median over the other scenes of the largest velocity error of PIT, over the scene's speed.
        own: Median over those of the largest velocity error against PIT.
        share: Sampling's part of the velocity error, 0 to 1: the mean over those scenes that have one, so that one in
            which a small error has grown large does not drown the others. NaN without any.
        missed: How many impacts it misses, in all scenes held against PIT.
        pit_missed: How many PIT misses there.
        local: Local errors, where a scene has a horizon.
    """

    column: Column
    scenes: int
    exact: int
    equal: int
    sampling: float
    own: float
    share: float
    missed: int
    pit_missed: int
    local: LocalPrice | None


def prices(grid: Grid) -> tuple[Price, ...]:
    """Return the price of sampling for every engine that is not Carom's own; empty where PIT was not run."""
    found = []
    for column in grid.columns:
        scores = [
            cell.row.score
            for cell in grid.cells(column)
            if cell.row is not None
            and cell.row.score is not None
            and cell.row.score.sampling is not None
            and cell.row.score.convention is None  # of a scene without a unique answer there is no error
        ]
        common = [score for score in scores if not math.isnan(score.sampling_share) or score.equals_pit]
        common = [score for score in common if score.errors]
        if column.own or not scores:
            continue
        wrong = [score for score in common if score.total.velocity > THRESHOLDS.rounding]
        found.append(
            Price(
                column=column,
                scenes=len(common),
                exact=len(common) - len(wrong),
                equal=sum(score.equals_pit for score in common),
                sampling=_middle([score.sampling.velocity for score in wrong if score.sampling]),
                own=_middle([score.solver.velocity for score in wrong if score.solver]),
                share=_share(common),
                missed=sum(len(score.missed) for score in scores),
                pit_missed=sum(score.sampling_missed or 0 for score in scores),
                local=_local(grid, column),
            )
        )
    return tuple(found)


def _middle(values: Sequence[float]) -> float:
    known = [value for value in values if not math.isnan(value)]
    return statistics.median(known) if known else 0.0


def _share(scores: Sequence[Score]) -> float:
    shares = [
        1.0 if score.equals_pit else score.sampling_share
        for score in scores
        if score.total.velocity > THRESHOLDS.rounding and (score.equals_pit or not math.isnan(score.sampling_share))
    ]
    return statistics.fmean(shares) if shares else math.nan


def _local(grid: Grid, column: Column) -> LocalPrice | None:
    scores: dict[str, Score] = {
        cell.row.job.scene.name: cell.row.score
        for cell in grid.cells(column)
        if cell.row is not None and cell.row.score is not None and cell.row.score.horizon_s is not None
    }
    sampling, own = [], []
    for score in scores.values():
        for price, rest in zip(score.local.sampling_velocity, score.local.solver_velocity, strict=True):
            if math.isfinite(price) and math.isfinite(rest):
                sampling.append(float(price))
                own.append(float(rest))
    if not sampling:
        return None
    return LocalPrice(len(sampling), statistics.median(sampling), statistics.median(own), tuple(scores))


def price_lines(found: Sequence[Price]) -> Iterator[str]:
    """Return one sentence for each engine: how much of its error is the price of sampling."""
    for entry in found:
        name, scenes = entry.column.name, wording.count(entry.scenes, "scene")
        if not entry.scenes:
            yield f"{name}: it has no impact in common with PIT, so there is nothing to take apart."
            continue
        missed = f"it misses {wording.count(entry.missed, 'impact')}, PIT {entry.pit_missed}"
        exact = f"right to rounding in {entry.exact} of {scenes}; elsewhere " if entry.exact else ""
        others = wording.count(entry.scenes - entry.exact, "scene")
        numbers = f"median over {others} of the largest: {wording.number(entry.sampling)} for sampling, "
        numbers += f"{wording.number(entry.own)} of its own"
        if entry.equal == entry.scenes:
            line = f"{name}: it equals PIT to rounding in all of {scenes}, so all of its error is the price of sampling"
        elif math.isnan(entry.share):
            yield f"{name}: its velocities are right to rounding, so it pays no price of sampling; {missed}."
            continue
        else:
            line = (
                f"{name}: {exact}{wording.percent(entry.share)} of its velocity error is the price of sampling, "
                "mean of scenes"
            )
        if 0 < entry.equal < entry.scenes:
            line += f", and in {entry.equal} of {scenes} all of it, to rounding"
        line = f"{line} ({numbers}); {missed}."
        if entry.local is not None:
            local = entry.local
            line += (
                f" Locally, over {wording.count(local.impacts, 'impact')} of {wording.listed(local.scenes)}: median "
                f"{wording.number(local.sampling)} for sampling, {wording.number(local.own)} of its own."
            )
        yield line
