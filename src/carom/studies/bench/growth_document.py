"""Document of the growth bench: diagrams, tables and files."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from urllib.parse import quote

from carom.report import svg
from carom.report.document import Cell, Column, Document, Figure, Figures, Lines, Media, Section, Table
from carom.report.files import format_json
from carom.report.provenance import build_provenance, format_command, format_stamp_lines
from carom.report.render.html import render_html
from carom.studies.bench.growth import DT_S, PACKING, STEPS, Growth, GrowthCurve, GrowthPoint
from carom.studies.bench.tables import METHOD
from carom.support import formatting
from carom.support.folders import write_files

if TYPE_CHECKING:
    from matplotlib import figure as drawn

_WIDTH_IN, _HEIGHT_IN = 7.4, 4.9
_MIB = 2.0**20

#: Simulated seconds of a run.
_SIMULATED_S = STEPS * DT_S


def build_growth_document(growth: Growth) -> Document:
    """Return the document of a growth bench: run time and memory against the number of discs."""
    dashed = "Dashed lines are runs with gravity."
    figures = (
        Figure(partial(_render_svg, growth, False), f"Run time per simulated second. {dashed}"),
        Figure(partial(_render_svg, growth, True), f"Memory. {dashed}"),
    )
    left_out = tuple(
        f"{curve.method.label}{_format_gas(curve)}, {point.discs} discs, not run: {point.reason}"
        for curve in growth.curves
        for point in curve.points
        if point.reason
    )
    sections = (
        Section("Run time and memory by number of discs", (Figures(figures, large=True), *_build_tables(growth))),
        Section("Omitted runs", (Lines(left_out, Media.IN_FULL),) if left_out else (), level=3),
        *build_provenance(growth.environment, growth.command, growth.elapsed_s),
    )
    return Document("Carom bench: growth", tuple(_describe_growth(growth)), sections)


def _describe_growth(growth: Growth) -> Iterator[str]:
    """Yield a sentence for each gas, with the run times for the largest number of discs and the exponents of growth."""
    for gravity in (False, True):
        runs = [run for run in _list_runs(growth) if run.curve.gravity == gravity]
        of_engines = [run for run in runs if run.curve.engine not in _SHOWN] or runs
        if not of_engines:
            continue
        discs = max(run.point.discs for run in of_engines)
        fastest = min((run for run in of_engines if run.point.discs == discs), key=lambda run: run.point.advance_s)
        of_own_methods = [run for run in runs if run.curve.engine in _SHOWN and run.point.discs == discs]
        compared = [*(run for run in of_own_methods if run is not fastest), fastest]
        names = [_SHOWN.get(run.curve.engine, run.curve.method.label) for run in compared]
        if len({run.curve.method.label for run in of_engines}) > 1:
            names[-1] = f"the fastest engine, {names[-1]},"
        phrases = [
            f"{name} takes {_format_cost(run.point)}{_format_growth(run.curve)}"
            for name, run in zip(names, compared, strict=True)
        ]
        gas = f"For a simulated second of {discs} {'falling ' if gravity else ''}discs"
        yield f"{gas}, {formatting.join_words(phrases)}."


#: Names of Carom's own methods in sentences and diagrams.
_SHOWN = {"pic": "PIC", "pit": "PIT"}


def _format_cost(point: GrowthPoint) -> str:
    return formatting.format_seconds(point.advance_s / _SIMULATED_S)


def _format_growth(curve: GrowthCurve) -> str:
    value, _, _ = curve.time_exponent
    return "" if math.isnan(value) else f" (grows as n^{value:.2f})"


def _format_gas(curve: GrowthCurve) -> str:
    return ", falling" if curve.gravity else ""


def _build_tables(growth: Growth) -> tuple[Table, ...]:
    curve_of = {(curve.method.label, curve.gravity): curve for curve in growth.curves}

    def format_falling(format_cell: Callable[[GrowthCurve], Cell | str]) -> Callable[[GrowthCurve], Cell | str]:
        return lambda curve: format_cell(falling) if (falling := curve_of.get((curve.method.label, True))) else ""

    def largest_column(head: str, format_cell: Callable[[GrowthPoint], str], only: Media = Media.EVERYWHERE) -> Column:
        return Column(head, _format_largest(format_cell), "max n", number=True, only=only)

    def number_column(head: str, read: Callable[[GrowthPoint], float]) -> Column:
        return Column(head, lambda run: formatting.format_number(read(run.point), 3), number=True)

    return (
        Table(
            (
                METHOD,
                Column("run time", lambda curve: _build_power_cell(curve.time_exponent), "grows as"),
                Column("falling", format_falling(lambda curve: _build_power_cell(curve.time_exponent)), "grows as"),
                largest_column("discs", lambda point: str(point.discs)),
                largest_column("a second", _format_cost),
                Column("falling", format_falling(_format_largest(_format_cost)), "max n", number=True),
                Column("memory", lambda c: _build_power_cell(c.memory_exponent), "grows as", only=Media.IN_FULL),
                largest_column("prepare", lambda p: formatting.format_seconds(p.prepare_s), only=Media.IN_FULL),
                largest_column("peak", lambda p: f"{formatting.format_number(p.peak_bytes / _MIB, 3)} MiB"),
            ),
            [curve for curve in growth.curves if not curve.gravity],
            title="Growth with the number of discs n, from 100 discs upwards",
            note="Column 'a second' shows the run time of one simulated second. 'Max n' is the largest number of "
            "discs. Exponents are fitted by least squares on logarithmic axes, with a 95 % interval. If the run time "
            "decreases with more discs, the method has changed its algorithm, and only later points are fitted.",
        ),
        Table(
            (
                Column("point", lambda run: Cell(run.name, anchor=run.anchor)),
                number_column("per step, ms", lambda point: 1e3 * point.advance_s / STEPS),
                Column("over PIT's", lambda run: formatting.format_ratio(run.point.ratio), number=True),
                number_column("prepare, s", lambda point: point.prepare_s),
                number_column("memory, MiB", lambda point: point.memory_bytes / _MIB),
                number_column("peak, MiB", lambda point: point.peak_bytes / _MIB),
                Column("command", _format_command, only=Media.PAGE),
            ),
            _list_runs(growth),
            title="All runs",
            note=f"The scene is a gas at packing {PACKING:g} in a square box, simulated for {STEPS} steps of "
            f"{formatting.format_step(DT_S)}. Each run has its own process, and only one process runs at a time. The "
            "time per step excludes preparation. Column \"over PIT's\" shows the run time divided by PIT's run time "
            "with as many discs in the same session. Only this ratio can be compared between machines. Memory is the "
            "peak of the process minus its memory before the world was built.",
            only=Media.IN_FULL,
        ),
    )


class _Run(NamedTuple):
    """A completed run of a curve."""

    curve: GrowthCurve
    point: GrowthPoint

    @property
    def name(self) -> str:
        discs = formatting.format_count(self.point.discs, "disc")
        return f"{self.curve.method.label}{_format_gas(self.curve)}, {discs}"

    @property
    def anchor(self) -> str:
        """Anchor of the run's row within the page."""
        falling = "/falling" if self.curve.gravity else ""
        return quote(f"{self.curve.engine}/{self.curve.profile}/{self.point.discs}{falling}")


