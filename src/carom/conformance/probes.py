"""Tasks of the suite that call an engine.

One task observes a run after each step; another task creates and closes many worlds. A worker process carries out each
task. If the adapter raises an error, the task returns an `AdapterFailure`.
"""

from __future__ import annotations

import ctypes
import gc
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from carom.engines.api import AdapterError, CuttableWorld, Observation, World
from carom.engines.registry import load_adapter
from carom.errors import CaromError
from carom.execution.codec import build_dataclass_type
from carom.execution.environment import measure_resident_bytes
from carom.model.scene import Scene
from carom.model.trace import Setting

#: Number of worlds after which an engine has allocated its reusable memory.
WARM_UP_WORLDS = 10

if TYPE_CHECKING:
    CarriedObservation = Observation
else:
    CarriedObservation = build_dataclass_type(Observation)


@dataclass(frozen=True)
class ObservedRun:
    """Observations of a run.

    Attributes:
        settings: The world's settings after its steps.
        states: Observations at the start and after each step, or only at the start and the end. If a step is observed
            several times, the list contains the first observation.
        overwritten_state: Number of the first observation whose arrays a later step changed; None if there is none.
    """

    settings: Mapping[str, Setting]
    states: tuple[CarriedObservation, ...]
    overwritten_state: int | None


@dataclass(frozen=True)
class AdapterFailure:
    """An error that the adapter raised.

    Attributes:
        where: Name of the method that raised the error, such as ``prepare``.
        kind: Name of the error's type.
        is_carom_error: True if the error is an `AdapterError` or another error of Carom.
        message: Message of the error.
    """

    where: str
    kind: str
    is_carom_error: bool
    message: str

    @property
    def cause(self) -> str:
        """Type and message of the error."""
        return f"{self.kind}: {self.message}"

    def __str__(self) -> str:
        return f"{self.where}() raised {self.cause}"


class _AdapterFailed(Exception):  # noqa: N818 - the suite decides whether this is an error
    def __init__(self, raised: AdapterFailure) -> None:
        super().__init__(raised)
        self.raised = raised


@contextmanager
def _catch_adapter_errors(method: str) -> Iterator[None]:
    try:
        yield
    except Exception as error:
        raised = AdapterFailure(method, type(error).__name__, isinstance(error, CaromError), str(error))
        raise _AdapterFailed(raised) from error


@dataclass(frozen=True)
class _Probe:
    """Adapter, scene and settings of a task.

    Attributes:
        engine: Name of the adapter.
        scene: The scene.
        settings: The settings with which the scene is prepared.
    """

    engine: str
    scene: Scene
    settings: Mapping[str, Setting]

    @contextmanager
    def _open_world(self) -> Iterator[World]:
        with _catch_adapter_errors("prepare"):
            world = load_adapter(self.engine).prepare(self.scene, self.settings)
        try:
            yield world
        finally:
            with _catch_adapter_errors("close"):
                world.close()


def _observe(world: World) -> Observation:
    with _catch_adapter_errors("observe"):
        return world.observe()


def _read_bytes(observation: Observation) -> tuple[bytes, bytes]:
    return observation.position_m.tobytes(), observation.velocity_m_s.tobytes()


def _copy_observation(observation: Observation) -> Observation:
    return replace(observation, position_m=observation.position_m.copy(), velocity_m_s=observation.velocity_m_s.copy())


@dataclass(frozen=True)
class Watch(_Probe):
    """Task that runs a scene to its end and returns every observation.

    Attributes:
        steps: Number of steps.
        observations: Number of observations after each step. With 0, the world makes all steps in one call, and only
            the end is observed.
        cut_s: Length to which each step is shortened, in seconds; None for whole steps.
        disturbed: Whether to take and undo a step of the length ``3 * cut_s`` before each step, and to call `touching`
            after both steps.
    """

    steps: int
    observations: int = 1
    cut_s: float | None = None
    disturbed: bool = False

    def carry_out(self) -> ObservedRun | AdapterFailure:
        """Return the observations."""
        try:
            return self._observe_steps()
        except _AdapterFailed as error:
            return error.raised

    def _observe_steps(self) -> ObservedRun:
        with self._open_world() as world:
            observations = [_observe(world)]
            copies = [_copy_observation(observations[0])]
            for _ in range(self.steps if self.observations else 1):
                if self.cut_s is None:
                    with _catch_adapter_errors("advance"):
                        world.advance(1 if self.observations else self.steps)
                else:
                    self._cut(world, self.cut_s)
                observations.append(_observe(world))
                copies.append(_copy_observation(observations[-1]))
                for _ in range(self.observations - 1):
                    _observe(world)
            with _catch_adapter_errors("settings"):
                settings = dict(world.settings)
        pairs = enumerate(zip(observations, copies, strict=True))
        changed = (k for k, (original, copied) in pairs if _read_bytes(original) != _read_bytes(copied))
        return ObservedRun(settings, tuple(copies), next(changed, None))

    def _cut(self, world: World, length_s: float) -> None:
        with _catch_adapter_errors("prepare"):
            if not isinstance(world, CuttableWorld):
                raise AdapterError(f"{type(world).__name__} lacks at least one of cut, touching, save and restore")
        with _catch_adapter_errors("cut"):
            if self.disturbed:
                state = world.save()
                world.cut(3 * length_s)
                world.advance(1)
                world.touching()
                world.restore(state)
            world.cut(length_s)
            world.advance(1)
            if self.disturbed:
                world.touching()


@dataclass(frozen=True)
class Make(_Probe):
    """Task that creates and closes many worlds, and measures the growth of memory after the first ten worlds.

    The memory of child processes is included, because an engine can be a separate program.

    Attributes:
        worlds: Number of worlds.
        step: Whether each world makes a step and is observed before it is closed.
    """

    worlds: int
    step: bool = True

    def carry_out(self) -> float | AdapterFailure:
        """Return the growth of resident memory, in bytes; NaN if the system does not report it."""
        try:
            return self._make_worlds()
        except _AdapterFailed as error:
            return error.raised

    def _make_worlds(self) -> float:
        before = math.nan
        for k in range(self.worlds):
            if k == min(WARM_UP_WORLDS, self.worlds - 1):
                gc.collect()
                before = _measure_memory()
            with self._open_world() as world:
                if self.step:
                    with _catch_adapter_errors("advance"):
                        world.advance(1)
                    _observe(world)
        gc.collect()
        return _measure_memory() - before


def _measure_memory() -> float:
    """Return the resident memory of this process and its children; NaN if the system does not report this memory.

    Before the measurement, the C library returns unused memory, such as 20 MB, to the system.
    """
    give_back = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if give_back is not None:
        give_back(0)
    started = [pid for file in Path("/proc/self/task").glob("*/children") for pid in file.read_text().split()]
    sizes = [measure_resident_bytes(process=pid) for pid in ("self", *started)]
    return math.nan if sizes[0] is None else sum(filter(None, sizes))
