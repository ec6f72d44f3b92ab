"""Cost as work grows: run time and memory against the number of discs, on one gas, with the fitted exponents."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

from carom.adapter import unsupported_reason
from carom.registry import load_adapter
from carom.runs.desk import Ask, answers
from carom.runs.engines import described, to_run
from carom.runs.environment import Environment, environment, resident_bytes
from carom.runs.job import Answer, Method, Progress, Status, UnsupportedError, unheard
from carom.runs.journal import Entry, Journal, Notes
from carom.runs.keys import versions_of
from carom.runs.observe import capabilities_of
from carom.runs.timing import Timing, time_run
from carom.studies.bench.convergence import fit_power
from carom.studies.bench.gas import gas_scene
from carom.studies.bench.options import GrowthOptions

#: Numbers of discs; engines go to the last of the first row, Carom's own methods to the last of the second.
SIZES = (2, 10, 30, 100, 300, 1_000, 3_000, 10_000)
OWN_SIZES = (*SIZES, 30_000, 100_000)

#: A gas as thin as this has room for every disc to move, and as dense that most meet another within a second.
PACKING = 0.3
DT_S = 1 / 240
STEPS = 30

#: Below this many discs what is fixed (a call, a box, the walls) hides how cost grows with their number.
FIT_FROM = 100

#: A run that is shorter than this is repeated, and the median taken.
SHORT_S = 0.5
REPEATS = 3

#: A warm-up has no more discs than this.
WARM = 1_000

#: Starting a process and building the scene in it take about this long, without the run itself.
START_S = 2.0


@dataclass(frozen=True)
class Grown:
    """What one run took.

    Attributes:
        timing: Its clocks.
        before_bytes: Bytes that the process held before there was a world.
        peak_bytes: The most that it ever held.
        sitting: When the bench began that ran it, UTC.
    """

    timing: Timing
    before_bytes: int
    peak_bytes: int
    sitting: str


@dataclass(frozen=True)
class GrowthTask:
    """Run a gas of this many discs in a worker process of its own, whose memory nothing else has touched."""

    discs: int
    method: Method
    sitting: str = ""

    @property
    def engine(self) -> str:
        """Name of the adapter."""
        return self.method.engine

    def carry_out(self) -> Grown:
        """Return what it took.

        Raises:
            UnsupportedError: The method does not support such a gas.
        """
        scene = gas_scene(self.discs, PACKING, duration_s=STEPS * DT_S)
        adapter = load_adapter(self.engine)
        profile = self.method.profile
        reason = unsupported_reason(scene, capabilities_of(adapter, profile), DT_S)
        if reason:
            raise UnsupportedError(reason)
        # What importing an engine takes is no part of a world.
        small = scene if self.discs <= WARM else gas_scene(WARM, PACKING, duration_s=STEPS * DT_S)
        time_run(adapter, small, profile, DT_S, steps=1, runs=1, zero=True)
        before = resident_bytes() or 0
        timing = time_run(adapter, scene, profile, DT_S, steps=STEPS, runs=REPEATS, enough_s=SHORT_S)
        return Grown(timing, before, resident_bytes("VmHWM") or 0, self.sitting)


@dataclass(frozen=True)
class GrowthKey:
    """What tells a run from all others: only on this machine, with these versions, is it the same.

    Attributes:
        discs: How many.
        method: Engine and profile.
        versions: Name and version of all that its cost depends on.
        machine: See `carom.runs.environment.Environment.machine`.
    """

    discs: int
    method: Method
    versions: tuple[tuple[str, str], ...]
    machine: tuple[str, str, int]


#: Opens the journal of a growth bench.
growth_journal = partial(Journal[GrowthKey, Grown], "growth", Entry[GrowthKey, Grown])


@dataclass(frozen=True)
class GrowthPoint:
    """One number of discs.

    Attributes:
        discs: How many.
        prepare_s: Seconds to build the world; NaN where it was not run.
        advance_s: Seconds for all steps; NaN where it was not run.
        memory_bytes: What the process grew by at most, over what it held before there was a world; NaN likewise.
        peak_bytes: The most that the process ever held; NaN likewise.
        ratio: `advance_s` over PIT's with as many discs; NaN where they were not both run in one sitting.
        reason: Why it was not run, empty where it was.
        sitting: When the bench began that ran it, UTC; empty where it was not run.
    """

    discs: int
    prepare_s: float
    advance_s: float
    memory_bytes: float
    peak_bytes: float
    ratio: float = math.nan
    reason: str = ""
    sitting: str = ""


@dataclass(frozen=True)
class GrowthCurve:
    """All numbers of discs of one engine's profile.

    Attributes:
        engine: Name of the adapter.
        profile: Name of the profile.
        points: From few discs to many.
        time_exponent: Of run time against the number of discs, with its interval: (exponent, low, high).
        memory_exponent: The same of memory.
    """

    engine: str
    profile: str
    points: tuple[GrowthPoint, ...]
    time_exponent: tuple[float, float, float]
    memory_exponent: tuple[float, float, float]


@dataclass(frozen=True)
class Growth:
    """A finished growth bench.

    Attributes:
        curves: One entry an engine.
        environment: Machine and versions.
        budget_s: Seconds that it was allowed.
        command: The command that makes this again.
        elapsed_s: Seconds that it took.
    """

    curves: tuple[GrowthCurve, ...]
    environment: Environment
    budget_s: float
    command: str
    elapsed_s: float


def growth(
    options: GrowthOptions,
    *,
    notes: Notes[GrowthKey, Grown] | None = None,
    progress: Progress = unheard,
    command: str = "",
) -> Growth:
    """Run a gas of more and more discs, one process a run and one run at a time, until the budget is used up.

    Args:
        options: What is asked for.
        notes: What was run already, and where more of it goes; what was left out for want of time is tried again.
        progress: Called with (done, all, what).
        command: The command line to print.

    Raises:
        UnknownNameError: There is no such engine.
    """
    engine_names, profile, sizes, budget_s = options.engines, options.profile, options.sizes, options.budget_s
    notes = Notes[GrowthKey, Grown]() if notes is None else notes
    with options.pool(1) as pool:
        infos = to_run(described(engine_names, pool), engine_names)
        here = environment(infos)
        wanted = [
            (size, info)
            for size in sorted(set(sizes or OWN_SIZES))
            for info in infos
            if sizes or size <= SIZES[-1] or info.engine == "Carom"
        ]
        started = time.perf_counter()
        points: dict[str, list[GrowthPoint]] = {info.name: [] for info in infos}
        spent = dict.fromkeys(points, 0.0)
        for done, (size, info) in enumerate(wanted):
            progress(done, len(wanted), f"{size} discs on {info.name}")
            own, method, before = points[info.name], Method(info.name, profile), time.perf_counter()
            key = GrowthKey(size, method, versions_of(info.name), here.machine)
            # No engine lives at the cost of another: each has its share of the budget.
            left_s = min(budget_s - (before - started), budget_s / len(infos) - spent[info.name])
            reason = info.unavailable or _too_long(own, size, min(left_s, options.time_limit_s), left_s)
            refused = Answer[Grown](Status.UNSUPPORTED, reason) if reason else None
            pool.renew()
            ask = Ask(size, key, GrowthTask(size, method, here.date), refused)
            ((_, answer),) = answers([ask], pool, notes, alone=True)
            spent[info.name] += time.perf_counter() - before
            own.append(_point(size, answer))
    pit = {(point.discs, point.sitting): point.advance_s for point in points.get("pit", ())}
    curves = tuple(_curve(name, profile, own, pit) for name, own in points.items())
    elapsed_s = time.perf_counter() - started
    return Growth(curves, here, budget_s, command, elapsed_s)


def _too_long(own: Sequence[GrowthPoint], size: int, allowed_s: float, left_s: float) -> str:
    """Return why a run is left out, judged by the ones before it; empty where it may be tried."""
    if left_s <= 0:
        return "its share of the budget was used up; raise --budget"
    if own and own[-1].reason:  # what fewer discs could not do, more can't
        first = next(point for point in own if point.reason)
        return f"as for {first.discs} discs"
    ran = [point for point in own if not point.reason]
    if len(ran) < 2:
        return ""
    last, before = ran[-1], ran[-2]
    spent, earlier = (point.advance_s + point.prepare_s for point in (last, before))
    # Cost that grew less than in proportion was fixed cost; it will grow at least in proportion from here.
    exponent = max(1.0, math.log(spent / earlier) / math.log(last.discs / before.discs))
    expected_s = spent * (size / last.discs) ** exponent
    if expected_s + START_S <= allowed_s:
        return ""
    left = f"{max(allowed_s, 0):.0f} s are left"
    return f"about {expected_s:.0f} s, judged by {last.discs} discs, and {left}; raise --budget or --time-limit"


def _point(discs: int, answer: Answer[Grown]) -> GrowthPoint:
    grown = answer.value
    if grown is None:
        started = answer.status in {Status.CRASHED, Status.TIMED_OUT}
        return GrowthPoint(
            discs, math.nan, math.nan, math.nan, math.nan, reason=answer.said if started else answer.reason
        )
    memory, peak = float(max(0, grown.peak_bytes - grown.before_bytes)), float(grown.peak_bytes)
    return GrowthPoint(discs, grown.timing.prepare_s, grown.timing.advance_s, memory, peak, sitting=grown.sitting)


def same_method(points: Sequence[GrowthPoint]) -> list[GrowthPoint]:
    """Return the points from the last one that cost less than the one before it.

    More discs are more work, so there the method has changed (PIC solves two discs by a closed form), and a power law
    through both methods would be one of neither.
    """
    falls = [k for k in range(1, len(points)) if points[k].advance_s < points[k - 1].advance_s]
    return list(points[falls[-1] if falls else 0 :])


def _curve(engine: str, profile: str, points: Sequence[GrowthPoint], pit: dict[tuple[int, str], float]) -> GrowthCurve:
    held = tuple(
        replace(point, ratio=point.advance_s / pit.get((point.discs, point.sitting), math.nan)) for point in points
    )
    fitted = same_method([point for point in held if not point.reason and point.discs >= FIT_FROM])
    sizes = [float(point.discs) for point in fitted]
    time_exponent = fit_power(sizes, [point.advance_s for point in fitted])[:3]
    with_memory = [point for point in fitted if point.memory_bytes > 0]
    memory_exponent = fit_power([float(p.discs) for p in with_memory], [p.memory_bytes for p in with_memory])[:3]
    return GrowthCurve(engine, profile, held, time_exponent, memory_exponent)
