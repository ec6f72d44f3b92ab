"""Timing pass: measures run times, one run at a time, in several rounds of random order.

The most important time is the time of all steps, which run in as few calls as the adapter allows. The construction of
the engine's world is timed separately. Two more times show costs that do not depend on the scene: the time of a Python
call without a step, and the time of the same number of steps in a world without impacts. Each time is only compared
with other times of the same round. To measure the machine's noise, the same fixed work is timed between the runs.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from carom.engines.registry import load_adapter
from carom.execution.cache_key import compute_scene_hash, find_versions
from carom.execution.environment import describe_environment
from carom.execution.job import PIT_METHOD, Answer, Method, Progress, Status, no_progress
from carom.execution.journal import Journal, JournalEntry
from carom.execution.pool import TaskRunner
from carom.execution.scheduler import DependentTasks
from carom.execution.timing import time_run
from carom.model.scene import Disc, Scene
from carom.studies.bench.machine_noise import Noise, NoiseProbe, Spread, compute_spread
from carom.studies.bench.options import LEAST_ROUNDS
from carom.support import formatting
from carom.support.formatting import format_seconds

#: A short run is repeated for `VISIT_S` seconds, but at most `MOST_REPEATS` times, to reduce effects of the clock and
#: of caches.
VISIT_S = 5e-3
MOST_REPEATS = 50

#: Number of steps for which a world without impacts is timed. More steps do not change the time per step.
EMPTY_STEPS = 1000

#: A method and a step size in seconds.
At = tuple[Method, float]


@dataclass(frozen=True)
class Visit:
    """Times of one method with one step size in one round. Each time is a median over repeated runs, in seconds.

    Attributes:
        prepare_s: Time to build the world.
        advance_s: Time of all steps.
        call_s: Time of a call with no steps; NaN if the adapter does not accept such a call.
        empty_s: Time of the same number of steps of a world with one disc at rest, without the time of the call.
    """

    prepare_s: float
    advance_s: float
    call_s: float
    empty_s: float

    @property
    def whole_s(self) -> float:
        """Run time including preparation."""
        return self.prepare_s + self.advance_s

    @property
    def net_s(self) -> float:
        """Time of all steps, minus `call_s` and `empty_s`."""
        return self.advance_s - self.empty_s - (0.0 if math.isnan(self.call_s) else self.call_s)


@dataclass(frozen=True)
class VisitTask:
    """Task that times a scene with one method and step size.

    Attributes:
        scene: The scene.
        at: The method and the step size.
        repeats: Number of runs, each in a new world.
    """

    scene: Scene
    at: At
    repeats: int = 1

    @property
    def engine(self) -> str:
        """Name of the adapter."""
        return self.at[0].engine

    def carry_out(self) -> Visit:
        """Run the scene repeatedly, and return the median times."""
        method, dt_s = self.at
        adapter = load_adapter(method.engine)
        steps = self.scene.step_count(dt_s)
        empty_steps = min(steps, EMPTY_STEPS)
        full = time_run(adapter, self.scene, method.profile, dt_s, runs=self.repeats, call=True)
        # The empty world has one disc at rest and no wall.
        disc = Disc(position_m=(0.0, 0.0), radius_m=max(disc.radius_m for disc in self.scene.discs))
        nothing = Scene(name="empty", discs=[disc], duration_s=self.scene.duration_s)
        runs = min(self.repeats, 5)
        empty = time_run(adapter, nothing, method.profile, dt_s, steps=empty_steps, runs=runs, zero=True)
        paid_s = 0.0 if math.isnan(full.call_s) else full.call_s
        empty_s = max(0.0, empty.advance_s - paid_s) * steps / empty_steps
        return Visit(full.prepare_s, full.advance_s, full.call_s, empty_s)


@dataclass(frozen=True)
class CellTiming:
    """Times of one method with one step size over all rounds, in seconds.

    Attributes:
        steps: Number of steps of the run.
        rounds: Number of rounds.
        advance_s: Time of all steps.
        prepare_s: Time to build the world.
        whole_s: The sum of `advance_s` and `prepare_s`.
        call_s: The part of `advance_s` that Python's call into the world takes, measured by a call of zero steps; NaN
            if the adapter does not accept a call of zero steps.
        empty_s: The part of `advance_s` that steps take without any impact, measured by the same number of steps of a
            world with one disc at rest.
        net_s: `advance_s` minus `call_s` and `empty_s`.
        ratio: `advance_s` divided by that of PIT with the same step size in the same round; None if PIT was not timed.
        whole_ratio: `whole_s` divided by that of PIT with the same step size in the same round; None if PIT was not
            timed.
        ratios: For each round, `advance_s` divided by that of PIT; empty if PIT was not timed.
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
    ratios: tuple[float, ...] = ()


