"""The growth bench: tables, diagrams and files."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from carom.bench.growth import DT_S, PACKING, STEPS, Growth, GrowthCurve, GrowthPoint
from carom.report import wording
from carom.report.bench_write import value_of
from carom.report.document import Document, Figure, Figures, Lines, Section, Table
from carom.report.extra import require_report_extra
from carom.report.made import making, stamp_lines
from carom.report.records import strict
from carom.report.render import html
from carom.report.svg import alone, drawing, finish, framed, line_style, plain_number, png, render
from carom.report.write import replace_all

if TYPE_CHECKING:
    from matplotlib import figure as drawn

__all__ = ["growth_diagram", "growth_document", "growth_tables", "unrun_growth", "write_growth"]

FORMAT = 1
_WIDTH_IN, _HEIGHT_IN = 7.6, 4.6
_MIB = 2.0**20


def growth_document(growth: Growth) -> Document:
    """Return run time and memory against the number of discs."""
    figures = (
        Figure(lambda: growth_diagram(growth, memory=False)[0], "Run time"),
        Figure(lambda: growth_diagram(growth, memory=True)[0], "Memory"),
    )
    left_out = tuple(unrun_growth(growth))
    return Document(
        "Carom bench: growth",
        ("Run time and memory against the number of discs.",),
        (
            Section("Cost as work grows", (Figures(figures), *growth_tables(growth))),
            Section("Left out, and why", (Lines(left_out),) if left_out else (), level=3),
            *making(growth.environment, growth.command, growth.elapsed_s),
        ),
    )


def growth_tables(growth: Growth) -> tuple[Table, ...]:
    """Return run time, memory and exponents."""
    sizes = sorted({point.discs for curve in growth.curves for point in curve.points})
    what = (
        f"A gas at packing {PACKING:g} in a square box, {STEPS} steps of {wording.step(DT_S)}; each run in a process "
        "of its own, one at a time."
    )
    return (
        Table.of(
            "Run time of a step, ms",
            ("engine", "profile", *map(str, sizes)),
            _rows(growth, sizes, lambda point: wording.number(1e3 * point.advance_s / STEPS)),
            f"{what} Preparation is not in it.",
        ),
        Table.of(
            "Run time over PIT's with as many discs",
            ("engine", "profile", *map(str, sizes)),
            _rows(growth, sizes, lambda point: wording.number(point.ratio)),
            "Both in one sitting. Only these may be held against another machine's.",
        ),
        Table.of(
            "Memory, MiB",
            ("engine", "profile", *map(str, sizes)),
            _rows(growth, sizes, lambda point: wording.number(point.memory_bytes / _MIB)),
            "What the process held at most, less what it held with the scene and the engine loaded and no world yet.",
        ),
        Table.of(
            "Growth with the number of discs n, from 100 discs on",
            (
                "engine",
                "profile",
                "run time grows as",
                "memory grows as",
                "prepare, the most discs",
                "peak of the process",
            ),
            tuple(_exponents(curve) for curve in growth.curves),
            "Least squares on logarithmic axes; 95 % interval. Where run time falls as discs are added, the method has "
            "changed, and only what follows is fitted.",
            left=6,
        ),
    )


def _rows(growth: Growth, sizes: Sequence[int], shown: Callable[[GrowthPoint], str]) -> tuple[tuple[str, ...], ...]:
    rows = []
    for curve in growth.curves:
        at = {point.discs: point for point in curve.points if not point.reason}
        cells = (shown(at[size]) if size in at else wording.ABSENT for size in sizes)
        rows.append((curve.engine, curve.profile, *cells))
    return tuple(rows)


def _exponents(curve: GrowthCurve) -> tuple[str, ...]:
    ran = [point for point in curve.points if not point.reason]
    most = ran[-1] if ran else None
    return (
        curve.engine,
        curve.profile,
        _power(curve.time_exponent),
        _power(curve.memory_exponent),
        wording.ABSENT if most is None else f"{wording.seconds(most.prepare_s)} for {most.discs}",
        wording.ABSENT if most is None else f"{wording.number(most.peak_bytes / _MIB, 3)} MiB",
    )


def _power(exponent: tuple[float, float, float]) -> str:
    value, low, high = exponent
    if math.isnan(value):
        return "too few runs to tell"
    interval = "" if math.isnan(low) else f" ({wording.number(low, 3)} to {wording.number(high, 3)})"
    return f"n^{wording.number(value, 3)}{interval}"


def unrun_growth(growth: Growth) -> Iterator[str]:
    """Return a line for each number of discs that was not run, with the reason."""
    for curve in growth.curves:
        for point in curve.points:
            if point.reason:
                yield f"{curve.engine} {curve.profile}, {point.discs} discs, not run: {point.reason}"


def growth_diagram(growth: Growth, memory: bool, foot: Sequence[str] = ()) -> tuple[str, bytes]:
    """Return run time (or memory) against the number of discs, as SVG and as PNG with the lines at its foot."""
    with drawing():
        return render(_figure(growth, memory), "Memory" if memory else "Run time"), png(_figure(growth, memory, foot))


def _figure(growth: Growth, memory: bool, foot: Sequence[str] = ()) -> drawn.Figure:
    title = f"{'Memory' if memory else 'Run time'} against the number of discs"
    figure, axes = framed(_WIDTH_IN, _HEIGHT_IN, title, foot)
    axes.set_xscale("log")
    axes.set_yscale("log")
    for k, curve in enumerate(growth.curves):
        own = [point for point in curve.points if not point.reason and _height(point, memory) > 0]
        exponent = curve.memory_exponent if memory else curve.time_exponent
        axes.plot(
            [point.discs for point in own],
            [_height(point, memory) for point in own],
            label=f"{curve.engine} {curve.profile}\n{_power(exponent)}",
            **line_style(k, pit=curve.engine == "pit", hollow=False),
        )
    axes.set_xlabel("discs")
    axes.set_ylabel("memory of the world, MiB" if memory else "a step, ms")
    axes.xaxis.set_major_formatter(plain_number)
    axes.yaxis.set_major_formatter(plain_number)
    finish(axes)
    return figure


def _height(point: GrowthPoint, memory: bool) -> float:
    return point.memory_bytes / _MIB if memory else 1e3 * point.advance_s / STEPS


def write_growth(growth: Growth, folder: Path) -> Path:
    """Write `growth.html`, `growth.json` and the diagrams as SVG and PNG; return the page.

    Raises:
        MissingExtraError: jinja2 or matplotlib, the extra `report`, is not installed.
        OSError: The folder can't be written to.
    """
    require_report_extra()
    foot = stamp_lines(growth.environment, growth.command)
    files: dict[Path, str | bytes] = {}
    for memory, name in ((False, "growth-time"), (True, "growth-memory")):
        svg, png = growth_diagram(growth, memory, foot)
        files[folder / f"{name}.svg"], files[folder / f"{name}.png"] = alone(svg), png
    page = folder / "growth.html"
    files[page] = html(growth_document(growth))
    content = {"format": FORMAT, **{k: v for k, v in _plain_fields(growth).items() if k != "engines"}}
    files[folder / "growth.json"] = json.dumps(strict(content), ensure_ascii=False, allow_nan=False, indent=1) + "\n"
    folder.mkdir(parents=True, exist_ok=True)
    replace_all(files)
    return page


def _plain_fields(growth: Growth) -> dict[str, object]:
    plain = value_of(growth)
    return plain if isinstance(plain, dict) else {}
