"""The suite's worker process: answers the requests of a cross-check, and the probes.

Run as ``python -m carom.conformance.worker`` by `carom.conformance.subject` only.
"""

from __future__ import annotations

import ctypes
import gc
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from carom.adapter import AdapterError, CuttableWorld, Observation, World
from carom.conformance.probe import Cut, Grown, Make, Raised, Watch, Watched
from carom.errors import CaromError
from carom.registry import load_adapter
from carom.runs.messages import Request
from carom.runs.worker import answer as answer_request
from carom.runs.worker import serve

__all__ = ["main"]

#: Pools that an engine fills once are full after so many worlds.
WARM_UP_WORLDS = 10


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


def _prepare(probe: Watch | Cut | Make) -> World:
    with _calling("prepare"):
        return load_adapter(probe.engine).prepare(probe.scene, probe.settings)


def _observe(world: World) -> Observation:
    with _calling("observe"):
        return world.observe()


def _copy(seen: Observation) -> Observation:
    return replace(seen, position_m=seen.position_m.copy(), velocity_m_s=seen.velocity_m_s.copy())


def _watch(probe: Watch) -> Watched:
    world = _prepare(probe)
    try:
        given = [_observe(world)]
        copies = [_copy(given[0])]
        for _ in range(probe.steps if probe.looks else 1):
            with _calling("advance"):
                world.advance(1 if probe.looks else probe.steps)
            given.append(_observe(world))
            copies.append(_copy(given[-1]))
            for _ in range(probe.looks - 1):
                _observe(world)
        with _calling("settings"):
            settings = dict(world.settings)
    finally:
        with _calling("close"):
            world.close()
    changed = (
        k
        for k, (now, then) in enumerate(zip(given, copies, strict=True))
        if now.position_m.tobytes() != then.position_m.tobytes()
        or now.velocity_m_s.tobytes() != then.velocity_m_s.tobytes()
    )
    return Watched(settings, tuple(copies), next(changed, None))


def _cut(probe: Cut) -> Watched:
    world = _prepare(probe)
    try:
        with _calling("prepare"):
            if not isinstance(world, CuttableWorld):
                raise AdapterError(f"{type(world).__name__} lacks one of cut, touching, save and restore")
        given = [_observe(world)]
        for _ in range(probe.steps):
            with _calling("cut"):
                if probe.disturbed:
                    state = world.save()
                    world.cut(3 * probe.dt_s)
                    world.advance(1)
                    world.touching()
                    world.restore(state)
                world.cut(probe.dt_s)
                world.advance(1)
                if probe.disturbed:
                    world.touching()
            given.append(_copy(_observe(world)))
    finally:
        with _calling("close"):
            world.close()
    return Watched({}, tuple(given), None)


def _resident_bytes() -> int | None:
    statm = Path("/proc/self/statm")
    return int(statm.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") if statm.exists() else None


def _make(probe: Make) -> Grown:
    before = None
    for k in range(probe.worlds):
        if k == min(WARM_UP_WORLDS, probe.worlds - 1):
            gc.collect()
            before = _resident_bytes()
        world = _prepare(probe)
        try:
            if probe.step:
                with _calling("advance"):
                    world.advance(1)
                _observe(world)
        finally:
            with _calling("close"):
                world.close()
    gc.collect()
    after = _resident_bytes()
    return Grown(None if before is None or after is None else after - before)


def _answer(request: Request | Watch | Cut | Make) -> object:
    try:
        match request:
            case Watch():
                return _watch(request)
            case Cut():
                return _cut(request)
            case Make():
                return _make(request)
            case Request():
                return answer_request(request)
    except _AdapterRaised as error:
        return error.raised
    finally:
        if os.name == "posix":
            ctypes.CDLL(None).fflush(None)  # what an engine printed from C is still in its buffer


def main() -> None:
    """Serve the suite."""
    serve(_answer)


if __name__ == "__main__":
    main()
