"""Sections with the results of every engine in every scene, and with the reasons why runs have no score."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from functools import partial
from pathlib import Path
from urllib.parse import quote

from carom.engines.api import Capabilities, ContactTimes
from carom.model.scene import Scene
from carom.report.document import Block, Cell, Column, Legend, Lines, Media, Replays, Section, Table, Text
from carom.report.files import pack_data
from carom.report.outcome_marks import Mark
from carom.studies.cross_check.grid import Grid, GridRow, merge_own_profiles, select_worst
from carom.support import formatting
from carom.support.escaping import escape_controls

#: File name of the page in the folder of a report.
PLAY_PAGE = "play.html"

#: Largest number of scenes in the table.
MOST_SCENES = 500

#: Failures that a user can do something about: install an engine, report a crash, or raise a limit.
_ACTIONABLE = (Mark.UNAVAILABLE, Mark.CRASHED, Mark.TIMED_OUT, Mark.FAILED)

FIGURE_NOTE = (
    "'0.5 of PIT's error' means that the run's largest error is half of PIT's largest error at the same step size. If "
    "all velocities are correct, a cell shows by how many steps an impact is late or early."
)
FIGURE_DETAIL = (
    "If impacts are missed or invented, a cell shows their number. Otherwise, a cell shows the largest velocity or "
    "spin error, divided by PIT's largest error over the phases of the step. If PIT has no such error, the error is "
    "divided by the greatest speed. If all velocities and spins are correct except for rounding, a cell shows the "
    "largest time error in steps. This table compares PIC with itself; the known answers show how accurate PIC is."
)
SHORT_NOTE = (
    "0.5\N{MULTIPLICATION SIGN} is the largest velocity or spin error divided by PIT's error\n"
    "-1 +2 are the numbers of missed and invented impacts\n"
    "0.4 steps means that all velocities are correct, but an impact is late or early by 0.4 steps"
)


def build_scenes_section(grid: Grid) -> Section:
    """Return a section with a table of all scenes and engines."""
    columns = [Column("scene", lambda row: Cell(row.name, title=row.description))]
    contents = {method: tuple((cell.mark, cell.figure) for cell in grid.list_cells(method)) for method in grid.methods}
    columns += [
        Column(method.heading, partial(_build_cell, grid.methods.index(method)), "" if others else method.profile_shown)
        for *others, method in merge_own_profiles(contents)
    ]
    rows, note = select_worst(grid.rows, MOST_SCENES, lambda row: row.cells)
    blocks: tuple[Block, ...] = (
        Legend(tuple((mark.cell, mark.meaning) for mark in grid.marks), Media.MARKDOWN | Media.DETAIL),
        Table(columns, rows, note=note, css="grid", only=Media.IN_FULL),
        Text(FIGURE_NOTE, Media.ON_PAPER),
        Text(FIGURE_DETAIL, Media.ON_PAPER, folded=True),
        Text(SHORT_NOTE, Media.DETAIL),
        Replays(partial(pack_replays, grid)),
    )
    return Section(f"Every scene on every engine, at {grid.step_phrase}", blocks, short="Every scene")


def _build_cell(column_number: int, row: GridRow) -> Cell:
    """Return the cell of a scene in a column of the grid."""
    cell = row.cells[column_number]
    short = cell.short_figure or ("" if cell.mark.ran else cell.mark.word)
    title = cell.mark.sentence if cell.compared_run else f"{cell.method.title} on {row.name}: {'; '.join(cell.reasons)}"
    return cell.mark.cell._replace(note=cell.figure, link=cell.link, short=short, title=title)


def pack_replays(grid: Grid) -> Iterator[tuple[str, str]]:
    """Yield the name and the packed replays of each scene that has a reference."""
    # imported here, because only a page contains replays
    from carom.report.replay_data import build_replay_data, describe_run, format_run_command

    for row in grid.rows:
        reference = grid.results.references.get(row.name)
        runs = []
        for cell in row.cells:
            if cell.row and cell.compared_run:
                command = format_run_command(escape_controls(row.name), cell.row.job)
                description = describe_run(cell.row, cell.method.heading, cell.replay_key, command)
                runs.append((*cell.compared_run, description))
        if reference is not None and runs:
            data = build_replay_data(reference, runs) | {"drag": build_play_link(reference.scene)}
            yield escape_controls(row.name), pack_data(data)


def build_play_link(scene: Scene) -> str:
    """Return the relative link to a scene on the play page; empty if the page can't show the scene."""
    from carom.web.page import find_page_limit

    return "" if find_page_limit(scene) else f"{PLAY_PAGE}#{quote(scene.name, safe='')}"


