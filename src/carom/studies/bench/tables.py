"""Tables of a bench: accuracy and run time of each method, its error with each step size, and all points."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple
from urllib.parse import quote

from carom.comparator.thresholds import THRESHOLDS
from carom.execution.job import Method
from carom.report.document import Cell, Column, Media, Table
from carom.report.provenance import format_command
from carom.studies.bench.convergence import Convergence, ConvergenceOrder
from carom.studies.bench.machine_noise import Spread
from carom.studies.bench.options import TARGETS, BenchPlan, ErrorKind
from carom.studies.bench.result import Bench, Curve, Point, SceneBench, find_cheapest, read_run_time, sort_best_first
from carom.studies.bench.timing_pass import CellTiming
from carom.support import formatting

TABLE_NOTE = (
    "The best method is first. 'Least error' is the smallest error of all step sizes that find every impact at every "
    "phase. If no step size finds every impact, the column shows the missed (-) and spurious (+) impacts of the best "
    "step size. If the heading of a column is an error, the column shows the shortest run time with which the method "
    "finds every impact and reaches this error. 'Order' is the slope of error against step size on logarithmic axes. "
    "Step sizes that miss an impact, or whose error is only rounding, are left out. Checking once per step has order "
    "1. A method does not converge if the whole confidence interval of its order is below 1/2."
)
TABLE_SHORT = "'ms' is the run time. -n counts missed impacts, +n spurious ones. The error grows as step size^order."
EXACT = "exact"

#: Smallest error that is shown in per cent. Smaller percentages, such as 0.0009 %, would be hard to read.
LEAST_PERCENT = 1e-4

#: A terminal shows this number of target errors, the smallest ones.
TARGETS_SHOWN = 3

#: The first column of every table of a bench.
METHOD = Column("method", lambda curve: curve.method.label)


def format_error(error: float, kind: ErrorKind) -> str:
    """Return an error as shown in tables and sentences: exact, 0.16 %, 2e-6, or 0.01 rad."""
    if error <= THRESHOLDS.rounding:
        return EXACT
    if not kind.is_percent:
        return f"{formatting.format_number(error)} rad"
    return formatting.format_percent(error) if error >= LEAST_PERCENT else formatting.format_number(error)


def list_reached_targets(bench: Bench) -> list[float]:
    """Return the targets that an engine reaches on at least one scene, from the largest error to the smallest.

    If a method is exact on a scene, the last target is the largest error that counts as rounding.
    """
    engines = [point for scene in bench.scenes for curve in scene.engines for point in curve.points]
    all_points = [point for scene in bench.scenes for point in scene.points]
    targets = sorted({bench.plan.target, *TARGETS}, reverse=True)
    reached = [target for target in targets if any(_is_within_target(point, target) for point in engines)]
    if any(_is_within_target(point, THRESHOLDS.rounding) for point in all_points):
        reached.append(THRESHOLDS.rounding)
    return reached


def _is_within_target(point: Point, target: float) -> bool:
    return point.is_correct and point.error <= target


def build_method_table(scene: SceneBench, kind: ErrorKind, targets: Sequence[float]) -> Table:
    """Return a table with one row per method, best first: smallest error, and run time for each target."""
    columns = [
        METHOD,
        Column("least", partial(_build_least_error_cell, kind), "error", number=True),
        Column("run", _format_best_time, "ms", number=True),
        Column("at", _format_best_step, "step", number=True),
        *(
            Column(format_error(target, kind), partial(_build_cost_cell, scene, target), "ms", number=True, only=only)
            # A terminal shows the run time of exact results only once, next to their error.
            for target, only in zip(targets, _select_media(targets, exact=Media.IN_FULL), strict=True)
        ),
        Column("order", lambda curve: _format_order(curve.order)),
        Column("step sizes that find all", _format_sound_steps, number=True, only=Media.IN_FULL),
    ]
    title = f"{scene.scene.name}: accuracy and run time of each method"
    return Table(columns, sort_best_first(scene.curves), title=title)


def _select_media(targets: Sequence[float], exact: Media = Media.EVERYWHERE) -> list[Media]:
    """For each target, return the media that show its column. A terminal shows only the columns of the smallest errors.

    Args:
        targets: Targets, from the largest error to the smallest.
        exact: Media that show the column for exact results.
    """
    errors = sum(target > THRESHOLDS.rounding for target in targets)
    hidden = max(0, errors - TARGETS_SHOWN)
    return [Media.IN_FULL] * hidden + [Media.EVERYWHERE] * (errors - hidden) + [exact] * (len(targets) - errors)


def build_suite_table(bench: Bench, targets: Sequence[float]) -> Table:
    """Return a table with one row per method.

    For each target error, the table counts the scenes in which a method finds every impact and reaches the target.
    """
    curves = [(scene, curve) for scene in bench.scenes for curve in scene.curves]
    by_method = formatting.group_by((curve.method, (scene, curve)) for scene, curve in curves)
    kind = bench.plan.error
    columns = [
        METHOD,
        Column(
            "found",
            lambda method: f"{sum(point.is_correct for point in method.best)} of {len(method.curves)}",
            "all",
            number=True,
        ),
        *(
            Column(format_error(target, kind), partial(_build_reach_cell, target), "n, ×", only=only)  # noqa: RUF001 - the sign of a ratio
            for target, only in zip(targets, _select_media(targets), strict=True)
        ),
        Column("order", _format_median_order, "median", number=True),
    ]
    methods = [_MethodCurves(method, tuple(method_curves)) for method, method_curves in by_method.items()]
    return Table(
        columns,
        sorted(methods, key=lambda method: method.build_sort_key(targets)),
        title=f"All methods on {formatting.format_count(len(bench.scenes), 'scene')}",
        note="n: scenes in which a method reaches the error; ×: median run time / PIC's.",  # noqa: RUF001
    )


class _MethodCurves(NamedTuple):
    """A method, with its curve on each scene."""

    method: Method
    curves: tuple[tuple[SceneBench, Curve], ...]

    @property
    def best(self) -> list[Point]:
        return [curve.best for _, curve in self.curves if curve.best is not None]

    def list_scenes_within(self, target: float) -> list[SceneBench]:
        return [scene for scene, curve in self.curves if any(_is_within_target(p, target) for p in curve.points)]

    def compute_median_cost(self, target: float) -> float:
        """Return the median run time for a target error, divided by PIC's run time; NaN if unknown."""
        cheap = [(scene, find_cheapest(curve.points, target)) for scene, curve in self.curves]
        cost_ratios = [read_run_time(point) / read_run_time(scene.exact) for scene, point in cheap]
        known = [cost for cost in cost_ratios if 0 < cost < math.inf]  # points without a run time are omitted
        return statistics.median(known) if known else math.nan

    def build_sort_key(self, targets: Sequence[float]) -> tuple[list[int], list[float]]:
        """Return a sort key: the numbers of scenes within each target error, then the run times.

        The smallest target is first.
        """
        median_costs = [self.compute_median_cost(target) for target in reversed(targets)]
        reached = [-len(self.list_scenes_within(target)) for target in reversed(targets)]
        return reached, [math.inf if math.isnan(cost) else cost for cost in median_costs]


