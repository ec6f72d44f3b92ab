"""Which engines do just what PIT does at the same step, and how nearly: then sampling is all their error."""

from __future__ import annotations

import math
from dataclasses import dataclass

from carom.comparator import Score
from carom.report.grid import Column, Grid
from carom.runs.results import Results

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
    if not any(row.job.engine == "pit" and row.trace is not None for row in results.rows):
        return ()
    found = []
    for column in grid.columns:
        differences = {
            cell.row.job.scene.name: _difference(cell.row.score)
            for cell in grid.cells(column)
            if cell.row is not None and cell.row.score is not None and cell.row.score.solver is not None
        }
        if column.own or not differences:
            continue
        equal = [worst for worst in differences.values() if worst is not None]
        found.append(
            Agreement(
                column=column,
                equal=len(equal),
                scenes=len(differences),
                largest=max(equal, default=0.0),
                different=tuple(name for name, worst in differences.items() if worst is None),
            )
        )
    return tuple(found)


def _difference(score: Score) -> float | None:
    """Return the largest difference from PIT, without unit; None where it is not PIT to rounding."""
    if not score.equals_pit or score.solver is None:
        return None
    numbers = (score.solver.velocity, abs(score.solver.time_s) / score.scales.time_s)
    return max([0.0, *(number for number in numbers if not math.isnan(number))])
