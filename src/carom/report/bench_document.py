"""A bench as a document: how accurate each engine is for what cost; with its diagrams and every number as files."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

from carom.bench.axes import Diagram
from carom.bench.convergence import ConvergenceOrder
from carom.bench.noise import Noise, Spread
from carom.bench.points import Bench, Curve, Point, SceneBench
from carom.bench.rounds import CellTiming
from carom.comparator.thresholds import THRESHOLDS
from carom.folders import file_name, write_files
from carom.report import wording
from carom.report.bench_figure import diagram_png, diagram_svg, is_floor
from carom.report.document import ON_PAPER, Column, Document, Figure, Figures, Lines, Section, Table, Text
from carom.report.files import as_json, require_report_extra
from carom.report.made import making, stamp_lines
from carom.report.render import html
from carom.report.svg import alone

__all__ = ["METHOD", "bench_document", "write_bench"]

DIAGRAM_NOTE = (
    "Full marks find every impact, crosses miss or invent some; thin lines: quartiles of run time, and the luckiest "
    "start."
)


#: The columns that head every table of a bench.
METHOD = (Column("engine", lambda curve: curve.engine), Column("profile", lambda curve: curve.profile))


def bench_document(bench: Bench, axes: Sequence[Diagram] = tuple(Diagram)) -> Document:
    """Return a bench: for each scene its diagrams, its tables, what is left out, and how it was timed."""
    target = bench.plan.target
    return Document(
        "Carom bench",
        (
            "How accurate for what cost: each mark is one engine's profile at one step.",
            *(
                _cheapest_sentence(scene, target) if scene.noise is not None else f"{scene.scene.name}: not timed."
                for scene in bench.scenes
            ),
        ),
        (
            *(section for scene in bench.scenes for section in _scene(bench, scene, axes)),
            *making(bench.environment, bench.command, bench.elapsed_s),
        ),
    )


def write_bench(bench: Bench, folder: Path, axes: Sequence[Diagram] = tuple(Diagram)) -> Path:
    """Write `index.html`, `bench.json` and a diagram a scene and pair of axes, in place of older ones.

    Returns:
        The page.

    Raises:
        MissingExtraError: jinja2 or matplotlib, the extra `report`, is not installed.
        InputError: The folder can't be written into, or holds files of others.
    """
    require_report_extra()
    files: dict[str, str | bytes] = {"index.html": html(bench_document(bench, axes)), "bench.json": _json(bench)}
    label, foot = bench.plan.error.label, stamp_lines(bench.environment, bench.command)
    for scene in bench.scenes:
        for kind in _diagrams_of(scene, axes):
            name = f"{file_name(scene.scene.name)}-{kind.value}"
            files[f"{name}.svg"] = alone(diagram_svg(scene, kind, label))
            files[f"{name}.png"] = diagram_png(scene, kind, label, foot)
    return write_files(folder, "bench", files)


def _json(bench: Bench) -> str:
    scenes = []
    for scene in bench.scenes:
        fields = {field.name: getattr(scene, field.name) for field in dataclasses.fields(scene)}
        fields["scene"] = fields.pop("scene").name
        scenes.append(fields)
    return as_json(
        "bench",
        command=bench.command,
        environment=bench.environment,
        plan=bench.plan,
        elapsed_s=bench.elapsed_s,
        scenes=scenes,
    )


def _diagrams_of(scene: SceneBench, axes: Sequence[Diagram]) -> tuple[Diagram, ...]:
    """Return the diagrams that can be drawn: without run times only the one of errors against steps."""
    return tuple(kind for kind in axes if scene.noise is not None or kind is Diagram.ERROR_DT)


def _scene(bench: Bench, scene: SceneBench, axes: Sequence[Diagram]) -> Iterator[Section]:
    label = bench.plan.error.label
    figures = []
    for kind in _diagrams_of(scene, axes):
        figures.append(Figure(partial(diagram_svg, scene, kind, label), f"{kind.heading}. {DIAGRAM_NOTE}"))
        if kind is Diagram.ERROR_TIME:
            draw = partial(diagram_svg, scene, kind, label, whole=True)
            figures.append(Figure(draw, f"{kind.heading}, preparation included. {DIAGRAM_NOTE}"))
    described = (Text(scene.scene.description, ON_PAPER),) if scene.scene.description else ()
    tables = [_error_table(scene, bench.plan.error.meaning), _order_table(scene)]
    if scene.noise is not None:
        tables = [_cheapest_table(scene, bench.plan.target), *tables, _cost_table(scene)]
    yield Section(scene.scene.name, (*described, Figures(tuple(figures)), *tables))
    left_out = tuple(_unrun(scene))
    yield Section("Left out, and why", (Lines(left_out),) if left_out else (), level=3)
    if scene.noise is not None:
        how = (
            f"Timed {scene.timed_at} in {wording.count(scene.rounds, 'round')} of random order (seed "
            f"{bench.plan.seed}), nothing observed and nothing else of this bench running. Noise: "
            f"{_quiet(scene.noise)}."
        )
        yield Section("How it was timed", (Text(how),), level=3)


def _error_table(bench: SceneBench, error_label: str) -> Table:
    steps = sorted({point.dt_s for curve in bench.curves for point in curve.points}, reverse=True)
    phases = max((point.phases for curve in bench.curves for point in curve.points), default=1)
    return Table(
        (*METHOD, *(Column(wording.step(dt_s), partial(_error, dt_s), number=True) for dt_s in steps)),
        bench.curves,
        title=f"{bench.scene.name}: error at each step",
        note=f"{wording.capitalised(error_label)}; the largest of {wording.count(phases, 'start')} spread evenly "
        "over a step. -1 +2: impacts missed and invented, over all starts; an error beside them is that of the rest.",
    )


def _error(dt_s: float, curve: Curve) -> str:
    point = next((point for point in curve.points if point.dt_s == dt_s), None)
    if point is None or point.reason:
        return wording.ABSENT
    lost = " ".join([f"-{point.missed}"] * bool(point.missed) + [f"+{point.spurious}"] * bool(point.spurious))
    exact = point.error <= THRESHOLDS.rounding
    error = f"≤ {wording.number(THRESHOLDS.rounding)}" if exact else wording.number(point.error)
    return f"{error} ({lost})" if lost else error


def _order_table(bench: SceneBench) -> Table:
    return Table(
        (
            *METHOD,
            Column("order (95 % interval)", lambda curve: _order(curve.order)),
            Column("steps fitted", lambda curve: str(curve.order.points), number=True),
            Column("steps that find every impact", _sound, number=True),
        ),
        bench.curves,
        title=f"{bench.scene.name}: order of convergence",
        note="Least squares of error against step on logarithmic axes, steps with a missed or invented impact and "
        "errors at rounding left out. Sampling alone has order 1; an interval below 1/2 is called not converging.",
    )


def _order(order: ConvergenceOrder) -> str:
    if math.isnan(order.exponent):
        return order.verdict.value
    if math.isnan(order.low):
        return f"{order.verdict.value} ({wording.number(order.exponent)} from two)"
    interval = f"{wording.number(order.low, 3)} to {wording.number(order.high, 3)}"
    return f"{order.verdict.value}: {wording.number(order.exponent, 3)} ({interval})"


def _sound(curve: Curve) -> str:
    return f"{sum(point.sound for point in curve.points)} of {len(curve.points)}"


def _clock(say: Callable[[CellTiming], str]) -> Callable[[Point], str]:
    """Return what a column says of the timing of a point that has one."""
    return lambda point: "" if point.timing is None else say(point.timing)


#: Two clocks, with what is paid without any collision in columns of its own.
_COST_COLUMNS = (
    *METHOD,
    Column("step", lambda point: wording.step(point.dt_s)),
    Column("a step, µs", _clock(lambda timing: _microseconds(timing.step_s)), number=True),
    Column("spread", _clock(lambda timing: _share(timing.advance_s)), number=True),
    Column("empty world, µs", _clock(lambda timing: _microseconds(timing.empty_s.median / timing.steps)), number=True),
    Column("call, µs", _clock(lambda timing: _microseconds(timing.call_s / timing.steps)), number=True),
    Column("net, µs", _clock(lambda timing: _microseconds(timing.net_s.median / timing.steps)), number=True),
    Column("prepare, ms", _clock(lambda timing: _milliseconds(timing.prepare_s)), number=True),
    Column("whole, ms", _clock(lambda timing: _milliseconds(timing.whole_s)), number=True),
    Column("steps / PIT", _clock(lambda timing: _median(timing.ratio)), number=True),
    Column("ratio, quartiles", _clock(lambda timing: _quartiles(timing.ratio)), number=True, only=ON_PAPER),
    Column("whole / PIT", _clock(lambda timing: _median(timing.whole_ratio)), number=True),
    Column("whole ratio, quartiles", _clock(lambda timing: _quartiles(timing.whole_ratio)), number=True, only=ON_PAPER),
)


def _cost_table(bench: SceneBench) -> Table:
    return Table(
        _COST_COLUMNS,
        [point for curve in bench.curves for point in curve.points if point.timing is not None],
        title=f"{bench.scene.name}: run time",
        note="Medians over rounds; spread is the distance between the quartiles over the median. Empty world: a step "
        "of one disc at rest. Call: Python's call into the world, shared by all steps that one call takes. Net: what "
        "is left. Whole: with preparation. Ratios are to PIT at the same step in the same round; times are this "
        "machine's, and only ratios may be held against another run.",
    )


def _cheapest_table(bench: SceneBench, target: float) -> Table:
    """Return the cheapest way of every curve to an error of at most the target."""
    base_s = _seconds(bench.cheapest)

    def cheapest(say: Callable[[Point, CellTiming], str]) -> Callable[[Curve], str]:
        def said(curve: Curve) -> str:
            point = curve.cheapest
            return "" if point is None or point.timing is None else say(point, point.timing)

        return said

    columns = (
        *METHOD,
        Column("step, or why there is none", lambda curve: _cheapest_step(curve, target)),
        Column("error", cheapest(lambda point, _: _exact_or(point.error)), number=True),
        Column("all steps, ms", cheapest(lambda _, timing: _milliseconds(timing.advance_s)), number=True),
        Column("whole, ms", cheapest(lambda _, timing: _milliseconds(timing.whole_s)), number=True),
        Column("times the cheapest", cheapest(lambda point, _: wording.ratio(_seconds(point) / base_s)), number=True),
    )
    return Table(
        columns,
        sorted(bench.curves, key=lambda curve: _seconds(curve.cheapest)),
        title=f"{bench.scene.name}: the cheapest way to an error of {wording.number(target)}",
        note="Of the steps that were run, the one of least run time whose error is at most that, at every start, with "
        "every impact found.",
    )


def _exact_or(error: float) -> str:
    return wording.number(error) if error > THRESHOLDS.rounding else "exact"


def _cheapest_step(curve: Curve, target: float) -> str:
    """Return the step of the cheapest way, or why there is none."""
    point = curve.cheapest
    if point is not None and point.timing is not None:
        return "any step" if is_floor(curve) else wording.step(point.dt_s)
    reasons = list(dict.fromkeys(point.reason for point in curve.points if point.reason))
    if reasons and all(point.reason for point in curve.points):
        return reasons[0]
    meeting = [point for point in curve.points if point.sound and point.error <= target]
    if meeting:
        return f"reached, not timed: {meeting[0].untimed or 'no timing pass'}"
    sound = [point for point in curve.points if point.sound]
    if not sound:
        return "misses or invents impacts at every step"
    best = min(sound, key=lambda point: point.error)
    return f"not reached: {wording.number(best.error)} at {wording.step(best.dt_s)}"


def _cheapest_sentence(bench: SceneBench, target: float) -> str:
    """Return the answer to the user's question in a sentence."""
    name, wanted = bench.scene.name, wording.number(target)
    others = [c.cheapest for c in bench.curves if c.cheapest is not None and c.engine not in {"pic"}]
    engine = min(others, key=_seconds, default=None)
    if engine is None or engine.timing is None:
        return f"{name}: no engine reaches an error of {wanted} at the steps that were run."
    found = engine.timing.ratio
    of_pit = f", {_median(found)} PIT's at that step (quartiles {_quartiles(found)})"
    ratio = of_pit if found and engine.engine != "pit" else ""
    sentence = (
        f"{name}: the cheapest way to an error of {wanted} is {engine.engine} ({engine.profile}) at "
        f"{wording.step(engine.dt_s)}: {_milliseconds(engine.timing.advance_s)} ms{ratio}"
    )
    pic = next((c.cheapest for c in bench.curves if is_floor(c) and c.cheapest is not None), None)
    if pic is None or pic.timing is None:
        return f"{sentence}."
    times = pic.timing.advance_s.median / engine.timing.advance_s.median
    return f"{sentence}; PIC is exact in {_milliseconds(pic.timing.advance_s)} ms, {wording.ratio(times)} that."


