"""Error against run time: a scoring pass, then a timing pass with nothing else running, and what they say together."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from carom.bench.convergence import Order, fit_order
from carom.bench.error_kind import ErrorKind, error_of
from carom.bench.noise import Noise
from carom.bench.timing import CellTiming, Config, SceneTiming, time_scene
from carom.bench.timing_journal import TimingJournal
from carom.comparator.verdict import THRESHOLDS
from carom.errors import InputError, UnknownNameError
from carom.registry import EngineInfo
from carom.runner.cell_score import CellKey, CellResult, cell_key
from carom.runner.cross_check import chosen_engines, distinct_profiles
from carom.runner.environment import Environment, environment
from carom.runner.journal import Journal
from carom.runner.phases import even_phases
from carom.runner.results import Cell, Status
from carom.runner.sweep import Pool, sweep
from carom.scene import Scene

__all__ = [
    "Bench",
    "Curve",
    "Plan",
    "Point",
    "SceneBench",
    "cheapest",
    "default_steps",
    "geometric_steps",
    "pareto_front",
    "plan_cells",
    "work_precision",
]

#: Steps of a scene's series where none are asked for: from its own frame to one as much finer as 1/10000 s is than
#: 1/60 s, in so many steps as a fitted order needs to have a confidence interval worth reading.
FINEST = 60 / 10_000
STEPS = 6

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class Plan:
    """What a bench is to do.

    Attributes:
        engines: Names of adapters; None for all.
        dts: Steps, seconds; None for each scene's own series.
        profiles: Names of profiles.
        phases: How many starts, evenly spread over a step, each cell is scored at.
        error: Which error.
        target: The error for which the cheapest way is looked for.
        rounds: Rounds of the timing pass.
        seed: Of the order of its visits.
        budget_s: Seconds a scene: half for scoring, half for timing. What does not fit is left out, and says so.
        time_limit_s: A run that takes longer is ended.
        timing: Whether to time at all.
    """

    engines: tuple[str, ...] | None = None
    dts: tuple[float, ...] | None = None
    profiles: tuple[str, ...] = ("default", "tuned")
    phases: int = 4
    error: ErrorKind = ErrorKind.IMPACT
    target: float = 1e-3
    rounds: int = 7
    seed: int = 1
    budget_s: float = 80.0
    time_limit_s: float = 60.0
    timing: bool = True


@dataclass(frozen=True)
class Point:
    """One engine's profile at one step on one scene.

    Attributes:
        engine: Name of the adapter.
        profile: Name of the profile.
        dt_s: Step, seconds.
        error: Largest error over all starts; NaN where no impact was found or nothing was run.
        error_median: The median over the starts.
        error_least: The least.
        phases: How many starts were scored.
        expected: Impacts of the reference, over all starts.
        missed: Impacts missed, over all starts.
        spurious: Impacts invented, over all starts.
        reason: Why there is no error, empty where there is one.
        timing: Its clocks; None where it was not timed.
        untimed: Why it was not timed.
    """

    engine: str
    profile: str
    dt_s: float
    error: float
    error_median: float
    error_least: float
    phases: int
    expected: int
    missed: int
    spurious: int
    reason: str = ""
    timing: CellTiming | None = None
    untimed: str = ""

    @property
    def sound(self) -> bool:
        """Whether every impact was found and none invented, at every start: only then an error says it all."""
        return not self.reason and not self.missed and not self.spurious and not math.isnan(self.error)

    @property
    def config(self) -> Config:
        """The point's configuration."""
        return Config(self.engine, self.profile, self.dt_s)


@dataclass(frozen=True)
class Curve:
    """All points of one engine's profile on one scene, from the coarsest step on.

    Attributes:
        engine: Name of the adapter.
        profile: Name of the profile.
        points: From coarse to fine.
        order: The fitted order of convergence, of the sound points.
        cheapest: The point of least run time that meets the target; None where none does.
    """

    engine: str
    profile: str
    points: tuple[Point, ...]
    order: Order
    cheapest: Point | None


@dataclass(frozen=True)
class SceneBench:
    """What was found on one scene.

    Attributes:
        scene: The scene.
        curves: By engine and profile.
        front: Points that no other one but PIC beats in both error and run time, from fast to exact.
        cheapest: The point of least run time that meets the target; None where none does.
        noise: What the machine made of fixed work while this scene was timed; None where it was not.
        rounds: Rounds of its timing pass.
        timed_at: When it was timed, UTC; an earlier sitting's where the bench was resumed.
    """

    scene: Scene
    curves: tuple[Curve, ...]
    front: tuple[Point, ...]
    cheapest: Point | None
    noise: Noise | None
    rounds: int
    timed_at: str


