"""Document of `carom history`: a table of releases, a table of changed runs, and a diagram of errors."""

from __future__ import annotations

import math
import statistics
from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

from carom.comparator import Grade
from carom.report.document import Column, Document, Lines, Media, Section, Table, Text
from carom.report.outcome_marks import mark_of_grade
from carom.report.provenance import build_provenance
from carom.report.render.markdown import render_markdown
from carom.report.svg import build_framed_figure, choose_line_style, finish, render, to_separate_svg, use_drawing_style
from carom.studies.history.compare_cells import CellChange, ChangeKind
from carom.studies.history.release_engines import Origin
from carom.studies.history.result import Bisection, History, Release, RunCell, Transition
from carom.studies.history.run import PURPOSE
from carom.support import formatting
from carom.support.escaping import is_older, parse_release_numbers
from carom.support.folders import write_files

_WIDTH_IN, _HEIGHT_IN = 8.6, 4.2

RULE = (
    "A change is attributed to the engine if the settings that it reports are equal and the motion differs. The motion "
    "is compared for the unshifted scene, and for the scene shifted to {phases} phases of the step. Three kinds of "
    "numbers describe the motion: final velocity errors, position errors at eight instants, and single coordinates. "
    "The motion differs if the two releases' ranges of a number do not overlap, and the gap exceeds rounding. Before "
    "the comparison, both ends of each range are moved outwards: the upper end by the distance between the two largest "
    "values, the lower end by the distance between the two smallest values. Differences of reported contacts do not "
    "count. 'Same bits' means that impacts and final states are bit-identical for the unshifted scene."
)


class _Changed(NamedTuple):
    """A scene, profile and step size for which the result changed from one release to the next."""

    step: Transition
    cell: RunCell
    change: CellChange


def build_history_document(history: History) -> Document:
    """Return the document of a history."""
    changed = [
        _Changed(step, cell, change)
        for step in reversed(history.transitions)
        for cell, change in sorted(step.engine_changes.items(), key=lambda item: (item[1].kind.name, item[0]))
    ]
    sections = (
        Section("Releases", (_build_release_table(history), *_describe_settings(history))),
        Section("Changed cells", (Table(_CHANGE_COLUMNS, changed),) if changed else ()),
        Section("How changes are detected", (Text(RULE.format(phases=history.options.phases)),), only=Media.ON_PAPER),
        *build_provenance(history.environment, history.command, history.elapsed_s),
    )
    return Document(f"Carom: releases of {history.origin.engine}", tuple(_build_headline(history)), sections)


def write_history(history: History, document: Document, folder: Path) -> Path:
    """Write a history as ``history.md`` with the chart ``history.svg``, and return the path of ``history.md``.

    Raises:
        InputError: The folder contains files that Carom did not write.
        OSError: The files can't be written.
    """
    files = {"history.md": render_markdown(document), "history.svg": render_error_chart(history)}
    return write_files(folder, PURPOSE, files)


def describe_listing(origin: Origin, versions: tuple[str, ...]) -> Iterator[str]:
    """Yield a line for each release that a registry lists, newest first, with notes such as "installed"."""
    for version in reversed(versions):
        notes = []
        if is_older(version, origin.oldest):
            notes.append(f"older than {origin.oldest}, the oldest supported release")
        # A test with release "7.3" also counts for 7.3.1.
        newest_tested = parse_release_numbers(origin.newest_tried)
        if newest_tested and parse_release_numbers(version)[: len(newest_tested)] > newest_tested:
            notes.append(f"newer than {origin.newest_tried}, the newest tested release")
        if version == origin.installed:
            notes.append("installed")
        yield f"{version:16} {'; '.join(notes)}".rstrip()


def describe_bisection(bisection: Bisection | None) -> Iterator[str]:
    """Yield sentences that describe the result of a bisection."""
    if bisection is None:
        yield "The results of the oldest and the newest release differ by no more than results at different phases."
        return
    oldest = bisection.tested_versions[0]
    agrees = f"{bisection.last}, which agrees with {oldest}, the oldest"
    before = f"{oldest}, the oldest" if bisection.last == oldest else agrees
    why = f"{bisection.change.kind.value}: {bisection.change.numbers}"
    cell = f"{bisection.cell.scene} with {bisection.cell.profile} at {formatting.format_step(bisection.cell.dt_s)}"
    yield f"{cell}: {bisection.first} differs from {before} ({why})."
    yield f"Releases run: {', '.join(dict.fromkeys(bisection.tested_versions))}."


def _build_headline(history: History) -> Iterator[str]:
    run_releases, engine = history.completed, history.origin.engine
    changed_steps = [step for step in history.transitions if step.engine_changes]
    if len(run_releases) >= 2 and not changed_steps:
        nothing = "no change is larger than the difference between results at different phases"
        if all(step.count(ChangeKind.SAME_BITS) == step.compared for step in history.transitions):
            nothing = "no bit changed"
        yield f"In {engine} from {run_releases[0].version} to {run_releases[-1].version}, {nothing}."
    for step in reversed(changed_steps):
        counts = Counter(change.kind for change in step.engine_changes.values())
        became = {
            ChangeKind.WORSE: "became worse",
            ChangeKind.BETTER: "became better",
            ChangeKind.OTHERWISE: "changed without becoming better or worse",
        }
        first, *others = [(counts[kind], words) for kind, words in became.items() if counts[kind]]
        phrases = [f"{formatting.format_count(first[0], 'cell')} {first[1]}", *(f"{n} {words}" for n, words in others)]
        yield f"From {engine} {step.old.version} to {step.new.version}, {formatting.join_words(phrases)}."
    cells = formatting.format_count(max((len(one.cells) for one in run_releases), default=0), "cell")
    requested = formatting.format_count(len(history.releases), "requested release")
    yield f"{len(run_releases)} of {requested} of {engine} ran, each on {cells}."


