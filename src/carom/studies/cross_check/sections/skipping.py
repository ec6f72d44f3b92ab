"""Section on skipped work: calculations that PIC and PIT can omit in a scene, and the run time that is saved."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import NamedTuple

from carom.execution.time_saved import SceneSkips, SkippedTime
from carom.model.trace import Trace
from carom.report import svg
from carom.report.document import Block, Cell, Column, Figure, Figures, Media, Section, Table, Text
from carom.studies.cross_check.explain import describe_pic, describe_pit
from carom.studies.cross_check.grid import Grid
from carom.support import formatting

NOTE = (
    "Skipping changes no result. Without skipping, PIC predicts the next impact of every pair after each impact. PIC "
    "solves some scenes by a formula; without skipping, PIC computes one impact after another in these scenes. PIT "
    "without skipping tests every pair and wall at every frame. Runs with and without skipping are timed alternately "
    "on this machine. If a ratio is below 1, the scene is so small that skipping takes more time than it saves."
)


class _Scene(NamedTuple):
    """A scene's PIC trace, and the run times of PIC and PIT with and without skipping."""

    reference: Trace
    skips: SceneSkips


def build_skipping_section(grid: Grid) -> Section:
    """Return a section with the skipped work and the saved time of each scene; empty if nothing was timed."""
    scenes = [_Scene(grid.results.references[name], skips) for name, skips in grid.results.skipped.items()]
    if not scenes:
        return Section("Skipped work", ())
    pit = [one.skips.pit.ratio for one in scenes if one.skips.pit]
    pic = [one.skips.pic.ratio for one in scenes if one.skips.pic]
    sentences = [
        f"Without skipping, {name} takes {formatting.format_ratio(statistics.median(ratios))} the run time (median of "
        f"{formatting.format_count(len(ratios), 'scene')}, up to {formatting.format_ratio(max(ratios))})."
        for name, ratios in (("PIC", pic), ("PIT", pit))
        if ratios
    ]
    columns = (
        Column("scene", lambda one: one.reference.scene.name),
        Column("PIC", lambda one: Cell(describe_pic(one.reference.scene, one.reference), css="prose")),
        *_build_time_columns("PIC", lambda one: one.skips.pic),
        Column("PIT", lambda one: Cell(describe_pit(one.reference.scene, one.skips.dt_s), css="prose")),
        *_build_time_columns("PIT", lambda one: one.skips.pit),
    )
    folded = f"Skipped work in {formatting.format_count(len(scenes), 'scene')}"
    blocks: list[Block] = [Text(" ".join(sentences), Media.ON_PAPER)]
    if len(scenes) > 1:  # the sentences are enough for one scene
        caption = "Run times with skipping (filled discs) and without skipping (rings)."
        blocks.append(Figures((Figure(partial(_render_diagram, scenes), caption),), large=True))
    blocks += [
        Table(columns, scenes, folded=folded, css="cells", only=Media.ON_PAPER),
        Text(NOTE, Media.ON_PAPER, folded=True),
    ]
    return Section("Skipped work", tuple(blocks))


def _build_time_columns(name: str, read: Callable[[_Scene], SkippedTime | None]) -> Iterator[Column]:
    def column(head: str, say: Callable[[SkippedTime], str]) -> Column:
        return Column(head, lambda one: say(saved) if (saved := read(one)) else formatting.ABSENT, number=True)

    yield column(f"{name}, ms", lambda saved: formatting.format_number(1e3 * saved.with_skipping_s, 3))
    yield column("without", lambda saved: formatting.format_ratio(saved.ratio))


def _render_diagram(scenes: Sequence[_Scene], narrow: bool = False) -> str:
    """Draw a line for each scene as SVG, from the run time with skipping to the run time without skipping."""
    with svg.use_drawing_style():
        width, height, left = 4.0 if narrow else 9.0, 0.7 + 0.24 * len(scenes), 1.9
        figure = svg.build_figure(width, height)
        axes = figure.add_axes((left / width, 0.5 / height, 0.97 - left / width - 0.5 / width, 1.0 - 0.65 / height))
        for k, one in enumerate(scenes):
            for engine, saved, shift in (("pic", one.skips.pic, 0.15), ("pit", one.skips.pit, -0.15)):
                if saved is None:
                    continue
                color = svg.choose_line_style(engine)["color"]
                ends, level = [1e3 * saved.with_skipping_s, 1e3 * saved.with_skipping_s * saved.ratio], -k + shift
                axes.plot(ends, [level, level], color=color, linewidth=1.6, alpha=0.6)
                axes.plot(ends[1:], [level], "o", color=color, markerfacecolor=svg.SURFACE, markersize=6)
                label = engine.upper() if k == 0 else None
                axes.plot(ends[:1], [level], "o", color=color, markersize=5, label=label)
        axes.set(xscale="log", ylim=(0.5 - max(2, len(scenes)), 0.5), xlabel="run time, ms")
        axes.set_yticks([-k for k in range(len(scenes))], [one.reference.scene.name for one in scenes])
        axes.xaxis.set_major_formatter(svg.format_tick)
        svg.finish(axes)
        return svg.render(figure, "Run time of PIC and PIT with and without skipping", narrow=narrow)
