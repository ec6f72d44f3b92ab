"""Tables of a bench: accuracy and cost of each method, its error at each step, and all points."""

from __future__ import annotations

import math
import shlex
import statistics
from collections.abc import Callable, Sequence
from dataclasses import fields
from functools import partial
from typing import NamedTuple
from urllib.parse import quote

from carom.comparator.thresholds import THRESHOLDS
from carom.engines.registry import engine_argument
from carom.execution.job import Method
from carom.report import formatting
from carom.report.document import EVERYWHERE, IN_FULL, ON_PAPER, PAGE, Cell, Column, Media, Table
from carom.studies.bench.axes import TARGETS, ErrorKind
from carom.studies.bench.convergence import Convergence, ConvergenceOrder
from carom.studies.bench.noise import Spread
from carom.studies.bench.options import BenchPlan
from carom.studies.bench.result import Bench, Curve, Point, SceneBench, best_first, cheapest, run_s
from carom.studies.bench.timing_pass import CellTiming

TABLE_NOTE = (
    "Best first. Least error: over all steps that find every impact at every start; if there is none, the number of "
    "missed (-) and spurious (+) impacts at the best step. Columns of an error: run time of the cheapest step that "
    "reaches it and finds every impact; empty if no step does. Order: least-squares fit of error against step on "
    "logarithmic axes, without steps that miss an impact or reach rounding; sampling alone has order 1, and an "
    "interval below 1/2 is called not converging."
)
TABLE_SHORT = "ms: run time; order: exponent of the error in the step; -n, +n: impacts missed, spurious"
EXACT = "exact"

#: A smaller error is written as a number, because 0.0009 % is hard to read.
LEAST_PERCENT = 1e-4

#: Number of targets, the finest, for which a terminal has room.
TARGETS_SHOWN = 3

#: The first column of every table of a bench.
METHOD = Column("method", lambda of: Method(of.engine, of.profile).label)


def error_text(error: float, kind: ErrorKind) -> str:
    """Return an error as shown in tables and sentences: exact, 0.16 %, 2e-6, or 0.01 rad."""
    if error <= THRESHOLDS.rounding:
        return EXACT
    if not kind.in_percent:
        return f"{formatting.number(error)} rad"
    return formatting.percent(error) if error >= LEAST_PERCENT else formatting.number(error)


def reached(bench: Bench) -> list[float]:
    """Return the targets that engines reach on a scene, from coarse to fine; rounding is last, for exact results."""
    engines = [point for scene in bench.scenes for curve in scene.engines for point in curve.points]
    every = [point for scene in bench.scenes for curve in scene.curves for point in curve.points]
    asked = sorted({bench.plan.target, *TARGETS}, reverse=True)
    found = [target for target in asked if any(_meets(point, target) for point in engines)]
    return found + [THRESHOLDS.rounding] * any(_meets(point, THRESHOLDS.rounding) for point in every)


def _meets(point: Point, target: float) -> bool:
    return point.sound and point.error <= target


def method_table(scene: SceneBench, kind: ErrorKind, targets: Sequence[float]) -> Table:
    """Return a row a method, best first: its least error with the cost, and the cost of each target."""

    def best(say: Callable[[Point], Cell | str]) -> Callable[[Curve], Cell | str]:
        return lambda curve: "" if curve.best is None else say(curve.best)

    columns = [
        METHOD,
        Column("least", partial(_least, kind), "error", number=True),
        Column("run", best(lambda p: milliseconds(p.timing.advance_s) if p.timing else ""), "ms", number=True),
        Column("at", lambda curve: _step(curve, curve.best), "step", number=True),
        *(
            Column(error_text(target, kind), partial(_cost, scene, target), "ms", number=True, only=only)
            # A terminal shows the run time of exact results once: next to their error.
            for target, only in zip(targets, _shown_where(targets, exact=IN_FULL), strict=True)
        ),
        Column("order", lambda curve: _order(curve.order)),
        Column("steps that find all", _sound, number=True, only=IN_FULL),
    ]
    return Table(columns, best_first(scene.curves), title=f"{scene.scene.name}: what each method gives for what cost")


def _shown_where(targets: Sequence[float], exact: Media = EVERYWHERE) -> list[Media]:
    """Return where the column of each target is shown; a terminal shows only the finest, and perhaps rounding."""
    errors = sum(target > THRESHOLDS.rounding for target in targets)
    hidden = max(0, errors - TARGETS_SHOWN)
    return [IN_FULL] * hidden + [EVERYWHERE] * (errors - hidden) + [exact] * (len(targets) - errors)