def _format_median_order(method: _MethodCurves) -> str:
    orders = [curve.order for _, curve in method.curves]
    if all(order.verdict is Convergence.EXACT for order in orders):
        return EXACT
    known = [order.exponent for order in orders if not math.isnan(order.low)]  # an interval requires three step sizes
    return f"{statistics.median(known):.2f}" if known else ""


def _build_reach_cell(target: float, method: _MethodCurves) -> Cell:
    scenes = method.list_scenes_within(target)
    found = method.compute_median_cost(target)
    cost = "" if math.isnan(found) else f", {formatting.format_ratio(found)}"
    short = f"{len(scenes)}{cost.removesuffix(' ×')}"  # noqa: RUF001 - the sign of a ratio
    return Cell(f"{len(scenes)} of {len(method.curves)}{cost}", short=short) if scenes else Cell("")


def _format_order(order: ConvergenceOrder) -> Cell:
    if math.isnan(order.exponent):
        return Cell(order.verdict.value, short=EXACT if order.verdict is Convergence.EXACT else formatting.ABSENT)
    short = f"{order.exponent:.2f}"
    if math.isnan(order.low):
        return Cell(f"{formatting.format_number(order.exponent)} from two step sizes", order.verdict.value, short=short)
    interval = f"{formatting.format_number(order.low, 3)} to {formatting.format_number(order.high, 3)}"
    return Cell(f"{formatting.format_number(order.exponent, 3)} ({interval})", order.verdict.value, short=short)


