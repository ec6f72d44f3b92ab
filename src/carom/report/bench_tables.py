"""The tables of a bench, as rows of words: one source for the terminal and the page."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from carom.bench.convergence import Order
from carom.bench.noise import Noise, Spread
from carom.bench.results import Curve, Point, SceneBench
from carom.comparator.thresholds import THRESHOLDS
from carom.report import wording
from carom.report.bench_figure import is_floor
from carom.report.document import Table

__all__ = [
    "all_tables",
    "cheapest_sentence",
    "cheapest_table",
    "cost_table",
    "error_table",
    "noise_sentence",
    "order_table",
    "order_words",
    "unrun_lines",
]


def error_table(bench: SceneBench, error_label: str) -> Table:
    """Return the errors of every curve at every step."""
    steps = sorted({point.dt_s for curve in bench.curves for point in curve.points}, reverse=True)
    rows = []
    for curve in bench.curves:
        at = {point.dt_s: point for point in curve.points}
        rows.append((curve.engine, curve.profile, *(_error(at.get(dt_s)) for dt_s in steps)))
    phases = max((point.phases for curve in bench.curves for point in curve.points), default=1)
    return Table.of(
        f"{bench.scene.name}: error at each step",
        ("engine", "profile", *(wording.step(dt_s) for dt_s in steps)),
        tuple(rows),
        f"{error_label[0].upper()}{error_label[1:]}; the largest of {wording.count(phases, 'start')} spread evenly "
        "over a step. -1 +2: impacts missed and invented, over all starts; an error beside them is that of the rest.",
    )


def _error(point: Point | None) -> str:
    if point is None or point.reason:
        return wording.ABSENT
    lost = " ".join([f"-{point.missed}"] * bool(point.missed) + [f"+{point.spurious}"] * bool(point.spurious))
    error = (
        f"≤ {wording.number(THRESHOLDS.rounding)}"
        if point.error <= THRESHOLDS.rounding
        else wording.number(point.error)
    )
    return f"{error} ({lost})" if lost else error


def order_words(order: Order) -> str:
    """Return what a fitted order says, with its interval."""
    if math.isnan(order.exponent):
        return order.verdict.value
    if math.isnan(order.low):
        return f"{order.verdict.value} ({wording.number(order.exponent)} from two)"
    interval = f"{wording.number(order.low, 3)} to {wording.number(order.high, 3)}"
    return f"{order.verdict.value}: {wording.number(order.exponent, 3)} ({interval})"


def order_table(bench: SceneBench) -> Table:
    """Return the fitted order of convergence of every curve."""
    rows = [
        (curve.engine, curve.profile, order_words(curve.order), str(curve.order.points), _sound(curve))
        for curve in bench.curves
    ]
    return Table.of(
        f"{bench.scene.name}: order of convergence",
        ("engine", "profile", "order (95 % interval)", "steps fitted", "steps that find every impact"),
        tuple(rows),
        "Least squares of error against step on logarithmic axes, steps with a missed or invented impact and errors at "
        "rounding left out. Sampling alone has order 1; an interval below 1/2 is called not converging.",
        left=3,
    )


def _sound(curve: Curve) -> str:
    return f"{sum(point.sound for point in curve.points)} of {len(curve.points)}"


def cost_table(bench: SceneBench) -> Table:
    """Return the two clocks of every point, with what is paid without any collision in columns of its own."""
    rows = []
    for curve in bench.curves:
        for point in curve.points:
            timing = point.timing
            if timing is None:
                continue
            rows.append(
                (
                    curve.engine,
                    curve.profile,
                    wording.step(point.dt_s),
                    _microseconds(timing.step_s),
                    _share(timing.advance_s),
                    _microseconds(timing.empty_s.median / timing.steps),
                    _microseconds(timing.call_s / timing.steps),
                    _microseconds(timing.net_s.median / timing.steps),
                    _milliseconds(timing.prepare_s.median),
                    _milliseconds(timing.whole_s.median),
                    _median(timing.ratio),
                    _quartiles(timing.ratio),
                    _median(timing.whole_ratio),
                    _quartiles(timing.whole_ratio),
                )
            )
    return Table.of(
        f"{bench.scene.name}: run time",
        (
            "engine",
            "profile",
            "step",
            "a step, µs",
            "spread",
            "empty world, µs",
            "call, µs",
            "net, µs",
            "prepare, ms",
            "whole, ms",
            "steps / PIT",
            "ratio, quartiles",
            "whole / PIT",
            "whole ratio, quartiles",
        ),
        tuple(rows),
        "Medians over rounds; spread is the distance between the quartiles over the median. Empty world: a step of one "
        "disc at rest. Call: Python's call into the world, shared by all steps that one call takes. Net: what is left. "
        "Whole: with preparation. Ratios are to PIT at the same step in the same round; "
        "times are this machine's, and only ratios may be held against another run.",
        left=3,
        page_only=frozenset({"ratio, quartiles", "whole ratio, quartiles"}),
    )


def cheapest_table(bench: SceneBench, target: float) -> Table:
    """Return the cheapest way of every curve to an error of at most the target."""
    rows = []
    for curve in sorted(bench.curves, key=lambda curve: _seconds(curve.cheapest)):
        point = curve.cheapest
        if point is not None and point.timing is not None:
            best = bench.cheapest
            base = best.timing.advance_s.median if best is not None and best.timing is not None else math.nan
            rows.append(
                (
                    curve.engine,
                    curve.profile,
                    "any step" if is_floor(curve) else wording.step(point.dt_s),
                    wording.number(point.error) if point.error > THRESHOLDS.rounding else "exact",
                    _milliseconds(point.timing.advance_s.median),
                    _milliseconds(point.timing.whole_s.median),
                    wording.ratio(point.timing.advance_s.median / base),
                )
            )
        else:
            rows.append((curve.engine, curve.profile, _why_not(curve, target), "", "", "", ""))
    return Table.of(
        f"{bench.scene.name}: the cheapest way to an error of {wording.number(target)}",
        (
            "engine",
            "profile",
            "step, or why there is none",
            "error",
            "all steps, ms",
            "whole, ms",
            "times the cheapest",
        ),
        tuple(rows),
        "Of the steps that were run, the one of least run time whose error is at most that, at every start, with every "
        "impact found.",
        left=3,
    )


def _why_not(curve: Curve, target: float) -> str:
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


def cheapest_sentence(bench: SceneBench, target: float) -> str:
    """Return the answer to the user's question in a sentence."""
    name, wanted = bench.scene.name, wording.number(target)
    others = [c.cheapest for c in bench.curves if c.cheapest is not None and c.engine not in {"pic"}]
    engine = min(others, key=_seconds, default=None)
    if engine is None or engine.timing is None:
        return f"{name}: no engine reaches an error of {wanted} at the steps that were run."
    found = engine.timing.ratio
    ratio = (
        f", {_median(found)} PIT's at that step (quartiles {_quartiles(found)})"
        if found and engine.engine != "pit"
        else ""
    )
    sentence = (
        f"{name}: the cheapest way to an error of {wanted} is {engine.engine} ({engine.profile}) at "
        f"{wording.step(engine.dt_s)}: {_milliseconds(engine.timing.advance_s.median)} ms{ratio}"
    )
    pic = next((c.cheapest for c in bench.curves if is_floor(c) and c.cheapest is not None), None)
    if pic is None or pic.timing is None:
        return f"{sentence}."
    times = pic.timing.advance_s.median / engine.timing.advance_s.median
    return f"{sentence}; PIC is exact in {_milliseconds(pic.timing.advance_s.median)} ms, {wording.ratio(times)} that."


