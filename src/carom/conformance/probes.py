"""What the suite asks of an engine beyond whole runs: to look closely, to be refused, to make many worlds.

Each probe is a task of a worker process. An error that the adapter raises is an answer like any other: `Raised`.
"""

from __future__ import annotations

import ctypes
import gc
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import wraps
from pathlib import Path
from typing import TypeVar

from carom.engines.api import AdapterError, CuttableWorld, Observation, World
from carom.engines.registry import load_adapter
from carom.errors import CaromError
from carom.execution.codec import CarriedObservation
from carom.execution.environment import resident_bytes
from carom.model.scene import Scene
from carom.model.trace import Setting

#: Pools that an engine fills once are full after this many worlds.
WARM_UP_WORLDS = 10

Probe = TypeVar("Probe")
Seen = TypeVar("Seen")


@dataclass(frozen=True)
class Watched:
    """What was seen.

    Attributes:
        settings: The world's settings after its steps.
        seen: Observations: at the start, and after each step (the last look of each), or at the end.
        altered: Number of the first observation that a later step altered; None where each stayed as it was.
    """

    settings: Mapping[str, Setting]
    seen: tuple[CarriedObservation, ...]
    altered: int | None


@dataclass(frozen=True)
class Leftover:
    """Growth of the resident memory, bytes; None where the system does not tell."""

    bytes: int | None


@dataclass(frozen=True)
class Raised:
    """The adapter raised an error.

    Attributes:
        where: The call that raised it: ``prepare``, ``advance``, ``observe``, ``settings``, ``cut`` or ``close``.
        kind: Name of its class.
        deliberate: Whether it is an `AdapterError` or another of Carom's.
        message: What it says.
    """

    where: str
    kind: str
    deliberate: bool
    message: str

    def __str__(self) -> str:
        return f"{self.where}() raised {self.kind}: {self.message}"


class _AdapterRaised(Exception):  # noqa: N818 - what happened; the suite decides whether that is an error
    def __init__(self, raised: Raised) -> None:
        super().__init__(raised)
        self.raised = raised


@contextmanager
def _calling(where: str) -> Iterator[None]:
    try:
        yield
    except Exception as error:
        raised = Raised(where, type(error).__name__, isinstance(error, CaromError), str(error))
        raise _AdapterRaised(raised) from error


def _or_raised(carry_out: Callable[[Probe], Seen | Raised]) -> Callable[[Probe], Seen | Raised]:
    """Make what the adapter raises the answer."""

    @wraps(carry_out)
    def carried_out(probe: Probe) -> Seen | Raised:
        try:
            return carry_out(probe)
        except _AdapterRaised as error:
            return error.raised

    return carried_out


@dataclass(frozen=True)
class _Probe:
    """What every probe is of.

    Attributes:
        engine: Name of the adapter.
        scene: The scene.
        settings: The settings to prepare it with.
    """

    engine: str
    scene: Scene
    settings: Mapping[str, Setting]

    @contextmanager
    def _world(self) -> Iterator[World]:
        with _calling("prepare"):
            world = load_adapter(self.engine).prepare(self.scene, self.settings)
        try:
            yield world
        finally:
            with _calling("close"):
                world.close()


def _observe(world: World) -> Observation:
    with _calling("observe"):
        return world.observe()


def _copy(seen: Observation) -> Observation:
    return replace(seen, position_m=seen.position_m.copy(), velocity_m_s=seen.velocity_m_s.copy())


@dataclass(frozen=True)
class Watch(_Probe):
    """Run a scene to its end and return every observation.

    Attributes:
        steps: Number of steps.
        looks: Number of observations after each step; 0 takes all steps in one call and observes only the end.
        cut_s: Length to which each step is cut, seconds, as for a profile that is located; None for whole steps.
        disturbed: Whether a step of three times the length is tried and undone before each cut step, and contacts are
            queried after each.
    """

    steps: int
    looks: int = 1
    cut_s: float | None = None
    disturbed: bool = False

    @_or_raised
    def carry_out(self) -> Watched | Raised:
        """Return what was seen."""
        with self._world() as world:
            given = [_observe(world)]
            copies = [_copy(given[0])]
            for _ in range(self.steps if self.looks else 1):
                if self.cut_s is None:
                    with _calling("advance"):
                        world.advance(1 if self.looks else self.steps)
                else:
                    self._cut(world, self.cut_s)
                given.append(_observe(world))
                copies.append(_copy(given[-1]))
                for _ in range(self.looks - 1):
                    _observe(world)
            with _calling("settings"):
                settings = dict(world.settings)
        changed = (
            k
            for k, (now, then) in enumerate(zip(given, copies, strict=True))
            if now.position_m.tobytes() != then.position_m.tobytes()
            or now.velocity_m_s.tobytes() != then.velocity_m_s.tobytes()
        )
        return Watched(settings, tuple(copies), next(changed, None))

    def _cut(self, world: World, length_s: float) -> None:
        with _calling("prepare"):
            if not isinstance(world, CuttableWorld):
                raise AdapterError(f"{type(world).__name__} lacks one of cut, touching, save and restore")
        with _calling("cut"):
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
    """Make, step once, and close this many worlds, and tell by how many bytes the process grew since the first ten.

    The processes that it has started count, too: an engine can be a program.

    Attributes:
        worlds: How many.
        step: Whether to take a step and look before closing.
    """

    worlds: int
    step: bool = True

    @_or_raised
    def carry_out(self) -> Leftover | Raised:
        """Return by how much the process has grown."""
        before = None
        for k in range(self.worlds):
            if k == min(WARM_UP_WORLDS, self.worlds - 1):
                gc.collect()
                before = _held_bytes()
            with self._world() as world:
                if self.step:
                    with _calling("advance"):
                        world.advance(1)
                    _observe(world)
        gc.collect()
        after = _held_bytes()
        return Leftover(None if before is None or after is None else after - before)


def _held_bytes() -> int | None:
    """Return the resident memory of this process and of those it has started; None where the system does not tell.

    Free memory is given back first, where the C library can: glibc keeps, or gives back, 20 MB at a time as it likes.
    """
    give_back = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if give_back is not None:
        give_back(0)
    started = [pid for file in Path("/proc/self/task").glob("*/children") for pid in file.read_text().split()]
    held = [resident_bytes(process=pid) for pid in ("self", *started)]
    return None if held[0] is None else sum(filter(None, held))
