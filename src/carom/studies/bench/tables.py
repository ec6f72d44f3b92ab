"""The tables of a bench: what each method gives for what cost, its error at each step, every point."""

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
from carom.pages import wording
from carom.pages.document import IN_FULL, ON_PAPER, PAGE, Cell, Column, Table
from carom.registry import asked_as
from carom.studies.bench.convergence import Convergence, ConvergenceOrder
from carom.studies.bench.noise import Spread
from carom.studies.bench.options import BenchPlan
from carom.studies.bench.result import Bench, Curve, Point, SceneBench, cheapest, run_s
from carom.studies.bench.timing_pass import CellTiming

TABLE_NOTE = (
    "Order: least squares of error against step on logarithmic axes, steps with a missed or invented impact and errors "
    "at rounding left out; sampling alone has order 1, and an interval below 1/2 is called not converging. Cost: of "
    "the steps that were run, the one of least run time whose error is at most that, at every start, with every impact "
    "found; - where there is none. Over several scenes it is told over that of the cheapest engine, the median."
)
EXACT = "exact"
TABLE_SHORT = "order: of error in the step, 1 for sampling; -: at no step that was run"

#: The column that heads every table of a bench.
METHOD = Column("method", lambda of: f"{of.engine} {of.profile}")


def is_floor(curve: Curve) -> bool:
    """Whether the curve is PIC's own: its error does not depend on the step, and so it is what exactness costs."""
    return curve.engine == "pic" and curve.profile == "tuned"


def method_table(bench: SceneBench, targets: Sequence[float]) -> Table:
    """Return a row a method: how its error shrinks, the least of it, and what an error of each target costs."""
    columns = [
        METHOD,
        Column("order", lambda curve: _order(curve.order), "95 %"),
        Column("steps that find all", _sound, number=True, only=IN_FULL),
        Column("least", _least, "error", number=True),
        *(Column(f"to {wording.number(target)}", partial(_cost, bench, target), "ms, step") for target in targets),
    ]
    return Table(
        columns,
        sorted(bench.curves, key=lambda curve: run_s(cheapest(curve.points, targets[0]))),
        title=f"{bench.scene.name}: what each method gives for what cost",
    )


def suite_table(bench: Bench, targets: Sequence[float]) -> Table:
    """Return a row a method over several scenes: its order, where it comes to each target, and at what cost."""
    curves = [(scene, curve) for scene in bench.scenes for curve in scene.curves]
    by_method = wording.together(((curve.engine, curve.profile), (scene, curve)) for scene, curve in curves)
    columns = [
        METHOD,
        Column("order", _median_order, "median", number=True),
        *(Column(f"to {wording.number(target)}", partial(_reach, target), "scenes, cost") for target in targets),
    ]
    return Table(
        columns,
        [_Method(engine, profile, tuple(own)) for (engine, profile), own in by_method.items()],
        title=f"Every method on {wording.count(len(bench.scenes), 'scene')}",
    )


class _Method(NamedTuple):
    """A method, with its curve on each scene."""

    engine: str
    profile: str
    curves: tuple[tuple[SceneBench, Curve], ...]


def _median_order(method: _Method) -> str:
    orders = [curve.order for _, curve in method.curves]
    if all(order.verdict is Convergence.EXACT for order in orders):
        return "exact"
    known = [order.exponent for order in orders if not math.isnan(order.low)]  # of three steps or more
    return f"{statistics.median(known):.2f}" if known else "-"


def _reach(target: float, method: _Method) -> str:
    found = [(scene, cheapest(curve.points, target)) for scene, curve in method.curves]
    costs = [run_s(point) / run_s(cheapest_engine(scene, target)) for scene, point in found if point is not None]
    known = [cost for cost in costs if cost > 0]  # where no engine comes to it, there is nothing to hold a cost against
    cost = f", {wording.ratio(statistics.median(known))}" if known else ""
    return f"{len(costs)} of {len(found)}{cost}" if costs else "-"


def _order(order: ConvergenceOrder) -> Cell:
    if math.isnan(order.exponent):
        return Cell(order.verdict.value, short="exact" if order.verdict is Convergence.EXACT else "-")
    if math.isnan(order.low):
        return Cell(f"{wording.number(order.exponent)} from two", order.verdict.value, short=f"{order.exponent:.2f}")
    interval = f"{wording.number(order.low, 3)} to {wording.number(order.high, 3)}"
    short = f"{order.exponent:.2f} ± {order.high - order.exponent:.2f}"
    return Cell(f"{wording.number(order.exponent, 3)} ({interval})", order.verdict.value, short=short)


def _sound(curve: Curve) -> str:
    return f"{sum(point.sound for point in curve.points)} of {sum(not point.reason for point in curve.points)}"


def _least(curve: Curve) -> Cell:
    sound = [point for point in curve.points if point.sound]
    if sound:
        best = min(sound, key=lambda point: point.error)
        error, at = exact_or(best.error), f"at {wording.step(best.dt_s)}"
        return Cell(error, "" if error == EXACT else at, short=error)
    reasons = list(dict.fromkeys(point.reason for point in curve.points))
    if all(reasons):
        return Cell("not run", "; ".join(reasons), short=reasons[0].partition(":")[0] if curve.points else "")
    return Cell("", "misses or invents impacts at every step that was run", short="misses")


def exact_or(error: float) -> str:
    """Return an error, or that there is none but rounding."""
    return EXACT if error <= THRESHOLDS.rounding else wording.number(error)


