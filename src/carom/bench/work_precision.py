"""Error against run time: a scoring pass, then a timing pass with nothing else running, and what they say together."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from carom.bench.convergence import fit_order
from carom.bench.error_kind import ErrorKind, error_of
from carom.bench.plan import Plan, plan_cells
from carom.bench.results import Bench, Curve, Point, SceneBench, cheapest, pareto_front
from carom.bench.timing import Config, SceneTiming, time_scene
from carom.bench.timing_journal import TimingJournal
from carom.runs.cell_score import CellKey, CellResult, cell_key
from carom.runs.environment import environment
from carom.runs.journal import Journal
from carom.runs.plan import chosen_engines
from carom.runs.results import Cell, Status
from carom.runs.sweep import Pool, sweep
from carom.scene import Scene

__all__ = ["work_precision"]

Progress = Callable[[int, int, str], None]


def work_precision(
    scenes: Sequence[Scene],
    plan: Plan,
    pool: Pool,
    *,
    journal: Journal | None = None,
    timings: TimingJournal | None = None,
    progress: Progress | None = None,
    command: str = "",
) -> Bench:
    """Score every cell, then time every configuration that could be scored, and fit what the two say.

    Args:
        scenes: Scenes, no two of one name.
        plan: What to do.
        pool: Where the scoring pass is carried out; it is closed before the timing pass begins.
        journal: Results of scoring that are there already, and where new ones go.
        timings: Scenes that are timed already, and where new ones go.
        progress: Called with (done, all, what).
        command: The command line to print.

    Raises:
        InputError: As `plan_cells` says.
        UnknownNameError: There is no such engine or profile.
    """
    started = time.perf_counter()
    infos = chosen_engines(plan.engines)
    cells = plan_cells(scenes, infos, plan)
    with pool:  # its processes are gone when the timing pass begins
        results, over = _score(cells, plan.budget_s * len(scenes) / 2, pool, journal, progress)
    benches = []
    for scene in scenes:
        points = _points([cell for cell in cells if cell.scene is scene], results, over, plan.error)
        timing, timed_at = None, ""
        ran = [point.config for point in points if not point.reason]
        if plan.timing and ran:
            timing, timed_at = _timed(scene, ran, replace(plan, budget_s=plan.budget_s / 2), timings, progress)
            points = [_with_timing(point, timing) for point in points]
        benches.append(_scene_bench(scene, points, timing, timed_at, plan.target))
    versions = {info.engine: info.version for info in infos if info.available and info.engine != "Carom"}
    return Bench(tuple(benches), plan, tuple(infos), environment(versions), command, time.perf_counter() - started)


def _score(
    cells: Sequence[Cell], budget_s: float, pool: Pool, journal: Journal | None, progress: Progress | None
) -> tuple[dict[CellKey, CellResult], str]:
    """Return the results, from coarse steps to fine ones as far as the budget reaches, and why the rest has none."""
    results: dict[CellKey, CellResult] = {}
    started = time.perf_counter()
    last_s, last_steps, done = 0.0, math.inf, 0
    for level in sorted({cell.refinement for cell in cells}):
        own = [cell for cell in cells if cell.refinement == level]
        known = journal.results if journal else {}
        missing = [cell for cell in own if cell_key(cell) not in known]
        steps = sum(cell.scene.duration_s / cell.dt_s for cell in missing)
        expected_s = last_s * steps / last_steps
        if time.perf_counter() - started + expected_s > budget_s:
            return results, (
                f"steps as fine as this take about {expected_s:.0f} s more, beyond the {budget_s:.0f} s for scoring; "
                "raise --budget"
            )
        before = time.perf_counter()

        def shown(now: int, _all: int, what: str, done: int = done) -> None:
            if progress is not None:
                progress(done + now, len(cells), f"scoring {what}")

        results.update(sweep(own, pool, journal, shown))
        done += len(own)
        if missing:
            last_s, last_steps = time.perf_counter() - before, steps
    return results, ""


def _timed(
    scene: Scene, configs: list[Config], plan: Plan, timings: TimingJournal | None, progress: Progress | None
) -> tuple[SceneTiming, str]:
    if timings is not None and (found := timings.find(scene, configs, plan.seed)) is not None:
        return found
    timing = time_scene(
        scene,
        configs,
        rounds=plan.rounds,
        seed=plan.seed,
        budget_s=plan.budget_s,
        time_limit_s=plan.time_limit_s,
        progress=progress,
    )
    at = environment({}).date
    if timings is not None:
        timings.add(scene, configs, timing, at)
    return timing, at


def _points(
    cells: Sequence[Cell], results: Mapping[CellKey, CellResult], over_budget: str, kind: ErrorKind
) -> list[Point]:
    by_config: dict[Config, list[CellResult | None]] = {}
    for cell in cells:
        key = cell_key(cell)
        by_config.setdefault(Config(cell.engine, cell.profile, cell.dt_s), []).append(results.get(key))
    return [_point(config, found, over_budget, kind) for config, found in by_config.items()]


def _point(config: Config, found: Sequence[CellResult | None], over_budget: str, kind: ErrorKind) -> Point:
    results = [result for result in found if result is not None]
    measured = [result.measures for result in results if result.measures is not None]
    errors = [error for measures in measured if not math.isnan(error := error_of(measures, kind))]
    reason = next((f"{r.status.value}: {r.reason}" for r in results if r.status is not Status.RAN), "")
    if len(results) < len(found):
        reason = over_budget
    if not reason:
        reason = next((f"ended early: {m.outcome}" for m in measured if m.outcome != "completed"), "")
    if not reason and all(measures.expected == 0 for measures in measured):
        reason = "the scene has no impact, so there is no error to measure"
    return Point(
        config.engine,
        config.profile,
        config.dt_s,
        error=max(errors, default=math.nan),
        error_median=statistics.median(errors) if errors else math.nan,
        error_least=min(errors, default=math.nan),
        phases=len(found),
        expected=sum(measures.expected for measures in measured),
        missed=sum(measures.missed + measures.undecided for measures in measured),
        spurious=sum(measures.spurious for measures in measured),
        reason=reason,
    )


def _with_timing(point: Point, timing: SceneTiming) -> Point:
    return replace(point, timing=timing.timings.get(point.config), untimed=timing.untimed.get(point.config, ""))


def _scene_bench(
    scene: Scene, points: Sequence[Point], timing: SceneTiming | None, timed_at: str, target: float
) -> SceneBench:
    by_curve: dict[tuple[str, str], list[Point]] = {}
    for point in points:
        by_curve.setdefault((point.engine, point.profile), []).append(point)
    curves = []
    for (engine, profile), own in by_curve.items():
        sound = [point for point in own if point.sound]
        order = fit_order([point.dt_s for point in sound], [point.error for point in sound])
        curves.append(Curve(engine, profile, tuple(own), order, cheapest(own, target)))
    return SceneBench(
        scene,
        tuple(curves),
        pareto_front([point for point in points if point.engine != "pic"]),
        cheapest(points, target),
        timing.noise if timing else None,
        timing.rounds if timing else 0,
        timed_at,
    )