def _format_sound_steps(curve: Curve) -> str:
    return f"{sum(point.is_correct for point in curve.points)} of {sum(not point.reason for point in curve.points)}"


def _build_least_error_cell(kind: ErrorKind, curve: Curve) -> Cell:
    best = curve.best
    if best is None:
        reasons = list(dict.fromkeys(point.reason for point in curve.points))
        return Cell("not run", "; ".join(reasons), short=reasons[0].partition(":")[0] if reasons else "")
    if best.is_correct:
        return Cell(format_error(best.error, kind))
    short = formatting.format_missed_and_invented(best.missed, best.spurious) or formatting.ABSENT
    return Cell(format_losses(best), short=short)


def format_losses(point: Point) -> str:
    """Describe a point's missed and invented impacts over all phases."""
    losses = [f"{verb} {count}" for verb, count in (("misses", point.missed), ("invents", point.spurious)) if count]
    if not losses:
        return "has no measurable error"
    return f"{formatting.join_words(losses)} of {formatting.format_count(point.expected, 'impact')}"


def _format_best_time(curve: Curve) -> str:
    timing = None if curve.best is None else curve.best.timing
    return "" if timing is None else format_milliseconds(timing.advance_s)


def _format_best_step(curve: Curve) -> str:
    if curve.best is None:
        return ""
    return "any" if curve.is_pic else formatting.format_step(curve.best.dt_s).removesuffix(" s")


def _build_cost_cell(scene: SceneBench, target: float, curve: Curve) -> Cell:
    """Return a cell with the run time of the fastest point that reaches a target.

    The cell's title compares this run time with PIC's.
    """
    point = find_cheapest(curve.points, target)
    if point is None or point.timing is None:
        reaching_point = next((p for p in curve.points if _is_within_target(p, target)), None)
        why = f"not timed: {(reaching_point and reaching_point.untimed) or 'there was no timing pass'}"
        return Cell("") if reaching_point is None else Cell("reached", title=why, short="yes")
    whole = format_milliseconds(point.timing.whole_s)
    title = f"at {formatting.format_step(point.dt_s)}; {whole} ms with preparation"
    if scene.exact is not None and not curve.is_pic:
        title += f"; {formatting.format_ratio(read_run_time(point) / read_run_time(scene.exact))} PIC's"
    return Cell(format_milliseconds(point.timing.advance_s), title=title)


def _format_point_error(point: Point) -> str:
    if point.reason:
        return formatting.ABSENT
    losses = formatting.format_missed_and_invented(point.missed, point.spurious)
    error = EXACT if point.error <= THRESHOLDS.rounding else formatting.format_number(point.error)
    return f"{error} ({losses})" if losses else error


def _timing_column(head: str, say: Callable[[CellTiming], str], only: Media = Media.EVERYWHERE) -> Column:
    return Column(head, lambda point: "" if point.timing is None else say(point.timing), number=True, only=only)


def _step_column(head: str, read_s: Callable[[CellTiming], float]) -> Column:
    """Return a column with a part of the run time, in microseconds per step."""
    return _timing_column(head, lambda timing: formatting.format_number(read_s(timing) / timing.steps * 1e6, 3))


