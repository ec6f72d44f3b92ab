"""The tables below the grid: known answers, run times, settings, and every cell at every step."""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from carom.comparator.thresholds import THRESHOLDS
from carom.report import wording
from carom.report.grid import Column, Grid, reasons_of
from carom.report.marks import Mark, mark_of
from carom.runner import Results, Row
from carom.trace import Setting

__all__ = [
    "CellLine",
    "KnownLine",
    "RunTime",
    "SettingsOf",
    "UsedSetting",
    "cell_lines",
    "known_lines",
    "run_times",
    "settings_used",
]


class KnownLine(NamedTuple):
    """A scene with a known answer: what it shows, where the answer is from, and how far PIC is from it."""

    scene: str
    shows: str
    source: str
    convention: str
    impacts: str
    deviation: str
    reproduced: bool


class RunTime(NamedTuple):
    """How long an engine's profile takes, in units of what PIT takes: median, least and greatest over scenes."""

    column: Column
    median: float
    low: float
    high: float
    scenes: int


class UsedSetting(NamedTuple):
    """A setting as it was really used; what else it takes elsewhere is told in words."""

    name: str
    value: str
    varies: str


@dataclass(frozen=True)
class SettingsOf:
    """The settings of an engine's profile, with what the profile stands for."""

    column: Column
    description: str
    scene: str
    settings: tuple[UsedSetting, ...]


class CellLine(NamedTuple):
    """One cell of the cross-check, at any step, in words."""

    scene: str
    column: Column
    dt: str
    mark: Mark
    counts: str
    time: str
    velocity: str
    direction: str
    energy: str
    reasons: tuple[str, ...]


def known_lines(results: Results) -> tuple[KnownLine, ...]:
    """Return every known answer, in the order of the scenes."""
    return tuple(
        KnownLine(
            scene=name,
            shows=results.references[name].scene.description,
            source=answer.source,
            convention=answer.convention,
            impacts="not known" if answer.count is None else str(answer.count),
            deviation="an impact is missing or wrong" if math.isinf(deviation) else wording.number(deviation),
            reproduced=deviation <= THRESHOLDS.rounding,
        )
        for name, (answer, deviation) in results.known.items()
    )


def run_times(grid: Grid) -> tuple[RunTime, ...]:
    """Return the run times that were measured, at each scene's coarsest step."""
    found = []
    for column in grid.columns:
        ratios = [cell.row.time_ratio for cell in grid.cells(column) if cell.row and cell.row.time_ratio is not None]
        if ratios:
            found.append(RunTime(column, statistics.median(ratios), min(ratios), max(ratios), len(ratios)))
    return tuple(found)


def settings_used(results: Results, grid: Grid) -> tuple[SettingsOf, ...]:
    """Return the settings that the first scene's coarsest step used, and how they vary with the step and the scene."""
    profiles = {info.name: info.profiles for info in results.engines}
    found = []
    for column in grid.columns:
        runs = [
            row
            for row in results.rows
            if (row.cell.engine, row.cell.profile) == (column.engine, column.profile) and row.trace is not None
        ]
        if not runs:
            continue
        first = min(runs, key=lambda row: row.cell.refinement)
        found.append(
            SettingsOf(
                column=column,
                description=profiles.get(column.engine, {}).get(column.profile, ""),
                scene=first.cell.scene.name,
                settings=tuple(
                    UsedSetting(name, wording.setting(value), _variation(name, first, runs))
                    for name, value in _settings(first).items()
                ),
            )
        )
    return tuple(found)


def _settings(row: Row) -> Mapping[str, Setting]:
    return row.trace.settings if row.trace is not None else {}


def _variation(name: str, first: Row, runs: list[Row]) -> str:
    """Say on what a setting depends: two runs of one scene differ in the step, two at one step in the scene."""
    here = _settings(first)[name]
    scene = first.cell.scene.name
    with_step = any(row.cell.scene.name == scene and _settings(row).get(name) != here for row in runs)
    at_same_step = [row for row in runs if row.cell.dt_s == first.cell.dt_s and row.cell.scene.name != scene]
    with_scene = any(_settings(row).get(name) != here for row in at_same_step)
    on = [what for what, varies in (("step", with_step), ("scene", with_scene)) if varies]
    return f"varies with the {wording.listed(on, 'and the')}" if on else ""


def cell_lines(results: Results, grid: Grid) -> tuple[CellLine, ...]:
    """Return every cell that was asked for, in the order of the rows."""
    own = {(column.engine, column.profile): column for column in grid.columns}
    return tuple(_cell_line(row, own[row.cell.engine, row.cell.profile]) for row in results.rows)


def _cell_line(row: Row, column: Column) -> CellLine:
    score, dt_s = row.score, row.cell.dt_s
    counts = time = velocity = direction = energy = wording.ABSENT
    if score is not None:
        counts = f"{score.expected} / {len(score.missed)} / {len(score.spurious)}"
        energy = wording.number(score.energy_error, 3)
        if score.errors:
            time = f"{wording.seconds(score.time_error_s)} ({wording.steps(score.time_error_s, dt_s)})"
            velocity = wording.number(score.velocity_error, 3)
            direction = f"{wording.number(math.degrees(score.direction_error_rad), 3)}°"
    return CellLine(
        row.cell.scene.name,
        column,
        wording.step(dt_s),
        mark_of(row),
        counts,
        time,
        velocity,
        direction,
        energy,
        reasons_of(row),
    )