def suite_table(bench: Bench, targets: Sequence[float]) -> Table:
    """Return a row a method over several scenes: the number on which it finds every impact, and reaches each target."""
    curves = [(scene, curve) for scene in bench.scenes for curve in scene.curves]
    by_method = formatting.together(((curve.engine, curve.profile), (scene, curve)) for scene, curve in curves)
    kind = bench.plan.error
    columns = [
        METHOD,
        Column("found", lambda method: _share(method, sum(b.sound for b in method.best)), "all", number=True),
        *(
            Column(error_text(target, kind), partial(_reach, target), "n, ×", only=only)  # noqa: RUF001 - the sign of a ratio
            for target, only in zip(targets, _shown_where(targets), strict=True)
        ),
        Column("order", _median_order, "median", number=True),
    ]
    methods = [_Method(engine, profile, tuple(own)) for (engine, profile), own in by_method.items()]
    return Table(
        columns,
        sorted(methods, key=lambda method: method.rank(targets)),
        title=f"Every method on {formatting.count(len(bench.scenes), 'scene')}",
        note="n, ×: scenes that reach the error, median run time over PIC's; order: exponent",  # noqa: RUF001
    )


class _Method(NamedTuple):
    """A method, with its curve on each scene."""

    engine: str
    profile: str
    curves: tuple[tuple[SceneBench, Curve], ...]

    @property
    def best(self) -> list[Point]:
        return [curve.best for _, curve in self.curves if curve.best is not None]

    def reaching(self, target: float) -> list[SceneBench]:
        return [scene for scene, curve in self.curves if any(_meets(point, target) for point in curve.points)]

    def cost(self, target: float) -> float:
        """Return the median run time for a target over that of PIC; NaN if none is known."""
        cheap = [(scene, cheapest(curve.points, target)) for scene, curve in self.curves]
        costs = [run_s(point) / run_s(scene.exact) for scene, point in cheap]
        known = [cost for cost in costs if 0 < cost < math.inf]  # an untimed point has no cost
        return statistics.median(known) if known else math.nan

    def rank(self, targets: Sequence[float]) -> tuple[list[int], list[float]]:
        """Return the sort key: first by the number of scenes that reach the finest target, last by cost."""
        finest_first = list(reversed(targets))
        costs = [self.cost(target) for target in finest_first]
        return (
            [-len(self.reaching(target)) for target in finest_first],
            [math.inf if math.isnan(cost) else cost for cost in costs],
        )


def _share(method: _Method, count: int) -> str:
    return f"{count} of {len(method.curves)}"


def _median_order(method: _Method) -> str:
    orders = [curve.order for _, curve in method.curves]
    if all(order.verdict is Convergence.EXACT for order in orders):
        return EXACT
    known = [order.exponent for order in orders if not math.isnan(order.low)]  # of three steps or more
    return f"{statistics.median(known):.2f}" if known else ""


def _reach(target: float, method: _Method) -> Cell:
    scenes = method.reaching(target)
    found = method.cost(target)
    cost = "" if math.isnan(found) else f", {formatting.ratio(found)}"
    short = f"{len(scenes)}{cost.removesuffix(' ×')}"  # noqa: RUF001 - the sign of a ratio
    return Cell(f"{_share(method, len(scenes))}{cost}", short=short) if scenes else Cell("")


def _order(order: ConvergenceOrder) -> Cell:
    if math.isnan(order.exponent):
        return Cell(order.verdict.value, short=EXACT if order.verdict is Convergence.EXACT else formatting.ABSENT)
    short = f"{order.exponent:.2f}"
    if math.isnan(order.low):
        return Cell(f"{formatting.number(order.exponent)} from two", order.verdict.value, short=short)
    interval = f"{formatting.number(order.low, 3)} to {formatting.number(order.high, 3)}"
    return Cell(f"{formatting.number(order.exponent, 3)} ({interval})", order.verdict.value, short=short)


def _sound(curve: Curve) -> str:
    return f"{sum(point.sound for point in curve.points)} of {sum(not point.reason for point in curve.points)}"


def _least(kind: ErrorKind, curve: Curve) -> Cell:
    best = curve.best
    if best is None:
        reasons = list(dict.fromkeys(point.reason for point in curve.points))
        return Cell("not run", "; ".join(reasons), short=reasons[0].partition(":")[0] if reasons else "")
    if best.sound:
        return Cell(error_text(best.error, kind))
    return Cell(losses(best), short=formatting.lost(best.missed, best.spurious) or formatting.ABSENT)


def losses(point: Point) -> str:
    """Return a point's numbers of missed, invented and all impacts over its starts."""
    lost = [f"misses {point.missed}"] * bool(point.missed) + [f"invents {point.spurious}"] * bool(point.spurious)
    return (
        f"{formatting.listed(lost)} of {formatting.count(point.expected, 'impact')}"
        if lost
        else "has no error to measure"
    )


def _step(curve: Curve, point: Point | None) -> str:
    if point is None:
        return ""
    return "any" if curve.exact else formatting.step(point.dt_s).removesuffix(" s")


def _cost(scene: SceneBench, target: float, curve: Curve) -> Cell:
    """Return the cheapest point that reaches a target: its run time, its step, and the ratio to PIC."""
    point = cheapest(curve.points, target)
    if point is None or point.timing is None:
        met = next((p for p in curve.points if _meets(p, target)), None)
        why = f"not timed: {(met and met.untimed) or 'no timing pass'}"
        return Cell("") if met is None else Cell("reached", title=why, short="yes")
    spent = milliseconds(point.timing.advance_s)
    notes = [f"at {formatting.step(point.dt_s)}", f"{milliseconds(point.timing.whole_s)} ms with preparation"]
    if scene.exact is not None and not curve.exact:
        notes.append(f"{formatting.ratio(run_s(point) / run_s(scene.exact))} PIC's")
    return Cell(spent, title="; ".join(notes))


