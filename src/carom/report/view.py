"""All that the documents show, derived once, so that they can't disagree."""

from __future__ import annotations

from dataclasses import dataclass

from carom.report import wording
from carom.report.certified_reach import CertifiedLine, certified_lines
from carom.report.divergences import Divergence, divergences
from carom.report.grid import Grid, build_grid
from carom.report.price import Price, prices
from carom.report.profile_table import ProfileTable, build_profile_table
from carom.report.sampling import Agreement, agreements
from carom.report.spread import SpreadLine, spread_lines
from carom.report.summary import Summary, summarise
from carom.report.tables import (
    CellLine,
    KnownLine,
    RunTime,
    SettingsOf,
    cell_lines,
    known_lines,
    run_times,
    settings_used,
)
from carom.report.trend import Trend, build_trend
from carom.runner import Results

__all__ = ["View", "build_view"]


@dataclass(frozen=True)
class View:
    """What a document shows, in the order in which it shows it."""

    summary: Summary
    grid: Grid
    profiles: ProfileTable
    agreements: tuple[Agreement, ...]
    prices: tuple[Price, ...]
    spreads: tuple[SpreadLine, ...]
    horizons: tuple[tuple[str, str], ...]
    trend: Trend
    paper: tuple[Divergence, ...]
    worst: tuple[Divergence, ...]
    known: tuple[KnownLine, ...]
    certified: tuple[CertifiedLine, ...]
    run_times: tuple[RunTime, ...]
    settings: tuple[SettingsOf, ...]
    environment: tuple[tuple[str, str], ...]
    command: str
    cells: tuple[CellLine, ...]

    def certified_to(self, scene: str) -> str:
        """Return in a few words how far a scene's reference is certified; empty where that was not looked at."""
        return next((line.short for line in self.certified if line.scene == scene), "")


def build_view(results: Results) -> View:
    """Derive everything that the documents show."""
    grid = build_grid(results)
    found = agreements(results, grid)
    paper, worst = divergences(results, grid)
    return View(
        summary=summarise(results, grid, found),
        grid=grid,
        profiles=build_profile_table(results, grid),
        agreements=found,
        prices=prices(grid),
        spreads=spread_lines(results, grid),
        horizons=_horizons(results),
        trend=build_trend(results, grid),
        paper=paper,
        worst=worst,
        known=known_lines(results),
        certified=certified_lines(results),
        run_times=run_times(grid),
        settings=settings_used(results, grid),
        environment=_environment(results),
        command=results.command or _python_call(grid),
        cells=cell_lines(results, grid),
    )


def _environment(results: Results) -> tuple[tuple[str, str], ...]:
    here = results.environment
    versions = ", ".join(f"{name} {version}" for name, version in here.versions.items())
    return (
        ("Date", here.date),
        ("Processor", f"{here.processor}, {wording.count(here.cores, 'core')}"),
        ("System", here.system),
        ("Python", here.python),
        ("Carom", here.carom),
        ("Versions", versions),
        ("Whole run", wording.seconds(results.elapsed_s)),
    )


def _horizons(results: Results) -> tuple[tuple[str, str], ...]:
    """Return up to where the reference of a scene may be believed, where that is not the whole of it."""
    lines = []
    for name, until_s in results.horizons.items():
        times = results.references[name].impacts["time_s"]
        believed = int((times <= until_s).sum())
        lines.append((name, f"{believed} of {len(times)} impacts, to {wording.seconds(until_s)}"))
    return tuple(lines)


def _python_call(grid: Grid) -> str:
    """Return the Python that makes the results again, for a cross-check that was not called from the command line."""
    engines = list(dict.fromkeys(column.engine for column in grid.columns))
    profiles = list(dict.fromkeys(column.profile for column in grid.columns))
    return f"carom.cross_check(scenes, {engines!r}, profiles={profiles!r})"
