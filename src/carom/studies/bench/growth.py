"""Growth bench: measures run time and memory for more and more discs, with and without gravity, and fits power laws."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

from carom.engines.api import unsupported_reason
from carom.engines.registry import load_adapter
from carom.execution.adapter_profile import capabilities_of
from carom.execution.cache_key import find_versions
from carom.execution.describe_engines import describe_engines, select_engines
from carom.execution.environment import Environment, describe_environment, measure_resident_bytes
from carom.execution.job import Answer, Method, Progress, Status, UnsupportedError, no_progress
from carom.execution.journal import Journal, JournalEntry, MemoryJournal
from carom.execution.scheduler import TaskRequest, run_tasks
from carom.execution.timing import time_run
from carom.studies.bench.convergence import fit_power
from carom.studies.bench.gas import build_gas_scene
from carom.studies.bench.options import BenchPlan
from carom.studies.bench.own_methods import add_own_methods, list_own_methods
from carom.studies.bench.result import MethodResult
from carom.support import formatting

#: Numbers of discs for engines, and for Carom's own methods.
SIZES = (10, 100, 300, 1_000, 3_000, 10_000)
OWN_SIZES = (*SIZES, 30_000, 100_000)

#: Fraction of the box's area that the discs cover. Every disc has room to move, and most discs meet another disc within
#: a second.
PACKING = 0.3
DT_S = 1 / 240
#: Number of steps of a run: one simulated second. In less simulated time, only a few of a hundred discs would have an
#: impact.
STEPS = 240

#: Smallest number of discs in a fit. With fewer discs, fixed costs hide the growth.
FIT_FROM = 100

#: A run is repeated until all repeats together have taken `SHORT_S` seconds, but at most `REPEATS` times. The result is
#: the median.
SHORT_S = 0.5
REPEATS = 15

#: Largest number of discs in the warm-up before a run.
WARM = 1_000

#: Approximate time to start a process and to build the scene in it, in seconds.
START_S = 2.0


@dataclass(frozen=True)
class GrowthPoint:
    """Results for one number of discs.

    Attributes:
        discs: Number of discs.
        prepare_s: Seconds to build the world; NaN if the gas was not run.
        advance_s: Seconds for all steps; NaN if the gas was not run.
        memory_bytes: Peak memory of the process minus its memory before the world was built; NaN if the gas was not
            run.
        peak_bytes: Peak memory of the process; NaN if the gas was not run.
        ratio: `advance_s` divided by that of PIT with the same number of discs. NaN if the two run times were not
            measured in one session of the bench.
        reason: Reason why the gas was not run; empty if it was run.
        bench_start: Start time (UTC) of the bench that ran the gas; empty if the gas was not run. Only run times with
            the same start time are comparable.
    """

    discs: int
    prepare_s: float = math.nan
    advance_s: float = math.nan
    memory_bytes: float = math.nan
    peak_bytes: float = math.nan
    ratio: float = math.nan
    reason: str = ""
    bench_start: str = ""


@dataclass(frozen=True)
class GrowthTask:
    """Task that runs a gas of discs. Each task has a new worker process, so that nothing else affects the memory."""

    discs: int
    method: Method
    bench_start: str = ""
    gravity: bool = False

    @property
    def engine(self) -> str:
        """Name of the adapter."""
        return self.method.engine

    def carry_out(self) -> GrowthPoint:
        """Run the gas, and return the run time and the memory.

        Raises:
            UnsupportedError: The method does not support a feature of the gas.
        """
        gas = partial(build_gas_scene, packing=PACKING, duration_s=STEPS * DT_S, gravity=self.gravity)
        scene = gas(self.discs)
        adapter = load_adapter(self.engine)
        profile = self.method.profile
        reason = unsupported_reason(scene, capabilities_of(adapter, profile), DT_S)
        if reason:
            raise UnsupportedError(reason)
        # Warm up, so that the memory of importing an engine is not counted.
        small = scene if self.discs <= WARM else gas(WARM)
        time_run(adapter, small, profile, DT_S, steps=1, runs=1, zero=True)
        before = measure_resident_bytes() or 0
        timing = time_run(adapter, scene, profile, DT_S, steps=STEPS, runs=REPEATS, enough_s=SHORT_S)
        peak = float(measure_resident_bytes("VmHWM") or 0)
        memory = max(0.0, peak - before)
        return GrowthPoint(self.discs, timing.prepare_s, timing.advance_s, memory, peak, bench_start=self.bench_start)


@dataclass(frozen=True)
class GrowthKey:
    """Key of a run in the journal. Runs with equal keys ran the same gas on the same machine with the same versions.

    Attributes:
        discs: Number of discs.
        method: Engine and profile.
        versions: Names and versions of all packages that affect run time or memory.
        machine: See `carom.execution.environment.Environment.machine`.
        gravity: Whether the discs fall.
        steps: Number of steps.
    """

    discs: int
    method: Method
    versions: tuple[tuple[str, str], ...]
    machine: tuple[str, str, int]
    gravity: bool
    steps: int


#: Function that opens the journal of a growth bench.
growth_journal = partial(Journal[GrowthKey, GrowthPoint], "growth", JournalEntry[GrowthKey, GrowthPoint])


@dataclass(frozen=True)
class GrowthCurve(MethodResult):
    """Results of one engine and profile for all numbers of discs, with or without gravity.

    Attributes:
        points: Points, ordered by the number of discs.
        time_exponent: Exponent of the power law of run time against the number of discs, and its confidence interval:
            (exponent, low, high).
        memory_exponent: Exponent of memory against the number of discs, and its confidence interval.
        gravity: Whether the discs fall.
    """

    points: tuple[GrowthPoint, ...]
    time_exponent: tuple[float, float, float]
    memory_exponent: tuple[float, float, float]
    gravity: bool = False

    @property
    def ran(self) -> list[GrowthPoint]:
        """The points with results."""
        return [point for point in self.points if not point.reason]


@dataclass(frozen=True)
class Growth:
    """Result of a growth bench.

    Attributes:
        curves: Two curves per engine: without and with gravity.
        environment: Description of the machine, and versions of packages.
        budget_s: Time limit for all runs of each gas, in seconds.
        command: The command that repeats the bench.
        elapsed_s: Duration of the whole study, in seconds.
    """

    curves: tuple[GrowthCurve, ...]
    environment: Environment
    budget_s: float
    command: str
    elapsed_s: float


def measure_growth(
    plan: BenchPlan,
    *,
    notes: MemoryJournal[GrowthKey, GrowthPoint] | None = None,
    progress: Progress = no_progress,
    command: str = "",
) -> Growth:
    """Run gases with more and more discs, with and without gravity, until the time limit is reached.

    Args:
        plan: Options of the bench. Engines run with the last of its profiles, and PIC and PIT run with fixed profiles
            unless they are requested by name.
        notes: Journal of finished runs, to which new runs are added. Runs that were omitted for lack of time are tried
            again.
        progress: Function that is called with the number of finished runs, the number of all runs, and a description.
        command: The command that the report shows.

    Raises:
        UnknownNameError: An engine does not exist.
    """
    budget_s = plan.budget_s
    with plan.open_local_pool(1) as pool:
        infos = select_engines(describe_engines(plan.engines, pool), plan.engines)
        infos = add_own_methods(infos, plan, pool)
        own_methods = list_own_methods(plan)  # PIC and PIT do not use the requested profile
        methods = {info.name: own_methods.get(info.name, Method(info.name, plan.profiles[-1])) for info in infos}
        environment = describe_environment(infos)
        planned_runs = [
            (size, gravity, info)
            for size in sorted(set(plan.sizes or OWN_SIZES))
            for gravity in (False, True)
            for info in infos
            if plan.sizes or size <= SIZES[-1] or info.engine == "Carom"
        ]
        started = time.perf_counter()
        points: dict[tuple[str, bool], list[GrowthPoint]] = {(i.name, gravity): [] for _, gravity, i in planned_runs}
        spent = dict.fromkeys(points, 0.0)
        for done, (size, gravity, info) in enumerate(planned_runs):
            before = time.perf_counter()
            curve = (info.name, gravity)
            remaining_s = 2 * budget_s - (before - started)
            waiting_curves = {(one.name, falls) for _, falls, one in planned_runs[done:]}
            # If the last run of a curve failed, no time is reserved for this curve.
            time_shares_s = {
                key: max(0.0, 2 * budget_s / len(points) - spent[key])
                for key in waiting_curves
                if not (points[key] and points[key][-1].reason)
            }
            # A run may use its curve's share of the time or, if this is longer, the time that is not reserved for other
            # curves.
            own_share_s = time_shares_s.pop(curve, 0.0)
            available_s = min(remaining_s, max(own_share_s, remaining_s - sum(time_shares_s.values())))
            description = f"{size} {'falling ' if gravity else ''}discs on {info.name}"
            progress(done, len(planned_runs), f"{description}{formatting.format_time_left(remaining_s)}")
            curve_points, method = points[curve], methods[info.name]
            key = GrowthKey(size, method, find_versions(info.name), environment.machine, gravity, STEPS)
            reason = info.unavailable or _find_skip_reason(curve_points, size, min(available_s, plan.time_limit_s))
            refused = Answer[GrowthPoint](Status.UNSUPPORTED, reason) if reason else None
            pool.renew()
            request = TaskRequest(size, key, GrowthTask(size, method, environment.date, gravity), refused)
            ((_, answer),) = run_tasks([request], pool, notes, one_at_a_time=True)
            spent[curve] += time.perf_counter() - before
            has_begun = answer.status in {Status.CRASHED, Status.TIMED_OUT}
            failed = GrowthPoint(size, reason=answer.problem if has_begun else answer.reason)
            curve_points.append(answer.value or failed)
    curves = []
    for (name, gravity), curve_points in points.items():
        pit = {(point.discs, point.bench_start): point.advance_s for point in points.get(("pit", gravity), ())}
        curves.append(_build_curve(methods[name], gravity, curve_points, pit))
    elapsed_s = time.perf_counter() - started
    return Growth(tuple(curves), environment, budget_s, command, elapsed_s)


def _find_skip_reason(curve_points: Sequence[GrowthPoint], size: int, allowed_s: float) -> str:
    """Return the reason to omit a run, derived from runs with fewer discs; empty if the run may be tried."""
    if allowed_s <= 0:
        return "its share of the budget was used up; raise --budget"
    if curve_points and curve_points[-1].reason:  # a method that failed with fewer discs also fails with more discs
        first = next(point for point in curve_points if point.reason)
        return f"failed with {first.discs} discs"
    if len(curve_points) < 2:
        return ""
    before, last = curve_points[-2:]
    spent, earlier = (point.advance_s + point.prepare_s for point in (last, before))
    # Fixed costs can hide growth with few discs. Therefore the run time is expected to grow at least in proportion to
    # the number of discs.
    exponent = max(1.0, math.log(spent / earlier) / math.log(last.discs / before.discs))
    expected_s = spent * (size / last.discs) ** exponent
    if expected_s + START_S <= allowed_s:
        return ""
    expected = f"it would take about {expected_s:.0f} s according to the run with {last.discs} discs"
    return f"{expected}, and only {allowed_s:.0f} s are left; raise --budget or --time-limit"


def select_same_method(points: Sequence[GrowthPoint]) -> list[GrowthPoint]:
    """Return the points from the last decrease of the run time onwards, which were all computed by the same algorithm.

    If the run time decreases with more discs, the engine has changed its algorithm. For example, PIC solves two discs
    by a closed form. One power law can't describe the run times of two algorithms.
    """
    falls = [k for k in range(1, len(points)) if points[k].advance_s < points[k - 1].advance_s]
    return list(points[falls[-1] if falls else 0 :])


def _build_curve(
    method: Method, gravity: bool, points: Sequence[GrowthPoint], pit: dict[tuple[int, str], float]
) -> GrowthCurve:
    pit_s = [pit.get((point.discs, point.bench_start), math.nan) for point in points]
    rated_points = tuple(replace(point, ratio=point.advance_s / of) for point, of in zip(points, pit_s, strict=True))
    fitted = select_same_method([point for point in rated_points if not point.reason and point.discs >= FIT_FROM])
    time_exponent = fit_power([point.discs for point in fitted], [point.advance_s for point in fitted])[:3]
    with_memory = [point for point in fitted if point.memory_bytes > 0]
    memory_exponent = fit_power([p.discs for p in with_memory], [p.memory_bytes for p in with_memory])[:3]
    return GrowthCurve(method.engine, method.profile, rated_points, time_exponent, memory_exponent, gravity)