def _error(point: Point) -> str:
    if point.reason:
        return formatting.ABSENT
    lost = formatting.lost(point.missed, point.spurious)
    error = EXACT if point.error <= THRESHOLDS.rounding else formatting.number(point.error)
    return f"{error} ({lost})" if lost else error


def _clock(say: Callable[[CellTiming], str]) -> Callable[[Point], str]:
    """Return a column's text for the timing of a timed point."""
    return lambda point: "" if point.timing is None else say(point.timing)


#: Both run times, with the cost without any collision in separate columns.
_POINT_COLUMNS = (
    Column("error", _error, number=True),
    Column("luckiest start", lambda point: formatting.number(point.error_least), number=True, only=ON_PAPER),
    Column("all steps, ms", _clock(lambda timing: milliseconds(timing.advance_s)), number=True),
    Column("spread", _clock(lambda timing: _spread(timing.advance_s)), number=True),
    Column("prepare, ms", _clock(lambda timing: milliseconds(timing.prepare_s)), number=True),
    Column("whole, ms", _clock(lambda timing: milliseconds(timing.whole_s)), number=True),
    Column("a step, µs", _clock(lambda timing: _microseconds(timing.step_s)), number=True),
    Column("empty world, µs", _clock(lambda timing: _microseconds(timing.empty_s.median / timing.steps)), number=True),
    Column("call, µs", _clock(lambda timing: _microseconds(timing.call_s / timing.steps)), number=True),
    Column("net, µs", _clock(lambda timing: _microseconds(timing.net_s.median / timing.steps)), number=True),
    Column("steps / PIT", _clock(lambda timing: _median(timing.ratio)), number=True),
    Column("ratio, quartiles", _clock(lambda timing: quartiles(timing.ratio)), number=True, only=ON_PAPER),
    Column("whole / PIT", _clock(lambda timing: _median(timing.whole_ratio)), number=True),
    Column("whole ratio, quartiles", _clock(lambda timing: quartiles(timing.whole_ratio)), number=True, only=ON_PAPER),
)


def point_table(bench: SceneBench, plan: BenchPlan) -> Table:
    """Return a row for each point of the diagrams: its numbers, and the command that repeats them."""
    name = bench.scene.name
    return Table(
        (
            Column("point", lambda point: Cell(point_name(point), anchor=point_anchor(name, point))),
            *_POINT_COLUMNS,
            Column("command", partial(_command, name, plan), only=PAGE),
        ),
        [point for curve in bench.curves for point in curve.points if not point.reason],
        title=f"{name}: every point",
        note=f"{formatting.capitalised(plan.error.meaning)}; the largest of {formatting.count(plan.phases, 'start')} "
        "spread evenly over a step. -1 +2: impacts missed and invented, over all starts; the error is then that of "
        "all other impacts. Medians over rounds; spread is the distance between the quartiles over the median. Empty "
        "world: a step of one disc at rest. Call: the cost of one Python call, divided by the steps that it takes. "
        "Net: the rest. Whole: with preparation. Ratios are to PIT at the same step in the same round; times are this "
        "machine's, and only ratios may be compared with another run.",
        folded="The numbers of every point, and the command that makes it again",
        css="cells",
        only=IN_FULL,
    )


def point_name(point: Point) -> str:
    """Return the name of a point of the diagrams."""
    return f"{Method(point.engine, point.profile).label} at {formatting.step(point.dt_s)}"


def point_anchor(scene: str, point: Point) -> str:
    """Return the name of a point's row within the page."""
    return quote(f"{scene}/{point.engine}/{point.profile}/{point.dt_s!r}")


def _command(scene: str, plan: BenchPlan, point: Point) -> str:
    """Return the command that repeats a point, with the bench's options that are not the defaults."""
    words = [
        "carom",
        "bench",
        scene,
        "-e",
        engine_argument(point.engine),
        "-p",
        point.profile,
        "--dt",
        repr(point.dt_s),
    ]
    usual = {field.name: field.default for field in fields(BenchPlan)}
    for name in ("phases", "error", "rounds", "seed"):
        if (chosen := getattr(plan, name)) != usual[name]:
            words += [f"--{name}", str(chosen)]
    return shlex.join(words)


def _microseconds(value: float) -> str:
    return formatting.number(value * 1e6, 3)


def milliseconds(found: Spread) -> str:
    """Return the median of a run time, without its unit."""
    return formatting.number(found.median * 1e3, 3)


def _spread(found: Spread) -> str:
    return formatting.percent((found.high - found.low) / found.median)


def _median(found: Spread | None) -> str:
    return formatting.ABSENT if found is None else formatting.ratio(found.median)


def quartiles(found: Spread | None) -> str:
    """Return the quartiles of a ratio."""
    return formatting.ABSENT if found is None else f"{formatting.number(found.low)} to {formatting.number(found.high)}"
