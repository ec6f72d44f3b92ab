"""Which engines do just what PIT does at the same step, and how nearly: then sampling is all their error."""

from __future__ import annotations

from dataclasses import dataclass

from carom.comparator import compare
from carom.comparator.verdict import THRESHOLDS
from carom.report.grid import Column, Grid
from carom.runner import Results
from carom.trace import Trace

__all__ = ["Agreement", "agreements"]


@dataclass(frozen=True)
class Agreement:
    """How far an engine's profile agrees with PIT at each scene's coarsest step.

    Attributes:
        column: The engine and profile.
        equal: How many scenes it finds the same impacts in, times and velocities equal to rounding.
        scenes: How many scenes both ran.
        largest: Largest difference of a velocity, over the scene's speed, or time, over its duration, in the scenes
            that are equal.
        different: Names of the scenes that are not equal.
    """

    column: Column
    equal: int
    scenes: int
    largest: float
    different: tuple[str, ...]


def agreements(results: Results, grid: Grid) -> tuple[Agreement, ...]:
    """Hold every engine that is not Carom's own against the run of PIT; empty where PIT was not run."""
    pit = {
        row.cell.scene.name: row.trace
        for row in results.rows
        if row.cell.engine == "pit" and row.cell.refinement == 0 and row.trace is not None
    }
    found = []
    for column in grid.columns:
        differences = {}
        for cell in grid.cells(column):
            if cell.row is not None and cell.row.trace is not None and cell.row.cell.scene.name in pit:
                name = cell.row.cell.scene.name
                differences[name] = _difference(pit[name], cell.row.trace)
        if column.own or not differences:
            continue
        equal = [worst for worst in differences.values() if worst is not None and worst <= THRESHOLDS.rounding]
        found.append(
            Agreement(
                column=column,
                equal=len(equal),
                scenes=len(differences),
                largest=max(equal, default=0.0),
                different=tuple(
                    name for name, worst in differences.items() if worst is None or worst > THRESHOLDS.rounding
                ),
            )
        )
    return tuple(found)


def _difference(pit: Trace, observed: Trace) -> float | None:
    """Return the largest difference of matched impacts, without unit; None where not all impacts match."""
    score = compare(pit, observed)
    if score.missed or score.spurious:
        return None
    velocity = max((error.velocity for error in score.errors), default=0.0)
    time = max((abs(error.time_s) for error in score.errors), default=0.0)
    return max(velocity, time / score.scales.time_s)
