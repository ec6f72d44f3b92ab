"""The timing pass: nothing observed, nothing else running, several rounds in random order, ratios within a round only.

Two clocks: all steps in as few calls as the adapter allows, and the whole, with the world's preparation. Beside them
stands what is paid without any collision: Python's call into the world, and as many steps of an empty world.
"""

from __future__ import annotations

import gc
import math
import statistics
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from carom.adapter import Adapter, World
from carom.bench.noise import Noise, NoiseProbe, Spread, spread
from carom.errors import AdapterError
from carom.registry import load_adapter
from carom.runs.drive import profile_settings
from carom.runs.messages import Failure
from carom.runs.process import Crashed, TimedOut, Worker
from carom.scene import Disc, Scene

__all__ = ["CellTiming", "Config", "SceneTiming", "Visit", "VisitTask", "empty_world", "time_scene"]

#: A visit repeats a short run until it has taken so long, seconds: then what the clock and the caches do is small.
VISIT_S = 5e-3
MOST_REPEATS = 50

#: Steps for which an empty world is timed; its cost a step does not change after that.
EMPTY_STEPS = 1000

#: Fewer rounds than this have no spread worth a name.
LEAST_ROUNDS = 3

#: What is measured against, see `carom.runs.cross_check.SAMPLING`.
PIT = ("pit", "tuned")

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True, order=True)
class Config:
    """What is timed on a scene."""

    engine: str
    profile: str
    dt_s: float


@dataclass(frozen=True)
class Visit:
    """One visit of a configuration in one round, medians of its repeats, seconds.

    Attributes:
        prepare_s: To build the world.
        advance_s: For all steps.
        call_s: For a call of no steps; NaN where the adapter does not take one.
        empty_s: For as many steps of an empty world, without the call.
    """

    prepare_s: float
    advance_s: float
    call_s: float
    empty_s: float

    @property
    def whole_s(self) -> float:
        """The whole cost, preparation included."""
        return self.prepare_s + self.advance_s

    @property
    def net_s(self) -> float:
        """What is left for this scene's own work."""
        return self.advance_s - self.empty_s - (0.0 if math.isnan(self.call_s) else self.call_s)


@dataclass(frozen=True)
class VisitTask:
    """Time a configuration, in a worker process that has timed it before."""

    scene: Scene
    config: Config
    repeats: int = 1

    def carry_out(self) -> Visit:
        """Return the medians of the repeats, each in a fresh world."""
        adapter = load_adapter(self.config.engine)
        settings = dict(profile_settings(adapter, self.config.profile, self.config.dt_s))
        steps = self.scene.step_count(self.config.dt_s)
        some = min(steps, EMPTY_STEPS)
        with _no_collection():
            runs = [_run(adapter, self.scene, settings, steps) for _ in range(self.repeats)]
            empty = [_run(adapter, empty_world(self.scene), settings, some) for _ in range(min(self.repeats, 5))]
        call_s = statistics.median(run[1] for run in runs)
        paid_s = 0.0 if math.isnan(call_s) else call_s
        return Visit(
            prepare_s=statistics.median(run[0] for run in runs),
            advance_s=statistics.median(run[2] for run in runs),
            call_s=call_s,
            empty_s=max(0.0, statistics.median(run[2] for run in empty) - paid_s) * steps / some,
        )


def empty_world(scene: Scene) -> Scene:
    """Return the emptiest world that is a scene: one disc at rest, no wall."""
    radius_m = max(disc.radius_m for disc in scene.discs)
    return Scene(name="empty", discs=[Disc(position_m=(0.0, 0.0), radius_m=radius_m)], duration_s=scene.duration_s)


@contextmanager
def _no_collection() -> Iterator[None]:
    """Collect garbage now, and none meanwhile: somebody else's garbage is no part of a step."""
    collecting = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()


def _run(adapter: Adapter, scene: Scene, settings: dict[str, float | int | bool | str], steps: int) -> list[float]:
    """Return seconds to prepare, to call for no step, and to take all steps."""
    started = time.perf_counter()
    world = adapter.prepare(scene, settings)
    prepare_s = time.perf_counter() - started
    try:
        call_s = _call(world)
        started = time.perf_counter()
        world.advance(steps)
        return [prepare_s, call_s, time.perf_counter() - started]
    finally:
        world.close()