def _build_release_table(history: History) -> Table:
    """Return a table of the releases, newest first. Changes are counted from the previous release that ran."""
    since = {step.new.version: step for step in history.transitions}
    runs = [run for release in history.completed for run in release.results.values()]
    bits, grades = max((run.float_bits for run in runs), default=64), {run.grade for run in runs}
    marks = {grade: mark_of_grade(grade, bits).word for grade in Grade if grade.name in grades}
    counted = {change.kind for step in history.transitions for change in step.changes.values()} - {ChangeKind.NOT_RUN}
    kinds = [kind for kind in ChangeKind if kind in counted | {ChangeKind.SAME_BITS}]

    def count_grade(grade: Grade, release: Release) -> str:
        return str(sum(run.grade == grade.name for run in release.results.values()) or "")

    def count_changes(kind: ChangeKind, release: Release) -> str:
        if (step := since.get(release.version)) is None:
            return ""
        count = step.count(kind)
        return f"{count} of {step.compared}" if kind is ChangeKind.SAME_BITS else str(count or "")

    columns = (
        Column("release", lambda release: release.version),
        *(Column(word, partial(count_grade, grade), number=True) for grade, word in marks.items()),
        *(Column(kind.heading, partial(count_changes, kind), number=True) for kind in kinds),
        *([Column("note", _release_note)] if any(map(_release_note, history.releases)) else ()),
    )
    return Table(columns, history.releases[::-1])


def _release_note(release: Release) -> str:
    if release.observes_no_contact:
        return "the adapter can't read contacts of this release, so its results are not compared"
    return release.not_run


def _describe_settings(history: History) -> Iterator[Lines]:
    """List the settings that differ between consecutive releases, and the runs without a result."""
    setting_changes = dict.fromkeys(
        f"Different settings: {step.old.version} → {step.new.version}, {cell.profile}: {change.numbers}"
        for step in history.transitions
        for cell, change in step.changes.items()
        if change.kind is ChangeKind.OTHER_SETTINGS
    )
    lacking = formatting.group_by(
        ((cell.profile, one.at_phase_0.problem), release.version)
        for release in history.completed
        for cell, one in release.cells.items()
        if cell not in release.results
    )
    not_run = (
        f"Not run in some scenes with {profile}: {reason} ({', '.join(dict.fromkeys(versions))})"
        for (profile, reason), versions in lacking.items()
    )
    yield from (Lines(lines) for lines in (tuple(setting_changes), tuple(not_run)) if lines)


_CHANGE_COLUMNS = (
    Column("from", lambda item: item.step.old.version),
    Column("to", lambda item: item.step.new.version),
    Column("scene", lambda item: item.cell.scene),
    Column("profile", lambda item: item.cell.profile),
    Column("step", lambda item: formatting.format_step(item.cell.dt_s)),
    Column("change", lambda item: item.change.kind.value),
    Column("numbers over phases", lambda item: item.change.numbers),
)


def render_error_chart(history: History) -> str:
    """Draw a chart as SVG: the median and the largest velocity error of each profile, by release.

    A scene and step size is only included if its error is known in every release. A vertical line marks a release that
    changed at least one bit of a result.
    """
    with use_drawing_style():
        figure, axes = build_framed_figure(_WIDTH_IN, _HEIGHT_IN, f"{history.origin.engine}: velocity error by release")
        releases = [release for release in history.completed if not release.observes_no_contact]
        places, thin = range(len(releases)), {"linewidth": 0.6, "markersize": 2.5}
        for profile in history.options.profiles:
            errors = _list_errors(releases, profile)
            if not errors or not errors[0]:
                continue
            style = choose_line_style(history.engine, profile=profile)
            axes.plot(places, [statistics.median(one) for one in errors], label=f"{profile}, median", **style)
            axes.plot(places, [max(one) for one in errors], label=f"{profile}, largest", **style | thin)
        for k, step in enumerate(history.transitions, 1):
            if step.count(ChangeKind.SAME_BITS) < step.compared:
                axes.axvline(k, linewidth=0.6, alpha=0.4, zorder=0)
        axes.set_yscale("symlog", linthresh=1e-9)
        axes.set_xticks(list(places), [release.version for release in releases], rotation=45, ha="right")
        axes.set_ylabel("velocity error / scene's greatest speed")
        if axes.lines:
            finish(axes)
        return to_separate_svg(render(figure, f"Velocity error of {history.origin.engine} by release"))


def _list_errors(releases: list[Release], profile: str) -> list[list[float]]:
    """Return the velocity errors of a profile for each release.

    Only those scenes and step sizes are included whose error was measured in every release.
    """
    errors = [
        {cell: run.velocity for cell, run in release.results.items() if math.isfinite(run.velocity)}
        for release in releases
    ]
    cells = [cell for cell in (errors[0] if errors else ()) if cell.profile == profile]
    shared = [cell for cell in cells if all(cell in one for one in errors)]
    return [[one[cell] for cell in shared] for one in errors]