@dataclass(frozen=True)
class TimingKey:
    """Key of a scene's timing pass in the journal.

    Passes with equal keys have the same machine, versions and random order.

    Attributes:
        scene: Name of the scene, for readers.
        scene_sha256: Hash of the scene.
        requested: Timed methods and step sizes, in order.
        versions: Versions of the engines and of all packages that affect their numbers.
        machine: See `carom.execution.environment.Environment.machine`.
        seed: Seed of the random order of runs in a round.
    """

    scene: str
    scene_sha256: str
    requested: tuple[At, ...]
    versions: tuple[tuple[str, tuple[tuple[str, str], ...]], ...]
    machine: tuple[str, str, int]
    seed: int


@dataclass(frozen=True)
class SceneTiming:
    """Result of a scene's timing pass.

    Attributes:
        date: Time of the pass, UTC.
        timings: Timings by method and step size.
        untimed: Reasons why methods and step sizes were not timed.
        rounds: Number of rounds.
        noise: Spread of the run times of fixed work during the pass.
    """

    date: str
    timings: tuple[tuple[At, CellTiming], ...]
    untimed: tuple[tuple[At, str], ...]
    rounds: int
    noise: Noise

    @property
    def cut_off(self) -> bool:
        """Whether some methods or step sizes were not timed, so that a repeated pass may time them."""
        return bool(self.untimed)


def build_timing_key(scene: Scene, method_steps: Iterable[At], seed: int) -> TimingKey:
    """Return the key of a timing on this machine."""
    ordered = tuple(sorted(method_steps))
    engines = sorted({method.engine for method, _ in ordered})
    versions = tuple((engine, find_versions(engine)) for engine in engines)
    return TimingKey(scene.name, compute_scene_hash(scene), ordered, versions, describe_environment().machine, seed)


#: Function that opens the journal of a timing pass.
timing_journal = partial(Journal[TimingKey, SceneTiming], "timings", JournalEntry[TimingKey, SceneTiming])


@dataclass(frozen=True)
class TimeScene(DependentTasks[SceneTiming]):
    """Task that times a scene with several methods and step sizes. The caller ensures that nothing else is running.

    Each method first runs once with each step size to warm up. In each round, each method then runs with each step
    size, in random order. PIT is timed with each step size, even if it is not requested.

    Attributes:
        scene: The scene.
        requested: Methods and step sizes to time.
        rounds: Largest number of rounds. If the time is short, there are fewer rounds, but at least three.
        seed: Seed of the random order of runs in a round.
        budget_s: Time limit of the pass, in seconds. Methods that would take longer are omitted with a reason.
        progress: Function that is called with the number of finished runs, the number of all runs, and a description.
    """

    scene: Scene
    requested: tuple[At, ...]
    rounds: int = 7
    seed: int = 1
    budget_s: float = math.inf
    progress: Progress = no_progress

    @property
    def engine(self) -> str:
        """Name of the first adapter."""
        return PIT_METHOD.engine

    def run(self, runner: TaskRunner) -> Answer[SceneTiming]:
        """Return the measured times. Each engine has one worker process for all its runs."""
        scene, progress = self.scene, self.progress
        requested = set(self.requested)
        pit = {(PIT_METHOD, dt_s) for _, dt_s in requested}
        ordered = sorted(requested | pit, key=lambda at: (at[0] != PIT_METHOD, at[0], -at[1]))
        until_s = time.perf_counter() + self.budget_s
        probe = NoiseProbe()
        cells = [_Cell(at) for at in ordered]
        _warm_up(scene, cells, runner, self.budget_s, progress)
        rounds = _count_fitting_rounds(cells, self.rounds, until_s - time.perf_counter())
        warm = [cell for cell in cells if not cell.problem]
        draw = np.random.default_rng(self.seed)
        last_s = 0.0
        for turn in range(rounds):
            began = time.perf_counter()
            if turn >= LEAST_ROUNDS and began + last_s > until_s:
                rounds = turn  # stop early, because runs take longer than in the warm-up
                break
            for place, k in enumerate(draw.permutation(len(warm))):
                cell = warm[k]
                method, dt_s = cell.at
                if not cell.problem:
                    probe.take()
                    repeats = min(MOST_REPEATS, math.ceil(VISIT_S / cell.cost_s))
                    answer = runner.run(VisitTask(scene, cell.at, repeats))
                    cell.problem = answer.problem
                    if answer.value is not None:
                        cell.visits.append(answer.value)
                left = formatting.format_time_left(until_s - time.perf_counter())
                description = f"timing {scene.name} on {method.engine} at {formatting.format_step(dt_s)}{left}"
                progress(turn * len(warm) + place + 1, rounds * len(warm), description)
            last_s = time.perf_counter() - began
        probe.take()
        timed = {cell.at: cell.visits for cell in warm if not cell.problem}
        timings = tuple(
            (at, _summarise_visits(scene.step_count(at[1]), visits, timed.get((PIT_METHOD, at[1]))))
            for at, visits in timed.items()
            if at in requested
        )
        reasons = tuple((cell.at, cell.problem) for cell in cells if cell.problem and cell.at in requested)
        date = describe_environment().date
        return Answer(Status.RAN, value=SceneTiming(date, timings, reasons, rounds, probe.compute_noise()))


