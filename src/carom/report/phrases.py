"""Sentences that the HTML and the Markdown report have in common."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from carom.report import wording
from carom.report.divergences import Divergence
from carom.report.grid import Grid
from carom.report.sampling import Agreement
from carom.report.trend import Trend

__all__ = [
    "AGREEMENT_NOTE",
    "FIGURE_NOTE",
    "HORIZON_NOTE",
    "KNOWN_NOTE",
    "MAP_NOTE",
    "PRICE_NOTE",
    "PROFILE_NOTE",
    "RUN_TIME_NOTE",
    "SPREAD_NOTE",
    "TITLE",
    "agreement_lines",
    "caption",
    "trend_note",
    "trend_scenes",
    "unrun_lines",
]

TITLE = "Carom cross-check"

FIGURE_NOTE = (
    "Δv is the largest velocity error of a matched impact, over the greatest speed in the scene. Where all "
    "velocities are right to rounding, it is told how many steps late or early an impact was found; where impacts are "
    "missed or invented, they are counted. PIC is held against itself here: what it is worth, the known answers say."
)
AGREEMENT_NOTE = (
    "In how many scenes a run finds the very impacts that PIT finds at the same step, times and velocities equal to "
    "rounding."
)
PRICE_NOTE = (
    "A method that looks once a step is late by up to a step whatever else it does: what PIT, at the same step, errs "
    "against PIC is the price of sampling, and what an engine errs against PIT is its own."
)
SPREAD_NOTE = (
    "Where in a step an impact falls is luck. Each cell was run again with its scene shifted along its own motion by "
    "parts of a step; where two discs meet, the share that PIT must miss has a closed form."
)
HORIZON_NOTE = (
    "Beyond its horizon a reference is not believed, because rounding alone has led it elsewhere: impacts there are "
    "scored locally only, each from the engine's own state before it. Where no certified run says how far it reaches, "
    "a horizon is an estimate, from what a start moved by one unit in the last place leads to."
)
MAP_NOTE = (
    "Two equal discs, PIT against PIC, over impact parameter and relative speed times step over radius. White: the "
    "line beyond which PIT can miss the impact, where half the chord is passed within a step."
)
KNOWN_NOTE = (
    "What mathematics or a cited source says of a scene, never computed by the code under test. Times are divided by "
    "the scene's duration, velocities by its greatest speed and lengths by its extent, so the deviation has no unit."
)
PROFILE_NOTE = (
    "How many scenes each engine has of each grade with each profile and variant, at the coarsest step; where it has "
    "no such profile, why."
)
RUN_TIME_NOTE = (
    "Seconds for all steps of a scene over PIT's for the same scene and step: a ratio of two things timed in one run. "
    "Carom's PIT is Python that does not look at frames at which nothing can touch; below 1 is faster than it. Median "
    "over scenes, at each scene's coarsest step."
)


def unrun_lines(grid: Grid) -> Iterator[str]:
    """Return one sentence for each reason for which cells were not run or not scored."""
    for entry in grid.unrun:
        where = "every scene" if entry.everywhere else wording.listed(entry.scenes)
        yield f"{wording.listed(entry.columns)}, {entry.mark.word} on {where}: {entry.reason}"


def agreement_lines(found: Sequence[Agreement]) -> Iterator[str]:
    """Return one sentence for each engine that was held against PIT."""
    for entry in found:
        line = f"{entry.column.name}: {entry.equal} of {wording.count(entry.scenes, 'scene')}"
        if entry.equal:
            line += f", largest difference {wording.number(entry.largest)}"
        if 0 < len(entry.different) <= entry.equal:  # the longer list is not the one to read
            line += f"; not {wording.listed(entry.different)}"
        yield line


def caption(entry: Divergence) -> str:
    """Return what a picture shows: who ran it, at which step, and every verdict with its numbers."""
    row = entry.cell.row
    dt = wording.step(row.cell.dt_s) if row else ""
    return f"{entry.cell.column.name} at {dt}: {'; '.join(entry.cell.reasons)}."


def trend_note(trend: Trend) -> str:
    """Return of how many scenes the points of the charts are."""
    wrong = "Scenes with a missed or invented impact are counted among all graded ones."
    if not trend.scenes:
        return f"No scene has a velocity error that the step could change. {wrong}"
    scenes = wording.count(len(trend.scenes), "scene")
    return f"Velocity errors are medians over the same {scenes} at every step. {wrong}"


def trend_scenes(trend: Trend) -> Iterator[str]:
    """Return which scenes the velocity errors are medians of, why the others are not, and where one is missing."""
    if trend.scenes:
        yield f"Velocity errors are of {wording.listed(trend.scenes)}."
    for why, names in trend.left_out:
        yield f"Left out, {why}: {wording.listed(names)}."
    few = [
        f"{series.column.name} has {point.scenes} of the {len(trend.scenes)} at step {wording.part(part)}"
        for series in trend.series
        for point, part in zip(series.points, trend.parts, strict=True)
        if point.scenes < len(trend.scenes)
    ]
    if few:
        yield f"Fewer scenes, where an engine matched no impact or was not run: {'; '.join(few)}."