def _unrun(bench: SceneBench) -> Iterator[str]:
    """Return a line for each reason for which a point was not scored or not timed."""
    steps: dict[tuple[str, str], dict[str, list[str]]] = {}
    for curve in bench.curves:
        for point in curve.points:
            for what, reason in (("not scored", point.reason), ("not timed", point.untimed)):
                if reason:
                    own = steps.setdefault((what, reason), {})
                    own.setdefault(f"{curve.engine} {curve.profile}", []).append(wording.step(point.dt_s))
    for (what, reason), by_curve in steps.items():
        alike: dict[str, list[str]] = {}
        for who, at in by_curve.items():
            alike.setdefault(wording.listed(at), []).append(who)
        for at_steps, whose in alike.items():
            who = "everything" if len(whose) == len(bench.curves) else wording.listed(whose)
            yield f"{who}, {what} at {at_steps}: {reason}"


def _quiet(noise: Noise) -> str:
    return (
        f"the same {wording.number(noise.work_s * 1e3)} ms of fixed work, {noise.probes} times between the visits: "
        f"the middle half within {wording.percent(noise.interquartile)}, the slowest {wording.ratio(noise.worst)} that"
    )


def _seconds(point: Point | None) -> float:
    return point.timing.advance_s.median if point is not None and point.timing is not None else math.inf


def _microseconds(value: float) -> str:
    return wording.number(value * 1e6, 3)


def _milliseconds(found: Spread) -> str:
    return wording.number(found.median * 1e3, 3)


def _share(found: Spread) -> str:
    return wording.percent((found.high - found.low) / found.median)


def _median(found: Spread | None) -> str:
    return wording.ABSENT if found is None else wording.ratio(found.median)


def _quartiles(found: Spread | None) -> str:
    return wording.ABSENT if found is None else f"{wording.number(found.low)} to {wording.number(found.high)}"