@dataclass(eq=False)
class _Cell:
    """State of the timing of one method with one step size.

    Attributes:
        at: The method and the step size.
        cost_s: Seconds of one run.
        problem: Reason why the method is not timed with this step size; empty if it is timed.
        visits: Times of the finished rounds.
    """

    at: At
    cost_s: float = math.nan
    problem: str = ""
    visits: list[Visit] = field(default_factory=list)


def _warm_up(scene: Scene, cells: Sequence[_Cell], runner: TaskRunner, budget_s: float, progress: Progress) -> None:
    """Measure how long one run of each cell takes, or store the reason why the cell was not run."""
    last: dict[Method, _Cell] = {}
    for k, cell in enumerate(cells):
        method, dt_s = cell.at
        if method in last:
            coarser = last[method]
            expected_s = coarser.cost_s * coarser.at[1] / dt_s * LEAST_ROUNDS
            # Omit a method that alone would use more than a quarter of the time limit.
            if expected_s > budget_s / 4:
                budget = f"a budget of {budget_s:.0f} s for this scene; raise --budget"
                cell.problem = f"its {LEAST_ROUNDS} rounds would take about {expected_s:.0f} s of {budget}"
                continue
        else:
            runner.run(VisitTask(scene, cell.at))
        answer: Answer[Visit] = runner.run(VisitTask(scene, cell.at))
        cell.problem = answer.problem
        if answer.value is not None:
            empty_part = min(1.0, EMPTY_STEPS / scene.step_count(dt_s))
            cell.cost_s = answer.value.whole_s + answer.value.empty_s * empty_part
            last[method] = cell
            progress(k + 1, len(cells), f"warming up {method.engine}")


def _count_fitting_rounds(cells: Sequence[_Cell], rounds: int, left_s: float) -> int:
    """Return the number of rounds that fit into the remaining time.

    If even the smallest number of rounds would take too long, the slowest cells are omitted.
    """
    fitting = sorted((cell for cell in cells if not cell.problem), key=lambda cell: cell.cost_s)
    round_s = sum(max(cell.cost_s, VISIT_S) for cell in fitting)
    # A cell that takes at most `VISIT_S` is never omitted.
    while fitting and round_s * LEAST_ROUNDS > max(left_s, 0.0) and fitting[-1].cost_s > VISIT_S:
        slowest = fitting.pop()
        takes = f"a run takes {format_seconds(slowest.cost_s)}"
        slowest.problem = f"{takes}, more than the rest of the timing budget; raise --budget"
        round_s -= slowest.cost_s
    return max(LEAST_ROUNDS, int(min(rounds, left_s / round_s))) if fitting else LEAST_ROUNDS


def _summarise_visits(steps: int, visits: Sequence[Visit], pit: Sequence[Visit] | None) -> CellTiming:
    calls = [visit.call_s for visit in visits if not math.isnan(visit.call_s)]
    # The k-th runs of all methods are in round k, so run times are divided by PIT's of the same round.
    rounds = list(zip(visits, pit, strict=True)) if pit else []
    ratios = tuple(own_visit.advance_s / base.advance_s for own_visit, base in rounds)
    whole_ratios = [own_visit.whole_s / base.whole_s for own_visit, base in rounds]
    return CellTiming(
        steps=steps,
        rounds=len(visits),
        advance_s=compute_spread([visit.advance_s for visit in visits]),
        prepare_s=compute_spread([visit.prepare_s for visit in visits]),
        whole_s=compute_spread([visit.whole_s for visit in visits]),
        call_s=statistics.median(calls) if calls else math.nan,
        empty_s=compute_spread([visit.empty_s for visit in visits]),
        net_s=compute_spread([visit.net_s for visit in visits]),
        ratio=compute_spread(list(ratios)) if ratios else None,
        whole_ratio=compute_spread(whole_ratios) if whole_ratios else None,
        ratios=ratios,
    )