def _call(world: World) -> float:
    """Return seconds for a call of no steps, NaN where the adapter refuses one; the second, as the first warms up."""
    call_s = math.nan
    try:
        for _ in range(2):
            started = time.perf_counter()
            world.advance(0)
            call_s = time.perf_counter() - started
    except Exception:  # noqa: BLE001 - no adapter has to take no steps; then there is no such number
        return math.nan
    return call_s


@dataclass(frozen=True)
class CellTiming:
    """Timing of a configuration, over all rounds; seconds.

    Attributes:
        steps: Steps of the run.
        rounds: How many rounds there were.
        advance_s: For all steps.
        prepare_s: To build the world.
        whole_s: Both.
        call_s: Of `advance_s`, Python's call into the world; NaN where the adapter takes no call of no steps.
        empty_s: Of `advance_s`, what as many steps of an empty world cost.
        net_s: Of `advance_s`, what is left for this scene's own work.
        ratio: `advance_s` over that of PIT at the same step in the same round; None where PIT was not timed there.
        whole_ratio: Likewise of `whole_s`.
    """

    steps: int
    rounds: int
    advance_s: Spread
    prepare_s: Spread
    whole_s: Spread
    call_s: float
    empty_s: Spread
    net_s: Spread
    ratio: Spread | None
    whole_ratio: Spread | None

    @property
    def step_s(self) -> float:
        """Seconds a step, the median."""
        return self.advance_s.median / self.steps


@dataclass(frozen=True)
class SceneTiming:
    """What a scene's timing pass found.

    Attributes:
        timings: By configuration.
        untimed: Why a configuration was not timed.
        rounds: How many rounds there were.
        seed: Of the order of visits.
        noise: What the machine made of fixed work meanwhile.
    """

    timings: dict[Config, CellTiming]
    untimed: dict[Config, str]
    rounds: int
    seed: int
    noise: Noise


class _Workers:
    """One worker process an engine, so that each has its engine warm and no other's."""

    def __init__(self, stack: ExitStack, time_limit_s: float) -> None:
        self._stack, self._time_limit_s = stack, time_limit_s
        self._workers: dict[str, Worker[Any]] = {}

    def visit(self, task: VisitTask) -> Visit | str:
        """Return the visit, or why there is none."""
        engine = task.config.engine
        if engine not in self._workers:
            self._workers[engine] = self._stack.enter_context(Worker())
        try:
            answer = self._workers[engine].ask(task, self._time_limit_s)
        except Crashed as error:
            return f"crashed: {error}"
        except TimedOut as error:
            return f"timed out: {error}"
        if isinstance(answer, Failure):
            return f"failed: {answer.message}"
        if not isinstance(answer, Visit):
            raise AdapterError(f"a worker answered with {type(answer).__name__} where a timing was asked for")
        return answer


def time_scene(
    scene: Scene,
    configs: Iterable[Config],
    *,
    rounds: int = 7,
    seed: int = 1,
    budget_s: float = math.inf,
    time_limit_s: float = 60.0,
    progress: Progress | None = None,
) -> SceneTiming:
    """Time a scene on several configurations. The caller sees to it that nothing else is running.

    Every configuration is warmed up once. Then comes round after round: in each, every configuration is visited once,
    in random order. PIT at each step is among them, asked for or not.

    Args:
        scene: The scene.
        configs: What is timed.
        rounds: How many rounds; fewer, but three, where the budget is short.
        seed: Of the order of visits.
        budget_s: Seconds that the pass may take; configurations that do not fit into it are left out, and say so.
        time_limit_s: A visit that takes longer is ended, and its configuration left out.
        progress: Called with (done, all, what).
    """
    asked = list(dict.fromkeys(configs))
    pit = [Config(*PIT, dt_s) for dt_s in sorted({config.dt_s for config in asked}, reverse=True)]
    ordered = [*pit, *sorted(set(asked) - set(pit), key=lambda c: (c.engine, c.profile, -c.dt_s))]
    started = time.perf_counter()
    probe = NoiseProbe()
    with ExitStack() as stack:
        workers = _Workers(stack, time_limit_s)
        warm, untimed = _warm_up(scene, ordered, workers, budget_s, progress)
        left_s = budget_s - (time.perf_counter() - started)
        rounds = _fit(warm, untimed, rounds, left_s)
        repeats = {config: min(MOST_REPEATS, math.ceil(VISIT_S / cost)) for config, cost in warm.items()}
        visits: dict[Config, list[Visit]] = {config: [] for config in warm}
        draw = np.random.default_rng(seed)
        total, done = rounds * len(warm), 0
        last_s = 0.0
        for turn in range(rounds):
            began = time.perf_counter()
            if turn >= LEAST_ROUNDS and began - started + last_s > budget_s:
                rounds = turn  # the machine was slower than the warm-up said
                break
            order = list(visits)
            for k in draw.permutation(len(order)):
                config = order[k]
                done += 1
                if config in untimed:
                    continue
                probe.take()
                visit = workers.visit(VisitTask(scene, config, repeats[config]))
                if isinstance(visit, str):
                    untimed[config] = visit
                else:
                    visits[config].append(visit)
                if progress is not None:
                    progress(done, total, f"timing {config.engine} at {config.dt_s:.3g} s")
            last_s = time.perf_counter() - began
    probe.take()
    timed = {config: found for config, found in visits.items() if config not in untimed}
    timings = {
        config: _summary(scene.step_count(config.dt_s), found, timed.get(Config(*PIT, config.dt_s)))
        for config, found in timed.items()
    }
    kept = set(asked)
    return SceneTiming(
        {config: timing for config, timing in timings.items() if config in kept},
        {config: reason for config, reason in untimed.items() if config in kept},
        rounds,
        seed,
        probe.noise(),
    )