def _cost(bench: SceneBench, target: float, curve: Curve) -> Cell:
    """Return the cheapest way to a target: its run time, its step, and how many times that of the cheapest engine."""
    point = cheapest(curve.points, target)
    if point is None or point.timing is None:
        met = next((p for p in curve.points if p.sound and p.error <= target), None)
        return Cell("-") if met is None else Cell("reached", f"not timed: {met.untimed or 'no timing pass'}")
    step = "any" if is_floor(curve) else wording.step(point.dt_s)
    spent = milliseconds(point.timing.advance_s)
    least = cheapest_engine(bench, target)
    times = "" if least is None else f"; {wording.ratio(run_s(point) / run_s(least))} the cheapest engine's"
    whole = f"{milliseconds(point.timing.whole_s)} ms with preparation"
    return Cell(f"{spent} ms at {step}", f"{whole}{times}", short=f"{spent} at {step.removesuffix(' s')}")


def engine_points(bench: SceneBench) -> list[Point]:
    """Return the points of the engines; where none was run, those of PIT."""
    for own in ({"pic", "pit"}, {"pic"}):
        found = [point for curve in bench.curves if curve.engine not in own for point in curve.points]
        if found:
            return found
    return []


def cheapest_engine(bench: SceneBench, target: float) -> Point | None:
    """Return the cheapest way to a target by an engine; None where none comes to it."""
    return cheapest(engine_points(bench), target)


def error_table(bench: SceneBench, error_label: str) -> Table:
    """Return the error of each method at each step."""
    steps = sorted({point.dt_s for curve in bench.curves for point in curve.points}, reverse=True)
    phases = max((point.phases for curve in bench.curves for point in curve.points), default=1)
    return Table(
        (METHOD, *(Column(wording.step(dt_s), partial(_error_at, dt_s), number=True) for dt_s in steps)),
        bench.curves,
        title=f"{bench.scene.name}: error at each step",
        note=f"{wording.capitalised(error_label)}; the largest of {wording.count(phases, 'start')} spread evenly "
        "over a step. -1 +2: impacts missed and invented, over all starts; an error with them is that of the rest.",
        only=IN_FULL,
    )


def _error_at(dt_s: float, curve: Curve) -> str:
    point = next((point for point in curve.points if point.dt_s == dt_s), None)
    return wording.ABSENT if point is None else _error(point)


def _error(point: Point) -> str:
    if point.reason:
        return wording.ABSENT
    lost = wording.lost(point.missed, point.spurious)
    return f"{exact_or(point.error)} ({lost})" if lost else exact_or(point.error)


def _clock(say: Callable[[CellTiming], str]) -> Callable[[Point], str]:
    """Return what a column says of the timing of a point that has one."""
    return lambda point: "" if point.timing is None else say(point.timing)


#: Two clocks, with what is paid without any collision in columns of its own.
_POINT_COLUMNS = (
    Column("error", _error, number=True),
    Column("luckiest start", lambda point: wording.number(point.error_least), number=True, only=ON_PAPER),
    Column("all steps, ms", _clock(lambda timing: milliseconds(timing.advance_s)), number=True),
    Column("spread", _clock(lambda timing: _share(timing.advance_s)), number=True),
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
    """Return a row a point of the diagrams, which lead to it: its numbers, and the command that makes them again."""
    name = bench.scene.name
    return Table(
        (
            Column("point", lambda point: Cell(point_name(point), anchor=point_anchor(name, point))),
            *_POINT_COLUMNS,
            Column("command", partial(_command, name, plan), only=PAGE),
        ),
        [point for curve in bench.curves for point in curve.points if not point.reason],
        title=f"{name}: every point",
        note="Medians over rounds; spread is the distance between the quartiles over the median. Empty world: a step "
        "of one disc at rest. Call: Python's call into the world, shared by all steps that one call takes. Net: what "
        "is left. Whole: with preparation. Ratios are to PIT at the same step in the same round; times are this "
        "machine's, and only ratios may be compared with another run.",
        folded="The numbers of every point, and the command that makes it again",
        css="cells",
        only=IN_FULL,
    )


def point_name(point: Point) -> str:
    """Return what a point of the diagrams is called."""
    return f"{point.engine} {point.profile} at {wording.step(point.dt_s)}"


def point_anchor(scene: str, point: Point) -> str:
    """Return the name of a point's row within the page."""
    return quote(f"{scene}/{point.engine}/{point.profile}/{point.dt_s!r}")


def _command(scene: str, plan: BenchPlan, point: Point) -> str:
    """Return the command that makes a point again: of the bench's own choices, those that are not the usual ones."""
    words = ["carom", "bench", scene, "-e", asked_as(point.engine), "-p", point.profile, "--dt", repr(point.dt_s)]
    usual = {field.name: field.default for field in fields(BenchPlan)}
    for name in ("phases", "error", "rounds", "seed"):
        if (chosen := getattr(plan, name)) != usual[name]:
            words += [f"--{name}", str(chosen)]
    return shlex.join(words)


def _microseconds(value: float) -> str:
    return wording.number(value * 1e6, 3)


def milliseconds(found: Spread) -> str:
    """Return the median of a run time, without its unit."""
    return wording.number(found.median * 1e3, 3)


def _share(found: Spread) -> str:
    return wording.percent((found.high - found.low) / found.median)


def _median(found: Spread | None) -> str:
    return wording.ABSENT if found is None else wording.ratio(found.median)


def quartiles(found: Spread | None) -> str:
    """Return the quartiles of a ratio."""
    return wording.ABSENT if found is None else f"{wording.number(found.low)} to {wording.number(found.high)}"
