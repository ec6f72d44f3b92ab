"""Measures run times of engines. All steps are taken in as few calls as possible, without reading states.

Each run uses a new world. The preparation and the steps are timed separately. All of Carom's run times of engines are
measured by this module.
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
from carom.execution.adapter_profile import prepare_settings
from carom.execution.job import JobTask, SettingOverrides, UnsupportedError
from carom.execution.observation.step_cutter import Cutter
from carom.execution.validate_adapter import build_adapter_error
from carom.model.scene import Scene

#: Number of timed runs of a job. If another process disturbs one of three runs, the median ignores this run.
TIMING_RUNS = 3

#: A job is not timed again after two consecutive run times that differ by less than this fraction.
AGREED = 0.1

_TOO_SHORT = (
    "too short to time: the clock shows 0 s for {steps} steps, the median of {runs} runs; a program's clock should "
    "resolve microseconds (docs/reference/engine-protocol.md)"
)


@dataclass(frozen=True, slots=True)
class Timing:
    """Run times, each the median of several runs.

    Attributes:
        prepare_s: Seconds to build the world.
        advance_s: Seconds to take all steps, without observation.
        runs: Number of runs.
        call_s: Seconds of a call that takes no steps; NaN if the call was not requested, or the adapter refuses the
            call.
        ends: Number of different final states of the runs, compared bit by bit; 1 if the engine is repeatable. None if
            the times were read from a file of an older version.
    """

    prepare_s: float
    advance_s: float
    runs: int
    call_s: float = math.nan
    ends: int | None = None


@dataclass(frozen=True)
class TimeTask(JobTask):
    """Times a job in a worker process. The caller must ensure that nothing else runs."""

    def carry_out(self) -> Timing:
        """Return the run times."""
        job = self.job
        adapter = load_adapter(job.engine)
        return time_run(adapter, job.scene, job.profile, job.dt_s, overrides=job.method.overrides, agreed=AGREED)


def time_run(
    adapter: Adapter,
    scene: Scene,
    profile: str,
    dt_s: float,
    *,
    overrides: SettingOverrides = (),
    steps: int | None = None,
    runs: int = TIMING_RUNS,
    enough_s: float = math.inf,
    agreed: float = 0.0,
    call: bool = False,
    zero: bool = False,
) -> Timing:
    """Measure the run time of a run's steps repeatedly, each time in a new world.

    Args:
        adapter: The adapter.
        scene: The scene.
        profile: Name of the profile.
        dt_s: The step size, in seconds.
        overrides: Settings that are used instead of the profile's settings.
        steps: Number of steps; by default the steps of the whole scene.
        runs: Largest number of runs, 1 or more.
        enough_s: Stop when the total of the timed seconds reaches this value.
        agreed: Stop after two consecutive times that differ by less than this fraction.
        call: Whether to also measure a call that takes no steps. The call is made before the steps and timed
            separately.
        zero: Whether to accept a time of 0, for very short runs that measure only overhead.

    Raises:
        UnknownNameError: The adapter has no such profile.
        AdapterError: The adapter refuses the scene or fails, or its clock shows an impossible time.
        UnsupportedError: The run is so short that the clock shows 0 seconds.
    """
    settings = prepare_settings(adapter, profile, dt_s, overrides)
    steps = scene.step_count(dt_s) if steps is None else steps
    located = adapter.profiles[profile].located
    prepared, called, advanced = (list[float]() for _ in range(3))
    ends: set[bytes] = set()
    with _pause_garbage_collection():
        while not advanced or (
            len(advanced) < runs
            and sum(prepared) + sum(advanced) < enough_s
            and not _are_last_two_close(advanced, agreed)
        ):
            started = time.perf_counter()
            world = adapter.prepare(scene, settings)
            prepared.append(time.perf_counter() - started)
            try:
                called.append(_time_empty_call(world) if call else math.nan)
                advanced.append(_time_steps(world, steps, dt_s, located=located))
                end = world.observe()
                ends.add(b"".join(np.asarray(array).tobytes() for array in (end.position_m, end.velocity_m_s)))
            finally:
                world.close()
    call_s = math.nan if any(map(math.isnan, called)) else statistics.median(called)
    if not (zero or statistics.median(advanced) > 0.0):  # a ratio of run times can't be computed from a time of 0
        raise UnsupportedError(_TOO_SHORT.format(steps=steps, runs=len(advanced)))
    return Timing(statistics.median(prepared), statistics.median(advanced), len(advanced), call_s, len(ends))


def _are_last_two_close(times_s: list[float], fraction: float) -> bool:
    """Whether the last two times differ by less than a fraction of the longer time."""
    *_, previous, last = (math.nan, *times_s)
    return abs(previous - last) < fraction * max(previous, last)


def _time_steps(world: World, steps: int, dt_s: float, *, located: bool) -> float:
    """Take steps, and return their run time in seconds. If the world has its own clock, read this clock."""
    own_clock_s = world.seconds if isinstance(world, TimedWorld) else 0.0
    started = time.perf_counter()
    if located:  # the run time includes the shortening of steps, which the profile needs
        cutter = Cutter(world)
        for step in range(1, steps + 1):
            for _ in cutter.take_step((step - 1) * dt_s, step * dt_s):
                pass
    else:
        world.advance(steps)
    passed_s = time.perf_counter() - started
    return _read_own_clock(world, own_clock_s) if isinstance(world, TimedWorld) else passed_s


def _read_own_clock(world: TimedWorld, before_s: float) -> float:
    """Return the seconds that have passed on a world's clock since the clock showed `before_s`."""
    found = world.seconds
    numbers = isinstance(before_s, int | float) and isinstance(found, int | float)
    if not (numbers and -sys.float_info.max <= before_s <= found <= sys.float_info.max):
        wrong = f"got {found!r} after {before_s!r}"
        raise build_adapter_error(f"seconds of a world must be a finite number that never decreases, {wrong}")
    return float(found) - before_s


def _time_empty_call(world: World) -> float:
    """Return the run time in seconds of a call with no steps; NaN if the adapter refuses the call."""
    try:
        world.advance(0)
        started = time.perf_counter()
        world.advance(0)
        return time.perf_counter() - started
    except Exception:  # noqa: BLE001 - an adapter may refuse a call with no steps
        return math.nan


@contextmanager
def _pause_garbage_collection() -> Iterator[None]:
    """Suspend garbage collection, which would add time that the engine does not cause."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()