def unrun_lines(bench: SceneBench) -> Iterator[str]:
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


def noise_sentence(noise: Noise | None) -> str:
    """Return how quiet the machine was."""
    if noise is None:
        return "not timed"
    return (
        f"the same {wording.number(noise.work_s * 1e3)} ms of fixed work, {noise.probes} times between the visits: "
        f"the middle half within {wording.percent(noise.interquartile)}, the slowest {wording.ratio(noise.worst)} that"
    )


def _seconds(point: Point | None) -> float:
    return point.timing.advance_s.median if point is not None and point.timing is not None else math.inf


def _microseconds(value: float) -> str:
    return wording.number(value * 1e6, 3)


def _milliseconds(value: float) -> str:
    return wording.number(value * 1e3, 3)


def _share(found: Spread) -> str:
    return wording.percent((found.high - found.low) / found.median)


def _median(found: Spread | None) -> str:
    return wording.ABSENT if found is None else wording.ratio(found.median)


def _quartiles(found: Spread | None) -> str:
    return wording.ABSENT if found is None else f"{wording.number(found.low)} to {wording.number(found.high)}"


def all_tables(bench: SceneBench, error_label: str, target: float) -> Sequence[Table]:
    """Return every table of a scene, in the order of reading."""
    timed = bench.noise is not None
    tables = [error_table(bench, error_label), order_table(bench)]
    return [cheapest_table(bench, target), *tables, cost_table(bench)] if timed else tables
