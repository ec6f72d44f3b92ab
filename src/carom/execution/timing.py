"""The timed loop: all steps in as few calls as the adapter allows, nothing observed, each run in a fresh world.

Two clocks, for preparing the world and for its steps. How engines are compared by them is the bench's business; here is
the one loop that everything which times an engine runs.
"""

from __future__ import annotations

import gc
import math
import statistics
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from carom.engines.api import Adapter, TimedWorld, World
from carom.engines.registry import load_adapter
from carom.execution.engine_run import profile_settings
from carom.execution.job import JobTask, SettingOverrides, UnsupportedError
from carom.execution.locate import Cutter
from carom.execution.validate import adapter_error
from carom.model.scene import Scene

#: Timed runs of a job; the median of three throws one disturbed run away.
TIMING_RUNS = 3

#: Two runs in a row that differ by less than this part are enough: finer than this nobody reads a ratio of run times.
AGREED = 0.1


_TOO_SHORT = (
    "too short to time: the clock shows 0 s for {steps} steps, the median of {runs} runs; a program's clock should "
    "tell microseconds apart (docs/reference/engine-protocol.md)"
)


@dataclass(frozen=True)
class Timing:
    """Two clocks, each the median of several runs.

    Attributes:
        prepare_s: Seconds to build the world.
        advance_s: Seconds to take all steps, nothing observed.
        runs: How many runs the medians are of.
        call_s: Seconds of a call of no steps, where that was asked for; NaN where the adapter does not take one.
        ends: In how many final states the runs ended that differ in a bit: 1 where the engine repeats. None from a file
            that was written before they were counted.
    """

    prepare_s: float
    advance_s: float
    runs: int
    call_s: float = math.nan
    ends: int | None = None


@dataclass(frozen=True)
class TimeTask(JobTask):
    """Time a job, in a worker process; the caller sees to it that nothing else is running."""

    def carry_out(self) -> Timing:
        """Return the two clocks."""
        job = self.job
        adapter = load_adapter(job.engine)
        return time_run(adapter, job.scene, job.profile, job.dt_s, tried=job.method.tried, agreed=AGREED)


def time_run(
    adapter: Adapter,
    scene: Scene,
    profile: str,
    dt_s: float,
    *,
    tried: SettingOverrides = (),
    steps: int | None = None,
    runs: int = TIMING_RUNS,
    enough_s: float = math.inf,
    agreed: float = 0.0,
    call: bool = False,
    zero: bool = False,
) -> Timing:
    """Time the steps alone, each run in a fresh world.

    Args:
        adapter: The adapter.
        scene: The scene.
        profile: Name of the profile.
        dt_s: The step, seconds.
        tried: Settings instead of the profile's own.
        steps: How many; as many as the scene lasts by default.
        runs: How many runs the medians are of, one at least.
        enough_s: No further run is made once this many seconds have been timed.
        agreed: No further run is made once the times of two in a row differ by less than this part.
        call: Whether to time a call of no steps, too; it is made before the steps, and no part of them.
        zero: Whether the clock may show no time: what is timed is next to nothing, and its cost is taken off.

    Raises:
        UnknownNameError: The adapter has no such profile.
        AdapterError: The adapter refuses the scene or fails, or its clock shows what no clock can.
        UnsupportedError: The clock shows no time at all: it is too coarse for a run so short.
    """
    settings = profile_settings(adapter, profile, dt_s, tried)
    steps = scene.step_count(dt_s) if steps is None else steps
    located = adapter.profiles[profile].located
    prepared: list[float] = []
    called: list[float] = []
    advanced: list[float] = []
    ends: set[bytes] = set()
    with _no_collection():
        while not advanced or (
            len(advanced) < runs and sum(prepared) + sum(advanced) < enough_s and not _agree(advanced, agreed)
        ):
            started = time.perf_counter()
            world = adapter.prepare(scene, settings)
            prepared.append(time.perf_counter() - started)
            try:
                called.append(_call(world) if call else math.nan)
                advanced.append(_advance(world, steps, dt_s, located=located))
                ends.add(_end(world))
            finally:
                world.close()
    call_s = math.nan if any(map(math.isnan, called)) else statistics.median(called)
    if not (zero or statistics.median(advanced) > 0.0):  # no ratio, and no sum of visits, can be made of it
        raise UnsupportedError(_TOO_SHORT.format(steps=steps, runs=len(advanced)))
    return Timing(statistics.median(prepared), statistics.median(advanced), len(advanced), call_s, len(ends))


def _agree(seconds: list[float], part: float) -> bool:
    """Whether the last two of some times differ by less than a part of the longer."""
    *_, one, other = (math.nan, *seconds)
    return abs(one - other) < part * max(one, other)


def _advance(world: World, steps: int, dt_s: float, *, located: bool) -> float:
    """Take steps, and return the seconds that it took, by the world's own clock where it has one."""
    own_s = world.seconds if isinstance(world, TimedWorld) else 0.0
    started = time.perf_counter()
    if located:  # cutting is then a part of what the engine is asked to do
        _cut_steps(world, steps, dt_s)
    else:
        world.advance(steps)
    passed_s = time.perf_counter() - started
    return _shown(world, own_s) if isinstance(world, TimedWorld) else passed_s


def _end(world: World) -> bytes:
    """Return the bits of the state that a world is in."""
    seen = world.observe()
    return b"".join(np.ascontiguousarray(one).tobytes() for one in (seen.position_m, seen.velocity_m_s))


def _shown(world: TimedWorld, before_s: float) -> float:
    """Return the seconds that a world's own clock shows since it showed `before_s`."""
    found = world.seconds
    numbers = isinstance(before_s, int | float) and isinstance(found, int | float)
    if not (numbers and -sys.float_info.max <= before_s <= found <= sys.float_info.max):
        raise adapter_error(
            f"seconds of a world must be a finite number that never falls, got {found!r} after {before_s!r}"
        )
    return float(found) - before_s


def _cut_steps(world: World, steps: int, dt_s: float) -> None:
    cutter = Cutter(world)
    for step in range(1, steps + 1):
        for _ in cutter.step((step - 1) * dt_s, step * dt_s):
            pass


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


@contextmanager
def _no_collection() -> Iterator[None]:
    """Collect no garbage meanwhile: somebody else's is no part of a step."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()