@dataclass(frozen=True)
class Bench:
    """A finished bench.

    Attributes:
        scenes: One entry a scene.
        plan: What was asked for.
        engines: What was known of each engine.
        environment: Machine and versions.
        command: The command that makes this again.
        elapsed_s: Wall-clock seconds.
    """

    scenes: tuple[SceneBench, ...]
    plan: Plan
    engines: tuple[EngineInfo, ...]
    environment: Environment
    command: str
    elapsed_s: float


def geometric_steps(coarsest_s: float, finest_s: float, count: int) -> tuple[float, ...]:
    """Return so many steps, evenly spread on a logarithmic axis; whole frame rates where both ends are.

    Raises:
        InputError: An end is no positive number, or there are fewer than two steps.
    """
    for name, value in (("the coarsest step", coarsest_s), ("the finest step", finest_s)):
        if not 0 < value < math.inf:
            raise InputError(f"{name} must be a positive number of seconds, got {value}")
    if count < 2:
        raise InputError(f"a series of steps needs two of them or more, got {count}")
    coarsest_s, finest_s = max(coarsest_s, finest_s), min(coarsest_s, finest_s)
    rates = [(1 / coarsest_s) * (coarsest_s / finest_s) ** (k / (count - 1)) for k in range(count)]
    ends = rates[0], rates[-1]
    if all(round(rate) >= 1 and abs(rate - round(rate)) < 1e-9 * rate for rate in ends):  # a float holds 1/60 to 1e-16
        rates = [float(round(rate)) for rate in rates]
        return tuple(1.0 / rate for rate in dict.fromkeys(rates))
    return (coarsest_s, *(1.0 / rate for rate in rates[1:-1]), finest_s)


def default_steps(scene: Scene) -> tuple[float, ...]:
    """Return the series of steps that a scene is run at where none are asked for."""
    frame_s = 1.0 / scene.frame_rate_hz
    return geometric_steps(frame_s, frame_s * FINEST, STEPS)


def plan_cells(scenes: Sequence[Scene], infos: Sequence[EngineInfo], plan: Plan) -> list[Cell]:
    """Return every cell of the scoring pass.

    Raises:
        InputError: There is no scene, two have one name, or a number of the plan is out of range.
        UnknownNameError: No engine asked for has a profile of the plan.
    """
    if not scenes:
        raise InputError("there is no scene to bench")
    names = [scene.name for scene in scenes]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise InputError(f"two scenes have the name {twice[0]!r}: a report could not tell them apart")
    if plan.rounds < 1:
        raise InputError(f"rounds must be 1 or more, got {plan.rounds}")
    for name, value in (("budget", plan.budget_s), ("time limit", plan.time_limit_s), ("target", plan.target)):
        if not value > 0:
            raise InputError(f"the {name} must be a positive number, got {value}")
    offered = {profile for info in infos for profile in info.profiles}
    for profile in plan.profiles:
        if profile not in offered:
            there_are = ", ".join(sorted(offered)) or "none"
            raise UnknownNameError(f"no engine asked for has a profile {profile!r}; there are: {there_are}")
    cells = []
    for scene in scenes:
        for info in infos:
            for refinement, dt_s in enumerate(sorted(set(plan.dts or default_steps(scene)), reverse=True)):
                for profile in distinct_profiles(info, plan.profiles, dt_s):
                    cells += [
                        Cell(scene, info.name, profile, dt_s, refinement, phase) for phase in even_phases(plan.phases)
                    ]
    return cells


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


def _run_s(point: Point) -> float:
    return point.timing.advance_s.median if point.timing else math.inf


def pareto_front(points: Sequence[Point]) -> tuple[Point, ...]:
    """Return the sound, timed points that no other one beats in both run time and error, from fast to exact."""
    front: list[Point] = []
    for point in sorted((p for p in points if p.sound and p.timing), key=lambda p: (_run_s(p), p.error)):
        # Two methods that do the same differ by rounding, which is no accuracy to pay for.
        if not front or point.error < front[-1].error - THRESHOLDS.rounding:
            front.append(point)
    return tuple(front)


def cheapest(points: Sequence[Point], target: float) -> Point | None:
    """Return the sound point of least run time whose error is at most the target, None where there is none."""
    meeting = [point for point in points if point.sound and point.timing and point.error <= target]
    return min(meeting, key=_run_s, default=None)
