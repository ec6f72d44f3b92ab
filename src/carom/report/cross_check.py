"""The report of a cross-check as a document: which sections it has, in which order, and what stands in them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

from carom.comparator import Horizon
from carom.report import wording
from carom.report.chart import price_chart, velocity_chart, wrong_chart
from carom.report.divergences import Divergence, divergences
from carom.report.document import (
    DETAIL,
    IN_FULL,
    ON_PAPER,
    PAGE,
    TERMINAL,
    Block,
    Cell,
    Column,
    Document,
    Figure,
    Figures,
    Legend,
    Lines,
    Pair,
    Pairs,
    Replays,
    Section,
    Table,
    Text,
)
from carom.report.grid import Grid, Unrun, build_grid
from carom.report.made import making
from carom.report.marks import Mark
from carom.report.overview import group_table, impacts_side_by_side, method_table
from carom.report.picture import draw_pair
from carom.report.price import Price, price_table, prices
from carom.report.replay import scene_replays
from carom.report.summary import agreement, summarise
from carom.report.tables import (
    cell_table,
    grid_table,
    impact_tables,
    known_table,
    mark_cell,
    profile_table,
    run_time_table,
    settings_table,
    spread_table,
)
from carom.report.trend import Trend, build_trend
from carom.runs.plan import default_dts
from carom.runs.results import Results

__all__ = ["caption", "cross_check_document"]

TITLE = "Carom cross-check"

FIGURE_NOTE = (
    "Δv is the largest velocity error of a matched impact, over the greatest speed in the scene. Where all "
    "velocities are right to rounding, it is told how many steps late or early an impact was found; where impacts are "
    "missed or invented, they are counted. PIC is held against itself here: what it is worth, the known answers say."
)
HEAT_NOTE = (
    "Each cell tells the worst grade of a method in a group, of how many of its scenes, and leads to the worst of "
    "them, played beside the reference; the bar below shows all grades."
)
METHOD_NOTE = (
    "Missed and invented impacts are counted over all scenes. The error is the largest velocity error over PIT's at "
    "worst over the phases of the same step, median over scenes: 1 pays the price of looking once a step, 0 none of it."
)
METHOD_SHORT = "impacts: - missed, + invented; error: of velocity, median, by PIT's at worst"
PRICE_CAPTION = (
    "A ring: the largest velocity error against PIC. A disc: what of it sampling does not explain. Medians over "
    "scenes; the line between them is the price of sampling."
)
SHORT_NOTE = (
    "0.075: largest velocity error, over the scene's greatest speed\n"
    "-1 +2: impacts missed and invented\n"
    "0.4 dt: velocities right to rounding, found so many steps late or early"
)
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
SPREAD_NOTE = (
    "Where in a step an impact falls is luck. Each cell was run again with its scene shifted along its own motion by "
    "parts of a step; where two discs meet, the share that PIT must miss has a closed form."
)
HORIZON_NOTE = (
    "Beyond its horizon a reference is not believed, because rounding alone has led it elsewhere: impacts there are "
    "scored locally only, each from the engine's own state before it. Where no certified run says how far it reaches, "
    "a horizon is an estimate, from what a start moved by one unit in the last place leads to."
)
CERTIFIED_NOTE = (
    "Errors grow from impact to impact, also those of the reference. A certified run, in which every digit is proven, "
    "says up to which impact the reference may be believed; what comes later is not scored."
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
    "Carom's PIT does not look at frames at which nothing can touch; below 1 is faster than it. Median over scenes, at "
    "each scene's coarsest step."
)
PICTURE_NOTE = (
    "The reference beside the run, drawn to one scale. Outline with a number: a disc at the start; tinted: at an "
    "impact; filled: at the end. Dots are the frames that a run looks at; dashed: those just before and just after "
    "what is missed. Where everything moves along one line, position is drawn against time."
)
SETTINGS_NOTE = (
    "Read back from the engine where it can be read, at the coarsest step of the first scene that the engine ran."
)

#: Marks of cells that a reader can do something about: install an engine, report a crash, raise a limit.
_TO_MEND = (Mark.UNAVAILABLE, Mark.CRASHED, Mark.TIMED_OUT, Mark.FAILED)


def cross_check_document(results: Results) -> Document:
    """Return the report of a cross-check."""
    grid = build_grid(results)
    found = prices(grid)
    return Document(
        title=TITLE,
        lead=summarise(results, grid),
        sections=(
            *_overview(results, grid, found),
            *_grid(results, grid),
            *_sampling(found),
            *_horizons(results),
            Section("Spread over phases", _unless_empty(SPREAD_NOTE, spread_table(results, grid))),
            *_trend(build_trend(results, grid)),
            *_pictures(results, grid),
            Section("Known answers", _unless_empty(KNOWN_NOTE, known_table(results))),
            *_certified(results),
            Section("Run time", _unless_empty(RUN_TIME_NOTE, run_time_table(grid))),
            *_making(results, grid),
            Section("Every cell, at every step", (cell_table(results, grid),)),
            Section("Impact by impact", tuple(impact_tables(results)), only=DETAIL),
        ),
    )


def _unless_empty(note: str, table: Table) -> tuple[Block, ...]:
    """Return a note and its table; nothing where the table has no row."""
    return (Text(note, table.only), table) if table.rows else ()


def _overview(results: Results, grid: Grid, found: tuple[Price, ...]) -> Iterator[Section]:
    """Say the answer first: a line a method, and scene groups by method; of one scene, its impacts."""
    marks = Legend(tuple((mark_cell(mark), mark.meaning) for mark in grid.marks), PAGE)
    signs = {mark.symbol: mark.css.replace("-", " ") for mark in grid.marks}
    words = Text("  ".join(f"{symbol} {word}" for symbol, word in signs.items()), TERMINAL)
    what = f"Every method against PIC, at {grid.step_phrase}"
    title = f"{grid.rows[0].scene.name}: {what.lower()}" if len(grid.rows) == 1 else what
    table, groups = method_table(grid), replace(group_table(grid), only=PAGE)
    chart = Figure(partial(price_chart, found, "What sampling costs each engine, and what is its own"), PRICE_CAPTION)
    charts = (Figures((chart,)),) if any(price.paid for price in found) else ()
    notes = Text(METHOD_SHORT, TERMINAL), Text(METHOD_NOTE, ON_PAPER)
    yield Section(title, (groups, marks, Text(HEAT_NOTE, PAGE), *charts, table, words, *notes) if table.rows else ())
    impacts = tuple(impacts_side_by_side(results, grid))
    yield Section("Its impacts, every method beside the others", impacts, level=3)


def _grid(results: Results, grid: Grid) -> Iterator[Section]:
    legend = Legend(tuple((mark_cell(mark), mark.meaning) for mark in grid.marks), IN_FULL - PAGE)
    reach = {name: _in_short(found) for name, found in results.certified.items()}
    yield Section(
        f"Every scene on every engine, against PIC at {grid.step_phrase}",
        (
            legend,
            grid_table(grid, reach),
            Text(FIGURE_NOTE, ON_PAPER),
            Text(SHORT_NOTE, DETAIL),
            Replays(tuple(scene_replays(results, grid))),
        ),
    )
    unrun = {entry: _not_scored(entry) for entry in grid.unrun}
    # What can be mended, and what leaves a method with nothing, is part of the answer.
    telling = tuple(line for entry, line in unrun.items() if entry.everywhere or entry.mark in _TO_MEND)
    lines = (Lines(tuple(unrun.values()), IN_FULL), Lines(telling, TERMINAL))
    yield Section("Not scored, and why", tuple(block for block in lines if block.items), level=3)
    yield Section("Profiles and variants", (Text(PROFILE_NOTE, ON_PAPER), profile_table(results, grid)), level=3)


def _not_scored(entry: Unrun) -> str:
    where = "every scene" if entry.everywhere else wording.listed(entry.scenes)
    return f"{wording.listed(entry.columns)}, {entry.mark.word} on {where}: {entry.reason}"


def _sampling(found: tuple[Price, ...]) -> Iterator[Section]:
    if not found:
        return
    said = tuple(Text(sentence, IN_FULL) for sentence in (agreement(found),) if sentence)
    paid: tuple[Block, ...] = (*said, Text(PRICE_NOTE, ON_PAPER), price_table(found), Text(PRICE_SHORT, DETAIL))
    yield Section("The price of sampling", paid, level=3)


def _horizons(results: Results) -> Iterator[Section]:
    """Say up to where the reference of a scene may be believed, where that is not the whole of it."""
    rows = []
    for name, until_s in results.horizons.items():
        times = results.references[name].impacts["time_s"]
        believed = int((times <= until_s).sum())
        rows.append((name, f"{believed} of {len(times)} impacts, to {wording.seconds(until_s)}"))
    table = Table((Column("scene"), Column("believed")), tuple(rows), only=ON_PAPER)
    yield Section("Horizons", _unless_empty(HORIZON_NOTE, table), level=3)


def _trend(trend: Trend) -> Iterator[Section]:
    if not trend.drawable:
        return
    charts = Figures(
        (
            Figure(
                partial(velocity_chart, trend, "Median velocity error against the step"),
                "Velocity error. Shaded: from the least to the greatest scene, for PIT.",
            ),
            Figure(
                partial(wrong_chart, trend, "Scenes with a missed or invented impact, against the step"),
                "Scenes graded wrong.",
            ),
        )
    )
    steps = [f"step {wording.part(part)}" for part in trend.parts]
    columns = [Column("engine")]
    columns += [Column("velocity error", step) for step in steps] + [Column("scenes wrong", step) for step in steps]
    rows = tuple(
        (
            series.column.name,
            *(
                wording.ABSENT
                if point.median is None
                else Cell(
                    wording.number(point.median),
                    f"({wording.number(point.low)} to {wording.number(point.high)}; {point.scenes})",
                )
                for point in series.points
            ),
            *(f"{point.wrong} of {point.graded}" for point in series.points),
        )
        for series in trend.series
    )
    table = Table(
        tuple(columns),
        rows,
        note="Velocity error: median over scenes (least to greatest; scenes).",
        folded="The numbers of these charts",
        only=ON_PAPER,
    )
    wrong = "Scenes with a missed or invented impact are counted among all graded ones."
    said = (
        f"Velocity errors are medians over the same {wording.count(len(trend.scenes), 'scene')} at every step. {wrong}"
        if trend.scenes
        else f"No scene has a velocity error that the step could change. {wrong}"
    )
    scenes = Lines(tuple(_trend_scenes(trend)), ON_PAPER)
    yield Section("Error against step", (charts, Text(said, ON_PAPER), table, scenes))


def _trend_scenes(trend: Trend) -> Iterator[str]:
    """Say which scenes the velocity errors are medians of, why the others are not, and where one is missing."""
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


def _pictures(results: Results, grid: Grid) -> Iterator[Section]:
    paper, worst = divergences(results, grid)
    if paper or worst:
        yield Section("What goes wrong", (Text(PICTURE_NOTE, ON_PAPER),))
    for heading, shown in (("The source paper's cases, by PIT", paper), ("The worst of the other scenes", worst)):
        if shown:
            yield Section(heading, (Pairs(tuple(map(_pair, shown))),), level=3)


def caption(entry: Divergence) -> str:
    """Return what a picture shows: who ran it, at which step, and every verdict with its numbers."""
    row = entry.cell.row
    dt = wording.step(row.job.dt_s) if row else ""
    return f"{entry.cell.column.name} at {dt}: {'; '.join(entry.cell.reasons)}."


def _pair(entry: Divergence) -> Pair:
    said = caption(entry)
    labels = (f"What must happen in {entry.scene_name}, by PIC", f"{entry.scene_name}: {said}")
    return Pair(
        entry.scene_name,
        mark_cell(entry.cell.mark),
        (
            f"PIC: {wording.count(len(entry.reference.impacts), 'impact')}",
            f"{entry.cell.column.name}: {wording.count(len(entry.observed.impacts), 'impact')}",
        ),
        partial(draw_pair, entry, labels),
        tuple(filter(None, (entry.reference.scene.description, said))),
    )


def _certified(results: Results) -> Iterator[Section]:
    lines = tuple(f"{name}: {found}." for name, found in results.certified.items())
    if lines:
        yield Section("How far the reference is certified", (Text(CERTIFIED_NOTE, ON_PAPER), Lines(lines, IN_FULL)))


def _in_short(found: Horizon | str) -> str:
    """Return in a few words how far a reference is certified."""
    if isinstance(found, str):
        return found.partition(";")[0].partition(":")[0]
    return f"certified to impact {found.certified}"


def _making(results: Results, grid: Grid) -> Iterator[Section]:
    yield from making(results.environment, results.command or _python_call(results, grid), results.elapsed_s)
    used = settings_table(results, grid)
    yield Section("Settings really used", (used, Text(SETTINGS_NOTE, ON_PAPER)) if used.rows else (), level=3)


def _python_call(results: Results, grid: Grid) -> str:
    """Return the Python that makes the results again, for a cross-check that was not called from the command line."""
    engines = list(dict.fromkeys(column.engine for column in grid.columns))
    profiles = list(dict.fromkeys(column.profile for column in grid.columns))
    steps: dict[str, set[float]] = {}
    for row in results.rows:
        steps.setdefault(row.job.scene.name, set()).add(row.job.dt_s)
    own = all(steps[row.scene.name] <= set(default_dts(row.scene)) for row in grid.rows)
    dts = "" if own else f", dts={sorted(set().union(*steps.values()), reverse=True)!r}"
    return f"carom.cross_check(scenes, {engines!r}, profiles={profiles!r}{dts})"