def _warm_up(
    scene: Scene, configs: Sequence[Config], workers: _Workers, budget_s: float, progress: Progress | None
) -> tuple[dict[Config, float], dict[Config, str]]:
    """Return what one visit of each configuration costs, seconds, and why some have none; from coarse to fine."""
    costs: dict[Config, float] = {}
    untimed: dict[Config, str] = {}
    last: dict[tuple[str, str], tuple[float, float]] = {}
    for k, config in enumerate(configs):
        own = (config.engine, config.profile)
        if own in last:
            dt_s, cost = last[own]
            expected_s = cost * dt_s / config.dt_s
            # One configuration must leave most of the budget to the others.
            if expected_s * LEAST_ROUNDS > budget_s / 4:
                untimed[config] = (
                    f"its {LEAST_ROUNDS} rounds would take about {expected_s * LEAST_ROUNDS:.0f} s of a budget of "
                    f"{budget_s:.0f} s for this scene; raise --budget"
                )
                continue
        workers.visit(VisitTask(scene, config)) if own not in last else None
        visit = workers.visit(VisitTask(scene, config))
        if isinstance(visit, str):
            untimed[config] = visit
            continue
        costs[config] = visit.whole_s + visit.empty_s * min(1.0, EMPTY_STEPS / scene.step_count(config.dt_s))
        last[own] = (config.dt_s, costs[config])
        if progress is not None:
            progress(k + 1, len(configs), f"warming up {config.engine}")
    return costs, untimed


def _fit(costs: dict[Config, float], untimed: dict[Config, str], rounds: int, left_s: float) -> int:
    """Return how many rounds fit; where not even the least number does, leave out the most expensive configurations."""

    def round_s() -> float:
        return sum(max(cost, VISIT_S) for cost in costs.values())

    while costs and round_s() * LEAST_ROUNDS > max(left_s, 0.0):
        most_expensive = max(costs, key=lambda config: costs[config])
        if costs[most_expensive] <= VISIT_S:  # nothing left that is worth leaving out
            break
        cost = costs.pop(most_expensive)
        untimed[most_expensive] = f"{cost:.1f} s a run is more than the timing budget has left; raise --budget"
    if not costs:
        return LEAST_ROUNDS
    return max(LEAST_ROUNDS, int(min(rounds, left_s / round_s())))


def _summary(steps: int, visits: Sequence[Visit], pit: Sequence[Visit] | None) -> CellTiming:
    calls = [visit.call_s for visit in visits if not math.isnan(visit.call_s)]
    # The k-th visit of each is that of round k, so that both sides of a ratio saw the same machine.
    rounds = list(zip(visits, pit, strict=True)) if pit else []
    return CellTiming(
        steps=steps,
        rounds=len(visits),
        advance_s=spread([visit.advance_s for visit in visits]),
        prepare_s=spread([visit.prepare_s for visit in visits]),
        whole_s=spread([visit.whole_s for visit in visits]),
        call_s=statistics.median(calls) if calls else math.nan,
        empty_s=spread([visit.empty_s for visit in visits]),
        net_s=spread([visit.net_s for visit in visits]),
        ratio=spread([own.advance_s / base.advance_s for own, base in rounds]) if rounds else None,
        whole_ratio=spread([own.whole_s / base.whole_s for own, base in rounds]) if rounds else None,
    )