def _list_runs(growth: Growth) -> list[_Run]:
    return [_Run(curve, point) for curve in growth.curves for point in curve.ran]


def _format_command(run: _Run) -> str:
    return format_command(("bench", "--grow"), run.curve.method, "--discs", str(run.point.discs))


def _format_largest(format_point: Callable[[GrowthPoint], str]) -> Callable[[GrowthCurve], str]:
    """Return a function that formats, for a given curve, the run with the largest number of discs."""
    return lambda curve: format_point(curve.ran[-1]) if curve.ran else formatting.ABSENT


def _build_power_cell(exponent: tuple[float, float, float]) -> Cell:
    value, low, high = exponent
    if math.isnan(value):
        return Cell("too few runs")
    if math.isnan(low):
        return Cell(f"n^{value:.2f}")
    return Cell(f"n^{value:.2f} ({low:.2f} to {high:.2f})", short=f"n^{value:.2f}")


def _render_svg(growth: Growth, memory: bool, narrow: bool = False) -> str:
    """Return the diagram of run time or memory against the number of discs as SVG. A narrow diagram fits a phone."""
    links = {run.anchor: run.name for run in _list_runs(growth)}
    with svg.use_drawing_style():
        figure = _draw_figure(growth, memory, narrow=narrow)
        return svg.render(figure, "Memory" if memory else "Run time", links, narrow=narrow)


def _draw_figure(growth: Growth, memory: bool, foot: Sequence[str] = (), *, narrow: bool = False) -> drawn.Figure:
    quantity = "Memory" if memory else "Run time per simulated second"
    title = quantity if narrow else f"{quantity} against the number of discs"
    figure, axes = svg.build_framed_figure(_WIDTH_IN, _HEIGHT_IN, title, foot, narrow=narrow)
    axes.set(xscale="log", yscale="log", xlabel="discs")
    axes.set_ylabel("memory of the world, MiB" if memory else "run time per simulated second, s")
    ends = list[svg.LineEnd]()
    for curve in growth.curves:
        places = [
            (point.discs, height, _Run(curve, point).anchor)
            for point in curve.ran
            if (height := point.memory_bytes / _MIB if memory else point.advance_s / _SIMULATED_S) > 0
        ]
        if not places:
            continue
        style = svg.choose_line_style(curve.engine, profile=curve.profile)
        style["linestyle"] = "--" if curve.gravity else "-"
        axes.plot([discs for discs, _, _ in places], [height for _, height, _ in places], **style)
        for place in places:
            svg.draw_link_target(axes, *place)
        value, _, _ = curve.memory_exponent if memory else curve.time_exponent
        grows = "" if math.isnan(value) or narrow else f": n^{value:.2f}"
        name = f"{_SHOWN.get(curve.engine, curve.engine)}{_format_gas(curve)}{grows}"
        ends.append(svg.LineEnd(*places[-1][:2], name, style["color"]))
    axes.xaxis.set_major_formatter(svg.format_tick)
    axes.yaxis.set_major_formatter(svg.format_tick)
    svg.finish(axes)
    svg.label_lines(figure, axes, ends)
    return figure


def write_growth(growth: Growth, document: Document, folder: Path) -> Path:
    """Write `growth.html`, `growth.json` and the diagrams as SVG and PNG, and return the path of the page.

    Raises:
        MissingExtraError: jinja2 or matplotlib is not installed.
        InputError: The folder is not writable, or contains files that Carom did not write.
    """
    foot = format_stamp_lines(growth.environment, growth.command)
    files: dict[str, str | bytes] = {
        "growth.html": render_html(document),
        "growth.json": format_json("growth", growth),
    }
    for memory, name in ((False, "growth-time"), (True, "growth-memory")):
        files[f"{name}.svg"] = svg.to_separate_svg(_render_svg(growth, memory))
        with svg.use_drawing_style():
            files[f"{name}.png"] = svg.render_png(_draw_figure(growth, memory, foot))
    return write_files(folder, "bench", files)
