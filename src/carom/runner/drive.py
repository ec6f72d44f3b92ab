"""Driving one world through one scene: an observing pass that yields a trace, and a timing pass that yields seconds."""

from __future__ import annotations

import gc
import statistics
import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carom.adapter import Adapter, Observation, World
from carom.errors import AdapterError, UnknownNameError
from carom.runner.impacts import ImpactCollector, gravity_of
from carom.scene import Scene
from carom.trace import Outcome, Samples, Setting, Trace

__all__ = ["Timing", "observe_run", "profile_settings", "time_run"]


#: Samples are for drawing, and no picture is more than so many pixels wide.
MOST_SAMPLES = 4096


@dataclass(frozen=True)
class Timing:
    """Two clocks, each the median of several runs.

    Attributes:
        prepare_s: Seconds to build the world.
        advance_s: Seconds to take all steps, nothing observed.
        runs: How many runs the medians are of.
    """

    prepare_s: float
    advance_s: float
    runs: int


def profile_settings(adapter: Adapter, profile: str, dt_s: float) -> Mapping[str, Setting]:
    """Return the settings of a profile at a step.

    Raises:
        UnknownNameError: The adapter has no such profile.
        AdapterError: The profile fails, or a setting is no plain value.
    """
    if profile not in adapter.profiles:
        raise UnknownNameError(f"{adapter.name} has no profile {profile!r}; it has: {', '.join(adapter.profiles)}")
    try:
        settings = dict(adapter.profiles[profile].settings(dt_s))
    except Exception as error:
        message = f"profile {profile!r} of {adapter.name} fails: {type(error).__name__}: {error}"
        raise AdapterError(message) from error
    for name, value in settings.items():
        if not isinstance(value, float | int | bool | str):
            message = f"setting {name!r} of profile {profile!r} of {adapter.name} must be a number, a bool or a string"
            raise AdapterError(f"{message}, got {value!r}")
    return settings


def observe_run(adapter: Adapter, scene: Scene, profile: str, dt_s: float, *, samples: bool = False) -> Trace:
    """Run a scene step by step, looking after each one, and return what happened.

    The final state is that at the scene's duration: the last whole step's, moved along its free path by what is
    missing to, or beyond, the duration.

    Raises:
        UnknownNameError: The adapter has no such profile.
        AdapterError: The adapter refuses the scene or fails.
    """
    settings = profile_settings(adapter, profile, dt_s)
    steps = scene.step_count(dt_s)
    start = Observation(
        np.array([disc.position_m for disc in scene.discs], dtype=np.float64),
        np.array([disc.velocity_m_s for disc in scene.discs], dtype=np.float64),
    )
    collector = ImpactCollector(scene, start)
    positions = [start.position_m]
    stride = -(-steps // MOST_SAMPLES)
    outcome, taken, state = Outcome.COMPLETED, 0, start
    notes: tuple[str, ...] = ()
    world = adapter.prepare(scene, settings)
    try:
        used = dict(world.settings)
        for step in range(1, steps + 1):
            world.advance(1)
            now = world.observe()
            outcome, notes = _health(now)
            if outcome is not Outcome.COMPLETED:
                break
            taken, state = step, now
            collector.add(step * dt_s, now)
            if samples and step % stride == 0:
                positions.append(now.position_m)
    finally:
        world.close()
    impacts, effective = collector.finish()
    gravity = gravity_of(scene)
    missing = scene.duration_s - steps * dt_s if outcome is Outcome.COMPLETED else 0.0
    return Trace(
        method=adapter.name,
        scene=scene,
        impacts=impacts,
        final_position_m=state.position_m + state.velocity_m_s * missing + gravity * (missing * missing / 2),
        final_velocity_m_s=state.velocity_m_s + gravity * missing,
        end_time_s=taken * dt_s + missing,
        outcome=outcome,
        dt_s=dt_s,
        effective_time_s=effective,
        samples=_samples(positions, stride * dt_s) if samples else None,
        profile=profile,
        settings=used,
        counts={"steps": taken},
        notes=notes,
    )


def _samples(positions: list[NDArray[np.float64]], interval_s: float) -> Samples:
    return Samples(np.arange(len(positions), dtype=np.float64) * interval_s, np.array(positions))


def _health(now: Observation) -> tuple[Outcome, tuple[str, ...]]:
    if now.warning:
        return Outcome.WARNED, (now.warning,)
    if not (np.isfinite(now.position_m).all() and np.isfinite(now.velocity_m_s).all()):
        return Outcome.NON_FINITE, ()
    return Outcome.COMPLETED, ()


def time_run(adapter: Adapter, scene: Scene, profile: str, dt_s: float, *, runs: int = 3) -> Timing:
    """Time the steps alone, in as few calls as the adapter allows, each run in a fresh world.

    Raises:
        UnknownNameError: The adapter has no such profile.
        AdapterError: The adapter refuses the scene or fails.
    """
    if runs < 1:
        raise AdapterError(f"runs must be 1 or more, got {runs}")
    settings = profile_settings(adapter, profile, dt_s)
    steps = scene.step_count(dt_s)
    prepared, advanced = [], []
    for _ in range(runs):
        started = time.perf_counter()
        world = adapter.prepare(scene, settings)
        prepared.append(time.perf_counter() - started)
        try:
            advanced.append(_timed_advance(world, steps))
        finally:
            world.close()
    return Timing(statistics.median(prepared), statistics.median(advanced), runs)


def _timed_advance(world: World, steps: int) -> float:
    collecting = gc.isenabled()
    gc.disable()  # a collection of somebody else's garbage is no part of a step
    try:
        started = time.perf_counter()
        world.advance(steps)
        return time.perf_counter() - started
    finally:
        if collecting:
            gc.enable()
