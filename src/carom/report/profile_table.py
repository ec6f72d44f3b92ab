"""Engines down, profiles and variants across: what came of each, and why there is nothing where there is nothing."""

from __future__ import annotations

from typing import NamedTuple

from carom.report import wording
from carom.report.grid import NOT_PLANNED, Column, Grid
from carom.runner import Results
from carom.runner.plan import missing_profile_reason

__all__ = ["ProfileLine", "ProfileTable", "build_profile_table"]


class ProfileLine(NamedTuple):
    """An engine, and for each profile what came of it or why it has none, as a sentence."""

    engine: str
    cells: tuple[str, ...]


class ProfileTable(NamedTuple):
    """The table.

    Attributes:
        profiles: The profiles that any engine was run with.
        lines: The engines asked for.
    """

    profiles: tuple[str, ...]
    lines: tuple[ProfileLine, ...]


def build_profile_table(results: Results, grid: Grid) -> ProfileTable:
    """Derive the table, at each scene's coarsest step."""
    columns = {(column.engine, column.profile): column for column in grid.columns}
    profiles = tuple(dict.fromkeys(row.cell.profile for row in results.rows))
    lines = []
    for info in results.engines:
        label = info.name.upper() if info.engine == "Carom" else info.name
        cells = []
        for profile in profiles:
            column = columns.get((info.name, profile))
            if column is not None:
                cells.append(_tally(grid, column))
            elif info.unavailable:
                cells.append(f"unavailable: {info.unavailable}")
            elif profile in info.profiles or info.capabilities is None:
                cells.append(NOT_PLANNED)
            else:
                cells.append(f"none: {missing_profile_reason(profile, info.capabilities)}")
        lines.append(ProfileLine(label, tuple(cells)))
    return ProfileTable(profiles, tuple(lines))


def _tally(grid: Grid, column: Column) -> str:
    return wording.listed([f"{n} {mark.word}" for mark, n in grid.tally(column)])