#: Columns of the table of all points, except for the columns with the point's name and command.
_POINT_COLUMNS = (
    Column("error", _format_point_error, number=True),
    Column("smallest over phases", lambda p: formatting.format_number(p.error_least), number=True, only=Media.ON_PAPER),
    _timing_column("all steps, ms", lambda timing: format_milliseconds(timing.advance_s)),
    _timing_column("spread", lambda timing: _format_spread(timing.advance_s)),
    _timing_column("prepare, ms", lambda timing: format_milliseconds(timing.prepare_s)),
    _timing_column("whole, ms", lambda timing: format_milliseconds(timing.whole_s)),
    _step_column("per step, µs", lambda timing: timing.advance_s.median),
    _step_column("empty world, µs", lambda timing: timing.empty_s.median),
    _step_column("call, µs", lambda timing: timing.call_s),
    _step_column("net, µs", lambda timing: timing.net_s.median),
    _timing_column("steps / PIT", lambda timing: _format_median(timing.ratio)),
    _timing_column("ratio, quartiles", lambda timing: _format_quartiles(timing.ratio), Media.ON_PAPER),
    _timing_column("whole / PIT", lambda timing: _format_median(timing.whole_ratio)),
    _timing_column("whole ratio, quartiles", lambda timing: _format_quartiles(timing.whole_ratio), Media.ON_PAPER),
)


def build_point_table(bench: SceneBench, plan: BenchPlan) -> Table:
    """Return a table with one row per point of the diagrams: its numbers, and the command that repeats it."""
    name = bench.scene.name
    return Table(
        (
            Column("point", lambda point: Cell(format_point_name(point), anchor=build_point_anchor(name, point))),
            *_POINT_COLUMNS,
            Column("command", partial(_format_command, name, plan), only=Media.PAGE),
        ),
        [point for point in bench.points if not point.reason],
        title=f"{name}: all points",
        note=f"'Error' is the {plan.error.meaning}. Each error is the largest over "
        f"{formatting.format_count(plan.phases, 'phase')} that are spread evenly over a step. '-1 +2' means that over "
        "all phases one impact is missed and two are invented. The error then covers only the other impacts. Times are "
        "medians over rounds. 'Spread' is the distance between the quartiles, divided by the median. 'Empty world' is "
        "the time of a step with one disc at rest. 'Call' is the time of one Python call, divided by its number of "
        "steps. 'Net' is the time per step minus the times in 'empty world' and 'call'. 'Whole' is the time of all "
        "steps and of the preparation. Ratios are run times divided by PIT's at the same step size in the same round. "
        "Times are valid only for this machine and session. To compare machines, use only ratios.",
        folded="The numbers of all points, and the commands that repeat them",
        css="cells",
        only=Media.IN_FULL,
    )


def format_point_name(point: Point) -> str:
    """Return the name of a point of the diagrams."""
    return f"{point.method.label} at {formatting.format_step(point.dt_s)}"


def build_point_anchor(scene: str, point: Point) -> str:
    """Return the anchor of a point's row within the page."""
    return quote(f"{scene}/{point.engine}/{point.profile}/{point.dt_s!r}")


def _format_command(scene: str, plan: BenchPlan, point: Point) -> str:
    """Return the command that repeats a point, with those options of the bench that differ from the defaults."""
    options = ["--dt", repr(point.dt_s)]
    for name in ("phases", "error", "rounds", "seed"):
        if (chosen := getattr(plan, name)) != getattr(BenchPlan, name):
            options += [f"--{name}", str(chosen)]
    return format_command(("bench", scene), point.method, *options)


def format_milliseconds(spread: Spread) -> str:
    """Return the median of a run time in milliseconds, without the unit."""
    return formatting.format_number(spread.median * 1e3, 3)


def _format_spread(spread: Spread) -> str:
    return formatting.format_percent((spread.high - spread.low) / spread.median)


def _format_median(spread: Spread | None) -> str:
    return formatting.ABSENT if spread is None else formatting.format_ratio(spread.median)


def _format_quartiles(spread: Spread | None) -> str:
    if spread is None:
        return formatting.ABSENT
    return f"{formatting.format_number(spread.low)} to {formatting.format_number(spread.high)}"