def build_play_page(scenes: Iterable[Scene]) -> str:
    """Build the play page with all scenes that it can show; empty without such scenes."""
    from carom.web.page import add_gallery, render_page

    playable_scenes = [scene for scene in scenes if build_play_link(scene)]
    return render_page(add_gallery(*playable_scenes)) if playable_scenes else ""


def build_unscored_section(grid: Grid) -> Section:
    """Return a section with the reasons why cells were not run or scored. A terminal shows only important reasons."""
    reasons = list(_list_reasons(grid))
    important = tuple(reason for reason, is_important in reasons if is_important)
    run = {method.engine for method in grid.methods}
    missing = [info for info in grid.results.engines if info.missing and info.name not in run]
    folder_prefix = f"{Path.cwd()}{os.sep}"  # reports are shared, so paths are made relative
    unavailable = tuple(f"{one.name} is not run: {one.unavailable.replace(folder_prefix, '')}" for one in missing)
    names = formatting.join_words([info.name for info in missing])
    folded = formatting.format_count(len(reasons), "reason")
    hint = f"Not installed: {names}; 'carom engines' shows how to install them."
    lines = (
        Lines(tuple(reason for reason, _ in reasons), Media.IN_FULL, folded=folded),
        Lines(important, Media.TERMINAL),
        Lines(unavailable, Media.IN_FULL),
        Lines((hint,) if missing else (), Media.TERMINAL),
        Lines(tuple(_describe_missing_profiles(grid)), Media.ON_PAPER),
    )
    return Section("Runs without a score", tuple(block for block in lines if block.items), level=3)


def _list_reasons(grid: Grid) -> Iterator[tuple[str, bool]]:
    """Yield each reason why cells were not run or scored, with their methods and scenes.

    Also yield whether the reason is important: whether it concerns all scenes, or a user can remove its cause.
    """
    unscored = (cell for cell in grid.runs if not cell.mark.ran)
    found = formatting.group_by(((cell.mark, cell.method.engine, "; ".join(cell.reasons)), cell) for cell in unscored)
    for (mark, _, reason), cells in found.items():
        methods = list(dict.fromkeys(cell.method.title for cell in cells))
        scenes = list(dict.fromkeys(cell.scene for cell in cells))
        everywhere = len(scenes) == len(grid.rows)
        scenes_text = "every scene" if everywhere else formatting.join_words(scenes)
        text = f"{formatting.join_words(methods)}, {mark.word} on {scenes_text}: {reason}"
        yield text, everywhere or mark in _ACTIONABLE


def _describe_missing_profiles(grid: Grid) -> Iterator[str]:
    """Describe why an engine lacks a profile that other engines were run with."""
    profiles = dict.fromkeys(method.profile for method in grid.methods if not method.is_own)
    for info in grid.results.engines:
        for profile in profiles:
            if info.available and info.capabilities is not None and not info.own_profiles([profile]):
                yield f"{info.name} has no profile {profile}: {explain_missing_profile(profile, info.capabilities)}"


def explain_missing_profile(profile: str, capabilities: Capabilities) -> str:
    """Return the likely reason why a method with these capabilities has no profile of this name."""
    if profile.startswith("cylinder") and capabilities.dimensions == 2:
        return "its discs are two-dimensional, so they can't tip over"
    if profile == "resting":
        return "no settings are known that bring discs to rest better than `tuned`"
    if profile == "no-ccd" and not capabilities.continuous_detection:
        return "it has no continuous detection to switch off"
    if capabilities.contact_times is ContactTimes.SOLVED:
        return "it computes the instant of each impact, so it needs no shorter steps and no checks along paths"
    if profile == "located":
        return "by definition, it checks only at the ends of steps, so Carom does not shorten its steps"
    return "its adapter offers no such profile"
